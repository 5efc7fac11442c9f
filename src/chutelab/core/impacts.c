/* Impacts: resolved at their own instants, with those that follow from them. */

#include <string.h>
#include "core.h"

/* With this restitution, JAM impacts halve the normal velocity; with a larger one they don't jam a disk. */
#define LASTING 0.9914

/* Note that a disk lies on a surface. One that it left as this step began, and meets again, is listed already. */
void hold(Disk *d, int k) {
    for (int n = 0; n < d->held_count; n++) {
        if (d->held[n] != k) continue;
        d->supports = MAX(d->supports, 1);
        return;
    }
    if (d->held_count < MAX_HELD) d->held[d->held_count++] = k;
    d->supports++;
}

/* Note that a disk gets an impulse now; its state before it becomes a knot. */
void was_moved(int i) {
    Disk *d = W.disks + i;
    d->impacts++;
    d->hops = 0;
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
