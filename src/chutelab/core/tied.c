/* Lasting contacts of particles with joints, and of all particles in contact with these.

   Contacts and joints are solved in turn. Such contacts are halved: like the pull of a joint, their impulse is given half
   before the flight and half after it. The second half answers gravity and the second half of the pull at the end of the
   step. So nothing hops, and a contact does no work against a joint; see docs/physics.md. */

#include <string.h>
#include "core.h"

/* Greatest number of turns of the alternating solve; it ends at this share of the accuracy of the contacts. */
#define TURNS 50
#define AGREES 0.1
/* Share of LEFT_BY_TURNS at which it ends with at most FEW_CONTACTS contacts. */
#define FINE_TURNS 0.1
/* m/s on Earth; velocity change at which the sweeps for second halves end, and their greatest number. */
#define FINE 1e-11
#define SWEEPS 2000

/* Solve the pull of joints and the lasting contacts in turn until they agree. */
void agree_with_contacts(double h) {
    int meets = 0;
    for (const Contact *c = W.contacts; c < W.contacts + W.contact_count; c++)
        meets |= W.disks[c->i].tie >= 0 || (c->j >= 0 && W.disks[c->j].tie >= 0);
    for (int n = 0; n < TURNS && meets; n++) {
        double worst = 0;
        for (int i = W.low; i < W.high; i++) memcpy(W.disks[i].tugged, W.disks[i].tug, sizeof W.disks[i].tug);
        pull_joints(h);
        for (int i = W.low; i < W.high; i++)
            for (int k = 0; k < 3 && W.disks[i].tie >= 0; k++) {
                double more = fabs(W.disks[i].tug[k] - W.disks[i].tugged[k]);
                worst = MAX(worst, k < 2 ? more : has_corners(W.disks + i) ? more * W.disks[i].radius : 0);
            }
        if (worst <= (W.contact_count > FEW_CONTACTS ? AGREES * W.accurate : FINE_TURNS * LEFT_BY_TURNS * W.pace)) return;
        for (Contact *c = W.contacts; c < W.contacts + W.contact_count; c++) {
            /* Start from zero change with the impulses as they are; the path without them has changed with the pull. */
            const double back[3] = {-c->impulse[0], -c->impulse[1], -c->impulse[2]};
            push(c, back);
            for (int side = 0; side < 2; side++) {
                const Disk *d = side ? c->two ? W.disks + c->j : 0 : W.disks + c->i;
                if (!d || d->tie < 0) continue;
                double more = (d->tug[0] - d->tugged[0]) * c->nx + (d->tug[1] - d->tugged[1]) * c->ny;
                if (c->cornered) more += (side ? -c->others[0] : c->own[0]) * (d->tug[2] - d->tugged[2]);
                if (side) more = -more;
                c->need -= more;
                c->most -= more;
                c->free_gap += more * h;
            }
        }
        solve_contacts(1);
    }
    /* A push by hand changes the pull, too. */
    if (meets || W.hastened > 0) pull_joints(h);
}

/* Mark the particles that a halved contact presses; those that only touch go on like others with joints. */
void mark_halved(void) {
    for (EACH_LIVE(i)) W.disks[i].halved = 0;
    for (const Contact *c = W.contacts; c < W.contacts + W.contact_count; c++) {
        if (!c->halved || c->impulse[0] == 0) continue;
        W.disks[c->i].halved = 1;
        if (c->j >= 0) W.disks[c->j].halved = 1;
    }
}

/* Half of the work of a contact's impulse by the velocity change of the first half of the pull, J. */
static double against_pull(const Contact *c) {
    const double *J = c->impulse, x = J[0] * c->nx + J[1] * c->ny, y = J[0] * c->ny - J[1] * c->nx;
    double sum = 0;
    for (int side = 0; side <= c->two; side++) {
        const Disk *d = W.disks + (side ? c->j : c->i);
        const double *lever = side ? c->others : c->own;
        double moment = c->cornered ? lever[0] * J[0] + lever[1] * J[1] : d->radius * J[1];
        sum += (side ? -1 : 1) * (x * d->tug[0] + y * d->tug[1] + J[2] * d->tug[2]) + moment * d->tug[2];
    }
    return 0.5 * sum;
}

/* Keep the ledger entries of the first halves of contacts that were solved together until the second halves are known.
   They act at the same time as the first half of the pull, which `end_pull` books as if it came after them: the
   difference is added here. */
void leave_first_halves(Contact *list, int count) {
    for (Contact *c = list; c < list + count && c->halved; c++) {
        memcpy(c->later, c->entries, sizeof c->later);
        c->later[1] += against_pull(c);
        c->given[1] = c->given[0];
        c->given[0] = c->entries[0] = c->entries[1] = c->entries[2] = 0;
    }
}

/* Describe a contact of this step anew at the end of the step; as before if its place is not found again. */
static void describe_again(Contact *c, const Contact *last) {
    Touch places[MOST_TOUCHES];
    double t = W.step_end, least = 0.5 * W.disks[last->i].inner;
    *c = *last;
    if (!last->cornered) describe(c, last->i, last->j);
    int count = last->cornered ? list_touches(last->i, last->j, t, TOUCH * inner_of(last->i, last->j), t, places) : 0;
    for (int n = 0; n < count; n++) {
        Contact one;
        describe_touch(&one, last->i, last->j, places + n);
        double off = hypot(one.spot[0] - last->spot[0], one.spot[1] - last->spot[1]);
        if (off >= least) continue;
        least = off;
        *c = one;
    }
    c->island = last->island;
    c->halved = 1;
    c->impulse[0] = c->impulse[1] = c->impulse[2] = c->drift = 0;
}

