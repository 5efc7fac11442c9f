/* Islands at rest, or at rest on a belt, fall asleep: they are not solved until something touches them. */

#include "core.h"

/* m/s on Earth; surfaces whose velocities differ by less move alike. */
#define ALIKE 1e-12

/* Wake the island of a disk at t. Within a step its disks then hop like all disks in contact for the rest of it: they get
   half of the impulse by which gravity acts until its end from what they lie on. */
void wake(int i, double t) {
    int island = W.disks[i].island;
    for (EACH_LIVE(n)) {
        Disk *d = W.disks + n;
        if (d->mode != ASLEEP || d->island != island) continue;
        double h = t - W.t, left = W.step_end - t;
        /* The place at which it lies, without the hop of the step so far. */
        d->x += (d->ux - d->vx - 0.5 * W.gx * (d->t - W.t)) * (d->t - W.t);
        d->y += (d->uy - d->vy - 0.5 * W.gy * (d->t - W.t)) * (d->t - W.t);
        d->x += d->ux * (t - d->t);
        d->y += d->uy * (t - d->t);
        d->t = t;
        bear_asleep(d, t, h > 0 ? 0.5 * left : 0);
        d->vx = d->ux;
        d->vy = d->uy;
        d->spin = 0;
        d->mode = FREE;
        d->calm = d->rest = 0;
        d->changes++;
        if (h <= 0) {
            knot_before(n, t, d->vx, d->vy, d->spin);
            continue;
        }
        was_moved(n);
        W.woken = 1;
        double x = -0.5 * W.gx * left, y = -0.5 * W.gy * left;
        double entries[3] = {0, -d->mass * (x * (d->vx + 0.5 * x) + y * (d->vy + 0.5 * y)), 0};
        book(d->entries, 0, W.owner_count, entries);
        d->vx += x;
        d->vy += y;
    }
}

/* Whether a contact allows an island to sleep. `u` is the common velocity of the surfaces that the island lies on, and is
   set by the first one. */
static int joins(const Contact *c, double *u, int *owner) {
    const Surface *s = W.surfaces + (-1 - c->j);
    double belt = c->other[1], x = belt * c->ny, y = -belt * c->nx;
    if (stirs(s) || (s->speed != 0 && s->shape != SEGMENT)) return 0;
    /* An island on a belt that will throw it off has not settled. */
    if (s->speed != 0 && W.until == UNTIL_SETTLED && c->owner != W.landing) return 0;
    if (fabs(W.gx * x + W.gy * y) > 1e-12 * W.g * fabs(belt)) return 0;
    if (*owner >= 0 && (fabs(u[0] - x) > ALIKE * W.pace || fabs(u[1] - y) > ALIKE * W.pace)) return 0;
    u[0] = x;
    u[1] = y;
    *owner = c->owner;
    return 1;
}

/* Let islands fall asleep that have been at rest for long enough. This follows the solve of a step, which has left the
   islands in `W.queue`. */
void fall_asleep(void) {
    int ready = 0;
    for (EACH_LIVE(i)) ready |= W.disks[i].mode == FREE && W.disks[i].rest >= CALM_DOWN / W.pace;
    if (!ready || !W.sleeps || !W.contact_count) return;
    /* For each island, at its root: `found` counts what prevents its sleep, `moved` is the owner of its surfaces or -1, and
       `tugged` holds their velocity, as nothing needs it between two steps. */
    for (EACH_LIVE(i)) {
        W.found[i] = 0;
        W.moved[i] = -1;
    }
    for (EACH_LIVE(i)) {
        const Disk *d = W.disks + i;
        if (d->mode == FREE && d->rest < CALM_DOWN / W.pace) W.found[island_of(i)]++;
    }
    ready = 0;
    for (EACH_LIVE(i)) ready |= W.disks[i].mode == FREE && !W.found[island_of(i)];
    if (!ready) return;
    for (int n = 0; n < W.contact_count; n++) {
        const Contact *c = W.contacts + n;
        int k = island_of(c->i);
        if (c->impulse[0] == 0 || c->two) continue;
        if (c->j >= 0 || !joins(c, W.disks[k].tugged, W.moved + k)) W.found[k]++;
    }
    /* Disks that rattle in place would wake the islands next to them; these wait until such a disk touches something. */
    for (int n = 0; n < 2 * W.near_count; n++) {
        const Disk *d = W.disks + W.near[n];
        if (d->mode == FREE && !d->supports && d->rest >= CALM_DOWN / W.pace)
            W.found[island_of(W.near[n ^ 1])]++;
    }
    for (EACH_LIVE(i)) {
        int k = island_of(i);
        if (W.disks[i].mode == FREE && !W.found[k] && W.moved[k] >= 0) take_back(i);
    }
    for (EACH_LIVE(i)) {
        Disk *d = W.disks + i;
        Track *track = W.tracks + i;
        int k = island_of(i);
        if (d->mode != FREE || W.found[k] || W.moved[k] < 0) continue;
        const double *s = track->held, *u = W.disks[k].tugged;
        double x = u[0] - s[3], y = u[1] - s[4];
        double entries[3] = {d->mass * (x * u[0] + y * u[1]),
                             0.5 * d->mass * (x * x + y * y) + 0.5 * d->inertia * s[5] * s[5], 0};
        track->lasted = 0;
        book(d->entries, 0, W.moved[k], entries);
        bear_disk(d, W.moved[k], d->mass * (u[0] - d->ux - W.before * (d->vx - d->ux)),
                  d->mass * (u[1] - d->uy - W.before * (d->vy - d->uy)), d->t, d->t);
        d->slept = d->t;
        d->ux = u[0];
        d->uy = u[1];
        d->vx = u[0];
        d->vy = u[1];
        d->spin = d->uspin = 0;
        d->island = k;
        d->changes++;
        knot_now(i);
    }
    for (EACH_LIVE(i)) {
        Disk *d = W.disks + i;
        int k = island_of(i);
        if (d->mode != FREE || W.found[k] || W.moved[k] < 0) continue;
        d->mode = ASLEEP;
        d->vx -= 0.5 * W.gx * W.step;
        d->vy -= 0.5 * W.gy * W.step;
    }
    balance_sleepers();
    keep_sleepers();
}
