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

/* Report the load by a contact of disk i with a surface, or with a rider: then the belt of the rider bears it. */
void bear_contact(const Contact *c, double share, double from, double to) {
    const Disk *a = W.disks + c->i;
    double J[2];
    if (B.every == 0 || c->two) return;
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
static void branch_of(const Contact *c, double *b) {
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
    if (B.each == 0 || c->j < 0 || c->two) return;
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

/* Note the force with which the last surface of `held` supported a disk in a step. */
void note_force(Disk *d, const Contact *c, double span) {
    double *force = d->bears + 2 * (d->held_count - 1);
    force[0] = (pressed(c) * c->nx + c->impulse[1] * c->ny) / span;
    force[1] = (pressed(c) * c->ny - c->impulse[1] * c->nx) / span;
}

/* Report the loads by a sleeper since it fell asleep, and for the time `more` at the end. */
void bear_asleep(const Disk *d, double until, double more) {
    if (B.each > 0) keep_awake((int)(d - W.disks), until, until - d->slept + more);
    for (int n = 0; n < d->held_count && B.every > 0; n++) {
        double nx, ny, time = until - d->slept + more;
        const Surface *s = W.surfaces + d->held[n];
        double depth = depth_of(d, s, &nx, &ny);
        Push p = at_foot(d, s->owner, depth, nx, ny, d->slept, until);
        p.vx = d->ux;
        p.vy = d->uy;
        p.x -= d->ux * (d->t - d->slept);
        p.y -= d->uy * (d->t - d->slept);
        p.jx = d->bears[2 * n] * time;
        p.jy = d->bears[2 * n + 1] * time;
        bear(&p);
    }
}

/* Correct the forces on islands that have just fallen asleep so that they bear the weight: the difference, an error of
   the solve, is distributed over all forces in proportion to their size. `W.queue` leads to the roots of islands. */
void balance_sleepers(void) {
    for (int i = W.low; i < W.high && B.every > 0; i++) {
        if (W.disks[i].mode != ASLEEP || W.disks[i].slept != W.t || island_of(i) != i) continue;
        double x = 0, y = 0, size = 0;
        for (int pass = 0; pass < 2; pass++)
            for (int n = W.low; n < W.high; n++) {
                Disk *d = W.disks + n;
                if (d->mode != ASLEEP || d->slept != W.t || d->island != i) continue;
                if (pass == 0) x -= d->mass * W.gx, y -= d->mass * W.gy;
                for (double *f = d->bears; f < d->bears + 2 * d->held_count; f += 2) {
                    double strong = sqrt(square(f[0]) + square(f[1]));
                    if (pass == 0) x -= f[0], y -= f[1], size += strong;
                    else f[0] += x * strong / size, f[1] += y * strong / size;
                }
            }
    }
}

/* Greatest number of rounds of conjugate gradients, and the share of the weight that they may leave unbalanced. */
#define ROUNDS 200
#define BALANCED 1e-12

enum { RESIDUAL, DIRECTION, SOLUTION, PRODUCT };

/* One of the four vectors of conjugate gradients, at a disk. */
static double *vector_of(int disk, int which) { return B.balance + 8 * disk + 2 * which; }

/* Multiply a vector by the Laplacian of the net of contacts, and add the product to another one. */
static void multiply(const Lasting *rows, int count, int which, int to) {
    for (const Lasting *c = rows; c < rows + count; c++)
        for (int n = 0; n < 2; n++) {
            double more = vector_of(c->disk, which)[n] - (c->other < 0 ? 0 : vector_of(c->other, which)[n]);
            vector_of(c->disk, to)[n] += more;
            if (c->other >= 0) vector_of(c->other, to)[n] -= more;
        }
}

/* Change the forces of contacts as little as possible so that they bear the weight of all sleepers; what they miss is the
   error of the solve. The change of a force is the difference of a potential at its two disks, and the Laplacian of the
   potential on the net of contacts is the missing weight. Conjugate gradients find the potential. */
static void balance_contacts(Lasting *rows, int count) {
    double size = 0, weight = 0;
    for (int i = W.low; i < W.high; i++) {
        const Disk *d = W.disks + i;
        int sleeps = d->mode == ASLEEP && d->slept == W.t;
        for (int n = 0; n < 8; n++) vector_of(i, 0)[n] = 0;
        vector_of(i, RESIDUAL)[0] = sleeps ? -d->mass * W.gx : 0;
        vector_of(i, RESIDUAL)[1] = sleeps ? -d->mass * W.gy : 0;
        for (int n = 0; n < 2; n++) weight += square(vector_of(i, RESIDUAL)[n]);
    }
    for (const Lasting *c = rows; c < rows + count; c++)
        for (int n = 0; n < 2; n++) {
            vector_of(c->disk, RESIDUAL)[n] -= (&c->x)[n];
            if (c->other >= 0) vector_of(c->other, RESIDUAL)[n] += (&c->x)[n];
        }
    for (int i = W.low; i < W.high; i++)
        for (int n = 0; n < 2; n++) {
            vector_of(i, DIRECTION)[n] = vector_of(i, RESIDUAL)[n];
            size += square(vector_of(i, RESIDUAL)[n]);
        }
    for (int round = 0; round < ROUNDS && size > square(BALANCED) * weight; round++) {
        double along = 0, now = 0;
        for (int i = W.low; i < W.high; i++) vector_of(i, PRODUCT)[0] = vector_of(i, PRODUCT)[1] = 0;
        multiply(rows, count, DIRECTION, PRODUCT);
        for (int i = W.low; i < W.high; i++)
            for (int n = 0; n < 2; n++) along += vector_of(i, DIRECTION)[n] * vector_of(i, PRODUCT)[n];
        if (!(along > 0)) break;
        for (int i = W.low; i < W.high; i++)
            for (int n = 0; n < 2; n++) {
                vector_of(i, SOLUTION)[n] += size / along * vector_of(i, DIRECTION)[n];
                vector_of(i, RESIDUAL)[n] -= size / along * vector_of(i, PRODUCT)[n];
                now += square(vector_of(i, RESIDUAL)[n]);
            }
        for (int i = W.low; i < W.high; i++)
            for (int n = 0; n < 2; n++)
                vector_of(i, DIRECTION)[n] = vector_of(i, RESIDUAL)[n] + now / size * vector_of(i, DIRECTION)[n];
        size = now;
    }
    for (Lasting *c = rows; c < rows + count; c++) {
        double *force = &c->x, strong = square(force[0]) + square(force[1]), b[2];
        for (int n = 0; n < 2; n++) b[n] = (force[0] * c->stress[n] + force[1] * c->stress[2 + n]) / strong;
        for (int n = 0; n < 2; n++) {
            force[n] += vector_of(c->disk, SOLUTION)[n] - (c->other < 0 ? 0 : vector_of(c->other, SOLUTION)[n]);
            for (int k = 0; k < 2; k++) c->stress[2 * n + k] = force[n] * b[k];
        }
    }
}

/* Keep the forces that hold what has just fallen asleep: those of its latest step, balanced. */
void keep_sleepers(void) {
    int first = B.asleep_count;
    for (int n = 0; n < W.contact_count && B.each > 0; n++) {
        const Contact *c = W.contacts + n;
        const Disk *d = W.disks + c->i;
        double force[2], b[2];
        if (d->mode != ASLEEP || d->slept != W.t || (c->impulse[0] == 0 && c->clings == 0)) continue;
        impulse_of(c, 2 / (W.length_before + W.length), force);
        branch_of(c, b);
        keep_asleep(c->i, other_of(c), d->slept, force, b);
    }
    if (B.asleep_count > first) balance_contacts(B.asleep + first, B.asleep_count - first);
}
