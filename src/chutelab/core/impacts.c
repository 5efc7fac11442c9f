/* Impacts at their own instants: foreseen for each disk, resolved in the order of time. */

#include <string.h>
#include "core.h"

/* With this restitution, JAM impacts halve the normal velocity; with a larger one they don't jam a disk. */
#define LASTING 0.9914
/* Overlap, in radii, that a slow approach of supported particles may reach by the end of the step: such an approach is
   left to the next step, as an impact on a pile causes impacts without end. The next solve removes as much at once, see
   touching.c. One that is deeper already may become deeper by MORE. With corners the approach may be faster, up to
   LATEST: an impact of boxes is passed on four times as often. */
#define LATE 5e-3
#define MORE 1e-3

/* ------------------------------------------------------------------ the next event of each disk */

static int sooner(int i, int j) {
    double a = W.disks[i].due, b = W.disks[j].due;
    return a < b || (a == b && i < j);
}

static void place(int k, int i) {
    W.heap[k] = i;
    W.disks[i].heap_place = k;
}

static void sift(int k) {
    int i = W.heap[k];
    for (; k > 0 && sooner(i, W.heap[(k - 1) / 2]); k = (k - 1) / 2) place(k, W.heap[(k - 1) / 2]);
    for (;;) {
        int c = 2 * k + 1;
        if (c >= W.heap_count) break;
        if (c + 1 < W.heap_count && sooner(W.heap[c + 1], W.heap[c])) c++;
        if (!sooner(W.heap[c], i)) break;
        place(k, W.heap[c]);
        k = c;
    }
    place(k, i);
}

/* Set the next event of disk i and its time; only events within the step are kept in the heap. */
void expect(int i, double due, int partner) {
    Disk *d = W.disks + i;
    d->due = due;
    d->partner = partner;
    d->partner_changes = partner >= 0 ? W.disks[partner].changes : 0;
    if (d->heap_place >= 0 && due < W.step_end) sift(d->heap_place);
    else if (d->heap_place >= 0) {
        int k = d->heap_place, last = W.heap[--W.heap_count];
        d->heap_place = -1;
        if (last != i) {
            place(k, last);
            sift(k);
        }
    } else if (due < W.step_end) {
        place(W.heap_count++, i);
        sift(d->heap_place);
    }
}

/* The disk whose event is the next in this step, or -1. */
int next_disk(void) { return W.heap_count ? W.heap[0] : -1; }

/* Approach that counts as no impact, m/s. For a disk by itself that is a grazing one. In a crowd it is one that covers
   less than a tenth of TOUCH in a step, if gravity gives as much; without gravity it is rounding. */
double soft_approach(const Disk *d, double radius) {
    if (W.interact) return W.skip * radius * MIN(MAX(W.g * W.step / (W.skip * radius), 1e-9), 1);
    return GRAZE * sqrt(d->vx * d->vx + d->vy * d->vy);
}

/* The approach that is left, m/s, after more than `many` impacts in a step. */
static double grown(double least, int impacts, int many, double skip) {
    if (impacts <= many) return least;
    double most = skip * (MOST_SKIP / SKIP) * (impacts > STUCK ? pow(GROW, MIN(impacts - STUCK, 1000)) : 1);
    for (int n = MIN(impacts - many, 1000); n > 0 && skip < most && least < most; n--) skip *= GROW;
    return MAX(least, MIN(skip, most));
}

/* Approach up to which a contact is left to the next step, m/s. A disk that lies on a surface comes back to it at the end
   of each step, as fast as gravity makes it in a step, and inside an arc as fast as the curved path does. Of an approach
   with a deep overlap hardly anything is left. */
double left_over(const Disk *d, int impacts, int surface, double radius, int sunk, double t) {
    double skip = W.skip * radius, least = soft_approach(d, radius), nx, ny;
    if (has_corners(d)) {
        /* A corner in contact comes back as fast as gravity, the rotation, the surface and the inside of an arc make it. That
           of a particle in flight arrives: its blow is left only if it is as slow as a fall within a step. In a crowd it may get as deep as between particles. */
        double haste = surface >= 0 && d->lies ? hastes(surface_at(surface, d->t), d) : 0;
        double bends = d->bends > 0 && surface >= 0 && is_held(d, surface) ? d->bends : 0;
        double press = W.g + d->whirl + haste + bends, back = 1.000001 * press * W.step, left = W.step_end - t;
        if (W.interact && !are_few(W.contact_count) && left > 0) back = MIN(back, LATE * radius / left);
        least = MAX(least, back);
        sunk = 0;
    } else if (surface >= 0 && (W.interact || d->held_count))
        sunk = gap_to(surface_at(surface, d->t), d->x, d->y, d->radius, &nx, &ny) <= -SUNK * radius;
    if (sunk) least *= HARDLY;
    least = MAX(least, d->open);
    if (d->halved) least = MAX(least, LEFT_BY_TURNS * W.pace);
    for (int n = 0; n < d->held_count && surface >= 0 && !has_corners(d); n++) {
        if (sunk || !is_one(d, d->held[n], surface)) continue;
        double haste = hastes(surface_at(surface, d->t), d);
        double press = W.g + pressed_inside(d, surface) + haste, back = 1.000001 * press * W.step, left = W.step_end - t;
        if (W.interact && left > 0) back = MIN(back, LATE * radius / left - 0.5 * press * left);
        least = MAX(least, back);
    }
    /* Surfaces do not give way: with them the bound grows only if jams do not help. */
    return grown(least, impacts, sunk ? STUCK : surface >= 0 ? 2 * JAM : MANY, skip);
}

