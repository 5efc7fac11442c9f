/* One contact: its normal, its effective masses, its impulses, and the work of these. */

#include "core.h"

/* How many times the turn of a path that an arc gives in a step still counts as due to the arc; a larger one is due to an
   impact. */
#define CHORD 1.01
/* Sine of half the greatest angle by which a step may turn a disk inside an arc. */
#define STEEPEST 0.9
/* rad; greatest angle of a rebound from the inside of an arc that may count as rest, however long steps are. Smaller
   rebounds would follow each other without end. */
#define FLAT 0.01

/* Whether a disk touches two surfaces at the same place: where one lies on the other, or at an end that both share. */
static int same_place(const Disk *d, int k, int other) {
    double nx, ny, mx, my;
    double gap = gap_to(surface_at(k, d->t), d->x, d->y, d->radius, &nx, &ny);
    double off = gap - gap_to(surface_at(other, d->t), d->x, d->y, d->radius, &mx, &my);
    return fabs(off) <= TOUCHING * d->radius && fabs(nx - mx) + fabs(ny - my) <= TOUCHING;
}

/* The surface whose coefficients count where a disk touches surface k: of all surfaces at that place the first one of the
   file. */
static int acting(int i, int k) {
    const Disk *d = W.disks + i;
    const int *list;
    int count = surfaces_near(i, &list), first = W.surfaces[k].there == THERE ? k : W.surface_count;
    for (int n = 0; n < count && list[n] < first; n++) {
        const Surface *s = surface_at(list[n], d->t);
        if (list[n] == k || s->there != THERE || !is_near(s, d)) continue;
        if (same_place(d, k, list[n]) && face_at(s, d->x, d->y) == s) first = list[n];
    }
    return first < W.surface_count ? first : k;
}

/* Fill in a contact of disk i with j from their present states. Impulses are not changed. */
void describe(Contact *c, int i, int j) {
    const Disk *a = W.disks + i;
    const Pair *pair;
    double r = a->radius, mass = a->inv_mass, turn = a->inv_inertia, rb = 0, reach = r, escapes[2] = {0, 0};
    double spin_mass = turn;
    c->i = i;
    c->j = j;
    c->two = c->hung = c->cornered = c->halved = c->stalls = 0;
    c->owner = W.owner_count;
    c->moved[0] = c->moved[1] = c->moved[2] = 0;
    c->mass[1] = mass + r * r * turn;
    if (j < 0) {
        const Surface *s = surface_at(-1 - j, a->t);
        int acts = -1 - j;
        c->gap = gap_to(s, a->x, a->y, r, &c->nx, &c->ny);
        if (c->gap <= TOUCH * r) s = surface_at(acts = acting(i, acts), a->t);
        pair = surface_pair(a, acts);
        c->owner = s->owner;
        c->other[0] = 0;
        c->other[1] = surface_speed(s, c->nx, c->ny, a->x, a->y, r);
        c->other[2] = s->shape != SEGMENT ? -s->speed / s->radius : 0;
        if (s->mover >= 0) {
            double v[3];
            carried(s, a->x - (r + c->gap) * c->nx, a->y - (r + c->gap) * c->ny, v);
            c->moved[0] = v[0] * c->nx + v[1] * c->ny;
            c->moved[1] = v[0] * c->ny - v[1] * c->nx;
            c->moved[2] = v[2];
            for (int n = 0; n < 3; n++) c->other[n] += c->moved[n];
            pulled(s, a, c->nx, c->ny, escapes);
        }
    } else {
        const Disk *b = W.disks + j;
        double x = a->x - b->x, y = a->y - b->y, d = sqrt(x * x + y * y);
        rb = b->radius;
        reach = r * rb / (r + rb);
        c->nx = d > 0 ? x / d : 0;
        c->ny = d > 0 ? y / d : 1;
        c->gap = d - r - rb;
        pair = pair_of(a->kind, b->kind);
        c->two = b->mode == FREE;
        const double *v = motion_of(b);
        c->other[0] = v[0] * c->nx + v[1] * c->ny;
        c->other[1] = v[0] * c->ny - v[1] * c->nx;
        c->other[2] = 0;
        if (c->two) {
            mass += b->inv_mass;
            c->mass[1] += b->inv_mass + rb * rb * b->inv_inertia;
            spin_mass += b->inv_inertia;
        }
    }
    c->mass[0] = 1 / mass;
    c->mass[1] = 1 / c->mass[1];
    c->mass[2] = spin_mass > 0 ? 1 / spin_mass : 0;
    if (j < 0 && is_hung(-1 - j)) hang_on(c, W.movers + W.surfaces[-1 - j].mover, a);
    c->rest = pair->restitution, c->falls = pair->falls;
    c->share = 1;
    c->clings = 0;
    c->pull = j < 0 || sleeps(j) ? W.gx * c->ny - W.gy * c->nx - escapes[0] : 0;
    c->gives = c->turns = 0;
    c->most = INFINITY;
    c->parts = 0;
    c->friction = pair->friction;
    c->arm = pair->rolling * reach;
}

