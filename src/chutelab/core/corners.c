/* Particles with corners: convex polygons, among them boxes.

   A contact is at one place: a corner of one particle on an edge of the other, a corner on a surface, or an end of a
   surface on an edge; so two edges that lie on each other touch at two places. Each place is a contact of its own, with
   levers about the centres. A disk, or an arc seen from outside, counts as a corner with a radius. Gaps are those of the
   corner on its exact path with rotation, and an impact is at the instant at which the first gap closes. */

#include <string.h>
#include "shape.h"
#include "trig.h"

/* Share of a speed; a smaller approach velocity may be rounding and is no impact. */
#define ROUNDS 1e-14
/* Distance, in radii of the inner circle, by which two particles of a crowd may move before their places are looked up
   again; the gap is then wrong by its square. */
#define STILL 5e-4
/* How many times the turn of a corner's path that an arc gives in a step still counts as due to the arc. */
#define BENT 1.01
/* Infinite friction, by adhesion, as a number: what two places can hold is compared, and infinity less infinity is none. */
#define GRIPS 1e6
/* Number of pairs whose places are remembered during an impact and those that follow from it. */
#define KNOWN 8

/* Bound on the centripetal acceleration of a corner, m/s2. */
double whirl_of(const Disk *d) { return d->corners ? d->spin * d->spin * d->radius : 0; }

/* ------------------------------------------------------------------------------------------ contacts */

/* Set the levers of a contact about both centres, and how an impulse along and across its normal acts through rotation,
   1/kg. */
static void take_levers(Contact *c, const Touch *t, double *rotation) {
    const Disk *a = W.disks + c->i, *b = W.disks + MAX(c->j, 0);
    const double *pose = pose_of(c->i);
    double x = t->x - a->x, y = t->y - a->y, cosine = pose[0], sine = pose[1];
    c->own[0] = x * c->ny - y * c->nx;
    c->own[1] = -(x * c->nx + y * c->ny);
    c->spot[0] = cosine * x + sine * y;
    c->spot[1] = cosine * y - sine * x;
    c->others[0] = c->others[1] = 0;
    if (c->j >= 0) {
        x = t->x - b->x;
        y = t->y - b->y;
        c->others[0] = y * c->nx - x * c->ny;
        c->others[1] = x * c->nx + y * c->ny;
    }
    for (int n = 0; n < 2; n++) {
        rotation[n] = square(c->own[n]) * a->inv_inertia;
        if (c->two) rotation[n] += square(c->others[n]) * b->inv_inertia;
    }
}

/* Positions and angles of both partners of a contact; 0 for a surface. */
static void pose_now(const Contact *c, double *pose) {
    const Disk *d = W.disks + c->i, *o = W.disks + MAX(c->j, 0);
    memcpy(pose, (double[]){d->x, d->y, d->turned, c->j < 0 ? 0 : o->x, c->j < 0 ? 0 : o->y, c->j < 0 ? 0 : o->turned},
           6 * sizeof(double));
}

/* Note the pose at which a place was looked up, and the number of places then. */
static void note_look(Contact *c, int places) {
    c->looked[0] = c->gap;
    c->places = places;
    pose_now(c, c->looked + 1);
}

/* Velocity along a surface of the place at which a particle touches it, m/s, and that place. */
static double moves_along(const Contact *c, double *x, double *y) {
    const Disk *a = W.disks + c->i;
    double u[3];
    *x = a->x + c->own[0] * c->ny - c->own[1] * c->nx;
    *y = a->y - c->own[0] * c->nx - c->own[1] * c->ny;
    relative(c, 0, u);
    return u[1] + c->other[1] - c->moved[1];
}

/* Acceleration with which the inside of an arc turns the path of a corner that moves along it, m/s2. */
static double bent_by(const Contact *c, const Surface *s) {
    double x, y, along = moves_along(c, &x, &y);
    if (!c->is_corner || s->shape == SEGMENT || (s->x - x) * c->nx + (s->y - y) * c->ny <= 0) return 0;
    return along * along / s->radius;
}

/* The piece that continues a surface beyond an end that the place of a contact reaches in two steps, or left so, or -1. */
static int next_piece(const Contact *c) {
    double x, y, along = moves_along(c, &x, &y);
    const Surface *s = surface_at(-1 - c->j, W.disks[c->i].t);
    for (int n = 0; n < 2 && s->shape != CIRCLE; n++)
        if (length_of(x - s->end[2 * n], y - s->end[2 * n + 1]) <= 2 * fabs(along) * W.step && mate_of(s, n) >= 0)
            return mate_of(s, n);
    return -1;
}

