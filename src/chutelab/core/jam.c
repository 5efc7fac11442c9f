/* A disk that rattles without end is brought to rest together with those round it.

   In a vast crowd this also takes the place of an early end of the step, in which all disks would be solved anew
   because of one of them: its neighbourhood is solved for the rest of the step, as all are at its beginning. So work
   grows with the number of such places, not with that times the number of disks. */

#include <string.h>
#include "core.h"

/* Number of disks beyond which that pays, and for how many of them there may be one such jam in a step. */
#define VAST 1500
#define JAM_COST 20
/* Greatest number of sweeps of such a jam, how many of them have no momentum, and its accuracy as a share of that of
   others. What they leave open is left to impacts. */
#define QUICK_SWEEPS 100
#define QUICK_PLAIN 4
#define QUICK 0.2

/* Whether one more jam for the rest of the step takes less time than its early end. Crowds with corners, joints or
   hinges end it. */
int jams_pay(void) {
    int others = W.outline_count || W.joint_count || W.hinges;
    return !others && W.live_count > VAST && JAM_COST * (W.step_jams + 1) < W.live_count;
}

/* Add a contact to the list of a jam if the two touch now; return whether they do. */
static int add_touching(int i, int j, double radius, int *count) {
    Contact *c = W.earlier + *count;
    int room = TOUCHES * (W.high - W.low) - *count;
    if (room <= 0) return 0;
    if (is_cornered(i, j)) {
        Touch places[MOST_TOUCHES];
        int first = has_corners(W.disks + i) ? i : j, other = first == i ? j : i;
        int found = list_touches(first, other, W.disks[i].t, TOUCH * inner_of(i, j), W.disks[i].t, places);
        found = MIN(found, room);
        for (int n = 0; n < found; n++) describe_touch(c + n, first, other, places + n);
        *count += found;
        return found > 0;
    }
    describe(c, i, j);
    stall_too(c);
    if (c->gap > TOUCH * radius) return 0;
    c->impulse[0] = c->impulse[1] = c->impulse[2] = c->drift = 0;
    *count += 1;
    return 1;
}

/* Ask of contacts that afterwards nothing approaches faster than is left to the next step; opening is allowed. A disk
   with a deep overlap with a surface gets the hop that gravity will reverse. */
static void ask_to_stop(Contact *list, int count, double t) {
    for (Contact *c = list; c < list + count; c++) {
        const Disk *a = W.disks + c->i;
        double u[3], r = c->j >= 0 ? MIN(a->radius, W.disks[c->j].radius) : a->radius;
        int sunk = !c->cornered && c->gap <= -SUNK * r;
        relative(c, 0, u);
        c->need = -u[0] <= left_over(a, 0, -1 - c->j, r, sunk, a->t) ? MIN(-u[0], 0) : -u[0];
        if (sunk && c->j < 0) {
            double press = press_on(a, W.surfaces + (-1 - c->j), c->nx, c->ny);
            c->need = -u[0] + 0.5 * MAX(press, 0) * (W.step_end - t);
        }
    }
}

/* Ask of contacts that no gap is negative after the time h, and that deep overlaps are parted, as at the beginning of
   a step. */
static void ask_for_rest(Contact *list, int count, double h) {
    double heaviest = 0;
    int led = 0;
    for (Contact *c = list; c < list + count; c++) {
        const Disk *a = W.disks + c->i, *b = W.disks + (c->j >= 0 ? c->j : c->i);
        ask(c, MIN(c->gap, 0), gap_later(c, h, 0), MIN(a->radius, b->radius), h);
        heaviest = MAX(heaviest, MAX(a->mass, b->mass));
        led |= c->j < 0 && (c->other[1] - c->moved[1] != 0 || c->moved[0] > 0);
    }
    for (Contact *c = list; c < list + count; c++) {
        c->gives /= heaviest;
        if (!led) c->parts = INFINITY;
    }
}

/* Bring a disk that rattles without end to rest as far as possible: it is solved together with all disks that it touches,
   those that these touch, and so on, up to JAMMED of them, without restitution. The list of contacts uses the memory of
   those of the step before, which are not needed within a step. */
