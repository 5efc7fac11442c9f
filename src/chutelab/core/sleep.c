/* Sleep: particles at rest, or at rest on a belt, are not solved.

   A particle falls asleep when it and all particles that it lies on have been at rest for long enough; so an island may
   sleep in part, from its supports up. For the others a sleeper is as firm as a surface. It wakes, with all sleepers that
   lie on it, when it is struck, when something that moves touches it, or when the force of a contact with an awake
   particle has changed by more than solves change it by themselves. `World.frozen` lists the contacts of sleepers with
   their forces. */

#include "core.h"

/* Change of the force on a sleeper that wakes it: this share of its weight, and of the force when it fell asleep. */
#define MORE 0.5
#define BY 0.2
/* Times that for particles with corners: each solve distributes a load over their many places in another way. */
#define CORNERS 4
/* Share of that change that may last when the awake particle is about to fall asleep on it, if the sleeper has slept for
   LONG (s on Earth). A pile can carry a load in many ways; if each change woke deeper sleepers, that would not end. */
#define LASTING 0.1
#define LONG 0.5
/* s on Earth; time of the running means of forces, which change from step to step. */
#define LATELY 0.01
/* Component of the normal against gravity below which neither particle lies on the other: they lean on each other. */
#define LEANS 0.2
/* s on Earth; time for which a particle that was woken has to be at rest, if it has hardly moved since. */
#define AGAIN 0.01

/* The other particle, or surface as in `Contact.j`, of an end of a row of `frozen`, and its `rise` above the first. */
static int across(int end, double *above) {
    const Frozen *f = W.frozen + end / 2;
    *above = end % 2 ? f->rise : -f->rise;
    return end % 2 ? f->i : f->j;
}

/* The place of a contact, from the centre of its i, m. */
static void spot_of(const Contact *c, double *spot) {
    const double own[2] = {c->cornered ? c->own[0] : 0, c->cornered ? c->own[1] : W.disks[c->i].radius};
    spot[0] = own[0] * c->ny - own[1] * c->nx;
    spot[1] = -own[0] * c->nx - own[1] * c->ny;
}

/* The number, from 1 on, of the row of `frozen` for a contact: the same pair at nearly the same place. Else 0. */
int find_frozen(const Contact *c) {
    double above, spot[2], least = c->cornered ? 0.5 * inner_of(c->i, c->j) : INFINITY;
    int found = 0;
    if (W.disks[c->i].frozen < 0) return 0;
    spot_of(c, spot);
    for (int end = W.disks[c->i].frozen; end >= 0; end = W.frozen_links[end]) {
        const Frozen *f = W.frozen + end / 2;
        if (across(end, &above) != c->j) continue;
        double x = f->spot[0] - spot[0], y = f->spot[1] - spot[1];
        if (f->i != c->i) {
            x += W.disks[f->i].x - W.disks[c->i].x;
            y += W.disks[f->i].y - W.disks[c->i].y;
        }
        double off = sqrt(x * x + y * y);
        if (off >= least) continue;
        least = off;
        found = 1 + end / 2;
    }
    return found;
}

/* Start a contact with the impulses that it had when it was frozen, for a span of time. */
void start_from_frozen(Contact *c, double span) {
    const Frozen *f = W.frozen + c->frozen - 1;
    for (int n = 0; n < 3; n++) c->impulse[n] = span * f->pressed[n];
    c->impulse[2] *= f->i == c->i ? 1 : -1;
}

/* The sleeper of a pair of which the other one is awake; else -1. */
static int sleeper_of(const Frozen *f) {
    if (f->j < 0 || sleeps(f->i) == sleeps(f->j)) return -1;
    return sleeps(f->i) ? f->i : f->j;
}

/* List the rows between sleepers and what is awake, if particles have fallen asleep or woken since: they are few on a belt
   on which thousands ride. */
static void list_borders(void) {
    if (W.border_count >= 0) return;
    W.border_count = 0;
    for (int n = 0; n < W.frozen_count; n++)
        if (sleeper_of(W.frozen + n) >= 0) W.borders[W.border_count++] = n;
}

static void link_end(int end) {
    int i = end % 2 ? W.frozen[end / 2].j : W.frozen[end / 2].i;
    if (i < 0) return;
    W.frozen_links[end] = W.disks[i].frozen;
    W.disks[i].frozen = end;
}