/* The same, also by the next piece of the surface. */
double bends_by(const Contact *c) {
    double t = W.disks[c->i].t, most = bent_by(c, surface_at(-1 - c->j, t));
    int next = next_piece(c);
    double then = next >= 0 ? bent_by(c, surface_at(next, t)) : 0;
    return MAX(most, then);
}

/* Acceleration along the normal at which a contact would open without forces, m/s2. */
double opens_by(const Contact *c) {
    const Disk *a = W.disks + c->i, *b = W.disks + MAX(c->j, 0);
    double up = square(a->spin) * c->own[1], pull;
    if (c->j >= 0) return up + square(b->spin) * c->others[1];
    Disk place = *a;
    place.x += c->own[0] * c->ny - c->own[1] * c->nx;
    place.y += -c->own[0] * c->nx - c->own[1] * c->ny;
    const Surface *s = surface_at(-1 - c->j, a->t);
    up += W.gx * c->nx + W.gy * c->ny;
    return up - bent_by(c, s) - pulled(s, &place, c->nx, c->ny, &pull);
}

/* Fill in a contact at a place of particle i, which has corners, from the present states of both. */
RARELY void describe_touch(Contact *c, int i, int j, const Touch *t) {
    const Disk *a = W.disks + i, *b = W.disks + MAX(j, 0);
    const Pair *pair = j < 0 ? surface_pair(a, -1 - j) : pair_of(a->kind, b->kind);
    double rotation[2], mass = a->inv_mass, turn = a->inv_inertia;
    *c = (Contact){.nx = t->nx, .ny = t->ny, .gap = t->gap, .most = INFINITY, .share = 1, .i = i, .j = j, .cornered = 1,
                   .owner = W.owner_count, .rest = pair->restitution, .falls = pair->falls,
                   .friction = MIN(pair->friction, GRIPS)};
    c->two = j >= 0 && b->mode == FREE;
    take_levers(c, t, rotation);
    note_look(c, t->many);
    if (c->two) {
        mass += b->inv_mass;
        turn += b->inv_inertia;
    }
    for (int n = 0; n < 2; n++) c->mass[n] = 1 / (mass + rotation[n]);
    c->mass[2] = turn > 0 ? 1 / turn : 0;
    c->pull = -square(a->spin) * c->own[0];
    if (j >= 0) {
        const double *v = motion_of(b);
        c->pull -= square(b->spin) * c->others[0];
        if (sleeps(j)) c->pull += W.gx * c->ny - W.gy * c->nx;
        c->other[0] = v[0] * c->nx + v[1] * c->ny;
        c->other[1] = v[0] * c->ny - v[1] * c->nx;
        c->arm = b->corners ? 0 : pair->rolling * b->radius;
        return;
    }
    const Surface *s = surface_at(-1 - j, a->t);
    c->is_corner = t->which < a->corners;
    c->owner = s->owner;
    c->other[1] = surface_speed(s, c->nx, c->ny, t->x, t->y, 0);
    c->pull += W.gx * c->ny - W.gy * c->nx;
    if (s->mover < 0) return;
    Disk place = *a;
    double v[3], pull;
    place.x = t->x;
    place.y = t->y;
    place.vx -= a->spin * (t->y - a->y);
    place.vy += a->spin * (t->x - a->x);
    place.radius = 0;
    carried(s, t->x - c->gap * c->nx, t->y - c->gap * c->ny, v);
    c->moved[0] = v[0] * c->nx + v[1] * c->ny;
    c->moved[1] = v[0] * c->ny - v[1] * c->nx;
    c->moved[2] = v[2];
    for (int n = 0; n < 3; n++) c->other[n] += c->moved[n];
    pulled(s, &place, c->nx, c->ny, &pull);
    c->pull -= pull;
    if (is_hung(-1 - j)) hang_on(c, W.movers + s->mover, &place);
}