/* Approach up to which two particles of a crowd, of which one is supported, are left to the next step at t, where their gap
   is negative if they overlap, m/s: see LATE. */
static double left_late(const Disk *a, const Disk *b, double radius, double gap, double most, double t) {
    if (!W.interact || !(a->supports || b->supports) || !(t < W.step_end)) return 0;
    return MIN(most, W.eager * MAX(LATE * radius + MIN(gap, 0), MORE * radius) / (W.step_end - t));
}

/* Approach up to which two disks are left to the next step at t, where their gap is negative if they overlap, m/s. */
static double left_between(const Disk *a, const Disk *b, double radius, double gap, double t) {
    int sunk = gap < -SUNK * radius;
    double least = left_over(a, MAX(a->impacts, b->impacts), -1, radius, sunk, t);
    return sunk ? least : MAX(least, left_late(a, b, radius, gap, W.soft, t));
}

/* The same for two particles of which one has corners. */
double left_by_corners(int i, int j, double gap, double t) {
    const Disk *a = W.disks + i, *b = W.disks + j;
    double small = MIN(a->inner, b->inner), back = 1.000001 * (W.g + MAX(a->whirl, b->whirl)) * W.step;
    if (!are_few(W.contact_count) && (a->supports || b->supports))
        back = left_late(a, b, small, gap, MAX(back, LATEST * W.soft), t);
    double least = MAX(MAX(soft_approach(a, small), back), MAX(a->open, b->open));
    if (a->halved || b->halved) least = MAX(least, LEFT_BY_TURNS * W.pace);
    return grown(least, MAX(a->impacts, b->impacts), MANY, W.skip * small);
}

/* When particle i meets j, of which one has corners, between two times of the step. */
static RARELY double meet_cornered(int i, int j, double from, double until) {
    int first = has_corners(W.disks + i) ? i : j, other = first == i ? j : i;
    const Disk *d = W.disks + first;
    until = MIN(until, W.step_end);
    double most = fastest_of(first, other, from, until - from);
    /* Any approach of a corner up to this is left to the next step. */
    if (most == INFINITY || most <= W.g * W.step) return INFINITY;
    double soft = other < 0 ? left_over(d, d->impacts, -1 - other, d->inner, 0, from)
                            : left_by_corners(first, other, -INFINITY, from);
    return meet_corners(first, other, from, until, most, soft);
}

static void foresee_pair(int i, int j, double *due, int *partner) {
    const Disk *a = W.disks + i, *b = W.disks + j;
    if (is_cornered(i, j)) {
        double then = meet_cornered(i, j, W.now, *due);
        if (then >= *due || then >= W.step_end) return;
        *due = then;
        *partner = j;
        return;
    }
    double ta = W.now - a->t, tb = W.now - b->t, approach;
    double x = a->x + (a->vx + 0.5 * W.gx * ta) * ta - b->x - (b->vx + 0.5 * W.gx * tb) * tb;
    double y = a->y + (a->vy + 0.5 * W.gy * ta) * ta - b->y - (b->vy + 0.5 * W.gy * tb) * tb;
    double u = a->vx + W.gx * ta - b->vx - W.gx * tb, v = a->vy + W.gy * ta - b->vy - W.gy * tb;
    double small = MIN(a->radius, b->radius), reach = a->radius + b->radius;
    double t = W.now + meet_disk(x, y, u, v, reach, W.step_end - W.now, &approach);
    if (!(t < *due && t < W.step_end)) return;
    double gap = t > W.now ? 0 : sqrt(x * x + y * y) - reach;
    if (approach > left_between(a, b, small, gap, t)) {
        *due = t;
        *partner = j;
    }
}