/* Report the loads by the contacts of a sleeper up to t, when it wakes. */
static void thaw(int i, double t) {
    double above;
    for (int end = W.disks[i].frozen; end >= 0; end = W.frozen_links[end]) {
        Frozen *f = W.frozen + end / 2;
        int other = across(end, &above);
        if (f->from == INFINITY) {
            if (other >= 0) tell_frozen(f, i, (double[]){0, 0}, t);
            continue;
        }
        melt(f, t);
        f->told = t;
        for (int n = 0; n < 2 && f->first == i; n++) f->force[n] += f->more[n];
        f->first = other;
    }
}

/* Wake a disk at t, and all sleepers that lie on it. They go on as if they had been awake: at the beginning of a step they
   come down from the hop of the step before; within a step they hop for the rest of it, with half of the impulse by which
   gravity acts until its end. */
void wake(int i, double t) {
    int last = i, within = W.phase == WITHIN;
    double hop = within ? -0.5 * (W.step_end - t) : 0.5 * W.length, x = hop * W.gx, y = hop * W.gy;
    W.disks[i].rouses = -1;
    W.disks[i].mode = FREE;
    W.roused = 1;
    W.border_count = -1;
    for (int n = i; n >= 0; n = W.disks[n].rouses) {
        Disk *d = W.disks + n;
        d->supports = 0;
        for (int end = d->frozen; end >= 0; end = W.frozen_links[end]) {
            double above;
            int k = across(end, &above);
            d->supports++;
            if (above < 0 || !sleeps(k)) continue;
            W.disks[k].mode = FREE;
            W.disks[k].rouses = -1;
            last = W.disks[last].rouses = k;
        }
        /* The place at which it lies, without the hop of the step so far. */
        d->x += (d->ux - d->vx - 0.5 * W.gx * (d->t - W.t)) * (d->t - W.t);
        d->y += (d->uy - d->vy - 0.5 * W.gy * (d->t - W.t)) * (d->t - W.t);
        d->x += d->ux * (t - d->t);
        d->y += d->uy * (t - d->t);
        d->t = t;
        thaw(n, t - hop);
        d->vx = d->ux;
        d->vy = d->uy;
        d->spin = 0;
        d->calm = 0;
        d->rest = 0;
        d->waits = AGAIN / W.pace;
        d->changes++;
        if (within) {
            was_moved(n);
            W.woken = 1;
        } else knot_before(n, t, d->vx, d->vy, d->spin);
        double entries[3] = {0, -d->mass * (x * (d->vx + 0.5 * x) + y * (d->vy + 0.5 * y)), 0};
        book(d->entries, 0, W.owner_count, entries);
        d->vx += x;
        d->vy += y;
        if (!within) last_on(n);
    }
}

/* The sleeper of a pair if the force of the awake partner on it has changed too much since it fell asleep; else -1. */
static int roused_by(const Frozen *f) {
    int i = sleeper_of(f), awake = i == f->i ? f->j : f->i;
    if (i < 0) return -1;
    /* The sum over all places at which the two touch. */
    double above, x = 0, y = 0, bore[2] = {0, 0};
    for (int end = W.disks[i].frozen; end >= 0; end = W.frozen_links[end]) {
        const Frozen *o = W.frozen + end / 2;
        if (across(end, &above) != awake) continue;
        double sign = o->i == f->i ? 1 : -1;
        x += sign * (o->now[0] - o->bore[0]);
        y += sign * (o->now[1] - o->bore[1]);
        for (int n = 0; n < 2; n++) bore[n] += sign * o->bore[n];
    }
    double most = MORE * W.disks[i].mass * W.g + BY * sqrt(square(bore[0]) + square(bore[1]));
    if (is_cornered(i, awake)) most *= CORNERS;
    if (W.disks[awake].rest >= W.disks[awake].waits && W.t - W.disks[i].slept > LONG / W.pace) most *= LASTING;
    return x * x + y * y > most * most ? i : -1;
}

/* Wake all such sleepers, and those that a hand pushes. */
void rouse(void) {
    for (EACH_LIVE(i))
        if (sleeps(i) && W.disks[i].stirred) wake(i, W.t);
    list_borders();
    for (int n = 0, count = W.border_count; n < count; n++) {
        int i = roused_by(W.frozen + W.borders[n]);
        if (i >= 0) wake(i, W.t);
    }
}