/* Turn the directions of a contact with a surface, counterclockwise by the angle of this tangent. */
static void turn_contact(Contact *c, double by) {
    const Disk *d = W.disks + c->i;
    double cosine = 1 / sqrt(1 + by * by), sine = by * cosine;
    double *turned[] = {&c->nx, c->own, c->other, c->moved, c->lever};
    for (int n = 0; n < 5; n++) {
        double first = turned[n][0], second = turned[n][1];
        turned[n][0] = cosine * first - sine * second;
        turned[n][1] = cosine * second + sine * first;
    }
    for (int n = 0; n < 2; n++) {
        double light = d->inv_mass + square(c->own[n]) * d->inv_inertia;
        if (c->hung) light += square(c->lever[n]) / W.movers[c->hung - 1].inertia;
        c->mass[n] = 1 / light;
    }
}

/* Turn the normal of a contact whose corner moves along the inside of an arc, or onto or off one, as `follow` turns that
   of disks: until it is perpendicular to the mean of the corner's velocities before and after the impulse, which then does
   no work. `off` and `along` are that mean in the present directions of the contact, m/s, without hops by weight. Return
   the change of the first of them. */
static double lean(Contact *c, double off, double along) {
    double to = (c->leans * along + off) / (along - c->leans * off);
    to = MIN(MAX(to, -c->steep), c->steep);
    double by = (to - c->leans) / (1 + to * c->leans);
    turn_contact(c, by);
    c->leans = to;
    return by * along;
}

/* Do so for a new contact, if an arc turns the path of its corner; h is the length of the step. If the chords before and
   after are alike the normal is right already: then it is not turned, as hops by weight are not quite alike. */
RARELY void lean_first(Contact *c, double h) {
    double u[3], past = 2 * past_of(c);
    c->turns = bends_by(c);
    if (!(c->turns > 0)) return;
    relative(c, 0, u);
    double along = u[1] + c->other[1] - c->moved[1], hops = 0.25 * (h - past) * (W.gx * c->nx + W.gy * c->ny);
    c->steep = 0.5 * BENT * c->turns * W.step / fabs(along);
    if (W.g > 0 && next_piece(c) < 0) c->steep *= fabs(h - past) / h;
    lean(c, u[0] + 0.5 * c->need + hops, along);
}

/* The same again with the velocities that a solve has led to; return the change of their mean along the normal, m/s. */
RARELY double lean_again(Contact *c, double h) {
    double u[3], v[3], past = 2 * past_of(c), hops = 0.25 * (h - past) * (W.gx * c->nx + W.gy * c->ny);
    relative(c, 1, u);
    relative(c, 0, v);
    return lean(c, 0.5 * (u[0] + v[0]) + hops, 0.5 * (u[1] + v[1]) + c->other[1] - c->moved[1]);
}

/* Turn a halved contact back to the normal of its place: its second half has that of the end of the step, and both
   together turn the velocity without work. */
void straighten(Contact *c) {
    if (c->leans != 0) turn_contact(c, -c->leans);
    c->leans = c->steep = 0;
}

/* The place of a corner inside an arc after a time h, with the present velocities. */
static Touch arc_place(const Contact *c, double h) {
    const Disk *d = W.disks + c->i;
    const Surface *s = surface_at(-1 - c->j, d->t + h);
    double pose[2];
    turn_pose(c->i, d->spin * h, pose);
    Touch t = {.x = d->x + (d->vx + 0.5 * W.gx * h) * h + pose[0] * c->spot[0] - pose[1] * c->spot[1],
               .y = d->y + (d->vy + 0.5 * W.gy * h) * h + pose[1] * c->spot[0] + pose[0] * c->spot[1]};
    double x = s->x - t.x, y = s->y - t.y, away = length_of(x, y);
    t.nx = x / away;
    t.ny = y / away;
    t.gap = s->radius - away;
    return t;
}

double bent_gap(const Contact *c, double h) { return arc_place(c, h).gap; }

/* The contact of the step before that was at about the same place of particle i. */
RARELY const Contact *place_before(const Contact *c) {
    const Contact *found = 0;
    double least = INFINITY;
    for (int k = W.disks[c->i].before; k >= 0; k = W.earlier[k].next) {
        const Contact *o = W.earlier + k;
        if (o->j != c->j) continue;
        double off = length_of(o->spot[0] - c->spot[0], o->spot[1] - c->spot[1]);
        if (off >= least) continue;
        least = off;
        found = o;
    }
    return least <= 0.5 * W.disks[c->i].inner ? found : 0;
}

