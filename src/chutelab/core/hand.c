/* What a user does by hand between two steps: push disks and turn plates.

   A push is a force. Once a step it gives what it owes from the step before and its impulse for half of this one, together
   with the impulses of the contacts: so it is of second order, and its work is that impulse times the mean of the
   velocities before and after all impulses. To a disk in a halved contact it gives what it owes at the end of the step,
   see tied.c. A plate turns at a constant rate until a given time, at which a step ends. */

#include "core.h"

/* Apply a force (N) to a disk until the next call. A sleeping disk wakes as the next step begins; a disk that the
   incoming belt carries by adhesion is not moved. */
EXPORT void push_disk(int i, double x, double y) {
    Disk *d = W.disks + i;
    W.hastened = MAX(W.hastened, d->inv_mass * hypot(x, y));
    d->stirred |= d->mode == ASLEEP;
    d->force[0] = x;
    d->force[1] = y;
}

/* Greatest acceleration of a disk by a push in this step, m/s2. */
double hastened(void) {
    double most = 0;
    for (int i = W.low; i < W.high && W.hastened > 0; i++)
        most = MAX(most, W.disks[i].inv_mass * hypot(W.disks[i].force[0], W.disks[i].force[1]));
    return most;
}

/* Give a disk what a push owes and its impulse for a time to come. */
void kick(Disk *d, double time) {
    for (int n = 0; n < 2; n++) {
        double ahead = d->mode == FREE ? time * d->force[n] : 0;
        d->kick[n] = d->mode == FREE ? d->inv_mass * (d->owed[n] + ahead) : 0;
        d->owed[n] = -ahead;
        (&d->vx)[n] += d->kick[n];
    }
}

/* Work of the push of a step on a disk after the share f of its impulse has been given, J. */
double pushed(const Disk *d, double f) {
    /* The velocity after the impulses of halved contacts includes the pull of joints, which is booked as if it came later. */
    double x = d->vx - d->halved * d->tug[0], y = d->vy - d->halved * d->tug[1];
    double before = d->kick[0] * d->ux + d->kick[1] * d->uy, after = d->kick[0] * x + d->kick[1] * y;
    return 0.5 * d->mass * ((1 - f) * (1 - f) * before + (1 - f * f) * after);
}

/* Book a part of the work of a push. */
void book_push(double *entries, double work) {
    book(entries, 0, W.owner_count, (double[]){work, 0, 0});
    W.push_work += work;
}

/* Turn a plate that has no motion of its own to an angle relative to its written position, at a constant rate until a
   later time. Return 0 if there is no memory. */
EXPORT int steer(int owner, double x, double y, double angle, double until) {
    Mover *m = W.movers;
    while (m < W.movers + W.mover_count && m->surface != owner) m++;
    int is_new = m == W.movers + W.mover_count;
    if (is_new) {
        Mover *old = W.movers;
        RESERVE(W.movers, W.mover_count + 1.0);
        RESERVE(W.solver_bodies, W.disk_count + 2.0 + W.mover_count);
        RESERVE(W.light_bodies, W.disk_count + 2.0 + W.mover_count);
        if (!has_room()) return 0;
        for (int k = 0; k < W.mover_count; k++) W.movers[k] = old[k];
        m = W.movers + W.mover_count++;
        *m = (Mover){ .pivot = { x, y }, .surface = owner, .steered = 1, .t = NAN };
    }
    while (W.swing_count + 4 * (W.mover_count + 1) > W.swing_room) {
        if (W.swing_room == 0) {
            RESERVE(W.swings, W.swing_room = 1024);
            RESERVE(W.swing_work, 3.0 * W.swing_room);
        } else if (!stretch_swings()) return 0;
        if (!has_room()) return 0;
    }
    double now = steered_to(m, W.t);
    m->angle = now;
    m->since = W.t;
    m->until = until;
    m->rate = (angle - now) / (until - W.t);
    m->t = NAN;
    /* Sleepers are not passed over by a long step, and those beside what it may sweep now list it. */
    W.stirs = 1;
    for (int i = 0; i < W.disk_count && is_new; i++) W.disks[i].zone[0] = INFINITY;
    if (is_new) join_surfaces();
    for (Surface *s = W.surfaces; s < W.surfaces + W.surface_count; s++) {
        if (s->owner != owner) continue;
        if (is_new) prepare_mover(s);
        s->posed = NAN;
        s->fastest = s->reach * fabs(m->rate);
        s->haste = s->reach * m->rate * m->rate;
        W.fastest = MAX(W.fastest, s->fastest);
    }
    W.swings[W.swing_count++] = (Swing){ W.t, now, 0, owner, 0 };
    W.swings[W.swing_count++] = (Swing){ W.t, now, m->rate, owner, 0 };
    W.swings[W.swing_count++] = (Swing){ until, angle, m->rate, owner, 0 };
    W.swings[W.swing_count++] = (Swing){ until, angle, 0, owner, 0 };
    return 1;
}

/* The angle of a plate that is turned by hand, rad. */
double steered_to(const Mover *m, double t) {
    return m->angle + m->rate * MAX(MIN(t, m->until) - m->since, 0);
}
