/* After the solve of a step: what lasting contacts do to the ledger, which of them stick, slip or open, which disks come
   to rest, and how tracks end in contact. */

#include <string.h>
#include "core.h"

/* Smallest number of steps that a contact in a crowd has to last for its end to be recorded as a separation. */
#define LASTS 10
/* m/s on Earth; contacts of a crowd below this speed are calm, see `settled` in the contract. STOPPED is for the same
   gravity. */
#define CALM 1e-3
/* m/s; the same for a disk by itself: less is the rounding of a speed that has become zero. */
#define STOPPED 1e-9

/* Time since the foot of a disk passed the end at which it moves onto a surface, s, negative if it has not yet; and the
   tangent of the surface there. 0 if it passes none within a step. */
static double since_passage(const Contact *c, double *way) {
    const Disk *d = W.disks + c->i;
    const Surface *s = surface_at(-1 - c->j, d->t);
    double since = 0, least = INFINITY;
    way[0] = c->ny;
    way[1] = -c->nx;
    for (int n = 0; n < 4 && s->shape != CIRCLE; n += 2) {
        double x = s->end[n], y = s->end[n + 1];
        double tx = s->shape == SEGMENT ? s->tx : (s->y - y) / s->radius;
        double ty = s->shape == SEGMENT ? s->ty : (x - s->x) / s->radius;
        double past = (d->x - x) * tx + (d->y - y) * ty, along = d->ux * tx + d->uy * ty;
        if (fabs(past) > fabs(along) * MAX(W.length_before, W.length) || fabs(past) >= least) continue;
        least = fabs(past);
        since = past / along;
        way[0] = tx;
        way[1] = ty;
    }
    return since;
}

/* Record that a disk has moved onto another surface without an impact, at the time when it did. Position and velocity
   there are extrapolated from its last two steps on the surface before, along the tangent of both. */
static void tell_passage(const Contact *c, int kind) {
    const Disk *d = W.disks + c->i;
    const Track *track = W.tracks + c->i;
    const double *last = track->held, *past = track->past;
    double way[2], t = d->t - since_passage(c, way), on = t - last[0];
    double then[5] = {d->x, d->y, d->ux, d->uy, d->uspin};
    /* If a stop of a hinge ended a step of length 0, both are the same state. */
    for (int n = 0; n < 3 && track->lasted > 1 && last[0] > past[0]; n++) {
        then[2 + n] = last[3 + n] + on / (last[0] - past[0]) * (last[3 + n] - past[3 + n]);
        if (n < 2) then[n] = last[1 + n] + 0.5 * on * (last[3 + n] + then[2 + n]);
    }
    double along = then[2] * way[0] + then[3] * way[1];
    then[2] = along * way[0];
    then[3] = along * way[1];
    write_event(kind, c->i, -1, c->owner, t, then, then + 2, then + 2, 0, 0);
}

/* Record that a disk came to lie on a surface without an impact before: the contact's impulse since then counts as that
   of an impact. If it is the only impulse on the disk, it is taken off the lasting ones. */
static void tell_arrival(const Contact *c, int kind, double past, double h) {
    const Disk *d = W.disks + c->i;
    write_event(kind, c->i, -1, c->owner, d->t, &d->x, &d->ux, &d->vx, c->impulse[0], c->impulse[1]);
    if (is_alone(c, &d->ux)) keep_impulse(c, -1, W.t - past, W.t + 0.5 * h);
}

/* Forget the loads of a disk that does not lie on a single surface in this step: nothing may be extrapolated from them
   later. */
static void forget_loads(Track *track) { memset(track->load, 0, sizeof track->load); }

