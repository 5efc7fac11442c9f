/* Whether particles are inside each other: followed along their tracks, at all times of a run.

   A run is divided into spans of time in which particles move by about two radii or have two knots. In most
   spans two stay apart by their places at both ends and by how far they stray from an even motion. Others are
   followed from knot to knot, in strides in which they cannot get too deep into each other: the gap now, and what
   may be, divided by the greatest speed at which they come nearer. Gaps are those along the best separating axis.

   Nothing holds apart what rods and pins join, nor what the incoming belt carries by adhesion, which the summary
   describes.

   A check shares nothing with what it checks: nothing here is from the engine's files. */

#include <string.h>
#include "laws.h"

/* Least stride, in radii of the smaller of two: an overlap that is deeper than the bound by less than half of it may be
   missed. */
#define FINE 0.01

/* A particle between two times: its place and velocity at both, and for corners its angle at a share of the time
   after a knot. */
typedef struct {
    const Body *body;
    double from[4], to[4];      /* m, m/s */
    double begin, lasts;        /* shares of the time after a knot */
    int knot;
} Motion;

/* Its corners at an instant, or its centre. */
typedef struct { double p[MOST_CORNERS][2], x, y; int count; } Outline;

/* State at t, in the time after knot k, and the share of that time. */
static double state_at(int k, double t, double *state) {
    const double *a = KNOT(k), *b = a + L.row;
    double h = b[0] - a[0], s = h > 0 ? (t - a[0]) / h : 1, r = 1 - s;
    for (int n = 0; n < 2; n++) {
        double slope = h > 0 ? (b[1 + n] - a[1 + n]) / h : 0, u = a[3 + n], v = b[3 + n];
        state[n] = a[1 + n] + s * h * (r * r * u + s * ((3 - 2 * s) * slope - r * v));
        state[2 + n] = r * (1 - 3 * s) * u + s * (6 * r * slope + (3 * s - 2) * v);
    }
    return s;
}

/* Greatest speed of a corner by rotation in the time after a knot, m/s. */
static double whirl_after(const Body *body, int k) {
    const double *knot = KNOT(k), *next = knot + L.row;
    double lasts = next[0] - knot[0], mean = 0.5 * (knot[5] + next[5]);
    if (!body->corners || !(lasts > 0)) return 0;
    double missed = (L.angles[k + 1] - L.angles[k]) / lasts - mean;
    return body->reach * (MAX(fabs(knot[5]), fabs(next[5])) + fabs(missed));
}

/* The hull of the control points of a path: its corners, the greatest square of a distance from an even motion,
   and that motion. */
typedef struct { Two low, high, strays, from, even; double begin; } Hull;

/* Add a control point, which is the place at t if the motion is even. */
PAIRED static inline void add_point(Hull *hull, double t, Two place) {
    Two off = place - hull->from - (t - hull->begin) * hull->even, squares = off * off;
    hull->low = lesser(hull->low, place);
    hull->high = larger(hull->high, place);
    hull->strays = larger(hull->strays, both(squares[0] + squares[1]));
}

/* Find the path of a particle from t to `end`. Between knots it is a cubic, inside the hull of its control points. */
PAIRED static void find_path(int i, double t, double end) {
    const Body *body = L.bodies + i;
    Path *path = L.paths + i;
    int last = last_of(i), k = path->knot;
    double *box = path->box, begin = MAX(t, KNOT(L.offsets[i])[0]), ends = MIN(end, KNOT(last)[0]);
    Two reach = both(body->reach);
    box[0] = box[1] = INFINITY;
    box[2] = box[3] = -INFINITY;
    path->turns = 0;
    if (last <= L.offsets[i] || !(begin < ends)) return;
    while (KNOT(k + 1)[0] <= begin) k++;
    path->knot = k;
    state_at(k, begin, path->from);
    while (KNOT(k + 1)[0] < ends) k++;
    state_at(k, ends, path->to);
    Two from = two_at(path->from), to = two_at(path->to), v = two_at(path->from + 2);
    Hull hull = {from, from, both(0), from, (to - from) / both(ends - begin), begin};
    for (k = path->knot; begin < ends; k++) {
        const double *next = KNOT(k) + L.row, *then = next[0] < ends ? next + 1 : path->to;
        double until = MIN(next[0], ends), third = (until - begin) * (1.0 / 3);
        Two place = two_at(then), w = two_at(then + 2);
        add_point(&hull, begin + third, from + third * v);
        add_point(&hull, until - third, place - third * w);
        add_point(&hull, until, place);
        path->turns += (until - begin) * whirl_after(body, k);
        begin = until;
        from = place;
        v = w;
    }
    path->strays = hull.begin == t && ends == end ? sqrt(hull.strays[0]) : INFINITY;
    *(Two *)box = hull.low - reach;
    *(Two *)(box + 2) = hull.high + reach;
}

