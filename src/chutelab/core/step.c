/* A step: it begins with lasting contacts and their solve, goes through the events in it, and ends. */

#include <string.h>
#include "core.h"

/* Greatest factor by which impulses are scaled up after two steps that were cut short, as their errors are scaled, too. */
#define MOST_AGAIN 2.0
/* Greatest number of tries to find the time at which an impact cuts a step with halved contacts. */
#define CUTS 5
/* Losses of a crowd must not fall for long: then it lives on overlaps, as each fall makes one, and its removal lifts what
   falls next. If they are below their maxima by more than what lifts all particles by OWED radii, overlaps are
   made and removed by a share of WARY. */
#define OWED 0.01
#define WARY 0.25

/* Set which surfaces exist at t. All sleepers wake when one appears or vanishes. Return the time of the next change, s. */
double set_gates(double t) {
    W.looked = t;
    if (!W.gate_count && !W.mover_count && W.step_count > 0) return INFINITY;
    int stirred = stir(t) && W.step_count > 0, changed = 0;
    for (int i = W.low; i < W.high && stirred; i++)
        if (W.disks[i].mode == ASLEEP) wake(i, W.t);
    for (int k = 0; k < W.surface_count; k++) {
        Surface *s = W.surfaces + k;
        int there = t < s->opens || t > s->closes ? ABSENT : t < s->closes ? THERE : LEAVING;
        if (there != s->there && W.step_count > 0)
            for (int i = W.low; i < W.high; i++)
                if (W.disks[i].mode == ASLEEP) wake(i, W.t);
        changed |= (there == ABSENT) != (s->there == ABSENT);
        s->there = there;
        /* Pieces of a chain share a column of `spared`. */
        int is_first = s->gate >= 0 && (k == 0 || s->gate != s[-1].gate);
        s->ignored = 0;
        for (int i = W.low; i < W.high && is_first; i++) {
            if (!is_live(W.disks + i)) continue;
            if (*spared_by(s, W.disks + i) == CLEARS) *spared_by(s, W.disks + i) = 0;
            spare(W.disks + i, s, t);
            s->ignored |= !s->one_sided && *spared_by(s, W.disks + i) != 0;
        }
    }
    if (changed) find_crowns();
    return W.gate_count || W.mover_count ? next_gate(t) : INFINITY;
}

/* Wake a sleeper that rides a belt where the belt ends, and one that a moving surface reaches. One with corners wakes before it
   reaches anything: a slow blow is left to a contact, which sleepers have not. */
static void look_ahead(int i) {
    Disk *d = W.disks + i;
    const int *list;
    double nx, ny;
    int arrives = has_corners(d) && (d->ux != 0 || d->uy != 0), count = W.stirs || arrives ? surfaces_near(i, &list) : 0;
    for (int n = 0; n < count; n++) {
        if (!is_near(W.surfaces + list[n], d)) continue;
        if (!stirs(W.surfaces + list[n]) && !(arrives && !is_held(d, list[n]))) continue;
        if (gap_to(surface_at(list[n], W.t), d->x, d->y, d->radius, &nx, &ny) > TOUCH * d->radius) continue;
        wake(i, W.t);
        return;
    }
    if (d->ux == 0 && d->uy == 0) return;
    for (int n = 0; n < d->held_count; n++) {
        const Surface *s = surface_at(d->held[n], W.t);
        if (gap_to(s, d->x + d->ux * W.step, d->y + d->uy * W.step, d->radius, &nx, &ny)
                > 0.1 * TOUCH * d->radius
            || bending(s, d->x + d->ux * W.step, d->y + d->uy * W.step, d->radius) != 0) {
            wake(i, W.t);
            return;
        }
    }
}

/* Record the energy and the ledger entries of all disks at the beginning of a step, and set how overlaps are treated from
   then on. */
