/* The run: its parts, its steps, and its end. */

#include "core.h"

World W;

/* s on Earth; a crowd has settled if everything has been calm for so long. */
#define SETTLED 0.1

/* List all disks that are live as a step begins. */
static void list_live(void) {
    W.live_count = 0;
    for (int i = W.low; i < W.high; i++)
        if (is_live(W.disks + i)) W.live[W.live_count++] = i;
}

/* Whether a crowd has settled: all of it has been calm for long enough, no surface moves, and no gate will change. */
static int has_settled(void) {
    if (W.stirs || next_gate(W.looked) < INFINITY) return 0;
    for (int i = W.low; i < W.high; i++) {
        const Disk *d = W.disks + i;
        if (d->mode == WAITING || d->mode == RIDING || (d->mode == FREE && d->calm < SETTLED / W.pace)) return 0;
    }
    return 1;
}

/* Whether all disks of this part of the run have ended, or nothing can happen any more, and the reason for the end. */
static int is_over(int *reason) {
    int awake = 0;
    double next = INFINITY;
    for (EACH_LIVE(i)) {
        const Disk *d = W.disks + i;
        if (d->mode == RIDING || d->mode == FREE) awake = 1;
        if (d->mode == ASLEEP && (d->ux != 0 || d->uy != 0 || W.stirs || d->stirred)) awake = 1;
    }
    if (awake && !W.hinges) return 0;
    for (int i = W.low; i < W.high; i++) {
        const Disk *d = W.disks + i;
        if (W.hinges && d->mode == WAITING && d->release < W.end_time) awake = 1;
        if (d->mode == WAITING) next = MIN(next, MAX(d->release, W.t));
    }
    /* Hinges move on until a given time, else as long as there are disks. */
    if (W.hinges) return !awake && W.until != UNTIL_TIME;
    if (W.interact && W.until == UNTIL_SETTLED && has_settled()) {
        *reason = BY_SETTLING;
        return 1;
    }
    /* If a run was paused at the time of a change, that change has not been applied yet. */
    next = MIN(next, MAX(next_gate(W.looked), W.t));
    int asleep = 0;
    for (int i = W.low; i < W.high; i++) asleep |= W.disks[i].mode == ASLEEP;
    if (next >= W.end_time || next == INFINITY) next = W.end_time;
    if (W.pause > 0) next = MIN(next, MAX(W.pause, W.t));
    if (asleep || next < W.end_time) {
        for (int i = W.low; i < W.high; i++)
            if (W.disks[i].mode == ASLEEP) W.disks[i].t = next;
    }
    W.t = next;
    return !(asleep && next < W.end_time) && next >= W.end_time;
}

/* Begin with the next disk, if disks do not meet, or with all of them; return 0 at the end. */
static int begin_part(void) {
    W.low = W.high;
    if (W.low >= W.disk_count) return 0;
    W.high = W.interact ? W.disk_count : W.low + 1;
    W.contact_count = W.earlier_count = W.live_count = W.frozen_count = 0;
    W.border_count = -1;
    W.t = W.disks[W.low].release;
    W.smallest = W.low;
    W.taken[0] = W.taken[1] = W.borne = W.regained = W.risen = 0;
    W.eager = 1;
    for (int i = W.low; i < W.high; i++) {
        Disk *d = W.disks + i;
        if (d->radius < W.disks[W.smallest].radius) W.smallest = i;
        W.borne += d->mass * W.g * d->radius;
        d->left = d->bottom = INFINITY;
        d->right = d->top = -INFINITY;
        d->before = d->links = d->nears = d->frozen = -1;
        d->waits = CALM_DOWN / W.pace;
        d->inv_mass = 1 / d->mass;
        d->inv_inertia = d->inertia > 0 ? 1 / d->inertia : 0;
        d->heap_place = -1;
        d->on = -1;
        W.t = MIN(W.t, d->release);
    }
    if (W.hinges) W.t = MIN(W.t, 0);
    W.looked = W.t;
    W.ease = 1;
    W.room = INFINITY;
    for (int k = 0; k < W.surface_count; k++) {
        double room = W.surfaces[k].radius - W.disks[W.low].radius;
        if (W.surfaces[k].shape != SEGMENT && room > 0) W.room = MIN(W.room, room);
    }
    return 1;
}