/* Stop the drive of a contact if it stalls under that disk in this step, see `stall`: each impact would start it again. */
void stall_too(Contact *c) {
    for (int link = W.disks[c->i].links; link >= 0 && c->j < 0; link = W.links[link]) {
        const Contact *last = W.contacts + link / 2;
        if (!last->stalls || last->i != c->i || !goes_on(last->j, c->j)) continue;
        c->other[1] = c->moved[1];
        c->other[2] = c->moved[2];
    }
}

/* Relative velocities at a contact: normal, slip, spin; now, or before the impulses of the step (`earlier`). */
void relative(const Contact *c, int earlier, double *out) {
    const Disk *a = W.disks + c->i, *b = W.disks + MAX(c->j, 0);
    const double *v = earlier ? &a->ux : &a->vx;
    out[0] = v[0] * c->nx + v[1] * c->ny - c->other[0];
    out[1] = v[0] * c->ny - v[1] * c->nx + (c->cornered ? c->own[1] : a->radius) * v[2] - c->other[1];
    out[2] = v[2] - c->other[2];
    if (c->cornered) out[0] += c->own[0] * v[2];
    if (c->two) {
        v = earlier ? &b->ux : &b->vx;
        out[0] += c->other[0] - (v[0] * c->nx + v[1] * c->ny);
        out[1] += c->other[1] - (v[0] * c->ny - v[1] * c->nx) + (c->cornered ? c->others[1] : b->radius) * v[2];
        out[2] -= v[2];
        if (c->cornered) out[0] += c->others[0] * v[2];
    }
    if (c->hung) swing_away(c, earlier, out);
}

/* The root of the island of a disk; `W.queue` holds the parents of a union-find forest. */
int island_of(int i) {
    int *parent = W.queue;
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
}

/* Apply an impulse to disk i, and the opposite one to its partner if that can move. */
void push(const Contact *c, const double *J) {
    Disk *a = W.disks + c->i;
    double x = J[0] * c->nx + J[1] * c->ny, y = J[0] * c->ny - J[1] * c->nx;
    a->vx += x * a->inv_mass;
    a->vy += y * a->inv_mass;
    a->spin += ((c->cornered ? c->own[0] * J[0] + c->own[1] * J[1] : a->radius * J[1]) + J[2]) * a->inv_inertia;
    if (c->two) {
        Disk *b = W.disks + c->j;
        b->vx -= x * b->inv_mass;
        b->vy -= y * b->inv_mass;
        b->spin += ((c->cornered ? c->others[0] * J[0] + c->others[1] * J[1] : b->radius * J[1]) - J[2]) * b->inv_inertia;
    }
    if (c->hung) push_hinge(c, J);
}

/* The owner whose surface carries the partner of a contact, a rider or a sleeper. */
int giver_of(const Contact *c) {
    return W.disks[c->j].mode == ASLEEP ? W.disks[c->j].bearer : W.ride_owner;
}

/* Ledger entries, J, of a contact's impulses, which changed its relative velocities from u to v: an impulse J does the
   work J (u + v) / 2. After the share f of the impulse has been given, the rest of it does (1 - f) J (u (1 - f) + v (1 +
   f)) / 2. `given` is the work of the surface that carries the partner, if that is a rider or a sleeper. */
void share_out(const Contact *c, const double *u, const double *v, double f, double *entries,
               double *given) {
    const double J[3] = {pressed(c), c->impulse[1], c->impulse[2]};
    double first = 0.5 * (1 - f) * (1 - f), then = 0.5 * (1 - f * f), all = 1 - f;
    entries[0] = c->j < 0 ? all * (J[0] * c->other[0] + J[1] * c->other[1] + J[2] * c->other[2]) : 0;
    entries[1] = -J[0] * (first * u[0] + then * v[0]);
    entries[2] = -J[1] * (first * u[1] + then * v[1]) - J[2] * (first * u[2] + then * v[2]);
    given[0] = c->j >= 0 && !c->two ? all * (J[0] * c->other[0] + J[1] * c->other[1]) : 0;
    given[1] = given[2] = 0;
    if (c->hung) entries[0] += swung(c, f);
}