/* Book both halves of a contact's impulse in a step of length h; `c` has the entries of both. */
static void book_halves(const Contact *first, const Contact *c, double h) {
    Disk *a = W.disks + c->i, *b = c->two ? W.disks + c->j : 0;
    double given[3] = {c->given[0] + first->given[1], 0, 0};
    bear_contact(first, 1, W.t, W.t + 0.5 * h);
    keep_impulse(first, 1, W.t, W.t + 0.5 * h);
    bear_contact(c, 1, W.step_end - 0.5 * h, W.step_end);
    keep_impulse(c, 1, W.step_end - 0.5 * h, W.step_end);
    book(a->entries, b ? b->entries : 0, c->owner, c->entries);
    if (c->j < 0) W.drives[c->owner] += driven(first, 0) + driven(c, 0);
    if (given[0] != 0) book(a->entries, 0, W.ride_owner, given);
}

/* The particles of a list of contacts, two per contact; -1 if the second one does not move. */
static int felt_by(const Contact *list, int n) {
    const Contact *c = list + n / 2;
    return n % 2 ? c->two ? c->j : -1 : c->i;
}

/* Give the second halves at the end of a step of length h: no contact that pressed approaches then, and friction stops
   its slip. The first half of a contact whose particle has ended is booked alone. */
void press_again(double h) {
    int count = 0;
    Contact *list = W.earlier;
    for (int n = 0; n < W.contact_count; n++) {
        const Contact *c = W.contacts + n;
        if (!c->halved || c->impulse[0] == 0) continue;
        if (W.disks[c->i].mode == FREE && (!c->two || W.disks[c->j].mode == FREE)) {
            describe_again(list + count, c);
            list[count++].next = n;
        } else {
            Contact none = *c;
            memcpy(none.entries, c->later, sizeof none.entries);
            none.impulse[0] = none.impulse[1] = none.impulse[2] = none.given[0] = 0;
            book_halves(c, &none, h);
        }
    }
    for (int n = 0; n < 2 * count; n++) {
        int i = felt_by(list, n);
        if (i < 0) continue;
        Disk *d = W.disks + i;
        if (!W.tracks[i].lasted) knot_before(i, d->t, d->vx, d->vy, d->spin);
        memcpy(&d->ux, &d->vx, 2 * sizeof(double));
        d->uspin = d->spin;
        d->kick[0] = d->kick[1] = 0;
    }
    for (int n = 0; n < count; n++) {
        double u[3];
        relative(list + n, 0, u);
        list[n].need = -u[0];
    }
    for (int n = 0; W.hastened > 0 && n < 2 * count; n++) {
        Disk *d = W.disks + felt_by(list, n);
        if (d >= W.disks && (d->owed[0] != 0 || d->owed[1] != 0)) kick(d, 0);
    }
    W.swings_too = 0;
    for (int n = 0, to = 0; n < count; n = to) {
        double least = INFINITY;
        for (; to < count && list[to].island == list[n].island; to++) least = MIN(least, W.disks[list[to].i].radius);
        sweep_contacts(list + n, to - n, 0, SWEEPS, W.sweeps, FINE * W.pace, W.skip * least);
        account(list + n, to - n);
        for (int m = n; m < to; m++)
            for (int k = 0; k < 3; k++) list[m].entries[k] += W.contacts[list[m].next].later[k];
        pool(list + n, to - n, 0);
    }
    for (int n = 0; n < count; n++) book_halves(W.contacts + list[n].next, list + n, h);
    give_back(list, count);
    for (int n = 0; n < 2 * count; n++) {
        int i = felt_by(list, n);
        if (i < 0) continue;
        Disk *d = W.disks + i;
        d->changes++;
        if (W.hastened > 0) book_push(d->entries, pushed(d, 0));
        d->kick[0] = d->kick[1] = 0;
        track_ended(i);
    }
}

/* Whether a halved contact presses in this step. */
int has_halves(void) {
    for (const Contact *c = W.contacts; c < W.contacts + W.contact_count && W.joint_count; c++)
        if (c->halved && c->impulse[0] != 0) return 1;
    return 0;
}

/* Add (`way` 1) or subtract (-1) the part of the work of pushes that depends on the impulses of halved contacts. */
static void book_pushes_again(int way) {
    for (EACH_LIVE(i)) {
        Disk *d = W.disks + i;
        double along = d->kick[0] * (d->vx - d->tug[0]) + d->kick[1] * (d->vy - d->tug[1]);
        if (d->halved && along != 0) book_push(d->entries, way * 0.5 * d->mass * along);
    }
}

/* Take back the first halves and the pull; the step is solved anew. */
void take_halves_back(void) {
    if (W.hastened > 0) book_pushes_again(-1);
    for (Contact *c = W.contacts; c < W.contacts + W.contact_count; c++) {
        double back[3] = {-c->impulse[0], -c->impulse[1], -c->impulse[2]};
        if (!c->halved) continue;
        push(c, back);
        c->impulse[0] = c->impulse[1] = c->impulse[2] = 0;
    }
    drop_tugs();
    if (W.hastened > 0) book_pushes_again(1);
    for (EACH_LIVE(i)) {
        Disk *d = W.disks + i;
        if (d->halved) memcpy(W.tracks[i].after, &d->vx, sizeof W.tracks[i].after);
    }
}
