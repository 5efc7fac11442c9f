/* Surfaces with a prescribed motion: position and velocity at a time, and when a disk meets one.

   Code that needs a surface's position sets it first, by `surface_at`: within a step each disk has its own time. The
   pivot p shakes and travels, and the surface turns about it:

       p(t) = p0 + by sin(2 pi f t + phase) + way share(t),    angle(t) = turn t,

   where the share goes from 0 to 1, with constant acceleration up to half of its time, and the opposite acceleration from
   there on. */

#include "core.h"

#define PI 3.14159265358979323846

/* Least number of parts into which a span is divided for the search; a contact that begins and ends within one part is
   left to the next step. */
#define STRIDES 8
/* Greatest number of iterations (Newton, bisection) to the instant of an impact; they reach its last bit. */
#define TO_ROOT 100

static int travels(const Mover *m, double t) {
    double from = m->begins + m->from;
    return m->lasts > 0 && t >= from && t < from + m->lasts;
}

static void set_mover(Mover *m, double t) {
    if (m->t == t) return;
    if (m->inertia > 0) {
        set_hinge(m, t);
        return;
    }
    int moves = t >= m->begins;
    double since = MAX(t - m->begins, 0);
    double rate = 2 * PI * m->frequency, phase = rate * since + m->phase, s = sin(phase), c = cos(phase);
    double share = 0, pace = 0, bend = 0, u = m->lasts > 0 ? (since - m->from) / m->lasts : 0;
    if (travels(m, t)) {
        int late = u >= 0.5;
        share = late ? 1 - 2 * (1 - u) * (1 - u) : 2 * u * u;
        pace = 4 * (late ? 1 - u : u) / m->lasts;
        bend = (late ? -4 : 4) / (m->lasts * m->lasts);
    } else if (u > 0.5) share = 1;
    for (int n = 0; n < 2; n++) {
        m->place[n] = m->pivot[n] + m->by[n] * s + m->way[n] * share;
        m->velocity[n] = moves ? m->by[n] * rate * c + m->way[n] * pace : 0;
        m->pull[n] = moves ? -m->by[n] * rate * rate * s + m->way[n] * bend : 0;
    }
    m->turn = moves && (!m->steered || t < m->until) ? m->rate : 0;
    double angle = m->steered ? steered_to(m, t) : m->rate * since;
    m->sine = sin(angle);
    m->cosine = cos(angle);
    m->t = t;
}

static Mover *mover_of(const Surface *s) {
    Mover *m = W.movers + s->mover;
    set_mover(m, s->posed);
    return m;
}

/* Set a surface to where it is at t. */
const Surface *move_to(Surface *s, double t) {
    s->posed = t;
    const Mover *m = mover_of(s);
    for (int n = 0; n < 12; n += 2) {
        int is_vector = n == 2 || n >= 8;
        double x = s->still[n] - (is_vector ? 0 : m->pivot[0]), y = s->still[n + 1] - (is_vector ? 0 : m->pivot[1]);
        double *to = n < 4 ? &s->x + n : n < 8 ? s->end + (n - 4) : s->crown + (n - 8);
        to[0] = m->cosine * x - m->sine * y + (is_vector ? 0 : m->place[0]);
        to[1] = m->sine * x + m->cosine * y + (is_vector ? 0 : m->place[1]);
    }
    return s;
}

/* Velocity of a point that moves with a surface, m/s, and its angular velocity, rad/s. */
void carried(const Surface *s, double x, double y, double *v) {
    v[0] = v[1] = v[2] = 0;
    if (s->mover < 0) return;
    const Mover *m = mover_of(s);
    v[0] = m->velocity[0] - m->turn * (y - m->place[1]);
    v[1] = m->velocity[1] + m->turn * (x - m->place[0]);
    v[2] = m->turn;
}

/* Velocity of a disk in the frame in which its path along a surface has the curvature of the surface, m/s. For an arc
   that frame moves with its centre and does not rotate. */
void along_with(const Surface *s, const Disk *d, double *v) {
    double frame[3];
    if (s->shape == SEGMENT) carried(s, d->x, d->y, frame);
    else carried(s, s->x, s->y, frame);
    v[0] = d->vx - frame[0];
    v[1] = d->vy - frame[1];
}

/* Acceleration of a moving surface away from a disk next to it, m/s2: along the normal, with the Coriolis part of the
   disk's motion along the surface; `pull` is that along the tangent (ny, -nx). */