void jam(Contact *struck, double t) {
    int i = struck->i, count = 0, last = i, found, reached = 0;
    Contact *list = W.earlier;
    if (W.hinges) stop_hinges(t);
    W.jams++;
    W.disks[i].jam = W.jams;
    W.disks[i].jam_next = -1;
    for (int m = i; m >= 0; m = W.disks[m].jam_next) {
        Disk *a = W.disks + m;
        a->ux = a->vx;
        a->uy = a->vy;
        a->uspin = a->spin;
        a->kick[0] = a->kick[1] = 0;
        if (reached++ >= JAMMED) continue;
        found = reachable(m);
        a->jam = -W.jams;
        for (int n = 0; n < found; n++) {
            int k = W.found[n];
            Disk *b = W.disks + k;
            if (b->jam == -W.jams || (t > W.t && is_tied(k))) continue;
            double x = b->x + (b->vx + 0.5 * W.gx * (t - b->t)) * (t - b->t) - a->x;
            double y = b->y + (b->vy + 0.5 * W.gy * (t - b->t)) * (t - b->t) - a->y;
            double reach = a->radius + b->radius + TOUCH * MIN(a->radius, b->radius);
            if (x * x + y * y > reach * reach) continue;
            if (b->mode == ASLEEP) wake(k, t);
            advance(b, t);
            if (!add_touching(m, k, MIN(a->radius, b->radius), &count)) continue;
            if (b->jam == W.jams || b->mode != FREE) continue;
            b->jam = W.jams;
            b->jam_next = -1;
            W.disks[last].jam_next = k;
            last = k;
        }
        const int *nearby;
        int most = surfaces_near(m, &nearby);
        for (int n = 0; n < most; n++) {
            const Surface *s = surface_at(nearby[n], t);
            if (s->there == THERE && is_near(s, a) && (has_corners(a) || face_at(s, a->x, a->y) == s))
                add_touching(m, -1 - nearby[n], a->radius, &count);
        }
    }
    int anew = jams_pay() && t < W.step_end;
    W.step_jams++;
    if (anew) ask_for_rest(list, count, W.step_end - t);
    else ask_to_stop(list, count, t);
    struck->impulse[0] = struck->impulse[1] = 0;
    double left = 0.5 * (MOST_SKIP / SKIP) * W.skip * W.disks[i].radius;
    W.swings_too = 0;
    for (int n = 0; n < count; n++) W.swings_too |= list[n].hung > 0;
    /* Without momentum at first: with it the remaining velocities may never be small enough. */
    int ended = anew ? sweep_contacts(list, count, 0, QUICK_SWEEPS, QUICK_PLAIN, QUICK * 0.1 * left, QUICK * left)
                     : sweep_contacts(list, count, 0, JAM_SWEEPS, W.sweeps, 0.1 * left, left);
    for (int m = i; m >= 0; m = W.disks[m].jam_next) {
        Disk *d = W.disks + m;
        double v[3] = {d->vx, d->vy, d->spin};
        if (v[0] == d->ux && v[1] == d->uy && v[2] == d->uspin) continue;
        memcpy(&d->vx, &d->ux, 2 * sizeof(double));
        d->spin = d->uspin;
        was_moved(m);
        memcpy(&d->vx, v, sizeof v);
    }
    /* As after the beginning of a step, impacts are counted anew. Else, if the sweeps have not ended, more jams would
       not help: the jam counts as many impacts, so that soon more is left open. */
    for (int m = i; m >= 0 && (anew || !ended); m = W.disks[m].jam_next) {
        Disk *d = W.disks + m;
        d->impacts = anew ? 0 : d->impacts + (d->impacts < STUCK ? CROWDED : FEW / 2);
    }
    account(list, count);
    give_in(list, count);
    for (int n = 0; n < count; n++) {
        const Contact *c = list + n;
        Disk *a = W.disks + c->i, *b = W.disks + MAX(c->j, 0);
        double given[3] = {c->given[0], 0, 0};
        if (c->j < 0 && c->impulse[0] > 0) hold(a, -1 - c->j);
        int was_struck = (c->i == i && c->j == struck->j) || (c->i == struck->j && c->j == i);
        bear_contact(c, 1, t, t);
        if (!was_struck) keep_impulse(c, 1, t, t);
        book(a->entries, c->two ? b->entries : 0, c->owner, c->entries);
        if (c->j < 0) W.drives[c->owner] += driven(c, 0);
        if (given[0] != 0) book(a->entries, 0, W.ride_owner, given);
        if (was_struck)
            for (int k = 0; k < 2; k++) struck->impulse[k] = c->impulse[k];
    }
    if (W.hinges) go_on();
    give_back(list, count);
}
