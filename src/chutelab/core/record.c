/* What a run leaves behind: knots, events, entries of the ledger. */

#include <string.h>
#include "core.h"

/* Of what gravity does in two steps: a blow that changes a velocity by less is soft. */
#define SOFT_BLOW 0.1

static void emit(int i, const double *state, const double *entries) {
    Knot *k = W.knots + W.knot_count++;
    memcpy(&k->t, state, 6 * sizeof(double));
    memcpy(k->entries, entries, sizeof k->entries);
    k->disk = i;
}

/* Write the knot after a blow that was held back, if there is one. */
static void let_go(int i) {
    Track *track = W.tracks + i;
    if (track->held_back) emit(i, track->knot, track->blow_entries);
    track->held_back = 0;
}

static void write_knot(int i, const double *state, const double *entries) {
    Track *track = W.tracks + i;
    let_go(i);
    emit(i, state, entries);
    memcpy(track->knot, state, sizeof track->knot);
    track->bent = track->open = 0;
}

/* Write the state of a disk as it is. */
void knot_now(int i) {
    Disk *d = W.disks + i;
    double state[6] = {d->t, d->x, d->y, d->vx, d->vy, d->spin};
    write_knot(i, state, d->entries);
}

/* Write the state in which a path ends, unless it is the last knot anyhow. */
void knot_before(int i, double t, double vx, double vy, double spin) {
    Disk *d = W.disks + i;
    double state[6] = {t, d->x, d->y, vx, vy, spin};
    flush_track(i);
    if (memcmp(state, W.tracks[i].knot, sizeof state)) write_knot(i, state, d->entries);
}

/* The same before a blow. In a crowd a rattling disk has many of them within a thousandth of a
   radius: of these, if they are soft, the state before the first and that after the last are told. */
void knot_before_blow(int i) {
    const Disk *d = W.disks + i;
    Track *track = W.tracks + i;
    double state[6] = {d->t, d->x, d->y, d->vx, d->vy, d->spin};
    track->again = track->held_back && d->t - track->knot[0] < W.step
        && fabs(d->x - track->knot[1]) + fabs(d->y - track->knot[2]) < W.smooth_x * d->radius;
    if (track->again) {
        memcpy(track->blow, state, sizeof state);
        memcpy(track->blow_before, d->entries, sizeof track->blow_before);
    } else knot_before(i, d->t, d->vx, d->vy, d->spin);
}

/* Note the state after a blow; in a crowd it is held back, since that of the next may replace it. */
void knot_after(int i) {
    const Disk *d = W.disks + i;
    Track *track = W.tracks + i;
    double state[6] = {d->t, d->x, d->y, d->vx, d->vy, d->spin};
    if (!W.interact) {
        knot_now(i);
        return;
    }
    if (track->again) {
        const double *was = track->blow;
        double change = fabs(d->vx - was[3]) + fabs(d->vy - was[4]) + fabs(d->spin - was[5]) * d->radius;
        if (change > SOFT_BLOW * W.soft) {
            let_go(i);
            emit(i, track->blow, track->blow_before);
        }
    }
    memcpy(track->knot, state, sizeof state);
    memcpy(track->blow_entries, d->entries, sizeof track->blow_entries);
    track->bent = track->open = track->again = 0;
    track->held_back = 1;
}

/* End the smooth part of a track: the state halfway through the last impulses, and that after. */
void flush_track(int i) {
    Track *track = W.tracks + i;
    if (!track->lasted) return;
    double state[6];
    memcpy(state, track->held, sizeof state);
    if (track->open) write_knot(i, state, track->held_entries);
    memcpy(state + 3, track->after, sizeof track->after);
    write_knot(i, state, track->after_entries);
    track->lasted = 0;
}

static int foretold(const Track *track, const double *state, double radius) {
    double h = state[0] - track->knot[0], close = W.smooth_x * radius;
    for (int n = 0; n < 3; n++) {
        double v = track->knot[3 + n], a = track->bend[n], off = fabs(v + a * h - state[3 + n]);
        if (off * (n < 2 ? 1 : radius) > W.smooth_v) return 0;
        /* A cubic whose end velocity is off by so much bulges by a seventh of off h. */
        if (n < 2 && 0.15 * off * h > close) return 0;
        if (n < 2 && fabs(track->knot[1 + n] + (v + 0.5 * a * h) * h - state[1 + n]) > close)
            return 0;
    }
    return 1;
}

static void foretell(Track *track, const double *from, const double *to) {
    for (int n = 0; n < 3; n++) track->bend[n] = (to[3 + n] - from[3 + n]) / (to[0] - from[0]);
    track->bent = 1;
}

