/* The next event of each disk within a step, kept in a heap: what it meets, or what else happens to it, and when; and which
   approaches are too slow to be impacts and are left to the next solve. */

#include "core.h"

/* Overlap, in radii, that a slow approach of supported particles may reach by the end of the step: such an approach is
   left to the next step, as an impact on a pile causes impacts without end. The next solve removes as much at once, see
   touching.c. One that is deeper already may become deeper by MORE. With corners the approach may be faster, up to
   LATEST: an impact of boxes is passed on four times as often. */
#define LATE 5e-3
#define MORE 1e-3


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
double left_between(const Disk *a, const Disk *b, double radius, double gap, double t) {
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
    else if (t < W.step_end) back = MIN(back, LATE * small / (W.step_end - t));
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