/* Sort particles by the left of their boxes: they are nearly in the order of the span before. */
static void sort_boxes(int *order) {
    for (int n = 1; n < L.particle_count; n++) {
        int i = order[n], to = n;
        for (; to > 0 && L.paths[order[to - 1]].box[0] > L.paths[i].box[0]; to--) order[to] = order[to - 1];
        order[to] = i;
    }
}

/* Whether two may be in one place: kinds that do not meet, or members of a group. */
static int may_overlap(const Body *a, const Body *b) {
    return L.passing[a->kind * L.kind_count + b->kind] || (a->group && a->group == b->group);
}

/* Where a particle is at a share of its motion of h seconds. */
static void place_outline(const Motion *m, double share, double h, Outline *out) {
    double s = share, r = 1 - s, *at = &out->x;
    for (int n = 0; n < 2; n++) {
        double a = m->from[n], b = m->to[n];
        at[n] = r * r * (a * (1 + 2 * s) + s * h * m->from[2 + n]) + s * s * (b * (3 - 2 * s) - r * h * m->to[2 + n]);
    }
    out->count = m->body->corners;
    if (!out->count) return;
    double angle = angle_at(m->knot, m->begin + share * m->lasts), c = cos(angle), z = sin(angle);
    for (int n = 0; n < out->count; n++) {
        const double *q = L.outlines + 2 * (m->body->outline + n);
        out->p[n][0] = out->x + c * q[0] - z * q[1];
        out->p[n][1] = out->y + z * q[0] + c * q[1];
    }
}

/* Greatest gap of an outline from an edge of another one, m, or one that is above `enough`. A round one is a point. */
static double gap_of_edges(const Outline *a, const Outline *b, double enough) {
    double best = -INFINITY;
    for (int n = 0; n < a->count && best <= enough; n++) {
        const double *q = a->p[n], *next = a->p[n + 1 < a->count ? n + 1 : 0];
        double x = next[1] - q[1], y = q[0] - next[0], size = sqrt(x * x + y * y), least = INFINITY;
        for (int k = 0; k < MAX(b->count, 1); k++) {
            const double *other = b->count ? b->p[k] : &b->x;
            least = MIN(least, x * (other[0] - q[0]) + y * (other[1] - q[1]));
        }
        best = MAX(best, least / size);
    }
    return best;
}

/* Distance of a point outside of an outline from it, m. */
static double away_from(const Outline *a, double x, double y) {
    double best = INFINITY;
    for (int n = 0; n < a->count; n++) {
        const double *q = a->p[n], *next = a->p[n + 1 < a->count ? n + 1 : 0];
        double ex = next[0] - q[0], ey = next[1] - q[1], u = x - q[0], v = y - q[1];
        double s = MIN(MAX((u * ex + v * ey) / (ex * ex + ey * ey), 0), 1);
        best = MIN(best, length_of(u - s * ex, v - s * ey));
    }
    return best;
}

/* Gap between two particles at a share of their motions of h seconds, m, below 0 if they overlap; or one that is above
   `enough`. */