/* Note the state of a disk in lasting contact, after the impulses of a step.

   In contact a disk hops from step to step; its smooth track goes through the states partway through
   the impulses of each step, halfway if steps are equal. There its velocity has no part of the hop,
   and its entries are short of what the rest of the impulses does. One is written where constant acceleration from
   the last knot on no longer foretells the next. */
void track_lasting(int i) {
    Disk *d = W.disks + i;
    Track *track = W.tracks + i;
    double f = W.before;
    double state[6] = {d->t, d->x, d->y, d->ux + f * (d->vx - d->ux), d->uy + f * (d->vy - d->uy),
                       d->uspin + f * (d->spin - d->uspin)};
    double entries[3];
    if (d->lacks > 0) {
        /* In a hollow the velocity turns, so that its mean is too small. */
        double square_speed = square(state[3]) + square(state[4]);
        double longer = sqrt(1 + 2 * d->lacks * d->inv_mass / square_speed);
        state[3] *= longer;
        state[4] *= longer;
    }
    for (int n = 0; n < 3; n++) entries[n] = d->entries[n] + d->gain[n] - d->ahead[n];
    if (!track->lasted) {
        knot_before(i, d->t, d->ux, d->uy, d->uspin);
        write_knot(i, state, entries);
    } else {
        if (!track->bent) foretell(track, track->knot, state);
        if (!foretold(track, state, d->radius)) {
            double held[6];
            memcpy(held, track->held, sizeof held);
            if (track->open) write_knot(i, held, track->held_entries);
            foretell(track, held, state);
        }
        track->open = 1;
    }
    track->lasted++;
    memcpy(track->past, track->lasted > 1 ? track->held : state, sizeof track->past);
    memcpy(track->held, state, sizeof state);
    memcpy(track->held_entries, entries, sizeof entries);
    memcpy(track->after, &d->vx, sizeof track->after);
    for (int n = 0; n < 3; n++) track->after_entries[n] = d->entries[n] + d->gain[n];
}

/* Write the latest state in lasting contact, which sleep ends. */
void knot_held(int i) {
    Track *track = W.tracks + i;
    double state[6];
    memcpy(state, track->held, sizeof state);
    if (track->open) write_knot(i, state, track->held_entries);
    track->lasted = 0;
}

/* End a track at its last knot. */
void finish(int i, int reason) {
    Disk *d = W.disks + i;
    let_go(i);
    d->mode = GONE;
    d->reason = reason;
    d->due = INFINITY;
    d->changes++;
    W.done++;
}

/* Write an event; states are velocity and spin, the impulses act on disk i. */
void write_event(int kind, int i, int other, int owner, double t, const double *place,
                 const double *before, const double *after, double normal, double tangent) {
    Event *e = W.events + W.event_count++;
    e->t = t;
    e->x = place[0];
    e->y = place[1];
    memcpy(e->before, before, sizeof e->before);
    memcpy(e->after, after, sizeof e->after);
    e->normal = normal;
    e->tangent = tangent;
    e->disk = i;
    e->other = other;
    e->kind = kind;
    e->surface = owner;
}

/* Write an event that changes nothing. */
void event_here(int kind, int i, int owner) {
    Disk *d = W.disks + i;
    write_event(kind, i, -1, owner, d->t, &d->x, &d->vx, &d->vx, 0, 0);
}

/* Book entries of a contact on its owner, and on one disk, or half each on two. */
void book(double *first, double *second, int owner, const double *entries) {
    double share = second ? 0.5 : 1;
    for (int n = 0; n < 3; n++) {
        W.books[3 * owner + n] += entries[n];
        first[n] += share * entries[n];
        if (second) second[n] += share * entries[n];
    }
}

/* Book a loss, or a gain below zero, as a part of what has been lost so far, at each surface in
   proportion. A gain beyond that waits in the last row until there is something to take it from. */
void spread(double loss, int k) {
    double *last = W.books + 3 * W.owner_count + k, lost = 0;
    loss += MIN(*last, 0);
    *last = MAX(*last, 0);
    if (loss == 0) return;
    for (int n = 0; n <= W.owner_count; n++) lost += MAX(W.books[3 * n + k], 0);
    double share = lost > 0 ? MAX(loss / lost, -1) : 0;
    for (int n = 0; n <= W.owner_count; n++) W.books[3 * n + k] += share * MAX(W.books[3 * n + k], 0);
    *last += loss - share * lost;
}

/* Book what contacts of a crowd gave back, their losses below zero, as a part of what has been lost, at
   whatever surface: what parts an overlap was lost when that came to be, and a hop's height when the
   one before ended. */
void give_back(const Contact *list, int count) {
    for (int k = 1; k < 3 && W.interact; k++) {
        double back = 0;
        for (int n = 0; n < count; n++) {
            double gain = MIN(list[n].entries[k], 0);
            W.books[3 * list[n].owner + k] -= gain;
            back += gain;
        }
        spread(back, k);
    }
}
