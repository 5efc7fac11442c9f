/* What surfaces bear in the contact engine: of blows, of contacts that last, under what sleeps and rides. */

#include "core.h"

static Push at_foot(const Disk *d, int owner, double depth, double nx, double ny, double from, double to) {
    return (Push){ .owner = owner, .from = from, .to = to, .x = d->x - depth * nx, .y = d->y - depth * ny,
                   .nx = nx, .ny = ny };
}

/* The same below a rider, on the belt. */
static Push on_belt(const Disk *d, double from, double to) {
    double phi = MAX(d->ride_x + d->ride_speed * (0.5 * (from + to) - d->ride_from), 0) / d->ride_rho - W.ride_incline;
    double depth = d->ride_rho - (W.pulley < 0 ? 0 : W.surfaces[W.pulley].radius);
    return at_foot(d, W.ride_owner, depth, sin(phi), cos(phi), from, to);
}

/* The impulse on disk i of a contact, N s. */
static void impulse_of(const Contact *c, double share, double *J) {
    J[0] = share * (pressed(c) * c->nx + c->impulse[1] * c->ny);
    J[1] = share * (pressed(c) * c->ny - c->impulse[1] * c->nx);
}

/* Tell of the impulse on disk i of a contact with a surface, or with a rider, whose belt bears it. */
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

/* Keep what surfaces gave by a push, from the foot below a disk. */
static void keep_push(const Disk *d, const Push *p, double depth) {
    double J[] = {p->jx, p->jy}, b[] = {depth * p->nx, depth * p->ny};
    keep_contact((int)(d - W.disks), -1 - p->owner, p->from, p->to, J, b);
}

/* What disk i of a contact is off the other, or off its foot on a surface, m. */
static void branch_of(const Contact *c, double *b) {
    const Disk *a = W.disks + c->i, *other = W.disks + MAX(c->j, 0);
    b[0] = c->j < 0 ? a->radius * c->nx : a->x - other->x;
    b[1] = c->j < 0 ? a->radius * c->ny : a->y - other->y;
    if (!c->cornered || c->j >= 0) return;
    b[0] = c->own[1] * c->nx - c->own[0] * c->ny;
    b[1] = c->own[1] * c->ny + c->own[0] * c->nx;
}

static int other_of(const Contact *c) { return c->j < 0 ? -1 - c->owner : c->j; }

/* The same, kept pair by pair. Blows are events instead. */
void keep_impulse(const Contact *c, double share, double from, double to) {
    double J[2], b[2];
    if (B.each == 0) return;
    impulse_of(c, share, J);
    branch_of(c, b);
    keep_contact(c->i, other_of(c), from, to, J, b);
    keep_carried(c, share, from, to);
}

/* What a contact takes from a rider its belt gives it, of a blow too: the rider's way stays as it is. */
void keep_carried(const Contact *c, double share, double from, double to) {
    double J[2];
    if (B.each == 0 || c->j < 0 || c->two) return;
    impulse_of(c, share, J);
    Push p = on_belt(W.disks + c->j, from, to);
    p.jx = J[0];
    p.jy = J[1];
    keep_push(W.disks + c->j, &p, W.disks[c->j].radius);
}

/* How far the foot of a disk on a surface is from its centre, m, and the normal there. What has corners is borne
   below its centre, as far as that is told. */
static double depth_of(const Disk *d, const Surface *s, double *nx, double *ny) {
    double gap = gap_to(s, d->x, d->y, d->radius, nx, ny);
    return has_corners(d) ? gap + d->radius : d->radius;
}

/* Tell of an impulse on a disk that the surface which it lies on, or one that bears its island, gives. */
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

/* Tell of a ride since the last knot, up to where the disk is now: the belt gives what changes its
   velocity and what gravity would. */
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

/* Note the force by which a surface that is pressed bore a disk in a step; it is the last of `held`. */
void note_force(Disk *d, const Contact *c, double span) {
    double *force = d->bears + 2 * (d->held_count - 1);
    force[0] = (pressed(c) * c->nx + c->impulse[1] * c->ny) / span;
    force[1] = (pressed(c) * c->ny - c->impulse[1] * c->nx) / span;
}