/* When a disk meets a surface that it can meet after a wait only. */
static double meet_after_wait(const Surface *s, const Disk *d, double wait, double *approach) {
    Disk then = *d;
    advance(&then, d->t + wait);
    return then.t + meet_surface(surface_at((int)(s - W.surfaces), then.t), &then, W.step_end - then.t, approach);
}

static void foresee_surfaces(int i, double *due, int *partner) {
    const Disk *d = W.disks + i;
    const int *list;
    int count = surfaces_near(i, &list);
    for (int n = 0; n < count; n++) {
        double approach = INFINITY;
        int k = list[n];
        if (W.surfaces[k].there != THERE || !is_beside(W.surfaces + k, d)) continue;
        double wait = 0, side;
        if (W.surfaces[k].one_sided) spare(d, W.surfaces + k, d->t);
        if (is_spared(W.surfaces + k, d)) {
            if (!W.surfaces[k].one_sided) continue;
            wait = clear_after(W.surfaces + k, d, W.step_end - d->t);
            *spared_by(W.surfaces + k, d) = wait < INFINITY ? CLEARS : 1;
            if (wait == INFINITY) continue;
        }
        const Surface *s = surface_at(k, d->t);
        if (s->mover >= 0 && !stirs(s) && d->mode == ASLEEP && d->ux == 0 && d->uy == 0) continue;
        if (!has_corners(d) && stirs(s) && closing(s, d, W.step_end - d->t) <= left_over(d, d->impacts, k, d->radius, 0, d->t)) continue;
        double t = has_corners(d) ? meet_cornered(i, -1 - k, MAX(W.now, d->t + wait), *due) : wait > 0 ? meet_after_wait(s, d, wait, &approach)
            : d->t + meet_surface(s, d, W.step_end - d->t, &approach);
        /* A disk that moves round an end within the step arrives at the side that lets it pass. */
        if (s->one_sided && t < W.step_end) {
            Disk then = *d;
            advance(&then, t);
            chain_gap(s, d, then.x, then.y, t, &side);
            if (side < 0) continue;
        }
        if (t < *due && t < W.step_end && approach > left_over(d, d->impacts, k, d->radius, 0, t)) {
            *due = MAX(t, W.now);
            *partner = -1 - k;
        }
    }
}

/* Foresee the next event of a disk from now on. */
void foresee(int i) {
    Disk *d = W.disks + i;
    double due = INFINITY;
    int partner = ALARM;
    if (d->mode == WAITING) due = d->waited ? MAX(d->release, W.step_end) : d->release;
    else if (d->mode == RIDING) due = d->ride_to;
    else if (d->mode == FREE || (d->mode == ASLEEP && (d->ux != 0 || d->uy != 0 || W.stirs)))
        foresee_surfaces(i, &due, &partner);
    if (d->mode == FREE) {
        for (int link = W.later_count < 0 ? -1 : d->nears; link >= 0; link = W.near_links[link]) {
            int j = W.near[link ^ 1];
            /* Of two disks that this shock has moved, the one that is foreseen last checks the pair. */
            if (!is_live(W.disks + j) || (is_cornered(i, j) && W.disks[j].moved)) continue;
            foresee_pair(i, j, &due, &partner);
        }
        int n = W.later_count < 0 ? reachable(i) : 0;
        for (int k = 0; k < n; k++) foresee_pair(i, W.found[k], &due, &partner);
    }
    expect(i, due, partner);
}

/* The same for all disks at the beginning of a step, by the list of pairs that may meet. */
void foresee_all(void) {
    W.heap_count = 0;
    for (int i = W.low; i < W.high; i++) {
        Disk *d = W.disks + i;
        int partner = ALARM;
        d->heap_place = -1;
        d->due = INFINITY;
        if (d->mode == WAITING) {
            d->due = MAX(d->release, W.now);
            if (d->due < W.step_end) expect(i, d->due, ALARM);
        } else if (d->mode == RIDING) d->due = d->ride_to;
        else if (d->mode == FREE || (d->mode == ASLEEP && (d->ux != 0 || d->uy != 0 || W.stirs)))
            foresee_surfaces(i, &d->due, &partner);
        d->partner = partner;
    }
    for (int n = 0; n < W.near_count; n++) {
        int i = W.near[2 * n], j = W.near[2 * n + 1];
        if (W.disks[i].mode != FREE) { int k = i; i = j; j = k; }
        if (W.disks[i].mode == FREE) foresee_pair(i, j, &W.disks[i].due, &W.disks[i].partner);
    }
    for (EACH_LIVE(i))
        if (W.disks[i].due < W.step_end) expect(i, W.disks[i].due, W.disks[i].partner);
    for (EACH_LIVE(i))
        if (W.disks[i].far) foresee(i);
}

