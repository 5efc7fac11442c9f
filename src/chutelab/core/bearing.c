/* Loads on surfaces in the contact engine: from impacts, lasting contacts, sleepers and riders. */

#include "core.h"

static Push at_foot(const Disk *d, int owner, double depth, double nx, double ny, double from, double to) {
    return (Push){ .owner = owner, .from = from, .to = to, .x = d->x - depth * nx, .y = d->y - depth * ny,
                   .nx = nx, .ny = ny };
}

/* The same for the belt below a rider. */
static Push on_belt(const Disk *d, double from, double to) {
    double phi = MAX(d->ride_x + d->ride_speed * (0.5 * (from + to) - d->ride_from), 0) / d->ride_rho - W.ride_incline;
    double depth = d->ride_rho - (W.pulley < 0 ? 0 : W.surfaces[W.pulley].radius);
    return at_foot(d, W.ride_owner, depth, sin(phi), cos(phi), from, to);
}

/* The impulse of a contact on disk i, N s. */
static void impulse_of(const Contact *c, double share, double *J) {
    J[0] = share * (pressed(c) * c->nx + c->impulse[1] * c->ny);
    J[1] = share * (pressed(c) * c->ny - c->impulse[1] * c->nx);
}

/* The loads by the partner are then reported by `tell_frozen`. */
static int is_on_sleeper(const Contact *c) { return sleeps(c->j); }

/* Report the load by a contact of disk i with a surface, or with a rider: then the belt of the rider bears it. */
void bear_contact(const Contact *c, double share, double from, double to) {
    const Disk *a = W.disks + c->i;
    double J[2];
    if (B.every == 0 || c->two || is_on_sleeper(c)) return;
    Push p = c->j < 0 ? at_foot(a, c->owner, c->cornered ? c->own[1] : a->radius, c->nx, c->ny, from, to)
                      : on_belt(W.disks + c->j, from, to);
    if (c->cornered && c->j < 0) {
        p.x += c->own[0] * c->ny;
        p.y -= c->own[0] * c->nx;
    }
    impulse_of(c, share, J);
    p.jx = J[0];
    p.jy = J[1];
    p.couple = share * c->impulse[2];
    bear(&p);
}

/* Record the impulse of a surface on a disk, from its foot on the surface. */
static void keep_push(const Disk *d, const Push *p, double depth) {
    double J[] = {p->jx, p->jy}, b[] = {depth * p->nx, depth * p->ny};
    keep_contact((int)(d - W.disks), -1 - p->owner, p->from, p->to, J, b);
}

/* The vector to the centre of disk i from that of its partner, or from its foot on a surface, m. */
void branch_of(const Contact *c, double *b) {
    const Disk *a = W.disks + c->i, *other = W.disks + MAX(c->j, 0);
    b[0] = c->j < 0 ? a->radius * c->nx : a->x - other->x;
    b[1] = c->j < 0 ? a->radius * c->ny : a->y - other->y;
    if (!c->cornered || c->j >= 0) return;
    b[0] = c->own[1] * c->nx - c->own[0] * c->ny;
    b[1] = c->own[1] * c->ny + c->own[0] * c->nx;
}

static int other_of(const Contact *c) { return c->j < 0 ? -1 - c->owner : c->j; }

/* Record the impulse of a lasting contact for its pair. Impacts are events instead. */
void keep_impulse(const Contact *c, double share, double from, double to) {
    double J[2], b[2];
    if (B.each == 0) return;
    impulse_of(c, share, J);
    branch_of(c, b);
    keep_contact(c->i, other_of(c), from, to, J, b);
    keep_carried(c, share, from, to);
}

/* Record that the belt gives a rider what a contact takes from it, also in an impact, as its path doesn't change. */
void keep_carried(const Contact *c, double share, double from, double to) {
    double J[2];
    if (B.each == 0 || c->j < 0 || c->two || is_on_sleeper(c)) return;
    impulse_of(c, share, J);
    Push p = on_belt(W.disks + c->j, from, to);
    p.jx = J[0];
    p.jy = J[1];
    keep_push(W.disks + c->j, &p, W.disks[c->j].radius);
}

/* Distance of the foot of a disk on a surface from its centre, m, and the normal there. The place at which a particle
   with corners is supported isn't known here: its foot is taken below its centre. */
static double depth_of(const Disk *d, const Surface *s, double *nx, double *ny) {
    double gap = gap_to(s, d->x, d->y, d->radius, nx, ny);
    return has_corners(d) ? gap + d->radius : d->radius;
}

/* Report an impulse on a disk from the surface that it lies on, or that supports its island. */
void bear_disk(const Disk *d, int owner, double jx, double jy, double from, double to) {
    double nx = 0, ny = 1, depth = d->radius;
    if ((B.every == 0 && B.each == 0) || (jx == 0 && jy == 0)) return;
    if (d->held_count && W.surfaces[d->held[0]].owner == owner)
        depth = depth_of(d, W.surfaces + d->held[0], &nx, &ny);
    Push p = at_foot(d, owner, depth, nx, ny, from, to);
    p.jx = jx;
    p.jy = jy;
    if (B.every > 0) bear(&p);
    if (B.each > 0) keep_push(d, &p, depth);
}