/* Whether a surface with the velocity (x, y) moves like the earlier ones of a group, whose velocity is `u`. The first one,
   while `owner` is -1, sets it. `owner` becomes `next`. */
static int moves_alike(double *u, double x, double y, int *owner, int next) {
    if (*owner >= 0 && (fabs(u[0] - x) > SAME_SPEED * W.pace || fabs(u[1] - y) > SAME_SPEED * W.pace)) return 0;
    u[0] = x;
    u[1] = y;
    *owner = next;
    return 1;
}

/* Whether a contact with a surface allows a group to sleep. `u` is the common velocity of the surfaces that it lies on, and
   is set by the first one. */
static int joins(const Contact *c, double *u, int *owner) {
    const Surface *s = W.surfaces + (-1 - c->j);
    double belt = c->other[1], x = belt * c->ny, y = -belt * c->nx;
    if (stirs(s) || (s->speed != 0 && s->shape != SEGMENT)) return 0;
    /* A group on a belt that will throw it off has not settled. */
    if (s->speed != 0 && W.until == UNTIL_SETTLED && c->owner != W.landing) return 0;
    if (fabs(W.gx * x + W.gy * y) > 1e-12 * W.g * fabs(belt)) return 0;
    return moves_alike(u, x, y, owner, c->owner);
}

/* The impulse of a contact on its i, N s. */
static void given_by(const Contact *c, double *J) {
    J[0] = pressed(c) * c->nx + c->impulse[1] * c->ny;
    J[1] = pressed(c) * c->ny - c->impulse[1] * c->nx;
}

static int holds(const Contact *c) { return c->impulse[0] != 0 || c->clings > 0; }

/* Whether two sleep and wake only together: with cohesion, what has joints, a disk and a particle with corners, and
   particles with corners that are too few for a crowd. */
static int is_pair(const Contact *c) {
    return c->clings > 0 || is_tied(c->i) || is_tied(c->j)
        || (c->cornered && c->j >= 0 && (!has_corners(W.disks + c->j) || are_few(W.contact_count)));
}

/* See `Frozen.rise`. */
static double rise_of(const Contact *c) {
    double rise = c->nx * W.up[0] + c->ny * W.up[1];
    return is_pair(c) || fabs(rise) < LEANS ? 0 : rise;
}

static Frozen *freeze(const Contact *c) {
    W.border_count = -1;
    Frozen *f = W.frozen + W.frozen_count++;
    *f = (Frozen){.from = INFINITY, .told = W.t + 0.5 * W.length, .rise = rise_of(c), .i = c->i, .j = c->j, .first = c->i};
    spot_of(c, f->spot);
    link_end(2 * W.frozen_count - 2);
    link_end(2 * W.frozen_count - 1);
    return f;
}

/* Note the forces of awake particles on sleepers in this step. */
void note_frozen(void) {
    double middle = W.t + 0.5 * W.length, of_now = MIN(W.length * W.pace / LATELY, 1);
    list_borders();
    for (int n = 0; n < 2 * W.border_count; n++) W.frozen[W.borders[n / 2]].felt[n % 2] = 0;
    for (int n = 0; n < W.contact_count; n++) {
        Contact *c = W.contacts + n;
        double J[2], past = W.tracks[c->i].lasted ? 0.5 * W.length_before : 0;
        given_by(c, J);
        for (int k = 0; k < 2; k++) {
            double force = J[k] / (past + 0.5 * W.length);
            c->mean[k] = isnan(c->mean[k]) ? force : c->mean[k] + of_now * (force - c->mean[k]);
        }
        if (!sleeps(c->j) || !holds(c)) continue;
        if (!c->frozen && W.frozen_count < 2 * W.contact_room) {
            freeze(c);
            c->frozen = W.frozen_count;
        }
        Frozen *f = W.frozen + c->frozen - 1;
        double sign = f->i == c->i ? 1 : -1;
        if (!c->frozen) continue;
        for (int k = 0; k < 2; k++) f->felt[k] = sign * J[k] / (past + 0.5 * W.length);
        tell_frozen(f, c->j, (double[]){sign * J[0], sign * J[1]}, middle);
    }
    list_borders();
    for (int k = 0; k < W.border_count; k++) {
        Frozen *f = W.frozen + W.borders[k];
        int i = sleeper_of(f);
        for (int n = 0; n < 2; n++) f->now[n] += of_now * (f->felt[n] - f->now[n]);
        if (f->felt[0] != 0 || f->felt[1] != 0) continue;
        tell_frozen(f, i, (double[]){0, 0}, middle);
        /* It touched a sleeper that it did not support, and no longer does. */
        W.roused |= f->force[0] == 0 && f->force[1] == 0;
    }
}

