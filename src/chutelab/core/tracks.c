/* How tracks begin and end: releases, the ends of rides, exits, and the end of the run. */

#include "core.h"

static void take_off(int i) {
    Disk *d = W.disks + i;
    d->mode = FREE;
    d->changes++;
    d->aired = d->t;
    /* A push acts on it from now on. */
    for (int n = 0; n < 2; n++) d->owed[n] = (W.t - d->t) * d->force[n];
    slow_down(i, 0.5 * (d->t + MAX(W.step_end, d->t)));
    d->ux = d->vx;
    d->uy = d->vy;
    d->uspin = d->spin;
    W.tracks[i].lasted = 0;
}

/* Add a released disk to those that are live. */
static void list_one(int i) {
    int n = W.live_count++;
    for (; n > 0 && W.live[n - 1] > i; n--) W.live[n] = W.live[n - 1];
    W.live[n] = i;
}

/* Release a disk at t, if its place is free. Its next event is then the end of a ride, or an impact. */
int release(int i, double t) {
    Disk *d = W.disks + i;
    /* It does not rotate while it waits. */
    d->t = d->since = t;
    if (!d->goes_on && !place_is_free(i, d->x, d->y, t)) {
        d->waited = 1;
        return 0;
    }
    d->on = -1;
    d->changes++;
    d->mode = RIDING;
    list_one(i);
    if (d->ride_rho > 0) plan_ride(d, t);
    event_here(RELEASE, i, -1);
    knot_now(i);
    double own[2] = {kinetic_of(d, &d->vx, d->spin), lifted(d, &d->x)};
    W.released += own[0] + own[1];
    for (int n = 0; n < 2; n++) W.latest[1 + n] = own[n] + (t == W.latest[0] ? W.latest[1 + n] : 0);
    W.latest[0] = t;
    if (d->ride_rho > 0) ride_on(d, t, MAX(W.step_end, t));
    else {
        take_off(i);
        for (int k = 0; k < W.surface_count && W.gate_count; k++)
            if (W.surfaces[k].one_sided) spare(d, W.surfaces + k, t);
        lie_down(i);
    }
    return 1;
}

void separate(int i) {
    Disk *d = W.disks + i;
    write_ride(i, d->ride_to);
    event_here(SEPARATION, i, W.ride_owner);
    take_off(i);
    enter_again(i, MAX(W.step_end, d->t));
    list_again(i);
    if (d->ride_met >= 0) shock(i, -1 - d->ride_met, d->t);
}

/* End the track of a disk that leaves the scene in this step, at the time when it crosses an edge outwards. */
void leave(int i, double end) {
    Disk *d = W.disks + i;
    double first = INFINITY, h = end - d->t;
    for (int n = 0; n < 4; n++) {
        int y = n % 2;
        double side = n < 2 ? -1 : 1, pull = side * (y ? W.gy : W.gx);
        double gap = side * (d->exit_box[n] - (y ? d->y : d->x)), rate = side * (y ? d->vy : d->vx);
        if (!(fabs(d->exit_box[n]) < INFINITY) || gap - (rate + 0.5 * pull * h) * h >= 0) continue;
        double t = 0, root = sqrt(MAX(rate * rate + 2 * pull * gap, 0));
        if (gap > 0) t = 2 * gap / (rate + root);
        else if (rate < 0) t = pull > 0 ? -rate / pull : INFINITY;
        first = MIN(first, t);
    }
    if (first > h) return;
    flush_track(i);
    advance(d, MIN(d->t + first, end));
    slow_down(i, d->t);
    knot_now(i);
    event_here(EXIT, i, -1);
    finish(i, BY_EXIT);
}

/* End all tracks at the end of the run; those in lasting contact halfway through the impulses of the step. */
void stop_all(int reason) {
    for (int i = W.low; i < W.high; i++)
        if (W.disks[i].mode == FREE && W.disks[i].supports && W.tracks[i].lasted) take_back(i);
    for (Frozen *f = W.frozen; f < W.frozen + W.frozen_count; f++) melt(f, W.disks[f->i].t);
    for (int i = W.low; i < W.high; i++) {
        Disk *d = W.disks + i;
        if (d->mode == FREE && d->supports && W.tracks[i].lasted) end_in_contact(i, BY_TIME);
        else if (d->mode == FREE) {
            flush_track(i);
            slow_down(i, d->t);
            if (d->t > W.tracks[i].knot[0]) knot_now(i);
            finish(i, BY_TIME);
        } else if (d->mode == ASLEEP) {
            d->vx = d->ux;
            d->vy = d->uy;
            if (d->t > W.tracks[i].knot[0]) knot_now(i);
            finish(i, BY_TIME);
        } else if (d->mode == RIDING) {
            write_ride(i, MIN(W.t, d->ride_to));
            finish(i, BY_TIME);
        } else if (d->mode == WAITING) {
            finish(i, BY_TIME);
            continue;
        } else continue;
        if (reason == BY_SETTLING) {
            event_here(SETTLE, i, d->held_count ? W.surfaces[d->held[0]].owner : -1);
            d->reason = BY_SETTLING;
        }
    }
    if (W.hinges) finish_hinges(W.t);
}