void note_totals(void) {
    Total all = {.t = W.t, .unsolved = W.unsolved, .released = W.released};
    all.kinetic = W.ended[0];
    all.potential = W.ended[1];
    memcpy(all.entries, W.ended + 2, sizeof all.entries);
    for (EACH_LIVE(i)) {
        const Disk *d = W.disks + i;
        if (d->mode == GONE) continue;
        const Track *track = W.tracks + i;
        const double *place = &d->x, *v = &d->vx, none[3] = {0}, *ahead = none;
        double state[4], spin = d->spin;
        if (d->mode == FREE && track->lasted) {
            place = track->held + 1;
            v = place + 2;
            spin = place[4];
            ahead = d->ahead;
        } else if (d->mode == ASLEEP) {
            v = &d->ux;
        } else if (d->mode == RIDING) {
            /* The work of the belt since the last knot, see `ride_knot`. */
            ride_at(d, W.t, state);
            place = state;
            v = place + 2;
            all.entries[0] -= d->mass * (W.gx * (place[0] - track->knot[1]) + W.gy * (place[1] - track->knot[2]));
        }
        all.kinetic += kinetic_of(d, v, spin);
        all.potential += lifted(d, place);
        for (int n = 0; n < 3; n++) all.entries[n] += d->entries[n] - ahead[n];
    }
    /* What is released at this instant does not count yet, unless its totals were noted before. */
    if (W.latest[0] == W.t && !(W.total_count && W.totals[W.total_count - 1].t == W.t)) {
        all.kinetic -= W.latest[1];
        all.potential -= W.latest[2];
        all.released -= W.latest[1] + W.latest[2];
    }
    add_springs(all.springs);
    double owed = 0;
    for (int n = 0; n < 2; n++) {
        W.taken[n] = MAX(W.taken[n], all.entries[1 + n]);
        owed += W.taken[n] - all.entries[1 + n];
    }
    W.regained = MAX(W.regained, owed);
    double explained = all.released + all.entries[0] - all.entries[1] - all.entries[2];
    W.risen = MAX(W.risen, all.kinetic + all.potential - explained);
    W.eager = W.g > 0 && owed > OWED * W.borne ? WARY : 1;
    W.totals[W.total_count++] = all;
}

/* Begin a step: paths of riders and sleepers, pairs that may meet, lasting contacts and their solve. If an array is too
   small, return a `Full` status before anything has changed; the step can then be begun again. */