double pulled(const Surface *s, const Disk *d, double nx, double ny, double *pull) {
    *pull = 0;
    if (s->mover < 0) return 0;
    const Mover *m = mover_of(s);
    double x = d->x - m->place[0], y = d->y - m->place[1], v[3];
    double ax = m->pull[0] - m->turn * m->turn * x - m->hastens * y;
    double ay = m->pull[1] - m->turn * m->turn * y + m->hastens * x;
    carried(s, d->x, d->y, v);
    *pull = ax * ny - ay * nx;
    return ax * nx + ay * ny + 2 * m->turn * ((d->vx - v[0]) * ny - (d->vy - v[1]) * nx);
}

/* Bound on the acceleration with which a surface presses on, or moves away from, a disk that lies on it, m/s2. */
double hastes(const Surface *s, const Disk *d) {
    double v[3];
    if (!stirs(s)) return 0;
    carried(s, d->x, d->y, v);
    return s->haste + 2 * fabs(v[2]) * hypot(d->vx - v[0], d->vy - v[1]);
}

/* Bound on the speed at which a disk and a surface approach each other within a span, m/s. */
double closing(const Surface *s, const Disk *d, double span) {
    double v[3];
    carried(s, d->x, d->y, v);
    double way = hypot(d->vx - v[0], d->vy - v[1]);
    return way * (1 + fabs(v[2]) * span) + (W.g + hastes(s, d)) * span;
}

/* The gap after a time h, m, and the speed at which it closes. */
static double gap_after(int k, const Disk *d, double h, double *rate) {
    double x = d->x + (d->vx + 0.5 * W.gx * h) * h, y = d->y + (d->vy + 0.5 * W.gy * h) * h, nx, ny, v[3];
    const Surface *now = surface_at(k, d->t + h);
    double gap = gap_to(now, x, y, d->radius, &nx, &ny);
    carried(now, x, y, v);
    *rate = -(d->vx + W.gx * h - v[0]) * nx - (d->vy + W.gy * h - v[1]) * ny;
    return gap;
}

/* Time from d->t until a disk meets a moving surface, INFINITY if not within the span. The search advances by steps in
   which they cannot meet, but at least by a share of the span; if they meet between two of these, Newton's method with
   bisection finds the instant. */
double meet_moving(int k, const Disk *d, double span, double *approach) {
    const Surface *s = W.surfaces + k;
    double most = closing(s, d, span), h = 0, rate, gap = gap_after(k, d, 0, &rate), low = 0;
    *approach = 0;
    if (gap > most * span) return INFINITY;
    if (gap <= 0 && rate > 0) {
        *approach = rate;
        return 0;
    }
    for (int met = 0; !met;) {
        if (h >= span) return INFINITY;
        low = h;
        h = MIN(h + MAX(gap / most, span / STRIDES), span);
        double next = gap_after(k, d, h, &rate);
        met = next <= 0 && (gap > 0 || rate > 0);
        if (met && gap <= 0) low = h;
        gap = next;
    }
    double high = h;
    for (int n = 0; n < TO_ROOT && high > low; n++) {
        double next = rate > 0 ? h + gap / rate : low;
        if (!(next > low && next < high)) next = 0.5 * (low + high);
        if (next == low || next == high || fabs(next - h) <= 1e-16 * span) break;
        gap = gap_after(k, d, h = next, &rate);
        if (gap > 0) low = h;
        else high = h;
    }
    *approach = rate;
    double x = d->x + (d->vx + 0.5 * W.gx * h) * h, y = d->y + (d->vy + 0.5 * W.gy * h) * h;
    return face_at(s, x, y) == s ? h : INFINITY;
}

/* Time within which a disk that flies alone cannot reach the region that a surface sweeps, s. */
double box_span(const Surface *s, const Disk *d) {
    const double *box = s->swept;
    double x = MAX(MAX(box[0] - d->x, d->x - box[2]), 0), y = MAX(MAX(box[1] - d->y, d->y - box[3]), 0);
    double room = hypot(x, y) - d->radius, v = hypot(d->vx, d->vy);
    if (room <= 0) return 0;
    if (W.g > 0) return 2 * room / (v + sqrt(v * v + 2 * W.g * room));
    return v > 0 ? room / v : INFINITY;
}

/* The next time at which a surface begins to travel, is half-way, arrives, begins to move, or stops being turned by hand,
   s. */