/* ----------------------------------------------------------------------------------- the impact */

/* Note that a disk lies on a surface. */
void hold(Disk *d, int k) {
    for (int n = 0; n < d->held_count; n++)
        if (d->held[n] == k) return;
    if (d->held_count < MAX_HELD) d->held[d->held_count++] = k;
    d->supports++;
}

/* Note that a disk gets an impulse now; its state before it becomes a knot. */
void was_moved(int i) {
    Disk *d = W.disks + i;
    d->impacts++;
    d->calm = 0;
    d->stirred = 1;
    if (W.interact && d->impacts > STUCK) W.step_end = MIN(W.step_end, MAX(d->t, W.t + SHORTEST * W.step));
    if (d->moved != W.shocks) {
        d->moved = W.shocks;
        W.moved[W.moved_count++] = i;
        knot_before(i, d->t, d->vx, d->vy, d->spin);
    }
}


/* Set the further friction (more[1]) and the moment of rolling friction (more[2]) that stop slip and rolling `v` of a
   contact that has its impulse. Each changes what the other has to stop, so both are solved together, and again if one is
   at its bound. */
static void stop_turning(const Contact *c, double most, double arm, const double *v, double *more) {
    const Disk *a = W.disks + c->i, *b = W.disks + MAX(c->j, 0);
    double slip = v[1] + c->drift, shared = (c->cornered ? c->own[1] : a->radius) * a->inv_inertia;
    if (c->two) shared -= (c->cornered ? c->others[1] : b->radius) * b->inv_inertia;
    double both = 1 - square(shared) * c->mass[1] * c->mass[2];
    double moment = both > 0 ? c->mass[2] * (shared * c->mass[1] * slip - v[2]) / both : 0;
    more[0] = 0;
    for (int n = 0; n < 2; n++) {
        more[2] = MIN(MAX(moment, -arm), arm);
        double along = c->impulse[1] - c->mass[1] * (slip + shared * more[2]);
        more[1] = MIN(MAX(along, -most), most) - c->impulse[1];
        moment = -c->mass[2] * (v[2] + shared * more[1]);
    }
}

/* Give a contact a normal impulse, with friction and rolling friction within their bounds, and book its work and losses. */
static void give(Contact *c, double normal) {
    Disk *a = W.disks + c->i, *b = W.disks + MAX(c->j, 0);
    double *J = c->impulse, u[3], v[3], given[3], most = c->friction * normal;
    double arm = c->arm * normal, more[3] = {0, 0, 0};
    /* A hinge that stands against its stop has no levers. */
    int tied = is_tied(c->i) || is_tied(c->j), swings = c->hung && c->lever[2] != 0;
    relative(c, 0, u);
    J[0] = normal;
    J[1] = MIN(MAX(-c->mass[1] * (u[1] + c->drift), -most), most);
    J[2] = 0;
    if (tied) {
        J[0] = J[1] = 0;
        double back = u[0] + normal / c->mass[0];
        find_blow(c, 1, fabs(u[0]), 1, &u, &back);
    } else if (swings) {
        const double before[3] = {u[0], u[1] + c->drift, u[2]};
        couple(c, normal / c->mass[0], before, J);
    }
    if (tied || swings) arm = 0;
    if (!tied) push(c, J);
    relative(c, 0, v);
    if (arm > 0) {
        stop_turning(c, most, arm, v, more);
        push(c, more);
        relative(c, 0, v);
        J[1] += more[1];
        J[2] = more[2];
    }
    share_out(c, u, v, 0, c->entries, given);
    /* Joints turn slip into normal velocity, and the reverse: if one entry seems to be a gain, only the sum counts. */
    for (int n = 1; n < 3 && tied; n++) {
        if (c->entries[n] >= 0) continue;
        c->entries[3 - n] += c->entries[n];
        c->entries[n] = 0;
    }
    book(a->entries, c->two ? b->entries : 0, c->owner, c->entries);
    if (c->j < 0) W.drives[c->owner] += driven(c, 0);
    if (given[0] != 0) book(a->entries, 0, W.ride_owner, given);
    give_back(c, 1);
    bear_contact(c, 1, a->t, a->t);
    if (c->hung) leave_struck(c->hung - 1);
}

/* Let a disk lie on a surface from t on. The step of a disk by itself ends here. In a crowd the disk gets half of the
   impulse by which gravity will act on it within the step, and hops to its end. Inside an arc its path is also turned:
   the impulse does no work if it reverses the velocity along the normal in the middle of the path. */
