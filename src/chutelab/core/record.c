/* What a run records: knots, events, entries of the ledger. */

#include <string.h>
#include "core.h"

/* A track is recorded as states: before and after each impact, and one a step in lasting contact. A state becomes a knot
   only where it has to, see `is_followed`: the states since the last knot wait until the cubic from that knot to the
   newest state no longer agrees with all of them. */

/* Share of the radius by which the impulses of one step change the way of a step, from which on they count as a blow: far
   beyond a hop, and what the removal of an overlap moves. */
#define JOLT 0.05

static Knot *waiting(int i) { return W.waits + WAITS * (long)(W.interact ? i : 0); }

static void emit(const Knot *state) {
    W.knots[W.knot_count++] = *state;
}

/* The angle at the share s of the time from the last knot to a state: a constant angular acceleration, with the
   difference to the true angle spread evenly over time. */
static double turned_by(const Track *track, const Knot *to, double s) {
    double h = to->t - track->from[0], spin = track->from[5], even = to->angle - track->angles[0] - 0.5 * h * (spin + to->spin);
    return track->angles[0] + s * (h * (spin + 0.5 * s * (to->spin - spin)) + even);
}

/* Whether the cubic from the last knot to a state agrees with all states that wait, within the tolerance of a track in
   place, velocity and entries. In a crowd the tolerance is a hop: a disk in lasting contact hops from step to step, g h^2
   / 8 high, and its track leaves the hops out, and with them impacts and bends that change its velocity by less than g h. */
static int is_followed(const Track *track, const Knot *wait, const Knot *to, const Disk *d) {
    const double *from = track->from;
    double h = to->t - from[0], fall = W.hops * W.g * W.usual;
    double close = MAX(W.smooth_x * d->radius, 0.125 * fall * W.usual), slow = MAX(W.smooth_v, fall);
    double little = d->mass * slow * (sqrt(square(from[3]) + square(from[4])) + slow);
    Two place = two(from + 1), way = minus(two(&to->x), place);
    Two first = times(h, two(from + 3)), last = times(h, two(&to->vx));
    Two bend = minus(minus(times(3, way), times(2, first)), last), turn = minus(plus(first, last), times(2, way));
    Two entries = two(from + 7), more = minus(two(to->entries + 1), entries);
    for (const Knot *k = wait + track->waits - 1; k >= wait; k--) {
        /* A velocity that is off by w at both ends of a time T moves the curve by w T / 4 in the middle: that is at most
           the tolerance of the place. */
        double then = k < wait + track->waits - 1 ? k[1].t : to->t, before = k > wait ? k[-1].t : from[0];
        double s = (k->t - from[0]) / h, most = MIN(slow, 4 * close / MAX(then - k->t, k->t - before));
        Two off = minus(plus(place, times(s, plus(first, times(s, plus(bend, times(s, turn)))))), two(&k->x));
        if (!are_within(off, close)) return 0;
        off = plus(first, times(s, plus(times(2, bend), times(3 * s, turn))));
        if (!are_within(minus(off, times(h, two(&k->vx))), h * most)) return 0;
        if (fabs(from[5] + s * (to->spin - from[5]) - k->spin) * d->radius > slow) return 0;
        if (has_corners(d) && fabs(turned_by(track, to, s) - k->angle) * d->radius > close) return 0;
        if (!W.interact) continue;
        if (fabs(from[6] + s * (to->entries[0] - from[6]) - k->entries[0]) > little) return 0;
        if (!are_within(minus(plus(entries, times(s, more)), two(k->entries + 1)), little)) return 0;
    }
    return 1;
}

/* Write the latest waiting state as a knot. If it follows an impact, write the state before the impact, too, unless in a
   crowd the track may leave the impact out. */
static void write_waiting(int i) {
    Track *track = W.tracks + i;
    const Knot *wait = waiting(i), *last = wait + track->waits - 1;
    if (!track->waits) return;
    if (track->waits > 1 && last[-1].t == last->t) {
        track->waits--;
        if (!W.interact || !is_followed(track, wait, last, W.disks + i)) emit(last - 1);
    }
    emit(last);
    memcpy(track->from, last, sizeof track->from);
    track->angles[0] = last->angle;
    track->waits = track->noted = track->mask = 0;
}

/* Drop every second waiting state except the last two. */
static void thin_out(Track *track, Knot *wait) {
    int left = 0;
    for (int n = 1; n < track->waits; n++)
        if (n % 2 || n >= track->waits - 2) wait[left++] = wait[n];
    track->waits = left;
    track->mask = 2 * track->mask + 1;
}

/* Add a state to those that wait. Those before the last two are evenly spread from the last knot on: every state, or every
   second, fourth and so on. Since times between them grow, `is_followed` allows smaller errors of velocity. */