/* Change of the gap of a contact by the motion of both since the place was looked up, m; NaN if they moved by more than
   STILL of a radius. */
static double gap_change_since(const Contact *c) {
    double pose[6], size = W.disks[c->i].radius, turns;
    pose_now(c, pose);
    for (int n = 0; n < 6; n++) pose[n] -= c->looked[n + 1];
    if (c->j >= 0) size = MAX(size, W.disks[c->j].radius);
    turns = size * (fabs(pose[2]) + fabs(pose[5]));
    if (!(fabs(pose[0] - pose[3]) + fabs(pose[1] - pose[4]) + turns <= STILL * inner_of(c->i, c->j))) return NAN;
    return (pose[0] - pose[3]) * c->nx + (pose[1] - pose[4]) * c->ny + c->own[0] * pose[2] + c->others[0] * pose[5];
}

/* If two of a crowd have hardly moved since their places were looked up, list their contacts of the step before and by how
   much the gaps have changed; return 0 if the places have to be looked up. */
RARELY int list_still(int i, int j, double h, const Contact **list, double *changes) {
    const Disk *a = W.disks + i, *b = W.disks + MAX(j, 0);
    const Surface *s = W.surfaces + (j < 0 ? -1 - j : 0);
    int count = 0;
    int moves = j < 0 ? s->mover >= 0 || s->shape != SEGMENT : b->mode != FREE && !sleeps(j);
    if (moves || are_few(W.earlier_count)) return 0;
    double turns = fabs(a->spin) * a->radius + (j < 0 ? 0 : fabs(b->spin) * b->radius);
    if (turns * h > STILL * inner_of(i, j)) return 0;
    for (int k = a->before; k >= 0 && count < MOST_TOUCHES; k = W.earlier[k].next)
        if (W.earlier[k].j == j) list[count++] = W.earlier + k;
    if (!count || list[0]->places != count || list[0]->two != (j >= 0 && b->mode == FREE)) return 0;
    for (int n = 0; n < count; n++)
        if (list[n]->turns > 0 || isnan(changes[n] = gap_change_since(list[n]))) return 0;
    return count;
}

/* Fill in a contact from that of the step before, whose gap has changed by `change` since its place was looked up. */
RARELY void go_on_with(Contact *c, const Contact *last, double change, double h) {
    double u[3];
    *c = *last;
    c->gap = c->looked[0] + change;
    c->most = INFINITY;
    c->share = 1;
    c->gives = c->parts = c->clings = 0;
    c->leaves = 0;
    if (c->j >= 0) {
        const double *v = motion_of(W.disks + c->j);
        c->other[0] = v[0] * c->nx + v[1] * c->ny;
        c->other[1] = v[0] * c->ny - v[1] * c->nx;
    }
    relative(c, 0, u);
    c->free_gap = c->gap + (u[0] + (c->j < 0 || sleeps(c->j) ? 0.5 * h * (W.gx * c->nx + W.gy * c->ny) : 0)) * h;
}

/* ------------------------------------------------------------------------------------------ impacts */

/* Places of pairs within an impact and those that follow from it. Nothing moves at that instant, and a pair may be struck
   several times. */
typedef struct { Touch places[MOST_TOUCHES]; double t, within; int i, j, changes, count; } Known;
static Known known[KNOWN];
static int known_count;

void forget_places(void) { known_count = 0; }

/* `list_touches` at an instant, which for pairs is remembered. */
static const Touch *places_at(int i, int j, double t, double within, int *count) {
    int changes = W.disks[i].changes + (j < 0 ? 0 : W.disks[j].changes);
    for (Known *k = known; k < known + MIN(known_count, KNOWN); k++) {
        if (k->i != i || k->j != j || k->t != t || k->within != within || k->changes != changes) continue;
        *count = k->count;
        return k->places;
    }
    Known *k = known + known_count++ % KNOWN;
    k->count = *count = list_touches(i, j, t, within, t, k->places);
    k->t = t;
    k->within = within;
    k->i = i;
    k->j = j;
    k->changes = changes;
    return k->places;
}

/* Add the places at which two touch now to a list of contacts: where a gap is closed, or where a contact lasts. Return how
   many there are then. */