/* Report the load by a ride since the last knot, up to the present place: the belt gives the change of the velocity and
   what gravity takes. */
void bear_ride(int i) {
    const Disk *d = W.disks + i;
    const double *last = W.tracks[i].knot;
    double span = d->t - last[0];
    if ((B.every == 0 && B.each == 0) || !(span > 0)) return;
    Push p = on_belt(d, last[0], d->t);
    p.vx = (d->x - last[1]) / span;
    p.vy = (d->y - last[2]) / span;
    p.x -= d->x - last[1];
    p.y -= d->y - last[2];
    p.jx = d->mass * (d->vx - last[3] - W.gx * span);
    p.jy = d->mass * (d->vy - last[4] - W.gy * span);
    if (B.every > 0) bear(&p);
    if (B.each > 0) keep_push(d, &p, d->radius);
}

/* Report the loads by a frozen contact of two sleepers, or of one with a surface, up to t. */
void melt(Frozen *f, double t) {
    double time = t - f->from, J[2] = {time * (f->force[0] + f->more[0]), time * (f->force[1] + f->more[1])};
    const Disk *d = W.disks + f->i, *first = W.disks + f->first;
    if (f->from == INFINITY) return;
    f->from = INFINITY;
    if (B.each > 0) keep_contact(f->i, f->j < 0 ? -1 - W.surfaces[-1 - f->j].owner : f->j, t - time, t, J, f->branch);
    if (B.every > 0 && f->j < 0) {
        const Surface *s = W.surfaces + (-1 - f->j);
        double nx, ny, way = d->t - (t - time);
        gap_to(s, d->x, d->y, d->radius, &nx, &ny);
        Push p = at_foot(d, s->owner, 0, nx, ny, t - time, t);
        p.vx = d->ux;
        p.vy = d->uy;
        p.x -= f->branch[0] + d->ux * way;
        p.y -= f->branch[1] + d->uy * way;
        p.jx = J[0];
        p.jy = J[1];
        bear(&p);
    }
    time = f->first == f->i ? -time : time;
    if (f->j >= 0) bear_disk(first, first->bearer, time * f->more[0], time * f->more[1], t - fabs(time), t);
}

/* Report that a sleeper got the impulse J (on i of the pair) from its awake partner up to a time. The surface below the
   sleeper bears what differs from the force that was frozen. */
void tell_frozen(Frozen *f, int sleeper, const double *J, double to) {
    const Disk *d = W.disks + sleeper;
    double time = to - f->told, sign = sleeper == f->j ? 1 : -1;
    bear_disk(d, d->bearer, sign * (J[0] - f->force[0] * time), sign * (J[1] - f->force[1] * time), MIN(f->told, to),
              MAX(f->told, to));
    f->told = to;
}

/* Greatest number of rounds of conjugate gradients, and the share of the weight that they may leave unbalanced. */
#define ROUNDS 1000
#define BALANCED 1e-12
/* Share of a change of force that a smooth surface takes across its normal. */
#define SMOOTH 1e-4

enum { RESIDUAL, DIRECTION, SOLUTION, PRODUCT, STIFF, VECTORS };

/* One of the vectors of conjugate gradients, at a disk; of STIFF the first number, the sum of the squares of its forces. */
static double *of(int disk, int which) { return W.balance + 2 * (VECTORS * disk + which); }

/* Whether the forces on a disk are balanced now: it has just fallen asleep, or the rest of its island has. */
static int is_new(int i) { return sleeps(i) && W.disks[i].balanced == W.t; }

/* The change of force of a frozen contact for the difference of a vector at its two disks: in proportion to the square of
   the force, and on a smooth surface nearly along its normal. */
static void give_more(const Frozen *f, int which, double *given) {
    double force[2], more[2], strong = 0, along = 0;
    double across = f->j < 0 && surface_pair(W.disks + f->i, -1 - f->j)->friction == 0 ? SMOOTH : 1;
    for (int n = 0; n < 2; n++) {
        force[n] = f->force[n] + f->more[n];
        more[n] = of(f->i, which)[n] - (f->j < 0 ? 0 : of(f->j, which)[n]);
        strong += square(force[n]);
        along += force[n] * more[n];
    }
    for (int n = 0; n < 2; n++) given[n] = across * strong * more[n] + (1 - across) * along * force[n];
}

/* Multiply a vector by the Laplacian of the net of contacts, and add the product to another one. */
static void multiply(int which, int to) {
    double given[2];
    for (const Frozen *f = W.frozen; f < W.frozen + W.frozen_count; f++) {
        if (f->from != W.t) continue;
        give_more(f, which, given);
        for (int n = 0; n < 2; n++) {
            of(f->i, to)[n] += given[n];
            if (f->j >= 0) of(f->j, to)[n] -= given[n];
        }
    }
}

/* The residual at a disk, divided by what holds it: forces differ a thousandfold, and the rounds take as long as the greatest
   ratio of their squares asks for. */