static void support(int i, int k, double t) {
    Disk *d = W.disks + i;
    Contact c;
    if (is_hung(k)) strike_hinge(W.surfaces[k].mover, t);
    describe(&c, i, -1 - k);
    hold(d, k);
    const Surface *s = surface_at(k, t);
    double press = press_on(d, s, c.nx, c.ny), u[3];
    if (press <= 0 || !W.interact || is_tied(i)) return;
    if (bending(s, d->x, d->y, d->radius) < 0) W.step_end = MIN(W.step_end, t + hop_time(d, press));
    double left = W.step_end - t, pull, weight = pulled(s, d, c.nx, c.ny, &pull) - (W.gx * c.nx + W.gy * c.ny);
    double cosine = follow(&c, 0, chord(&c, 0, left)), normal = 0.5 * press * d->mass * left;
    relative(&c, 0, u);
    c.drift = 0.5 * left * c.pull;
    if (c.turns > 0) normal = d->mass * (0.5 * left * weight / cosine - 2 * u[0]);
    if (normal <= 0) return;
    c.impulse[0] = normal;
    c.impulse[1] = c.impulse[2] = 0;
    hold_hinge(&c, 1);
    give(&c, normal);
    keep_impulse(&c, 1, t, t);
    /* Friction that need not slow it can hold it from now on. */
    if (fabs(u[1]) <= 1e-12 * W.g * W.dt && fabs(c.impulse[1]) < c.friction * c.impulse[0]) {
        d->slips = 0;
        event_here(STICK, i, c.owner);
    }
}

/* Bring a disk by itself that lies on a surface from its hop to the smooth path, before it is struck within a step: else
   the velocity of the hop, of first order in the step, would remain.

   On the smooth path the velocity changes at a constant rate from the middle of the last step to that of the next. The
   difference is an impulse of the surface, and the height of the hop is booked as a part of what its impulses lost.
   Infinite friction acts at once, not at a constant rate, and this would undo it; so it is left out after FEW impacts. */
static void end_hop(int i, double t) {
    Disk *d = W.disks + i;
    Track *track = W.tracks + i;
    if (W.interact || !track->lasted || track->held[0] != W.t) return;
    const Contact *last = 0;
    for (int link = d->links; link >= 0; link = W.links[link])
        if (W.contacts[link / 2].impulse[0] > 0) last = W.contacts + link / 2;
    if (!last) return;
    Contact c = *last;
    double h = t - W.t, half = 0.5 * W.length, u[3], v[3], entries[3], given[3], to[3];
    /* `held` is the smooth state at the beginning of the step; half a step later the smooth state is that without the
       hop. */
    const double *from = track->held + 3;
    for (int n = 0; n < 3; n++) {
        double mid = track->after[n] + (n == 0 ? half * W.gx : n == 1 ? half * W.gy : 0);
        to[n] = from[n] + (mid - from[n]) * (half > 0 ? h / half : 0);
    }
    relative(&c, 0, u);
    double x = track->held[1] + 0.5 * (from[0] + to[0]) * h;
    double y = track->held[2] + 0.5 * (from[1] + to[1]) * h;
    double jx = d->mass * (to[0] - d->vx), jy = d->mass * (to[1] - d->vy);
    c.impulse[0] = jx * c.nx + jy * c.ny;
    c.impulse[1] = jx * c.ny - jy * c.nx;
    c.impulse[2] = d->inertia * (to[2] - d->spin) - d->radius * c.impulse[1];
    c.clings = 0;
    double fall = d->mass * (W.gx * (x - d->x) + W.gy * (y - d->y));
    d->x = x;
    d->y = y;
    d->vx = to[0];
    d->vy = to[1];
    d->spin = to[2];
    relative(&c, 0, v);
    share_out(&c, u, v, 0, entries, given);
    entries[1] += fall;
    book(d->entries, 0, c.owner, entries);
    W.drives[c.owner] += driven(&c, 0);
    bear_contact(&c, 1, t, t);
    keep_impulse(&c, 1, t, t);
    track->lasted = 0;
}

/* Whether a disk by itself may, within a span, meet a surface other than k and those that it lies on. */
static int meets_another(int i, int k, double span) {
    const Disk *d = W.disks + i;
    double speed = MAX(sqrt(d->vx * d->vx + d->vy * d->vy), fabs(W.surfaces[k].speed)), nx, ny;
    const int *list;
    int count = surfaces_near(i, &list);
    for (int n = 0; n < count; n++) {
        const Surface *s = surface_at(list[n], d->t);
        if (is_one(d, k, list[n]) || is_held(d, list[n]) || !is_near(s, d)) continue;
        if (gap_to(s, d->x, d->y, d->radius, &nx, &ny) < (speed + W.fastest + W.g * span) * span) return 1;
    }
    return 0;
}