/* Record whether a disk in contact with one surface slips there, sticks, or has come to rest. */
static void note_grip(Disk *d, const Contact *c, const double *u, const double *v, double h) {
    int i = c->i;
    double most = c->friction * c->impulse[0], slip = v[1] + c->drift;
    /* The impulses act for the second half of the last step, if the contact lasted, and the first half of this one. */
    double past = past_of(c), span = past + 0.5 * h;
    int grips = fabs(c->impulse[1]) < most * (1 - 1e-12) || (most == 0 && slip == 0 && c->drift == 0);
    Track *track = W.tracks + i;
    if (span > 0) {
        for (int n = 2; n > 0; n--) {
            track->load[n] = track->load[n - 1];
            track->load_t[n] = track->load_t[n - 1];
        }
        track->load[0] = c->impulse[0] / span;
        track->load_t[0] = d->t;
    }
    if (d->on < 0) {
        /* It came to lie there without an impact that was recorded. */
        tell_arrival(c, IMPACT, past, h);
        d->slips = 1;
    } else if (d->on != c->owner) {
        tell_passage(c, grips ? STICK : SLIP);
        d->slips = !grips;
    }
    d->on = c->owner;
    if (grips && d->slips) {
        /* Friction slows the slip at a constant rate; from the middle of the last step on, the slip takes this long to
           vanish. */
        double s = u[1] - c->pull * past, pull = c->pull;
        double rate = most / (c->mass[1] * span) - (s > 0 ? pull : -pull);
        double t = d->t - past + (rate > 0 ? MIN(fabs(s) / rate, span) : 0);
        t = MAX(t, d->since);
        double place[2] = {d->x + (t - d->t) * 0.5 * (d->ux + d->vx), d->y + (t - d->t) * 0.5 * (d->uy + d->vy)};
        double after[3] = {d->vx + 0.5 * W.gx * h, d->vy + 0.5 * W.gy * h, d->spin};
        write_event(STICK, i, -1, c->owner, t, place, after, after, 0, 0);
        d->since = t;
    } else if (!grips && !d->slips)
        event_here(SLIP, i, c->owner);
    d->slips = !grips;
}

/* Whether a disk by itself that grips will stay as it is: nothing pulls it along, and it has stopped if its surface is
   round or its rolling is slowed. */
static int lies(const Disk *d, const Contact *c, double h) {
    const Surface *s = surface_at(-1 - c->j, d->t);
    double speed = fabs(d->vx + 0.5 * h * W.gx) + fabs(d->vy + 0.5 * h * W.gy);
    if (W.stirs || (s->speed != 0 && c->owner != W.landing)) return 0;
    if (bending(s, d->x, d->y, d->radius) != 0 && (speed > STOPPED * W.pace || c->other[1] != 0)) return 0;
    if (c->arm > 0 && fabs(d->spin - c->other[2]) * d->radius > STOPPED * W.pace) return 0;
    /* Rolling friction may have stopped it for a moment only, or it holds the disk. */
    int held = speed <= STOPPED * W.pace && fabs(c->pull) * d->radius <= c->arm * press_on(d, s, c->nx, c->ny);
    return d->inertia == 0 || c->pull == 0 || held;
}

/* End the track of a disk that came to rest on one surface, at the time when its slip vanished: `d->since`.

   From the velocity after the impulses to that in the middle of the step there is a hop, which is left out: it counts as
   an impulse of its own. Since `d->since` the disk has moved at that velocity, and the drive has paid for the work of
   gravity. */
static void settle(int i, const Contact *last, double h) {
    Disk *d = W.disks + i;
    Contact hop = *last;
    double u[3], v[3], entries[3], given[3], jx = 0.5 * h * d->mass * W.gx, jy = 0.5 * h * d->mass * W.gy;
    hop.impulse[0] = jx * hop.nx + jy * hop.ny;
    hop.impulse[1] = jx * hop.ny - jy * hop.nx;
    hop.impulse[2] = hop.clings = 0;
    for (int n = 0; n < 3; n++) d->entries[n] += d->gain[n];
    relative(&hop, 0, u);
    d->vx += jx / d->mass;
    d->vy += jy / d->mass;
    relative(&hop, 0, v);
    share_out(&hop, u, v, 0, entries, given);
    double back = d->t - d->since;
    entries[0] += d->mass * (W.gx * hop.ny - W.gy * hop.nx) * hop.other[1] * back;
    book(d->entries, 0, hop.owner, entries);
    bear_disk(d, hop.owner, jx, jy, d->t, d->t);
    bear_disk(d, hop.owner, d->mass * W.gx * back, d->mass * W.gy * back, MIN(d->since, d->t), MAX(d->since, d->t));
    d->x -= d->vx * back;
    d->y -= d->vy * back;
    d->t = d->since;
    W.tracks[i].lasted = 0;
    knot_now(i);
    event_here(SETTLE, i, hop.owner);
    finish(i, BY_SETTLING);
}