/* Pool the losses of contacts that were solved together: only their sum has a meaning. In a chain that is wedged between
   walls, impulses of any size can balance each other; if one gap opens while another closes, one contact seems to gain
   what the other loses. So if the sum is a loss, gains become 0 and all losses are scaled down to keep the sum; if it is
   a gain, losses become 0. */
void pool(Contact *list, int count, int later) {
    double sums[2] = {0, 0};
    for (int n = 0; n < count; n++) {
        const double *loss = later ? list[n].later : list[n].entries;
        for (int k = 1; k < 3; k++) {
            sums[0] += MAX(loss[k], 0);
            sums[1] += MIN(loss[k], 0);
        }
    }
    double all = sums[0] + sums[1];
    double shares[2] = {all > 0 ? all / sums[0] : 0, all < 0 ? all / sums[1] : 0};
    for (int n = 0; n < count; n++) {
        double *loss = later ? list[n].later : list[n].entries;
        for (int k = 1; k < 3; k++) loss[k] *= shares[loss[k] < 0];
    }
}

/* Mass of the disks of contacts that were solved together, kg. */
static double mass_of(const Contact *list, int count) {
    double mass = 0;
    W.stamp++;
    for (int n = 0; n < count; n++)
        for (int k = 0; k <= list[n].two; k++) {
            Disk *d = W.disks + (k ? list[n].j : list[n].i);
            mass += d->mark == W.stamp ? 0 : d->mass;
            d->mark = W.stamp;
        }
    return mass;
}

/* Kinetic energy by which the recorded state halfway through the impulses of a step is too low, J, for a disk inside an
   arc and the `mass` that it pushes along. The arc turns its velocity, so the mean of the velocities before and after is
   smaller than either. The part that gravity changes is a hop, whose normal velocity is zero halfway: it doesn't count. */
static double lacks(const Contact *c, double mass, const double *u, const double *v) {
    const Disk *d = W.disks + c->i;
    double f = W.before, x = d->ux + f * (d->vx - d->ux), y = d->uy + f * (d->vy - d->uy);
    double weight = MAX(-(W.gx * c->nx + W.gy * c->ny), 0), change = v[0] - u[0];
    double turns = change - weight * (0.5 * W.length_before + (c->leaves ? 1 : 0.5) * W.length);
    if (!(turns > 0) || x * x + y * y < 0.01 * (d->ux * d->ux + d->uy * d->uy)) return 0;
    return 0.5 * f * (1 - f) * MIN(c->impulse[0], mass * change) * turns;
}

/* Set the ledger entries of contacts that were solved together. */
void account(Contact *list, int count) {
    double mass = 0;
    for (int n = 0; n < count; n++) {
        Contact *c = list + n;
        double u[3], v[3], given[3];
        relative(c, 1, u);
        relative(c, 0, v);
        share_out(c, u, v, 0, c->entries, given);
        c->given[0] = given[0];
        share_out(c, u, v, W.before, c->later, given);
        c->given[1] = given[0];
        if (c->turns == 0 || c->halved) continue;
        if (mass == 0) mass = mass_of(list, count);
        double more = lacks(c, mass, u, v);
        c->later[1] += more;
        W.disks[c->i].lacks += more;
    }
    /* Halves of an impulse are pooled together: what one seems to gain by the hop between them the other loses. */
    if (!W.interact || list->halved) return;
    pool(list, count, 0);
    pool(list, count, 1);
}

/* Not inlined: callers rarely get here. */
RARELY int is_one(const Disk *d, int k, int other) {
    return other >= 0 && (goes_on(-1 - k, -1 - other) || same_place(d, k, other));
}

int is_held(const Disk *d, int k) {
    for (int n = 0; n < d->held_count; n++)
        if (is_one(d, d->held[n], k)) return 1;
    return 0;
}

/* By how much the path inside an arc presses a disk on a surface in addition to gravity, m/s2. The arc is that surface
   itself, or the piece before or after a joint that the disk passes. */
double pressed_inside(const Disk *d, int surface) {
    double most = 0;
    for (int n = 0; n < 2 * d->held_count; n++) {
        const Surface *s = surface_at(n % 2 ? surface : d->held[n / 2], d->t);
        double v[2];
        if (s->shape == SEGMENT || s->radius <= d->radius) continue;
        if (square(d->x - s->x) + square(d->y - s->y) >= s->radius * s->radius) continue;
        if (!is_one(d, d->held[n / 2], surface)) continue;
        along_with(s, d, v);
        most = MAX(most, (v[0] * v[0] + v[1] * v[1]) / (s->radius - d->radius));
    }
    return most;
}