static void add_waiting(Track *track, Knot *wait, const Knot *now) {
    if (track->waits > 1 && ((track->noted - 1) & track->mask)) {
        wait[track->waits - 2] = wait[track->waits - 1];
        track->waits--;
    }
    if (track->waits == WAITS) thin_out(track, wait);
    wait[track->waits++] = *now;
    track->noted++;
}

/* Note a state of a disk: t, x, y, vx, vy, spin. Of several states at the same instant the first and the last are kept. */
static void note(int i, const double *state, double angle, const double *entries) {
    Track *track = W.tracks + i;
    Knot *wait = waiting(i), now = {.disk = i, .angle = angle};
    memcpy(&now.t, state, 6 * sizeof(double));
    memcpy(now.entries, entries, sizeof now.entries);
    memcpy(track->knot, state, sizeof track->knot);
    if (!track->begun) {
        emit(&now);
        memcpy(track->from, &now, sizeof track->from);
        track->angles[0] = angle;
        track->begun = 1;
        return;
    }
    int count = track->waits, again = count > 1 ? wait[count - 2].t == now.t : track->from[0] == now.t;
    if (count && again && wait[count - 1].t == now.t) {
        track->waits--;
        track->noted--;
    } else if (count && wait[count - 1].t < now.t && !is_followed(track, wait, &now, W.disks + i)) write_waiting(i);
    add_waiting(track, wait, &now);
}

/* Write the present state of a disk as a knot. */
void knot_now(int i) {
    Disk *d = W.disks + i;
    double state[6] = {d->t, d->x, d->y, d->vx, d->vy, d->spin};
    note(i, state, d->turned, d->entries);
    write_waiting(i);
}

/* The same for a disk that ends in lasting contact: it replaces the state noted last, as entries have changed since. */
void knot_held(int i) {
    W.tracks[i].waits--;
    knot_now(i);
}

/* Note the state at the end of a path, unless it was noted last already. */
void knot_before(int i, double t, double vx, double vy, double spin) {
    Disk *d = W.disks + i;
    double state[6] = {t, d->x, d->y, vx, vy, spin};
    flush_track(i);
    if (memcmp(state, W.tracks[i].knot, sizeof state)) note(i, state, d->turned, d->entries);
}

/* Note the state after an impact; for a disk by itself it becomes a knot at once. */
void knot_after(int i) {
    const Disk *d = W.disks + i;
    double state[6] = {d->t, d->x, d->y, d->vx, d->vy, d->spin};
    note(i, state, d->turned, d->entries);
    if (!W.interact) write_waiting(i);
}

/* End the smooth part of a track: the state halfway through the last impulses has been noted, now that after them is. */
void flush_track(int i) {
    Track *track = W.tracks + i;
    if (!track->lasted) return;
    double state[6];
    memcpy(state, track->held, sizeof state);
    memcpy(state + 3, track->after, sizeof track->after);
    note(i, state, track->angles[1], track->after_entries);
    track->lasted = 0;
}

/* Whether a disk by itself approached a surface, as its contact began, faster than a hop does: a blow that impacts have left
   to the solve, as where it rattled in a wedge. */
static int is_struck(const Disk *d) {
    double u[3];
    for (int link = d->links; link >= 0; link = W.links[link]) {
        const Contact *c = W.contacts + link / 2;
        relative(c, 1, u);
        if (c->impulse[0] > 0 && -u[0] > W.soft) return 1;
    }
    return 0;
}

/* Note the state of a disk in lasting contact, after the impulses of a step.

   In contact a disk hops from step to step. Its smooth track goes through the states partway through the impulses of each
   step, halfway if steps are equal. There its velocity has no part of the hop, and its entries lack the work of the rest
   of the impulses. If they change the velocity as a blow does (where a wedge opens, say), half of that would bend the
   track of the step before, so the states before and after are noted, as of an impact. */