static int add_struck(int i, int j, double t, Contact *list, int count) {
    double least = inner_of(i, j);
    int lasts = 0, found = 0;
    for (int link = W.disks[i].links; link >= 0; link = W.links[link]) {
        const Contact *c = W.contacts + link / 2;
        lasts |= c->i == i && c->j == j && c->impulse[0] > 0;
    }
    double within = (lasts ? TOUCH : TOUCHING) * least, span = 2 * SOON * W.step, most = 0;
    /* With joints, an impact just after the beginning of a step is resolved at the beginning. */
    if (W.joint_count && t <= W.t) most = fastest_of(i, j, t, span);
    if (most < INFINITY) within = MAX(within, most * span);
    const Touch *places = places_at(i, j, t, within, &found);
    for (int n = 0; n < found && count < MOST_TOUCHES; n++) {
        describe_touch(list + count, i, j, places + n);
        list[count++].drift = 0;
    }
    return count;
}

/* List these contacts; those with a surface on all pieces that continue each other, as far as the particle reaches. */
RARELY int list_struck(int i, int j, double t, Contact *list) {
    int count = add_struck(i, j, t, list, 0), struck = -1 - j, is_closed = j >= 0;
    for (int n = 0; n < 2 && !is_closed; n++) {
        int end = n, last = struck, k = -1;
        while (end >= 0 && (k = mate_of(W.surfaces + last, end)) >= 0 && k != struck) {
            const Surface *s = W.surfaces + k;
            if (!is_near(s, W.disks + i)) break;
            count = add_struck(i, -1 - k, t, list, count);
            end = mate_of(s, 0) == last ? 1 : mate_of(s, 1) == last ? 0 : -1;
            last = k;
        }
        is_closed = k == struck;
    }
    return count;
}

/* Bring a contact inside an arc to where its corner is at t within the step, where its path leaves the chord. */
static void bring_along(Contact *c, double t) {
    double u[3];
    if (c->is_corner && W.surfaces[-1 - c->j].shape != SEGMENT) {
        Contact last = *c;
        Touch place = arc_place(c, 0);
        describe_touch(c, last.i, last.j, &place);
        memcpy(c->impulse, last.impulse, sizeof c->impulse);
        c->turns = last.turns;
        c->steep = 0.5 * BENT * sqrt(c->turns / W.surfaces[-1 - c->j].radius) * W.step;
    }
    relative(c, 0, u);
    double hop = (t - W.t - 0.5 * W.length) * (W.gx * c->nx + W.gy * c->ny);
    lean(c, 0.5 * (u[0] - hop), u[1] + c->other[1] - c->moved[1]);
}

/* Bound on the change of the velocity of a particle's corners by the solve of the step, m/s. */
static double change_of(const Disk *d) {
    return fabs(d->vx - d->ux) + fabs(d->vy - d->uy) + d->radius * fabs(d->spin - d->uspin);
}

static int is_free(const Contact *c) { return W.disks[c->i].mode == FREE && (c->j < 0 || W.disks[c->j].mode == FREE); }

/* Let the track of a particle go on from the middle of its last impulses to here, without a knot at their end. */
static void go_smoothly(int i) {
    W.tracks[i].lasted = 0;
    was_moved(i);
}

/* Before an impact, bring the contacts of an island from their hops to the smooth path: else the velocity of the hop,
   which is of first order in the step, would enter the impact. Impulses of the step that are not due yet are taken back,
   those that are due are given: a contact that is new since an impact has pressed only since then. This is done once a step,
   as the step ends soon after. Not in a crowd, which is not solved again at each impact; not for contacts with a moving
   surface, which has to press as hard as it moves; not where the solve has changed a velocity by more than hops do, as a blow
   does; and not with joints, whose pull is constant over the step. */