/* Take back a share of the load by a contact on a sleeper: the second half of the step. */
void untell_frozen(const Contact *c, double share) {
    int found = find_frozen(c);
    Frozen *f = W.frozen + found - 1;
    double sign = f->i == c->i ? share : -share, J[2];
    if (!found) return;
    given_by(c, J);
    tell_frozen(f, c->j, (double[]){sign * J[0], sign * J[1]}, W.t);
}

/* Remove the rows of `frozen` whose particles are awake, or which bear nothing. */
static void forget_frozen(void) {
    int left = 0;
    for (int n = 0; n < W.frozen_count; n++) {
        const Frozen f = W.frozen[n];
        int idle = f.felt[0] == 0 && f.felt[1] == 0 && f.force[0] == 0 && f.force[1] == 0;
        if (sleeper_of(&f) < 0 ? sleeps(f.i) : !idle) W.frozen[left++] = f;
    }
    for (int n = 0; n < W.contact_count; n++) W.contacts[n].frozen = 0;
    for (int i = W.low; i < W.high; i++) W.disks[i].frozen = -1;
    W.frozen_count = left;
    W.border_count = -1;
    W.roused = 0;
    for (int end = 0; end < 2 * left; end++) link_end(end);
}

/* Mark the disks that have to stay awake: those that have not been at rest for long enough, and all that lie on them. */
static void keep_up(int *up) {
    double u[2];
    for (EACH_LIVE(i)) {
        const Disk *d = W.disks + i;
        up[i] = d->mode == RIDING || (d->mode == FREE && (d->rest < d->waits || !d->supports));
    }
    for (int n = 0; n < W.contact_count; n++) {
        const Contact *c = W.contacts + n;
        int owner = -1;
        if (holds(c) && c->j < 0 && !joins(c, u, &owner)) up[c->i] = 1;
    }
    /* Disks that rattle in place would wake their neighbours; these wait until such a disk touches something. */
    for (int n = 0; n < 2 * W.near_count; n++) {
        const Disk *d = W.disks + W.near[n];
        if (d->mode == FREE && !d->supports && d->rest >= d->waits) up[W.near[n ^ 1]] = 1;
    }
    list_borders();
    for (int n = 0; n < W.border_count; n++) {
        const Frozen *f = W.frozen + W.borders[n];
        int i = roused_by(f);
        if (i >= 0) up[i == f->i ? f->j : f->i] = 1;
    }
    for (int again = 1; again;) {
        again = 0;
        for (const Contact *c = W.contacts; c < W.contacts + W.contact_count; c++) {
            if (c->j < 0 || up[c->i] == up[c->j] || !(holds(c) || is_pair(c))) continue;
            double rise = rise_of(c);
            int i = up[c->j] ? c->i : c->j;
            if (sleeps(i) || (up[c->j] ? rise < 0 : rise > 0)) continue;
            up[i] = again = 1;
        }
    }
}

/* Let disks fall asleep that have been at rest for long enough, as all have that they lie on. This follows the solve of a
   step. */