/* Tell of what surfaces gave a sleeper since it fell asleep, and for some time more at the end. */
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

/* Islands that have just fallen asleep are borne by their weight: what the forces of the latest step are off
   it, a solve's rest, goes to all of them in proportion. `W.queue` leads to islands. */
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

/* Rounds of conjugate gradients, and the share of weight that they may leave. */
#define ROUNDS 200
#define BALANCED 1e-12

enum { LEFT, AHEAD, CHANGE, RAISED };

/* One of the four vectors of a disk. */
static double *of(int disk, int which) { return B.balance + 8 * disk + 2 * which; }

/* Raise each contact's force on its disk by how much more of `which` the disk has than the other, and add up at
   disks what that gives into `to`. */
static void add_raised(const Lasting *rows, int count, int which, int to) {
    for (const Lasting *c = rows; c < rows + count; c++)
        for (int n = 0; n < 2; n++) {
            double more = of(c->disk, which)[n] - (c->other < 0 ? 0 : of(c->other, which)[n]);
            of(c->disk, to)[n] += more;
            if (c->other >= 0) of(c->other, to)[n] -= more;
        }
}

/* Change the forces of contacts by the least that has them bear the weight of all sleepers: what the forces of the
   latest step are off it is a solve's rest. The change is a difference of what disks have, a potential, whose
   Laplacian on the net of contacts is what weight lacks. */
static void balance_contacts(Lasting *rows, int count) {
    double size = 0, weight = 0;
    for (int i = W.low; i < W.high; i++) {
        const Disk *d = W.disks + i;
        int sleeps = d->mode == ASLEEP && d->slept == W.t;
        for (int n = 0; n < 8; n++) of(i, 0)[n] = 0;
        of(i, LEFT)[0] = sleeps ? -d->mass * W.gx : 0;
        of(i, LEFT)[1] = sleeps ? -d->mass * W.gy : 0;
        for (int n = 0; n < 2; n++) weight += square(of(i, LEFT)[n]);
    }
    for (const Lasting *c = rows; c < rows + count; c++)
        for (int n = 0; n < 2; n++) {
            of(c->disk, LEFT)[n] -= (&c->x)[n];
            if (c->other >= 0) of(c->other, LEFT)[n] += (&c->x)[n];
        }
    for (int i = W.low; i < W.high; i++)
        for (int n = 0; n < 2; n++) {
            of(i, AHEAD)[n] = of(i, LEFT)[n];
            size += square(of(i, LEFT)[n]);
        }
    for (int round = 0; round < ROUNDS && size > square(BALANCED) * weight; round++) {
        double along = 0, now = 0;
        for (int i = W.low; i < W.high; i++) of(i, RAISED)[0] = of(i, RAISED)[1] = 0;
        add_raised(rows, count, AHEAD, RAISED);
        for (int i = W.low; i < W.high; i++)
            for (int n = 0; n < 2; n++) along += of(i, AHEAD)[n] * of(i, RAISED)[n];
        if (!(along > 0)) break;
        for (int i = W.low; i < W.high; i++)
            for (int n = 0; n < 2; n++) {
                of(i, CHANGE)[n] += size / along * of(i, AHEAD)[n];
                of(i, LEFT)[n] -= size / along * of(i, RAISED)[n];
                now += square(of(i, LEFT)[n]);
            }
        for (int i = W.low; i < W.high; i++)
            for (int n = 0; n < 2; n++) of(i, AHEAD)[n] = of(i, LEFT)[n] + now / size * of(i, AHEAD)[n];
        size = now;
    }
    for (Lasting *c = rows; c < rows + count; c++) {
        double *force = &c->x, strong = square(force[0]) + square(force[1]), b[2];
        for (int n = 0; n < 2; n++) b[n] = (force[0] * c->stress[n] + force[1] * c->stress[2 + n]) / strong;
        for (int n = 0; n < 2; n++) {
            force[n] += of(c->disk, CHANGE)[n] - (c->other < 0 ? 0 : of(c->other, CHANGE)[n]);
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