/* Record the separation of a disk that no surface presses any more. */
static void tell_separation(int i) {
    const Disk *d = W.disks + i;
    const Track *track = W.tracks + i;
    if (track->lasted < 3 || track->load[2] == 0) {
        event_here(SEPARATION, i, track->ground);
        return;
    }
    double t = time_unloaded(track->load + 1, track->load_t + 1);
    if (t > 2 * d->t - track->load_t[0]) {
        /* The load did not fade, the face ended: the last impulse tells how long it acted. */
        double past = 0.5 * (track->load_t[0] - track->load_t[1]);
        double span = past + 0.5 * (d->t - track->load_t[0]);
        t = track->load_t[0] - past + track->load[0] / track->load[1] * span;
    }
    t = MIN(MAX(t, track->load_t[1]), d->t);
    /* It has been in flight since then. */
    Disk then = *d;
    advance(&then, t);
    write_event(SEPARATION, i, -1, track->ground, t, &then.x, &then.vx, &then.vx, 0, 0);
}

/* Restart the rest of a disk if something moves at its contacts, or it has none, and if it is also further from where its
   rest began than the greatest speed that counts as rest would take it. */
static void settle_down(Disk *d, double h) {
    double most = REST * sqrt(W.g * d->radius) * d->waits;
    double x = d->x - d->anchor[0], y = d->y - d->anchor[1], turn = d->anchor[2];
    int stays = x * x + y * y <= most * most && fabs(turn) <= most, moves = d->stirred || !d->supports;
    d->stirred = 0;
    if (d->rest > h && (!moves || stays)) return;
    if (d->rest > h) {
        d->rest = 0;
        d->waits = CALM_DOWN / W.pace;
    }
    d->anchor[0] = d->x;
    d->anchor[1] = d->y;
    d->anchor[2] = 0;
}

/* Set the approach at which disks in contact with a rider or a moving surface, directly or through others, may stay
   unresolved. The solver moves neither of these, so between two of them, or one and a wall, there may be no room, and
   impacts would go on without end. Impacts may leave open as much as the solve of all of these contacts does: see
   `left_over`. */
void give_in(const Contact *list, int count) {
    double open = 0, u[3], v[3];
    int led = 0;
    for (int n = 0; n < count; n++)
        led |= list[n].j >= 0 ? W.disks[list[n].j].mode == RIDING : stirs(W.surfaces + (-1 - list[n].j));
    for (int n = 0; n < count && led; n++) {
        relative(list + n, 1, u);
        relative(list + n, 0, v);
        open = MAX(open, u[0] + asks(list + n, list[n].impulse[0]) - v[0]);
    }
    for (int n = 0; n < count && led; n++) {
        W.disks[list[n].i].open = open;
        if (list[n].j >= 0) W.disks[list[n].j].open = open;
    }
}

/* Book the ledger entries of a lasting contact, whose impulses act for half of a step of length h and for a time `past`
   of the step before. */
static void book_lasting(const Contact *c, double past, double h) {
    Disk *a = W.disks + c->i, *b = c->two ? W.disks + c->j : 0;
    double given[3] = {c->given[0], 0, 0};
    bear_contact(c, 1, W.t - past, W.t + 0.5 * h);
    keep_impulse(c, 1, W.t - past, W.t + 0.5 * h);
    book(a->gain, b ? b->gain : 0, c->owner, c->entries);
    if (c->j < 0) W.drives[c->owner] += driven(c, 0);
    if (given[0] != 0) book(a->gain, 0, giver_of(c), given);
    a->ahead[0] += c->given[1];
    for (int k = 0; k < 3; k++) {
        a->ahead[k] += (c->two ? 0.5 : 1) * c->later[k];
        if (c->two) b->ahead[k] += 0.5 * c->later[k];
    }
}