static void end_hops(int i, double t) {
    const Contact *first = 0, *end = W.contacts + W.contact_count;
    int count = 0, many = 0, stamp = W.step_count + 1;
    double fresh = 2 * MAX(W.t - W.disks[i].since, 0), past = W.length_before;
    if (W.tracks[i].lasted <= 1) past = MIN(fresh, past);
    for (int link = W.disks[i].links; link >= 0 && !first; link = W.links[link]) first = W.contacts + link / 2;
    if (!first || t <= W.t || !are_few(W.contact_count) || W.disks[i].smooth == stamp) return;
    int island = first->island, stays = 0;
    while (first > W.contacts && first[-1].island == island) first--;
    for (const Contact *c = first; c < end && c->island == island; c++) {
        Disk *a = W.disks + c->i, *b = W.disks + MAX(c->j, 0);
        double hop = W.soft + 2 * W.step * (whirl_of(a) + (c->j < 0 ? 0 : whirl_of(b)));
        stays |= change_of(a) > hop || (c->two && change_of(b) > hop);
        stays |= (c->j < 0 && stirs(W.surfaces + (-1 - c->j))) || is_tied(c->i) || is_tied(c->j);
        a->smooth = stamp;
        if (c->two) b->smooth = stamp;
        count++;
    }
    if (stays) return;
    for (const Contact *c = first; c < first + count; c++) {
        Disk *a = W.disks + c->i, *b = W.disks + MAX(c->j, 0);
        if (!is_free(c)) continue;
        double u[3], v[3], given[3], change[3];
        Contact last = *c;
        advance(a, t);
        if (c->two) advance(b, t);
        if (c->impulse[0] > 0 && c->cornered && c->turns > 0) bring_along(&last, t);
        if (c->impulse[0] == 0) continue;
        for (int n = 0; n < 3; n++)
            last.impulse[n] = change[n] = -c->impulse[n] * (W.length - 2 * (t - W.t)) / (past + W.length);
        relative(&last, 0, u);
        push(&last, change);
        relative(&last, 0, v);
        share_out(&last, u, v, 0, last.entries, given);
        if (given[0] != 0) book(a->entries, 0, W.ride_owner, given);
        bear_contact(&last, 1, t, t);
        keep_impulse(&last, 1, t, t);
        W.earlier[many++] = last;
    }
    /* As in a step, only the sum of the losses has a meaning. What is taken back was booked ahead, so in these shares. */
    double sum = 0, ahead = 0;
    for (const Contact *c = W.earlier; c < W.earlier + many; c++) {
        sum += c->entries[1] + c->entries[2];
        ahead += c->later[1] + c->later[2];
    }
    int returns = sum < 0 && ahead > 0;
    if (!returns) pool(W.earlier, many, 0);
    for (Contact *c = W.earlier; c < W.earlier + many && returns; c++)
        for (int k = 1; k < 3; k++) c->entries[k] = sum * c->later[k] / ahead;
    for (const Contact *c = W.earlier; c < W.earlier + many; c++)
        book(W.disks[c->i].entries, c->two ? W.disks[c->j].entries : 0, c->owner, c->entries);
    give_back(W.earlier, many);
    for (const Contact *c = first; c < first + count; c++) {
        if (!is_free(c)) continue;
        go_smoothly(c->i);
        if (c->two) go_smoothly(c->j);
    }
    W.step_end = MIN(W.step_end, MAX(t, W.t + SHORTEST * W.step));
}

/* Whether a released particle touches a surface with hardly any normal velocity. */
RARELY int lies_flat(int i, int k) {
    const Disk *d = W.disks + i;
    Touch places[MOST_TOUCHES];
    int found = list_touches(i, -1 - k, d->t, TOUCHING * d->inner, d->t, places), lies = found > 0;
    for (int n = 0; n < found; n++) {
        Contact c;
        double u[3];
        describe_touch(&c, i, -1 - k, places + n);
        relative(&c, 0, u);
        lies &= fabs(u[0]) <= -opens_by(&c) * W.dt;
    }
    return lies;
}