/* Forget the surfaces from which an impact has lifted a disk by itself. */
static void let_fly(Disk *d) {
    double nx, ny;
    int kept = 0;
    for (int n = 0; n < d->held_count; n++) {
        double v[3];
        const Surface *s = surface_at(d->held[n], d->t);
        gap_to(s, d->x, d->y, d->radius, &nx, &ny);
        carried(s, d->x, d->y, v);
        if (!flies_off(d, d->held[n], (d->vx - v[0]) * nx + (d->vy - v[1]) * ny)) d->held[kept++] = d->held[n];
    }
    d->held_count = kept;
}

/* Whether a disk meets a face that is in line with another surface on which it slides: it moves onto it without an
   impact. */
static int goes_straight_on(const Contact *c) {
    const Disk *d = W.disks + c->i;
    const Surface *s = surface_at(-1 - c->j, d->t);
    if (d->on < 0 || d->on == c->owner || s->shape != SEGMENT) return 0;
    for (int link = d->links; link >= 0; link = W.links[link]) {
        const Contact *last = W.contacts + link / 2;
        if (last->owner == d->on && last->impulse[0] > 0
            && fabs(last->nx * s->tx + last->ny * s->ty) <= GRAZE) return 1;
    }
    return 0;
}

/* Whether a disk by itself that does not rotate rattles at a belt, with impacts of which some (`rest` is the restitution
   of this one) lose hardly any energy. Where a wedge narrows, neither the impacts nor the work of the belt would end. */
static int is_driven(int i, double approach, double rest) {
    const Disk *d = W.disks + i;
    double nx, ny;
    const int *list;
    if (W.interact || d->inertia > 0 || approach < SLOW * W.g * W.dt) return 0;
    int count = surfaces_near(i, &list), moves = 0;
    for (int n = 0; n < count; n++) {
        const Surface *s = surface_at(list[n], d->t);
        if (s->there != THERE || !is_near(s, d) || gap_to(s, d->x, d->y, d->radius, &nx, &ny) >= d->radius) continue;
        moves |= s->speed != 0;
        rest = MAX(rest, surface_pair(d, list[n])->restitution);
    }
    return moves && rest > LASTING;
}

/* Whether the impulse of an impact is all that changed the velocity of its disk. */
int is_alone(const Contact *c, const double *before) {
    const Disk *d = W.disks + c->i;
    double size = sqrt(square(c->impulse[0]) + square(c->impulse[1]));
    double change = d->mass * sqrt(square(d->vx - before[0]) + square(d->vy - before[1]));
    return fabs(change - size) <= SAME_IMPULSE * size;
}

/* Resolve the impact of disk i with disk j, or with surface k as j = -1 - k, with Newton's restitution and Coulomb's
   friction. */