/* Time in which a disk that slides inside an arc turns by FLAT, s; INFINITY on any other surface. */
double turning_time(const Disk *d, const Surface *s) {
    double v[2];
    along_with(s, d, v);
    double bends = -bending(s, d->x, d->y, d->radius) * sqrt(v[0] * v[0] + v[1] * v[1]);
    return bends > 0 ? FLAT / bends : INFINITY;
}

/* Acceleration with which gravity, the curvature of the path and the motion of the surface press a disk on it, m/s2. */
double press_on(const Disk *d, const Surface *s, double nx, double ny) {
    double v[3], pull, up = pulled(s, d, nx, ny, &pull);
    carried(s, d->x, d->y, v);
    double along = (d->vx - v[0]) * ny - (d->vy - v[1]) * nx;
    return up - (W.gx * nx + W.gy * ny) - along * along * bending(s, d->x, d->y, d->radius);
}

/* Sine of the angle between the surface and the chord on which a disk inside an arc moves for a time h, such that its gap
   is 0 at the end, or its overlap less by `parted` (m). If it passes an end of the arc, Newton steps find the angle. */
double chord(const Contact *c, double parted, double h) {
    const Disk *d = W.disks + c->i;
    const Surface *s = surface_at(-1 - c->j, d->t);
    double v[2];
    along_with(s, d, v);
    double bends = -bending(s, d->x, d->y, d->radius), way = sqrt(square(v[0]) + square(v[1])) * h, out = 0;
    if (!(way > 0) || (bends <= 0 && !(pressed_inside(d, -1 - c->j) > 0))) return 0;
    if (bends > 0) {
        double away = square(d->x - s->x) + square(d->y - s->y), to = MAX(away, square(1 / bends));
        if (parted > 0) to = square(sqrt(to) - parted);
        return (away - to + way * way) / (2 * way * sqrt(away));
    }
    double forth = v[0] * c->ny - v[1] * c->nx > 0 ? way : -way, nx, ny;
    for (int n = 0; n < 4; n++) {
        double cosine = sqrt(1 - out * out);
        double x = d->x + cosine * forth * c->ny + out * way * c->nx;
        double y = d->y - cosine * forth * c->nx + out * way * c->ny;
        double gap = gap_to(face_at(s, x, y), x, y, d->radius, &nx, &ny);
        double slope = way * (nx * c->nx + ny * c->ny) - out / cosine * forth * (nx * c->ny - ny * c->nx);
        if (slope < 0.5 * way) break;
        out = MIN(MAX(out + (MIN(c->gap, 0) + parted - gap) / slope, -STEEPEST), STEEPEST);
    }
    return out;
}

/* Turn the normal of a contact in a crowd as the path inside an arc requires; return the cosine of that turn.

   There the path is a sequence of chords. An impulse acts for half of the step before (of length `past`; 0 for a new
   contact) and half of this one, so its normal is that in the middle between the two chords: then it turns the velocity
   and does no work. With the normal at the point of contact the disk would be faster on chords than on the arc, by 1/2
   (v^2 h / 2 (R - r))^2 of its speed; the first chord causes that, and if an impact ends the sequence, nothing takes it
   back. Gravity bends each chord to a parabola; that part is a hop, as everywhere. `in` and `out` are the sines of the
   angles of both chords to the surface. */
double follow(Contact *c, double past, double out) {
    const Disk *d = W.disks + c->i;
    const Surface *s = surface_at(-1 - c->j, d->t);
    double v[2];
    along_with(s, d, v);
    double x = v[0] - 0.5 * W.gx * past, y = v[1] - 0.5 * W.gy * past, speed = sqrt(x * x + y * y);
    double fast = square(v[0]) + square(v[1]), inside = pressed_inside(d, -1 - c->j);
    double bends = MAX(-bending(s, d->x, d->y, d->radius), 0);
    c->turns = MAX(bends, fast > 0 ? inside / fast : 0) * speed * speed;
    if (!(c->turns > 0)) return 1;
    double most = MIN(CHORD * 0.5 * c->turns * W.step / speed, STEEPEST);
    double in = MIN(MAX(-(x * c->nx + y * c->ny) / speed, -most), most);
    most = MIN(2 * most, STEEPEST);
    out = MIN(MAX(out, -most), most);
    double tilt = (out - in) / (sqrt(1 - in * in) + sqrt(1 - out * out)), cosine = 1 / sqrt(1 + tilt * tilt);
    double nx = c->nx, ny = c->ny, sine = x * ny - y * nx > 0 ? tilt * cosine : -tilt * cosine;
    c->nx = cosine * nx - sine * ny;
    c->ny = cosine * ny + sine * nx;
    return cosine;
}