/* After the solve: ledger entries, supports, timers, tracks. */
void close_step(double h) {
    /* The share of the impulses that belongs to the step before; 0 for a new contact. */
    W.before = h > 0 ? W.length_before / (W.length_before + h) : 0;
    if (!W.interact && !W.tracks[W.low].lasted) W.before = 0;
    for (EACH_LIVE(i)) {
        Disk *d = W.disks + i;
        d->links = d->before = -1;
        /* A disk by itself that leaves a surface may come back to it within this step, by the error of a step. That is no
           impact, although infinite friction would make it one, however soft. */
        if (d->mode == FREE && (W.interact || !d->supports)) d->held_count = 0;
        /* A sleeper stays supported. */
        d->supports = d->mode == ASLEEP;
        if (W.length_before > 0.01 * W.step) d->impacts = 0;
        for (int n = 0; n < 3; n++) d->gain[n] = d->ahead[n] = 0;
        d->lacks = d->open = d->bends = d->whirl = 0;
        if (d->mode == FREE) {
            d->calm += h;
            /* A particle with joints does not fall asleep. */
            d->rest += is_tied(i) ? 0 : h;
            d->anchor[2] += h * d->radius * d->spin;
        }
        if (W.hastened > 0 && (d->kick[0] != 0 || d->kick[1] != 0)) {
            d->calm = d->rest = 0;
            d->ahead[0] = pushed(d, share_before(d));
            book_push(d->gain, pushed(d, 0));
        }
    }
    for (int from = 0, to = 0; from < W.contact_count; from = to) {
        while (to < W.contact_count && (!W.interact || W.contacts[to].island == W.contacts[from].island)) to++;
        account(W.contacts + from, to - from);
        give_in(W.contacts + from, to - from);
        leave_first_halves(W.contacts + from, to - from);
    }
    for (int n = 0; n < W.contact_count; n++) {
        Contact *c = W.contacts + n;
        Disk *a = W.disks + c->i, *b = c->j >= 0 ? W.disks + c->j : 0;
        double u[3], v[3], way[2];
        c->next = a->before;
        a->before = n;
        W.links[2 * n] = a->links;
        a->links = 2 * n;
        if (b) {
            W.links[2 * n + 1] = b->links;
            b->links = 2 * n + 1;
        }
        if (c->impulse[0] == 0 && c->clings == 0) continue;
        if (!W.interact && !a->supports) a->held_count = 0;
        double past = past_of(c);
        if (!b && a->held_count < MAX_HELD) a->held[a->held_count++] = -1 - c->j;
        double bends = !b && c->cornered ? bends_by(c) : 0;
        a->bends = MAX(a->bends, bends);
        relative(c, 1, u);
        /* Without weight contacts do not hop, see touching.c. */
        if (b && c->cornered && W.g > 0 && h > SHORTEST * W.step) {
            double fast = closing_rate(c, u[0], h);
            a->whirl = MAX(a->whirl, fast);
            b->whirl = MAX(b->whirl, fast);
        }
        relative(c, 0, v);
        if (!c->halved) book_lasting(c, past, h);
        a->supports++;
        if (b) b->supports++;
        else if (c->owner == W.landing && !a->landed && (a->on < 0 || since_passage(c, way) >= 0)) {
            if (a->on >= 0) tell_passage(c, LANDING);
            else tell_arrival(c, LANDING, past, h);
            a->landed = 1;
            a->on = c->owner;
            a->slips = 1;
        }
        /* In the mean of both velocities there is no hop. */
        double off = fabs(0.5 * (u[0] + v[0])), slip = fabs(v[1] + c->drift);
        double turn = fabs(v[2]) * a->radius, rest = REST * sqrt(W.g * a->radius);
        const Surface *s = W.surfaces + (b ? 0 : -1 - c->j);
        int belt = !b && s->speed != 0 && c->owner != W.landing;
        if (off > CALM * W.pace || slip > CALM * W.pace || belt || (!b && stirs(s)) || (b && b->mode == RIDING)) {
            a->calm = 0;
            if (b) b->calm = 0;
        }
        if (off > rest || slip > rest || turn > rest || (b && b->mode == RIDING)) {
            a->stirred = 1;
            if (b && b->mode == FREE) b->stirred = 1;
            /* A driven disk is not at rest, even if it stays where it is. */
            if (b ? b->mode == RIDING : c->other[1] != 0 || stirs(s)) a->rest = 0;
        }
    }
    give_back(W.contacts, W.contact_count);
    note_frozen();
    for (EACH_LIVE(i)) {
        Disk *d = W.disks + i;
        Track *track = W.tracks + i;
        /* If the step before was cut short, what rests is still on the hop that that step was solved for. */
        int hops = d->hops && d->links >= 0 && W.step_end <= W.hopped + SOON * W.step;
        d->ends = -1;
        d->lies = d->supports > 0;
        d->hops = d->lies || hops;
        d->whirl = d->lies ? MAX(d->whirl, whirl_of(d)) : 0;
        if (d->mode != FREE) {
            forget_loads(track);
            continue;
        }
        settle_down(d, h);
        if (!d->supports) {
            if (!hops) {
                if (!is_tied(i) || square(d->vx) + square(d->vy) > square(CALM * W.pace)) d->calm = 0;
                if (track->stays >= (W.interact ? LASTS : 3)) tell_separation(i);
                if (track->lasted || track->stays) d->on = -1;
                track->stays = 0;
                forget_loads(track);
            }
            flush_track(i);
            if (d->kick[0] != 0 || d->kick[1] != 0) {
                knot_before(i, d->t, d->ux, d->uy, d->uspin);
                d->entries[0] += d->gain[0];
                knot_after(i);
            }
            continue;
        }
        const Contact *only = 0;
        int reason = -1;
        int owners = 0;
        for (int link = d->links; link >= 0; link = W.links[link]) {
            const Contact *c = W.contacts + link / 2;
            /* It also lies on what its hop reaches: that is no impact. */
            if (!W.interact && c->impulse[0] == 0 && c->gap <= 0.125 * (W.g + W.haste) * h * h
                    && d->held_count < MAX_HELD) d->held[d->held_count++] = -1 - c->j;
            if (c->impulse[0] == 0 && c->clings == 0) continue;
            if (!only || c->owner != only->owner || c->j >= 0) owners++;
            if (!only || c->impulse[0] > only->impulse[0]) only = c;
        }
        if (owners == 1 && only->j < 0) {
            double u[3], v[3];
            relative(only, 1, u);
            relative(only, 0, v);
            note_grip(d, only, u, v, h);
            if (!W.interact && W.until == UNTIL_SETTLED && !d->slips && d->since <= d->t + h
                    && lies(d, only, h)) {
                /* A disk that rolled stops now, not when its slip ended. */
                if (only->arm > 0 && d->inertia > 0) d->since = MAX(d->since, d->t);
                settle(i, only, h);
            }
        } else {
            /* It lies on several; it may still separate from the surface among them, if there is one. */
            int ground = -1;
            for (int link = d->links; link >= 0; link = W.links[link]) {
                const Contact *c = W.contacts + link / 2;
                if (c->impulse[0] > 0 && c->j < 0) ground = c->owner;
            }
            if (ground < 0 && track->stays >= LASTS) event_here(SEPARATION, i, track->ground);
            if (track->ground != ground) track->stays = 0;
            forget_loads(track);
            d->slips = 1;
            d->on = ground;
        }
        track->ground = d->on;
        if (d->on >= 0) track->stays++;
        d->changes++;
        if (d->mode == GONE) continue;
        track_lasting(i);
        for (int n = 0; n < 3; n++) d->entries[n] += d->gain[n];
        /* Held in a corner by surfaces at rest. */
        if (owners > 1 && !W.interact && W.until == UNTIL_SETTLED && track->lasted > 3 && !W.stirs) {
            const double *s = track->held + 3, *p = track->past + 3;
            double most = MAX(fabs(s[0]) + fabs(s[1]), fabs(p[0]) + fabs(p[1]));
            for (int link = d->links; link >= 0; link = W.links[link])
                if (W.contacts[link / 2].impulse[0] > 0)
                    most = MAX(most, fabs(W.surfaces[-1 - W.contacts[link / 2].j].speed));
            if (most + fabs(s[2]) * d->radius < STOPPED * W.pace) reason = BY_SETTLING;
        }
        if (W.until == UNTIL_LANDED && d->landed) reason = BY_LANDING;
        d->ends = reason;
    }
    W.hopped = MAX(W.hopped, W.step_end);
    /* First take back what all of these are ahead, then change their states: impulses depend on both partners. */
    for (EACH_LIVE(i))
        if (W.disks[i].mode == FREE && W.disks[i].ends >= 0) take_back(i);
    for (EACH_LIVE(i))
        if (W.disks[i].mode == FREE && W.disks[i].ends >= 0) end_in_contact(i, W.disks[i].ends);
}