static void strike(int i, int j, double t) {
    Disk *a = W.disks + i, *b = W.disks + MAX(j, 0);
    if (a->mode == ASLEEP) wake(i, t);
    if (j >= 0 && b->mode == ASLEEP) wake(j, t);
    advance(a, t);
    slow_down(i, t);
    if (j >= 0) {
        advance(b, t);
        if (b->mode == FREE) slow_down(j, t);
    } else if (a->impacts < FEW) end_hop(i, t);
    /* It is clear of the surface that let it pass. */
    if (j < 0 && W.surfaces[-1 - j].one_sided) *spared_by(W.surfaces + (-1 - j), a) = 0;
    if (is_cornered(i, j)) {
        if (has_corners(a)) strike_corners(i, j, t);
        else strike_corners(j, i, t);
        return;
    }
    int impacts = j >= 0 ? MAX(a->impacts, b->impacts) : a->impacts;
    Contact c;
    double u[3];
    if (j < 0 && is_hung(-1 - j)) strike_hinge(W.surfaces[-1 - j].mover, t);
    describe(&c, i, j);
    stall_too(&c);
    c.drift = 0;
    if (is_tied(i) || is_tied(j)) strike_joints(i, j);
    was_moved(i);
    if (c.two) was_moved(j);
    relative(&c, 0, u);
    if (u[0] >= 0) return;
    /* Restitution that falls with speed: above 1 / falls it goes with v^(-1/4). */
    if (c.falls * -u[0] > 1) c.rest /= sqrt(sqrt(c.falls * -u[0]));
    double back = -c.rest * u[0], cohesion = cohesion_of(i, j);
    /* To pull two apart takes the work of cohesion: the force times its range. */
    if (cohesion > 0) {
        double range = TOUCH * (j < 0 ? a->radius : MIN(a->radius, b->radius));
        back = sqrt(MAX(square(back) - 2 * cohesion * range / c.mass[0], 0));
    }
    if (j >= 0 && -u[0] < W.soft && (a->supports || b->supports || !c.two)) back = 0;
    int jammed = impacts >= (j >= 0 ? CROWDED : c.rest < 1 ? JAM : CROWDED);
    int slow = c.rest < 1 && impacts >= FEW && -u[0] < SLOW * W.g * W.dt;
    jammed |= slow && jams_pay();
    if (jammed && is_driven(i, -u[0], c.rest)) {
        a->impacts = STALL + 1;
        jammed = 0;
    }
    if (jammed || slow) back = 0;
    const Surface *met = j < 0 ? surface_at(-1 - j, t) : 0;
    double drawn = pressed_by_joints(&c), press = met ? press_on(a, met, c.nx, c.ny) + drawn : 0, later = 0;
    if (!met && drawn > 0 && back <= drawn * W.step) back = 0;
    int rests = met && back <= press * MIN(W.step, turning_time(a, met));
    /* The bounces that are left out, infinitely many, would take so long, */
    if (rests && back > 0 && c.rest < 1) later = 2 * back / (press * (1 - c.rest));
    /* unless it meets something before they end: with infinite friction each of them is an impact. */
    if (!W.interact && later > 0 && c.friction > ROUGH && meets_another(i, -1 - j, later)) rests = later = 0;
    if (rests) back = 0;
    double before[3] = {a->vx, a->vy, a->spin};
    if (jammed) jam(&c, t);
    else {
        c.impulse[2] = 0;
        if (c.hung) couple(&c, back - u[0], u, c.impulse);
        hold_hinge(&c, 1);
        give(&c, c.mass[0] * (back - u[0]));
    }
    if (is_tied(i) || is_tied(j)) end_blow();
    a->since = t + later;
    if (c.two) b->since = t;
    if (!W.interact) let_fly(a);
    W.impact_count++;
    int landing = j < 0 && c.owner == W.landing && !a->landed, kind = COLLISION;
    if (j < 0) kind = landing ? LANDING : IMPACT;
    int passes = j < 0 && -u[0] <= W.soft && goes_straight_on(&c);
    int told = !passes && (landing || -u[0] > W.soft || W.g == 0 || (j < 0 && a->on != c.owner));
    if (told)
        write_event(kind, i, j >= 0 ? j : -1, c.owner, t, &a->x, before, &a->vx,
                    c.impulse[0], c.impulse[1]);
    /* In a jam, the event doesn't say which contacts its impulse came from. */
    if (!told || (jammed && !is_alone(&c, before))) keep_impulse(&c, 1, t, t);
    else keep_carried(&c, 1, t, t);
    if (landing && !passes) a->landed = 1;
    if (j < 0 && !passes) {
        a->on = c.owner;
        a->slips = 1;
    }
    if (rests) support(i, -1 - j, t);
}

/* Whether a lasting contact of the step is also struck now. On a smooth surface its partner `j` may be the next piece. */
static int struck_too(const Contact *c, double t, int *j) {
    Disk *a = W.disks + c->i, *b = W.disks + MAX(c->j, 0);
    double nx, ny;
    *j = c->j;
    if (a->mode != FREE || (!W.interact && c->impulse[0] == 0)) return 0;
    /* A particle with joints is struck only at the beginning of a step. */
    if (t > W.t && (is_tied(c->i) || is_tied(c->j))) return 0;
    advance(a, t);
    if (c->cornered) {
        Contact list[MOST_TOUCHES];
        double u[3], soft = 0;
        int moves = c->j < 0 && stirs(W.surfaces + (-1 - c->j)), fast = moves || are_few(W.contact_count);
        if (c->j >= 0 && b->mode != FREE) return 0;
        if (c->j >= 0) {
            advance(b, t);
            soft = left_by_corners(c->i, c->j, -INFINITY, t);
            double x = a->vx - b->vx, y = a->vy - b->vy, turns = fabs(a->spin) * a->radius + fabs(b->spin) * b->radius;
            if (turns < soft && x * x + y * y <= square(soft - turns)) return 0;
        } else soft = left_over(a, a->impacts, -1 - c->j, a->inner, 0, t);
        /* At the places in contact it must approach faster than that; what has rotated or closed since is foreseen. */
        for (const Contact *o = c; o >= W.contacts && o->i == c->i && o->j == c->j && !fast; o--) {
            relative(o, 0, u);
            fast = -u[0] > (c->j < 0 ? soft : left_by_corners(c->i, c->j, o->gap, t));
        }
        if (!fast) return 0;
        for (int n = list_struck(c->i, c->j, t, list) - 1; n >= 0; n--) {
            relative(list + n, 0, u);
            if (-u[0] > (c->j < 0 ? soft : left_by_corners(c->i, c->j, list[n].gap, t))) return 1;
        }
        return 0;
    }
    if (c->j < 0) {
        const Surface *s = face_at(surface_at(-1 - c->j, t), a->x, a->y);
        int k = (int)(s - W.surfaces);
        double gap = gap_to(s, a->x, a->y, a->radius, &nx, &ny), v[3];
        carried(s, a->x, a->y, v);
        *j = -1 - k;
        return gap < TOUCH * a->radius
            && -((a->vx - v[0]) * nx + (a->vy - v[1]) * ny) > left_over(a, a->impacts, k, a->radius, 0, t);
    }
    if (b->mode != FREE) return 0;
    advance(b, t);
    double x = a->x - b->x, y = a->y - b->y, d = sqrt(x * x + y * y), r = MIN(a->radius, b->radius);
    double approach = -(x * (a->vx - b->vx) + y * (a->vy - b->vy)) / d;
    return d < a->radius + b->radius + TOUCH * r
        && approach > left_between(a, b, r, d - a->radius - b->radius, t);
}