static double gap_at(const Motion *a, const Motion *b, double share, double h, double enough) {
    Outline one, other;
    place_outline(a, share, h, &one);
    place_outline(b, share, h, &other);
    double off = length_of(one.x - other.x, one.y - other.y) - a->body->reach - b->body->reach, gap;
    if (off > enough || !(one.count || other.count)) return off;
    if (one.count && other.count) {
        gap = gap_of_edges(&one, &other, enough);
        return gap > enough ? gap : MAX(gap, gap_of_edges(&other, &one, enough));
    }
    const Outline *cornered = one.count ? &one : &other, *disk = one.count ? &other : &one;
    double radius = one.count ? b->body->radius : a->body->radius;
    gap = gap_of_edges(cornered, disk, enough + radius);
    return (gap > 0 ? away_from(cornered, disk->x, disk->y) : gap) - radius;
}

/* How deep two particles are in each other at t, in the times after two knots of theirs, m; below 0 if they are apart. */
double depth_at(int i, int k, int j, int l, double t) {
    const int who[2] = {i, j}, knots[2] = {k, l};
    Motion m[2];
    for (int n = 0; n < 2; n++) {
        m[n].body = L.bodies + who[n];
        m[n].knot = knots[n];
        m[n].begin = state_at(knots[n], t, m[n].from);
        m[n].lasts = 0;
        memcpy(m[n].to, m[n].from, sizeof m[n].to);
    }
    return -gap_at(m, m + 1, 0, 0, 0);
}

/* Greatest speed at which two come nearer within motions of h seconds, m/s. */
static double fastest_of(const Motion *a, const Motion *b, double h) {
    double v[3] = {0, 0, 0}, turns;
    for (int n = 0; n < 2; n++) {
        double u = b->from[2 + n] - a->from[2 + n], w = b->to[2 + n] - a->to[2 + n];
        double mean = (b->to[n] - b->from[n] - a->to[n] + a->from[n]) / h;
        /* Velocity is a quadratic: these are its coefficients in Bernstein form. */
        v[0] += u * u;
        v[1] += (3 * mean - u - w) * (3 * mean - u - w);
        v[2] += w * w;
    }
    turns = whirl_after(a->body, a->knot) + whirl_after(b->body, b->knot);
    return sqrt(MAX(v[0], MAX(v[1], v[2]))) + turns;
}

/* Two particles and what is found of all. */
typedef struct { int i, j; double bound; Breach *found; } Couple;

static void tell_overlap(const Couple *two, double t, double deep, const double *at) {
    Breach *found = two->found;
    Body *a = L.bodies + two->i, *b = L.bodies + two->j;
    if (!found->particles || t < found->t) {
        found->particle = two->i;
        found->t = t;
        found->x = at[0];
        found->y = at[1];
    }
    found->amount = MAX(found->amount, deep);
    found->particles += !a->overlaps + !b->overlaps;
    a->overlaps = b->overlaps = 1;
}

/* Follow two particles from t for h seconds, in which neither has a knot. */
static void follow(const Couple *two, const Motion *a, const Motion *b, double t, double h) {
    double least = MIN(a->body->radius, b->body->radius), may = two->bound * least, fastest = fastest_of(a, b, h);
    for (double share = 0;;) {
        double gap = gap_at(a, b, share, h, fastest * (1 - share) * h - may);
        if (-gap > may) tell_overlap(two, t + share * h, -gap / least, a->from);
        if (share == 1 || fastest * (1 - share) * h < gap + may) return;
        share = MIN(share + MAX(gap + may, FINE * least) / (fastest * h), 1);
    }
}

/* Follow two particles from t to `end`, from knot to knot. */
static void follow_two(const Couple *two, double t, double end) {
    int which[2] = {two->i, two->j}, k[2];
    Motion m[2];
    for (int n = 0; n < 2; n++) {
        k[n] = L.paths[which[n]].knot;
        t = MAX(t, KNOT(L.offsets[which[n]])[0]);
        end = MIN(end, KNOT(last_of(which[n]))[0]);
        m[n].body = L.bodies + which[n];
    }
    while (t < end) {
        double next = end;
        for (int n = 0; n < 2; n++) {
            while (KNOT(k[n] + 1)[0] <= t) k[n]++;
            next = MIN(next, KNOT(k[n] + 1)[0]);
        }
        for (int n = 0; n < 2; n++) {
            m[n].knot = k[n];
            m[n].begin = state_at(k[n], t, m[n].from);
            m[n].lasts = state_at(k[n], next, m[n].to) - m[n].begin;
        }
        follow(two, m, m + 1, t, next - t);
        t = next;
    }
}