/* Take the loads by disk i in the second half of this step back. Of a contact with a disk that is `up`, awake, they
   stay. */
void unload(int i, const int *up) {
    for (int link = W.disks[i].links; link >= 0; link = W.links[link]) {
        const Contact *c = W.contacts + link / 2;
        int other = c->i == i ? c->j : c->i;
        if (c->halved) continue;
        double share = (c->two ? 0.5 * !(up && up[other]) : c->i == i) * (W.before - 1);
        keep_impulse(c, share, W.t, W.t + 0.5 * W.length);
        if (c->i != i) continue;
        bear_contact(c, W.before - 1, W.t, W.t + 0.5 * W.length);
        if (c->j >= 0 && !c->two) untell_frozen(c, W.before - 1);
    }
}

/* Take back what the second half of this step's impulses did to the ledger for disk i. */
void take_back(int i) {
    Disk *d = W.disks + i;
    if (W.hastened > 0) book_push(d->entries, -pushed(d, share_before(d)));
    for (int link = d->links; link >= 0; link = W.links[link]) {
        const Contact *c = W.contacts + link / 2;
        if (c->halved) continue;
        for (int n = 0; n < 3; n++) {
            double back = (c->two ? 0.5 : 1) * c->later[n];
            if (c->i != i && !c->two) back = 0;
            d->entries[n] -= back;
            if (W.interact && n > 0) spread(-back, n);
            else W.books[3 * c->owner + n] -= back;
        }
        if (c->j < 0) W.drives[c->owner] -= driven(c, W.before);
        if (c->i != i) continue;
        if (c->given[1] == 0) continue;
        W.books[3 * giver_of(c)] -= c->given[1];
        d->entries[0] -= c->given[1];
    }
    unload(i, 0);
}

/* End the track of a disk in lasting contact, in the state halfway through this step's impulses. */
void end_in_contact(int i, int reason) {
    Disk *d = W.disks + i;
    Track *track = W.tracks + i;
    const double *s = track->held, f = share_before(d);
    if (d->held_count)
        /* Inside an arc it is faster than its impulses make it, see `track_lasting`. */
        bear_disk(d, W.surfaces[d->held[0]].owner, d->mass * (s[3] - d->ux - f * (d->vx - d->ux)),
                  d->mass * (s[4] - d->uy - f * (d->vy - d->uy)), d->t, d->t);
    d->x = s[1];
    d->y = s[2];
    d->vx = s[3];
    d->vy = s[4];
    d->spin = s[5];
    if (track->lasted > 1) knot_held(i);
    track->lasted = 0;
    if (reason == BY_SETTLING) event_here(SETTLE, i, W.surfaces[d->held[0]].owner);
    finish(i, reason);
}
