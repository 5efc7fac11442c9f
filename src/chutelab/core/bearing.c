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

/* Tell of the impulse on disk i of a contact with a surface, or with a rider, whose belt bears it. */
void bear_contact(const Contact *c, double share, double from, double to) {
    const Disk *a = W.disks + c->i;
    if (B.every == 0 || c->two) return;
    Push p = c->j < 0 ? at_foot(a, c->owner, a->radius, c->nx, c->ny, from, to)
                      : on_belt(W.disks + c->j, from, to);
    p.jx = share * (pressed(c) * c->nx + c->impulse[1] * c->ny);
    p.jy = share * (pressed(c) * c->ny - c->impulse[1] * c->nx);
    p.couple = share * c->impulse[2];
    bear(&p);
}

/* Tell of an impulse on a disk that the surface which it lies on, or one that bears its island, gives. */
void bear_disk(const Disk *d, int owner, double jx, double jy, double from, double to) {
    double nx = 0, ny = 1;
    if (B.every == 0 || (jx == 0 && jy == 0)) return;
    if (d->held_count && W.surfaces[d->held[0]].owner == owner)
        gap_to(W.surfaces + d->held[0], d->x, d->y, d->radius, &nx, &ny);
    Push p = at_foot(d, owner, d->radius, nx, ny, from, to);
    p.jx = jx;
    p.jy = jy;
    bear(&p);
}

/* Tell of a ride since the last knot, up to where the disk is now: the belt gives what changes its
   velocity and what gravity would. */
void bear_ride(int i) {
    const Disk *d = W.disks + i;
    const double *last = W.tracks[i].knot;
    double span = d->t - last[0];
    if (B.every == 0 || !(span > 0)) return;
    Push p = on_belt(d, last[0], d->t);
    p.vx = (d->x - last[1]) / span;
    p.vy = (d->y - last[2]) / span;
    p.x -= d->x - last[1];
    p.y -= d->y - last[2];
    p.jx = d->mass * (d->vx - last[3] - W.gx * span);
    p.jy = d->mass * (d->vy - last[4] - W.gy * span);
    bear(&p);
}

/* Note the force by which a surface that is pressed bore a disk in a step; it is the last of `held`. */
void note_force(Disk *d, const Contact *c, double span) {
    double *force = d->bears + 2 * (d->held_count - 1);
    force[0] = (pressed(c) * c->nx + c->impulse[1] * c->ny) / span;
    force[1] = (pressed(c) * c->ny - c->impulse[1] * c->nx) / span;
}

/* Tell of what surfaces gave a sleeper since it fell asleep, and for some time more at the end. */
void bear_asleep(const Disk *d, double until, double more) {
    for (int n = 0; n < d->held_count && B.every > 0; n++) {
        double nx, ny, time = until - d->slept + more;
        const Surface *s = W.surfaces + d->held[n];
        gap_to(s, d->x, d->y, d->radius, &nx, &ny);
        Push p = at_foot(d, s->owner, d->radius, nx, ny, d->slept, until);
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