int begin_step(void) {
    int woke;
    if (W.contact_room < TOUCHES * (W.high - W.low)) return FULL_CONTACTS;
    if (W.total_count >= W.total_room) return FULL_TOTALS;
    if (W.hinges && W.swing_count + 4 * W.mover_count > W.swing_room) return FULL_SWINGS;
    double next = set_gates(W.t), stride = 0, h = choose_step();
    /* Steps end where a surface appears or vanishes, and at the end of the run. To avoid a very short last one, two equal
       steps share what is left. At the very end a step is solved for lasting contacts, but not carried out. */
    double stop = W.t < W.end_time ? MIN(next, W.end_time) : W.t + h;
    if (stop - W.t < (1 + 1e-9) * h) h = stop - W.t;
    else if (stop - W.t < 2 * h) h = 0.5 * (stop - W.t);
    W.step_end = stop - W.t <= h ? stop : W.t + h;
    if (!W.interact && W.disks[W.low].mode == FREE && !W.disks[W.low].supports && W.air == 0)
        stride = MIN(free_span(W.disks + W.low, h), stop - W.t);
    if (stride > h) W.step_end = W.t + stride < stop ? W.t + stride : stop;
    W.now = W.t;
    h = W.step_end - W.t;
    box_movers(W.t, h);
    if (W.hinges) bound_hinges(W.t, h);
    /* Impulses act for half of the step before and half of this one. */
    double span = W.length_before + W.length;
    W.length_before = W.length;
    if (W.joint_count) {
        /* Strings that pull and go slack may end the step earlier. */
        tie_joints();
        h = W.step_end - W.t;
    }
    rouse();
    do {
        W.again = span > 0 ? MIN((W.length + h) / span, MOST_AGAIN) : 1;
        for (EACH_LIVE(i))
            if (W.disks[i].mode == ASLEEP) look_ahead(i);
        for (EACH_LIVE(i)) {
            Disk *d = W.disks + i;
            d->halved = 0;
            if (d->mode == RIDING) ride_on(d, W.t, W.step_end);
            if (d->mode == ASLEEP) {
                d->vx = d->ux - 0.5 * W.gx * h;
                d->vy = d->uy - 0.5 * W.gy * h;
                d->spin = 0;
            }
            if (d->mode == FREE) {
                if (W.air > 0) begin_in_air(i, W.t + 0.5 * h);
                d->ux = d->vx;
                d->uy = d->vy;
                d->uspin = d->spin;
                if (d->tie >= 0) memcpy(d->tugged, &d->vx, sizeof d->tugged);
            }
        }
        if (W.joint_count) pull_joints(h);
        int near = list_near(W.step_end), room = near && find_contacts(h, &woke);
        if (!room || woke) drop_tugs();
        if (!room) {
            /* Repeat this part only: before it, the length of the last step and bounds on hinges have been replaced. */
            if (!make_room(near ? FULL_CONTACTS : FULL_NEAR)) return LACKING;
            woke = 1;
            continue;
        }
        if (stride > W.step && W.contact_count) {
            /* It is not in flight: its contacts are solved for a step of the usual length. */
            stride = 0;
            W.step_end = MIN(W.t + W.step, W.step_end);
            h = W.step_end - W.t;
            woke = 1;
        }
        double most = bent_step(h);
        /* A joint with a short arm that spins fast: Newton's method finds its pull in shorter steps. */
        if (W.joint_count && missed_by_joints() > 0) most = MIN(most, MAX(0.5 * h, SHORTEST * W.usual));
        if (h > (1 + 1e-9) * most) {
            set_step(most);
            W.step_end = W.t + most;
            h = W.step_end - W.t;
            if (missed_by_joints() > 0) forget_tugs();
            else if (!woke) drop_tugs();
            woke = 1;
        }
    } while (woke);
    W.length = h;
    if (W.interact) rate_overlaps();
    for (int i = W.low; W.hastened > 0 && i < W.high; i++) kick(W.disks + i, 0.5 * h);
    if (W.hinges) begin_hinges(W.t, h);
    W.swings_too = W.step_jams = 0;
    W.unsolved = 0;
    if (W.contact_count) solve_contacts(0);
    if (W.joint_count) {
        agree_with_contacts(h);
        mark_halved();
        W.unsolved = MAX(W.unsolved, missed_by_joints());
    }
    W.unsolved_most = MAX(W.unsolved_most, W.unsolved);
    /* A fast belt may have thrown a disk further than its list of neighbours allowed for. */
    for (EACH_LIVE(i))
        W.disks[i].far = W.disks[i].mode == FREE && enter_again(i, W.step_end);
    if (W.joint_count) tug_all(-1);
    close_step(h);
    if (W.hinges) {
        leave_hinges(W.t);
        W.step_end = meet_stops(W.t, W.step_end);
        bound_hinges(W.t, W.step_end - W.t);
    }
    /* A particle with corners is released in a step of length 0: note the totals of an instant once. */
    int again = W.outline_count && W.total_count && W.totals[W.total_count - 1].t == W.t;
    if (W.interact && !again) note_totals();
    return DONE;
}

/* Foresee the events of all particles with joints anew, after the end of the step, up to which the joints pull, has
   changed. */
static void foresee_tied(void) {
    for (int i = W.low; i < W.high; i++)
        if (is_tied(i) && W.disks[i].mode == FREE) foresee(i);
}

/* Time of the first event of all particles with joints, s. */
static double first_of_tied(void) {
    double first = INFINITY;
    for (int i = W.low; i < W.high; i++)
        if (is_tied(i) && W.disks[i].mode == FREE) first = MIN(first, W.disks[i].due);
    return first;
}

/* An impact of a particle with joints ends the step: the pull of the joints is solved anew for the shorter step, and the
   impact is resolved at the beginning of the next one, before all else. So are impacts of others just after that: they
   may pass on to such particles at once, and the first halves of impulses can only be taken back before. Return the disk
   if it had too many impacts, else -1. */