static double eased(int i, int n) { return of(i, STIFF)[0] > 0 ? of(i, RESIDUAL)[n] / of(i, STIFF)[0] : 0; }

/* Set a vector to 0 at disks that are not balanced now; return the sum of its squares. */
static double square_of(int which) {
    double sum = 0;
    for (int i = W.low; i < W.high; i++)
        for (int n = 0; n < 2; n++) sum += square(of(i, which)[n] *= is_new(i));
    return sum;
}

/* If all of an island sleeps now, after parts of it did, the forces on all of it are balanced once more. */
static void begin_whole(void) {
    int *parent = W.queue, *open = W.found;
    for (EACH_LIVE(i)) {
        parent[i] = i;
        open[i] = 0;
    }
    for (const Frozen *f = W.frozen; f < W.frozen + W.frozen_count; f++)
        if (f->j >= 0 && f->from < INFINITY) parent[island_of(f->i)] = island_of(f->j);
    for (const Frozen *f = W.frozen; f < W.frozen + W.frozen_count; f++)
        if (f->from == INFINITY) open[island_of(W.disks[f->i].mode == ASLEEP ? f->i : f->j)] = 1;
    for (EACH_LIVE(i))
        if (is_new(i)) open[island_of(i)] |= 2;
    for (Frozen *f = W.frozen; f < W.frozen + W.frozen_count; f++) {
        if (f->from == INFINITY || open[island_of(f->i)] != 2) continue;
        melt(f, W.t);
        f->from = W.t;
        for (int n = 0; n < 2; n++) f->force[n] += f->more[n], f->more[n] = 0;
    }
    for (EACH_LIVE(i))
        if (W.disks[i].mode == ASLEEP && open[island_of(i)] == 2) W.disks[i].balanced = W.t;
}

/* Change the forces of contacts that have just been frozen as little as possible so that they bear the weight of those that
   fell asleep; what they miss is the error of the solve. The change of a force is the difference of a potential at its two
   disks, and the Laplacian of the potential on the net of contacts is the missing weight. Conjugate gradients find the
   potential. */
void balance_sleepers(void) {
    begin_whole();
    for (int i = W.low; i < W.high; i++) {
        const Disk *d = W.disks + i;
        for (int n = 0; n < 2 * VECTORS; n++) of(i, 0)[n] = 0;
        of(i, RESIDUAL)[0] = -d->mass * W.gx;
        of(i, RESIDUAL)[1] = -d->mass * W.gy;
    }
    double weight = square_of(RESIDUAL);
    for (const Frozen *f = W.frozen; f < W.frozen + W.frozen_count; f++)
        for (int n = 0; n < 2 && (f->from == W.t || f->from == INFINITY); n++) {
            double force = f->force[n] + (f->from == W.t ? f->more[n] : 0);
            of(f->i, RESIDUAL)[n] -= force;
            if (f->j >= 0) of(f->j, RESIDUAL)[n] += force;
        }
    for (const Frozen *f = W.frozen; f < W.frozen + W.frozen_count; f++) {
        if (f->from != W.t) continue;
        double strong = square(f->force[0] + f->more[0]) + square(f->force[1] + f->more[1]);
        of(f->i, STIFF)[0] += strong;
        if (f->j >= 0) of(f->j, STIFF)[0] += strong;
    }
    double size = 0, left = square_of(RESIDUAL);
    for (int round = 0; round < ROUNDS && left > square(BALANCED) * weight; round++) {
        double along = 0, before = size;
        size = 0;
        for (int i = W.low; i < W.high; i++)
            for (int n = 0; n < 2; n++) size += of(i, RESIDUAL)[n] * eased(i, n);
        for (int i = W.low; i < W.high; i++)
            for (int n = 0; n < 2; n++)
                of(i, DIRECTION)[n] = eased(i, n) + (round ? size / before * of(i, DIRECTION)[n] : 0);
        for (int i = W.low; i < W.high; i++) of(i, PRODUCT)[0] = of(i, PRODUCT)[1] = 0;
        multiply(DIRECTION, PRODUCT);
        square_of(PRODUCT);
        for (int i = W.low; i < W.high; i++)
            for (int n = 0; n < 2; n++) along += of(i, DIRECTION)[n] * of(i, PRODUCT)[n];
        if (!(along > 0)) break;
        for (int i = W.low; i < W.high; i++)
            for (int n = 0; n < 2; n++) {
                of(i, SOLUTION)[n] += size / along * of(i, DIRECTION)[n];
                of(i, RESIDUAL)[n] -= size / along * of(i, PRODUCT)[n];
            }
        left = square_of(RESIDUAL);
    }
    for (Frozen *f = W.frozen; f < W.frozen + W.frozen_count; f++) {
        double given[2];
        if (f->from != W.t) continue;
        give_more(f, SOLUTION, given);
        for (int n = 0; n < 2; n++) {
            f->more[n] += given[n];
            if (f->j >= 0 && !(is_new(f->i) && is_new(f->j))) continue;
            f->force[n] += f->more[n];
            f->more[n] = 0;
        }
    }
}