/* A disk by itself is released outside of steps, and needs none while it rides. */
static int begin_alone(void) {
    int i = W.low;
    Disk *d = W.disks + i;
    if (W.interact || d->release >= W.end_time) return 1;
    if (W.knot_count + KNOTS_EACH + ride_knots(d) > W.knot_room) return 0;
    if (W.event_count + 64 > W.event_room) return 0;
    W.step_end = W.t;
    set_gates(W.t);
    release(i, W.t);
    if (d->mode == RIDING) {
        if (d->ride_to >= W.end_time) {
            if (d->ride_speed == 0 && W.until == UNTIL_SETTLED) {
                event_here(SETTLE, i, W.ride_owner);
                finish(i, BY_SETTLING);
            } else W.t = W.end_time;
        } else {
            W.t = W.step_end = d->ride_to;
            separate(i);
        }
    }
    return 1;
}

/* The fastest disk, once time can no longer advance by a step that is short enough for it; else -1. */
static int too_fast(void) {
    int found = W.low;
    double most = 0;
    if (W.t + W.step > W.t) return -1;
    for (int i = W.low; i < W.high; i++) {
        const Disk *d = W.disks + i;
        double speed = fabs(d->vx) + fabs(d->vy) + fabs(d->spin) * d->radius;
        if (d->mode != FREE || speed <= most) continue;
        most = speed;
        found = i;
    }
    return found;
}

/* Run for at most so many steps; return a `Status` or `Full`. */
static int run_on(int steps) {
    int status;
    for (;;) {
        int count = W.high - W.low;
        if (W.phase == PART) {
            if (!begin_part()) return DONE;
            W.phase = STEP;
            if (!begin_alone()) {
                W.high = W.low;
                W.phase = PART;
                return FULL_KNOTS;
            }
        } else if (W.phase == STEP) {
            list_live();
            int knots = (KNOTS_EACH + 2) * count + 64;
            for (EACH_LIVE(i))
                if (W.disks[i].mode == RIDING) knots += ride_knots(W.disks + i);
            if (W.knot_count + knots > W.knot_room) return FULL_KNOTS;
            if (W.event_count + 4 * count + 64 > W.event_room) return FULL_EVENTS;
            int reason = BY_TIME;
            if (is_over(&reason)) {
                if (W.joint_count && W.total_count >= W.total_room) return FULL_TOTALS;
                if (W.joint_count) note_totals();
                stop_all(reason);
                W.phase = PART;
                continue;
            }
            if (steps-- <= 0 || (W.pause > 0 && W.t >= W.pause)) return PAUSED;
            if ((status = begin_step()) != DONE) return status;
            if ((W.stalled = too_fast()) >= 0) {
                W.now = W.t;
                return STALLED;
            }
            int settled = W.interact && W.until == UNTIL_SETTLED && has_settled();
            if (settled || W.t >= W.end_time) {
                stop_all(settled ? BY_SETTLING : BY_TIME);
                W.phase = PART;
                continue;
            }
            if (W.joint_count) {
                tug_all(1);
                cut_at_snaps();
            }
            fall_asleep();
            foresee_all();
            W.phase = WITHIN;
        } else {
            if ((status = go_through()) != DONE) return status;
            end_step();
            W.phase = STEP;
        }
    }
}

/* Run for at most so many steps; see `Status`. If knots or events are full, the host takes them before the next call; if
   there were few to take, their room is doubled then. */
EXPORT int run(int steps) {
    int status = W.full;
    for (W.full = 0; !status || make_room(status);) {
        status = run_on(steps);
        if (W.is_whole && !W.interact) {
            if (status == FULL_KNOTS && W.knot_room < KEPT) continue;
            if (status == FULL_EVENTS && W.event_room < KEPT) continue;
        }
        if (status == FULL_KNOTS && W.knot_count <= W.knot_room / 2) W.full = status;
        if (status == FULL_EVENTS && W.event_count <= W.event_room / 2) W.full = status;
        if (status == FULL_KNOTS || status == FULL_EVENTS) return FULL;
        if (status < FULL_KNOTS) return status;
    }
    return LACKING;
}

EXPORT World *world(void) { return &W; }