static void enqueue(int i, int *tail) {
    Disk *d = W.disks + i;
    if (d->queued) return;
    d->queued = 1;
    W.queue[*tail] = i;
    *tail = (*tail + 1) % (W.disk_count + 1);
}

/* Resolve an impact and those that follow from it at the same instant: a disk that is pushed against others passes its
   impulse on, in the order of a queue. */
void shock(int i, int j, double t) {
    int head = 0, tail = 0, budget = SHOCKS * W.contact_count;
    W.moved_count = W.woken = 0;
    W.shocks++;
    if (W.outline_count) forget_places();
    W.now = t;
    strike(i, j, t);
    enqueue(i, &tail);
    if (j >= 0 && W.disks[j].mode == FREE) enqueue(j, &tail);
    while (head != tail) {
        int m = W.queue[head];
        head = (head + 1) % (W.disk_count + 1);
        W.disks[m].queued = 0;
        if (W.disks[m].landed && W.until == UNTIL_LANDED) continue;
        const Contact *last = 0;
        for (int link = W.disks[m].links; link >= 0; link = W.links[link]) {
            const Contact *c = W.contacts + link / 2;
            int partner, again = c->cornered && last && last->i == c->i && last->j == c->j;
            last = c;
            /* All places of two are struck together. */
            if (budget <= 0 || again || !struck_too(c, t, &partner)) continue;
            budget--;
            strike(c->i, partner, t);
            enqueue(c->i, &tail);
            if (partner >= 0) enqueue(partner, &tail);
        }
    }
    for (int k = 0; k < W.moved_count; k++) {
        Disk *d = W.disks + W.moved[k];
        d->changes++;
        knot_after(W.moved[k]);
        if (d->landed && W.until == UNTIL_LANDED) finish(W.moved[k], BY_LANDING);
    }
    /* A disk by itself begins a new step after each impact. */
    if (!W.interact) W.step_end = t;
    for (int k = 0; k < W.moved_count; k++) {
        int m = W.moved[k];
        W.disks[m].moved = 0;
        if (W.disks[m].mode == FREE) {
            enter_again(m, W.step_end);
            if (W.woken) list_again(m);
            foresee(m);
        } else expect(m, INFINITY, ALARM);
    }
}

/* Let a disk that is released on a surface lie on it at once, like one that was just struck. */
void lie_down(int i) {
    Disk *d = W.disks + i;
    for (int k = 0; k < W.surface_count; k++) {
        const Surface *s = surface_at(k, d->t);
        double nx, ny, v[3];
        if (has_corners(d)) {
            /* It becomes a contact in the next step. */
            if (s->there == THERE && !is_spared(s, d) && lies_flat(i, k)) {
                d->on = s->owner;
                d->slips = 1;
            }
            continue;
        }
        if (s->there != THERE || is_spared(s, d) || face_at(s, d->x, d->y) != s || is_held(d, k)) continue;
        if (gap_to(s, d->x, d->y, d->radius, &nx, &ny) > 1e-9 * d->radius) continue;
        double press = press_on(d, s, nx, ny);
        carried(s, d->x, d->y, v);
        if (press <= 0 || fabs((d->vx - v[0]) * nx + (d->vy - v[1]) * ny) > press * MIN(W.dt, turning_time(d, s))) continue;
        d->on = s->owner;
        d->slips = 1;
        support(i, k, d->t);
    }
    /* That step begins now. */
    if (has_corners(d)) W.step_end = MIN(W.step_end, MAX(d->t, W.t));
}