static int meet_tied(int i, int j, double t) {
    double soon = SOON * W.step;
    if (t > W.t + soon && t > W.step_end - soon) expect(i, INFINITY, ALARM);
    else if (t > W.t + soon) {
        double end = W.step_end, next = t;
        for (int n = 0; n < CUTS && next < end; n++) {
            cut_step(t = next);
            if (!has_halves()) break;
            /* In a shorter step the pull is less, and they may meet later. */
            W.step_end = end;
            foresee_tied();
            next = first_of_tied();
            W.step_end = t;
            if (next <= t + soon) break;
        }
        foresee_tied();
    } else {
        int anew = has_halves();
        if (anew) {
            take_halves_back();
            W.step_end = W.t + soon;
        } else drop_tugs();
        shock(i, j, W.t);
        if (W.disks[i].impacts > STALL) return i;
        cut_step(W.step_end);
        if (!anew) cut_at_snaps();
        foresee_tied();
    }
    return -1;
}

/* Resolve the events within the step in the order of time. */
int go_through(void) {
    int i, count = W.high - W.low;
    for (;;) {
        if (W.joint_count && is_cut()) foresee_tied();
        if ((i = next_disk()) < 0) return DONE;
        Disk *d = W.disks + i;
        double t = d->due;
        int j = d->partner;
        /* The step was cut short. What has joints or corners is released in a step of length 0, and with it all that is
           released then: totals are noted before and after. */
        int in_step = d->mode == WAITING && (is_tied(i) || has_corners(d) || W.step_end <= W.t);
        if (t > W.step_end || (t == W.step_end && !in_step)) return DONE;
        if (W.knot_count + KNOTS_EACH * count + ride_knots(d) > W.knot_room) return FULL_KNOTS;
        if (W.event_count + SHOCKS * W.contact_count + 64 > W.event_room)
            return FULL_EVENTS;
        if (j >= 0 && W.disks[j].changes != d->partner_changes) {
            W.now = MAX(W.now, MIN(t, W.step_end));
            foresee(i);
            continue;
        }
        W.now = t;
        if (j != ALARM && (is_tied(i) || is_tied(j) || (W.joint_count && t <= W.t + SOON * W.step))) {
            if ((W.stalled = meet_tied(i, j, t)) < 0) continue;
            return STALLED;
        }
        if (j != ALARM) {
            if (W.interact && d->impacts > CROWDED && !jams_pay() && t > W.t + SHORTEST * W.step) {
                W.step_end = t;
                continue;
            }
            shock(i, j, t);
            if (d->impacts <= STALL) continue;
            W.stalled = i;
            return STALLED;
        }
        if (d->mode == WAITING) {
            if (release(i, t)) enter_again(i, W.step_end);
        } else separate(i);
        if (is_tied(i) && d->mode == FREE) cut_step(t);
        foresee(i);
    }
}

void end_step(void) {
    for (EACH_LIVE(i)) {
        Disk *d = W.disks + i;
        if (!is_live(d)) continue;
        /* A particle with joints can leave only at the end of the step, as the pull of its joints lasts until then. */
        if (d->mode != RIDING && !is_tied(i)) leave(i, W.step_end);
        if (d->mode == FREE) {
            advance(d, W.step_end);
            for (int n = 0; n < 2; n++) d->owed[n] += (W.step_end - W.t) * d->force[n];
            if (d->tie < 0) slow_down(i, W.step_end);
        }
        else if (d->mode == ASLEEP) {
            d->x += d->ux * (W.step_end - W.t);
            d->y += d->uy * (W.step_end - W.t);
            d->vx = d->ux;
            d->vy = d->uy;
            d->t = d->aired = W.step_end;
        }
    }
    if (W.joint_count) {
        end_pull();
        press_again(W.step_end - W.t);
    }
    for (int i = W.low; i < W.high && W.joint_count; i++)
        if (is_tied(i) && W.disks[i].mode == FREE) {
            slow_down(i, W.step_end);
            leave(i, W.step_end);
        }
    if (W.hinges) end_hinges(W.step_end);
    W.length = W.step_end - W.t;
    W.t = W.step_end;
    W.step_count++;
    Contact *c = W.contacts;
    W.contacts = W.earlier;
    W.earlier = c;
    W.earlier_count = W.contact_count;
    if (MAX(W.stamp, W.shocks) > 1000000000) {
        W.stamp = W.shocks = W.jams = 0;
        for (int i = 0; i < W.disk_count; i++)
            W.disks[i].mark = W.disks[i].moved = W.disks[i].jam = 0;
    }
}