/* Set how far each particle reaches and forget what was found. Return into how many spans to divide the run: in one a
   particle moves by two radii or has two knots on average, but no span is without a knot. */
static int prepare(double *begin, double *end) {
    double way = 0, size = 0;
    *begin = INFINITY;
    *end = -INFINITY;
    for (int i = 0; i < L.particle_count; i++) {
        Body *body = L.bodies + i;
        body->reach = body->radius;
        body->overlaps = 0;
        L.order[i] = i;
        L.paths[i].knot = L.offsets[i];
        for (int n = 0; n < body->corners; n++) {
            const double *q = L.outlines + 2 * (body->outline + n);
            body->reach = MAX(body->reach, length_of(q[0], q[1]));
        }
        size += body->reach;
        if (last_of(i) < L.offsets[i]) continue;
        *begin = MIN(*begin, KNOT(L.offsets[i])[0]);
        *end = MAX(*end, KNOT(last_of(i))[0]);
        for (int k = L.offsets[i]; k < last_of(i); k++)
            way += length_of(KNOT(k + 1)[1] - KNOT(k)[1], KNOT(k + 1)[2] - KNOT(k)[2]);
    }
    double knots = L.offsets[L.particle_count];
    return 1 + (int)MAX(0.5 * knots / L.particle_count, MIN(way / (2 * size), knots));
}

/* Whether two cannot get too deep into each other from t to `end`, and need not be followed. Their circles are
   nearest at the foot of one centre on the way of the other, if both move evenly; with corners the gap at t may be
   wide enough. */
static int stay_apart(const Couple *two, double t) {
    const Path *p = L.paths + two->i, *q = L.paths + two->j;
    const Body *a = L.bodies + two->i, *b = L.bodies + two->j;
    double x = q->from[0] - p->from[0], y = q->from[1] - p->from[1], strays = p->strays + q->strays;
    double u = q->to[0] - p->to[0] - x, v = q->to[1] - p->to[1] - y, way = u * u + v * v;
    double foot = way > 0 ? MIN(MAX(-(x * u + y * v) / way, 0), 1) : 0, may = two->bound * MIN(a->radius, b->radius);
    if (square(x + foot * u) + square(y + foot * v) > square(a->reach + b->reach - may + strays)) return 1;
    double enough = sqrt(way) + strays + p->turns + q->turns - may;
    if (!(a->corners || b->corners) || enough >= may) return 0;
    Motion m[2];
    for (int n = 0; n < 2; n++) {
        const Path *path = n ? q : p;
        const double *knot = KNOT(path->knot), *next = knot + L.row;
        m[n].body = n ? b : a;
        m[n].knot = path->knot;
        m[n].begin = (t - knot[0]) / (next[0] - knot[0]);
        memcpy(m[n].from, path->from, sizeof m[n].from);
        memcpy(m[n].to, path->from, sizeof m[n].to);
    }
    return gap_at(m, m + 1, 0, 0, enough) > enough;
}

/* Find the particles that are deeper in others than by `bound`, in radii of the smaller of two: how many, the
   first of them, when and where that is, and how deep one is at most. */
void find_overlaps(double bound, Breach *found) {
    double begin, end;
    int *order = L.order, spans = prepare(&begin, &end);
    for (int span = 0; span < spans && begin < end; span++) {
        double t = begin + span * (end - begin) / spans, next = begin + (span + 1) * (end - begin) / spans;
        next = span + 1 < spans ? next : end;
        for (int i = 0; i < L.particle_count; i++) find_path(i, t, next);
        sort_boxes(order);
        for (int n = 0; n < L.particle_count; n++) {
            const double *box = L.paths[order[n]].box;
            for (int m = n + 1; m < L.particle_count; m++) {
                const double *other = L.paths[order[m]].box;
                Couple two = {order[n], order[m], bound, found};
                if (!(other[0] < box[2])) break;
                if (other[1] >= box[3] || other[3] <= box[1]) continue;
                if (may_overlap(L.bodies + two.i, L.bodies + two.j) || stay_apart(&two, t)) continue;
                follow_two(&two, t, next);
            }
        }
    }
}