double next_turn(double t) {
    double next = INFINITY;
    for (const Mover *m = W.movers; m < W.movers + W.mover_count; m++)
        for (int n = 0; n < 3 && m->lasts > 0; n++) {
            double then = m->begins + m->from + 0.5 * n * m->lasts;
            if (then > t) next = MIN(next, then);
        }
    for (const Mover *m = W.movers; m < W.movers + W.mover_count; m++)
        if ((m->steered ? m->until : m->begins) > t) next = MIN(next, m->steered ? m->until : m->begins);
    return next;
}

/* Set which surfaces move in the step that begins at t; return whether that has changed. */
int stir(double t) {
    int changed = 0;
    W.haste = W.shakes = W.stirs = 0;
    for (Mover *m = W.movers; m < W.movers + W.mover_count; m++) {
        int shakes = m->frequency > 0 && (m->by[0] != 0 || m->by[1] != 0), goes_on = m->rate != 0 || shakes;
        int now = m->inertia > 0 || (m->steered ? t < m->until : t >= m->begins && goes_on) || travels(m, t);
        if (shakes && now) W.shakes = MAX(W.shakes, m->frequency);
        changed |= now != m->stirs;
        W.stirs |= m->stirs = now;
    }
    for (const Surface *s = W.surfaces; s < W.surfaces + W.surface_count && W.stirs; s++)
        if (stirs(s)) W.haste = MAX(W.haste, s->haste);
    return changed;
}

/* Set the box of a surface round its present position, with a margin, m. */
void box_around(Surface *s, double more) {
    for (int n = 0; n < 2; n++) {
        int round = s->shape != SEGMENT;
        s->box[n] = (round ? (&s->x)[n] - s->radius : MIN(s->end[n], s->end[2 + n])) - more;
        s->box[2 + n] = (round ? (&s->x)[n] + s->radius : MAX(s->end[n], s->end[2 + n])) + more;
    }
}

/* Set the boxes of moving surfaces to what they sweep in a step of length h from t on. */
void box_movers(double t, double h) {
    for (Surface *s = W.surfaces; s < W.surfaces + W.surface_count && W.mover_count; s++) {
        if (s->mover < 0) continue;
        move_to(s, t);
        box_around(s, s->fastest * h);
    }
}

/* Enlarge a box to the region that its contents sweep; these extend up to `reach` from the pivot. */
static void sweep_box(const Mover *m, double reach, double *box) {
    for (int k = 0; k < 4; k++) {
        double way = m->way[k % 2], by = fabs(m->by[k % 2]);
        if (m->turn != 0 || m->inertia > 0 || m->steered) box[k] = m->pivot[k % 2] + (k < 2 ? -reach : reach);
        box[k] += k < 2 ? MIN(way, 0) - by : MAX(way, 0) + by;
    }
}

/* The number of the motion of a surface, or -1. */
int find_mover(const Surface *s) {
    for (int k = 0; k < W.mover_count; k++)
        if (W.movers[k].surface == s->owner) return k;
    return -1;
}

/* Distance of the point of a piece that is furthest from a pivot, m. It does not depend on directions, or on how many
   pieces a surface is written in: steps follow from it. */
static double furthest_from(const double *pivot, const Surface *s) {
    double x = s->x - pivot[0], y = s->y - pivot[1], away = hypot(x, y);
    if (s->shape == CIRCLE) return away + s->radius;
    if (s->shape == ARC && x * s->tx + y * s->ty >= s->cos_half * away) return away + s->radius;
    return MAX(hypot(s->end[0] - pivot[0], s->end[1] - pivot[1]), hypot(s->end[2] - pivot[0], s->end[3] - pivot[1]));
}

/* Let a surface begin to move from its written position. */
void prepare_mover(Surface *s) {
    Mover *m = W.movers + s->mover;
    double reach = furthest_from(m->pivot, s);
    double rate = 2 * PI * m->frequency, by = hypot(m->by[0], m->by[1]), way = hypot(m->way[0], m->way[1]);
    double lasts = m->lasts > 0 ? m->lasts : INFINITY;
    for (int n = 0; n < 4; n++) {
        s->still[n] = (&s->x)[n];
        s->still[4 + n] = s->end[n];
        s->still[8 + n] = s->crown[n];
    }
    s->reach = reach;
    s->fastest = rate * by + 2 * way / lasts + fabs(m->turn) * reach;
    s->haste = rate * rate * by + 4 * way / (lasts * lasts) + m->turn * m->turn * reach;
    W.fastest = MAX(W.fastest, s->fastest);
    sweep_box(m, reach, s->swept);
    s->posed = m->t = NAN;
}