void track_lasting(int i) {
    Disk *d = W.disks + i;
    Track *track = W.tracks + i;
    double f = share_before(d), way = 0.5 * (W.length_before + W.length);
    double state[6] = {d->t, d->x, d->y, d->ux + f * (d->vx - d->ux), d->uy + f * (d->vy - d->uy),
                       d->uspin + f * (d->spin - d->uspin)};
    double entries[3];
    if (d->lacks > 0) {
        /* Inside an arc the velocity turns, so its mean is too small: see `lacks` of contact.c. */
        double square_speed = square(state[3]) + square(state[4]);
        double longer = sqrt(1 + 2 * d->lacks * d->inv_mass / square_speed);
        state[3] *= longer;
        state[4] *= longer;
    }
    for (int n = 0; n < 3; n++) entries[n] = d->entries[n] + d->gain[n] - d->ahead[n];
    int lasted = track->lasted, is_blow = W.interact ? !d->halved
        && square(d->vx - d->ux) + square(d->vy - d->uy) > square(JOLT * d->inner / way) : !lasted && is_struck(d);
    if (!lasted || is_blow) knot_before(i, d->t, d->ux, d->uy, d->uspin);
    if (is_blow) {
        double after[6] = {d->t, d->x, d->y, d->vx, d->vy, d->spin}, given[3];
        for (int n = 0; n < 3; n++) given[n] = d->entries[n] + d->gain[n];
        note(i, after, d->turned, given);
    } else note(i, state, d->turned, entries);
    track->lasted = is_blow ? MAX(lasted, 1) + 1 : lasted + 1;
    if (track->lasted == 1 || track->held[0] < d->t)
        memcpy(track->past, track->lasted > 1 ? track->held : state, sizeof track->past);
    memcpy(track->held, state, sizeof state);
    track->angles[1] = d->turned;
    memcpy(track->after, &d->vx, sizeof track->after);
    for (int n = 0; n < 3; n++) track->after_entries[n] = d->entries[n] + d->gain[n];
}

/* Note the state of a disk in lasting contact at the end of a step in which all impulses have been given. */
void track_ended(int i) {
    Disk *d = W.disks + i;
    Track *track = W.tracks + i;
    double state[6] = {d->t, d->x, d->y, d->vx, d->vy, d->spin};
    note(i, state, d->turned, d->entries);
    if (!track->lasted) return;
    if (track->held[0] < d->t) memcpy(track->past, track->held, sizeof track->past);
    memcpy(track->held, state, sizeof state);
    track->angles[1] = d->turned;
    memcpy(track->after, &d->vx, sizeof track->after);
    memcpy(track->after_entries, d->entries, sizeof track->after_entries);
}

/* Let a track go on in lasting contact from the knot just written: the disk was in contact before it slept. */
void last_on(int i) {
    const Disk *d = W.disks + i;
    Track *track = W.tracks + i;
    memcpy(track->held, track->knot, sizeof track->held);
    memcpy(track->past, track->held, sizeof track->past);
    memcpy(track->after, &d->vx, sizeof track->after);
    memcpy(track->after_entries, d->entries, sizeof track->after_entries);
    track->angles[1] = d->turned;
    track->lasted = 1;
}

/* Note the state of a disk in flight whose path is bent by air. */
void track_flying(int i) {
    const Disk *d = W.disks + i;
    double state[6] = {d->t, d->x, d->y, d->vx, d->vy, d->spin};
    if (memcmp(state, W.tracks[i].knot, sizeof state)) note(i, state, d->turned, d->entries);
}

/* End a track; its latest waiting state becomes the last knot. */
void finish(int i, int reason) {
    Disk *d = W.disks + i;
    if (W.tracks[i].begun) {
        W.ended[0] += kinetic_of(d, &d->vx, d->spin);
        W.ended[1] += lifted(d, &d->x);
        for (int n = 0; n < 3; n++) W.ended[2 + n] += d->entries[n];
    }
    write_waiting(i);
    d->mode = GONE;
    W.border_count = -1;
    d->reason = reason;
    d->due = INFINITY;
    d->changes++;
    W.done++;
}

/* Write an event. States are velocity and spin; the impulses act on disk i. */
void write_event(int kind, int i, int other, int owner, double t, const double *place,
                 const double *before, const double *after, double normal, double tangent) {
    Event *e = W.events + W.event_count++;
    if (W.trigger_count && owner >= 0 && kind != RELEASE && kind != SEPARATION && kind != EXIT) touch(owner, t);
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

/* Write an event at which the state does not change. */
void event_here(int kind, int i, int owner) {
    Disk *d = W.disks + i;
    write_event(kind, i, -1, owner, d->t, &d->x, &d->vx, &d->vx, 0, 0);
}

/* Add entries of a contact to those of its owner, and to those of one disk, or half of them to each of two. */
void book(double *first, double *second, int owner, const double *entries) {
    double share = second ? 0.5 : 1;
    for (int n = 0; n < 3; n++) {
        W.books[3 * owner + n] += entries[n];
        first[n] += share * entries[n];
        if (second) second[n] += share * entries[n];
    }
}

/* Distribute a loss, or a gain if it is negative, over all surfaces in proportion to what has been lost there so far. A
   gain that exceeds all losses waits in the last row of the books until there are losses to reduce. */
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

/* Correct the books for contacts of a crowd with negative losses: such a gain is taken off what has been lost so far, at
   any surface. The energy of an overlap that is removed was lost when the overlap came to be, and the energy of a hop
   when the hop before ended. */
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