/* Resolve the impact of particle i, which has corners, with j, at all places at which they touch. */
RARELY void strike_corners(int i, int j, double t) {
    Disk *a = W.disks + i, *b = W.disks + MAX(j, 0);
    Contact list[MOST_TOUCHES], *main = list;
    double u[MOST_TOUCHES][3], back[MOST_TOUCHES], fastest = 0, J[2] = {0, 0};
    int impacts = MAX(a->impacts, j >= 0 ? b->impacts : 0), rests = 0;
    if (j < 0 && is_hung(-1 - j)) strike_hinge(W.surfaces[-1 - j].mover, t);
    end_hops(i, t);
    if (j >= 0 && b->mode == FREE) end_hops(j, t);
    int answers = is_tied(i) || is_tied(j);
    if (answers) strike_joints(i, j);
    int count = list_struck(i, j, t, list), two = j >= 0 && b->mode == FREE;
    for (int n = 0; n < count; n++) {
        const Contact *c = list + n;
        relative(c, 0, u[n]);
        fastest = MAX(fastest, -u[n][0]);
        double rest = c->rest, approach = MAX(-u[n][0], 0), drawn = pressed_by_joints(c), press = drawn - opens_by(c);
        if (c->falls * approach > 1) rest /= sqrt(sqrt(c->falls * approach));
        back[n] = rest * approach;
        int calm = j >= 0 ? approach < W.soft && (a->supports || b->supports || !two) : back[n] <= press * W.step;
        calm |= drawn > 0 && back[n] <= drawn * W.step;
        int ends = rest < 1 && (impacts >= JAM || (impacts >= FEW && approach < SLOW * W.g * W.dt));
        if (approach > 0 && (calm || ends)) back[n] = 0;
        /* A drive that strikes it time and again within a step, though hardly anything bounces, slips. */
        int driven = j < 0 && c->other[1] != c->moved[1];
        if (driven && rest < 1 && impacts >= FEW)
            list[n].friction = MIN(c->friction, ROUGH) / (1 << MIN(impacts / FEW, 30));
        rests |= approach > 0 && back[n] == 0;
    }
    /* An impact that was foreseen, but does not happen, is counted, so that it is left to the next step in the end. */
    was_moved(i);
    if (!(fastest > ROUNDS * (fabs(a->vx) + fabs(a->vy)))) return;
    if (two) was_moved(j);
    double before[3] = {a->vx, a->vy, a->spin}, lost, sums[3] = {0}, losses[3] = {0};
    lost = find_blow(list, count, fastest, answers, u, back);
    for (int n = 0; n < count; n++) {
        Contact *c = list + n;
        double v[3], given[3];
        relative(c, 0, v);
        share_out(c, u[n], v, 0, c->entries, given);
        for (int k = 1; k < 3; k++) {
            sums[k] += c->entries[k];
            losses[k] += MAX(c->entries[k], 0);
        }
        if (given[0] != 0) book(a->entries, 0, W.ride_owner, given);
    }
    /* Only the sums have a meaning where one impulse changes the velocity at another place: corners that stick share
       friction in any way, also with opposite signs. If bounce or friction seems to gain, the other loses it all. */
    double all = MAX(sums[1], 0) + MAX(sums[2], 0), by = all > 0 ? MAX(lost, 0) / all : 0;
    for (int n = 0; n < count; n++) {
        Contact *c = list + n;
        for (int k = 1; k < 3; k++)
            c->entries[k] = losses[k] > 0 ? by * MAX(sums[k], 0) / losses[k] * MAX(c->entries[k], 0) : 0;
        book(a->entries, two ? b->entries : 0, c->owner, c->entries);
        if (j < 0) W.drives[c->owner] += driven(c, 0);
        if (j < 0 && c->impulse[0] > 0) hold(a, -1 - c->j);
        bear_contact(c, 1, t, t);
        if (c->impulse[0] > main->impulse[0]) main = c;
    }
    if (main->hung) leave_struck(main->hung - 1);
    for (int n = 0; n < count; n++) {
        const Contact *c = list + n;
        double x = c->impulse[0] * c->nx + c->impulse[1] * c->ny, y = c->impulse[0] * c->ny - c->impulse[1] * c->nx;
        J[0] += x * main->nx + y * main->ny;
        J[1] += x * main->ny - y * main->nx;
    }
    if (answers) end_blow();
    a->since = t;
    if (two) b->since = t;
    W.impact_count++;
    int landing = j < 0 && main->owner == W.landing && !a->landed;
    int told = landing || fastest > W.soft || W.g == 0 || (j < 0 && a->on != main->owner);
    if (told)
        write_event(j >= 0 ? COLLISION : landing ? LANDING : IMPACT, i, MAX(j, -1), main->owner, t, &a->x, before,
                    &a->vx, J[0], J[1]);
    for (int n = 0; n < count; n++)
        if (!told || count > 1) keep_impulse(list + n, 1, t, t);
        else keep_carried(list + n, 1, t, t);
    if (landing) a->landed = 1;
    if (j < 0) {
        a->on = main->owner;
        a->slips = 1;
    }
    /* A place that comes to rest is a contact from the next step on, which begins soon; in a crowd it may hop until then. */
    if (rests && are_few(W.contact_count)) W.step_end = MIN(W.step_end, MAX(t, W.t + SHORTEST * W.step));
}