void fall_asleep(void) {
    int ready = 0, *up = W.found, *parent = W.queue;
    if (W.roused) forget_frozen();
    for (EACH_LIVE(i)) ready |= W.disks[i].mode == FREE && W.disks[i].rest >= W.disks[i].waits;
    if (!ready || !W.sleeps || !W.contact_count || W.frozen_count + W.contact_count > 2 * W.contact_room) return;
    keep_up(up);
    /* Groups of those in contact fall asleep together. At the root of each, `moved` is the owner of its surfaces or -1, and
       `tugged` holds their velocity, as nothing needs it between two steps. */
    for (EACH_LIVE(i)) {
        W.moved[i] = -1;
        parent[i] = i;
    }
    for (const Contact *c = W.contacts; c < W.contacts + W.contact_count; c++)
        if (c->two && !up[c->i] && !up[c->j] && (holds(c) || is_pair(c))) parent[island_of(c->i)] = island_of(c->j);
    for (const Contact *c = W.contacts; c < W.contacts + W.contact_count; c++) {
        if (c->two || up[c->i] || !holds(c)) continue;
        int k = island_of(c->i);
        double *u = W.disks[k].tugged;
        const Disk *b = W.disks + MAX(c->j, 0);
        if (c->j < 0 ? !joins(c, u, W.moved + k) : !moves_alike(u, b->ux, b->uy, W.moved + k, b->bearer)) up[k] |= 2;
    }
    ready = 0;
    for (EACH_LIVE(i)) {
        int k = island_of(i);
        if (W.disks[i].mode != FREE || W.moved[k] < 0 || up[k] & 2) up[i] |= 1;
        ready |= !(up[i] & 1);
    }
    if (!ready) return;
    for (EACH_LIVE(i)) {
        Disk *d = W.disks + i;
        int k = island_of(i);
        if (up[i]) continue;
        const double *u = W.disks[k].tugged;
        /* Its impulses in this step stay booked; the hop that would follow is left out. */
        double x = u[0] - d->vx, y = u[1] - d->vy;
        double entries[3] = {d->mass * (x * u[0] + y * u[1]),
                             0.5 * d->mass * (x * x + y * y) + 0.5 * d->inertia * d->spin * d->spin, 0};
        unload(i, up);
        W.tracks[i].lasted = 0;
        book(d->entries, 0, W.moved[k], entries);
        bear_disk(d, W.moved[k], d->mass * (u[0] - d->ux - W.before * (d->vx - d->ux)),
                  d->mass * (u[1] - d->uy - W.before * (d->vy - d->uy)), d->t, d->t);
        d->slept = d->balanced = d->t;
        d->ux = d->vx = u[0];
        d->uy = d->vy = u[1];
        d->spin = d->uspin = 0;
        d->bearer = W.moved[k];
        d->changes++;
        knot_now(i);
    }
    for (EACH_LIVE(i)) {
        Disk *d = W.disks + i;
        if (up[i]) continue;
        d->mode = ASLEEP;
        W.border_count = -1;
        d->vx -= 0.5 * W.gx * W.step;
        d->vy -= 0.5 * W.gy * W.step;
    }
    double span = 0.5 * (W.length_before + W.length);
    for (const Contact *c = W.contacts; c < W.contacts + W.contact_count; c++) {
        int new = !up[c->i] || (c->two && !up[c->j]), both = sleeps(c->i) && (c->j < 0 || sleeps(c->j)), found;
        double J[2];
        if (!new || !holds(c)) continue;
        found = find_frozen(c);
        Frozen *f = found ? W.frozen + found - 1 : freeze(c);
        double sign = f->i == c->i ? 1 : -1;
        for (int n = 0; n < 3; n++) f->pressed[n] = c->impulse[n] / span;
        f->pressed[2] *= f->i == c->i ? 1 : -1;
        given_by(c, J);
        branch_of(c, f->branch);
        if (c->j < 0 || c->two) {
            for (int n = 0; n < 2; n++) {
                f->bore[n] = f->now[n] = c->mean[n];
                f->force[n] = J[n] / span;
            }
        } else f->first = c->j;
        for (int n = 0; n < 2; n++) {
            f->branch[n] *= sign;
            f->more[n] = sign * J[n] / span - f->force[n];
        }
        if (both) f->from = W.t;
    }
    /* A disk that lay on a sleeper has fallen asleep without touching it: the force on the sleeper is gone. */
    for (Frozen *f = W.frozen; f < W.frozen + W.frozen_count; f++) {
        if (f->from < INFINITY || !sleeps(f->i) || !sleeps(f->j)) continue;
        f->first = W.disks[f->i].slept < W.disks[f->j].slept ? f->i : f->j;
        tell_frozen(f, f->first, (double[]){0, 0}, W.t);
        for (int n = 0; n < 2; n++) f->more[n] = -f->force[n];
        f->from = W.t;
    }
    if (B.every > 0 || B.each > 0) balance_sleepers();
}
