/* What lies still, or rides a belt all alike, falls asleep together with all that it lies on: it is not solved until
   something changes what it bears by more than solves do by themselves. */

#include <string.h>
#include "core.h"

/* m/s on Earth; surfaces whose velocities differ by less move alike. */
#define ALIKE 1e-12
/* By how much what a sleeper bears may change: times its weight, and of what it bore when it fell asleep. */
#define MORE 0.5
#define BY 0.2
/* ... times this of what has corners, whose many places share a load anew in each step. */
#define CORNERS 4
/* Of that, what it may differ by for good, from what falls asleep on it. */
#define LASTING 0.1
/* s on Earth; of what has slept for so long. What lies can share a load in many ways: if each of them woke what lies
   deeper, there would be no end. */
#define LONG 0.5
/* s on Earth; over so long what is borne is a mean: in each step it is shared otherwise. */
#define LATELY 0.01
/* Of the way between two, by which neither lies on the other: they lean on each other. */
#define LEANS 0.2
/* s on Earth; so long what was woken has to be at rest, if it was where it is before. */
#define AGAIN 0.01

/* The other of the two of an end of what is frozen, as `Contact.j`, and how far that is above the first. */
static int across(int end, double *above) {
    const Frozen *f = W.frozen + end / 2;
    *above = end % 2 ? f->rise : -f->rise;
    return end % 2 ? f->i : f->j;
}

/* Where a contact is, off the centre of its i. */
static void spot_of(const Contact *c, double *spot) {
    const double own[2] = {c->cornered ? c->own[0] : 0, c->cornered ? c->own[1] : W.disks[c->i].radius};
    spot[0] = own[0] * c->ny - own[1] * c->nx;
    spot[1] = -own[0] * c->nx - own[1] * c->ny;
}

/* The number of the frozen contact of two at about the same place, from 1 on, or 0. */
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

/* The sleeper of two of which one is awake, or -1. */
static int sleeper_of(const Frozen *f) {
    if (f->j < 0 || sleeps(f->i) == sleeps(f->j)) return -1;
    return sleeps(f->i) ? f->i : f->j;
}

static void link_end(int end) {
    int i = end % 2 ? W.frozen[end / 2].j : W.frozen[end / 2].i;
    if (i < 0) return;
    W.frozen_links[end] = W.disks[i].frozen;
    W.disks[i].frozen = end;
}

/* Let go of what is frozen at a disk that is no more asleep from t on. */
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

/* Wake a disk at t, and all sleepers that lie on it. What lies goes on with its hop: as a step begins it comes down from
   the one before; within a step, half of what gravity takes until it ends it gets from what it lies on. */
void wake(int i, double t) {
    int last = i, within = W.phase == WITHIN;
    double hop = within ? -0.5 * (W.step_end - t) : 0.5 * W.length, x = hop * W.gx, y = hop * W.gy;
    W.disks[i].rouses = -1;
    W.disks[i].mode = FREE;
    W.roused = 1;
    for (int n = i; n >= 0; n = W.disks[n].rouses) {
        Disk *d = W.disks + n;
        for (int end = d->frozen; end >= 0; end = W.frozen_links[end]) {
            double above;
            int k = across(end, &above);
            if (above < 0 || !sleeps(k)) continue;
            W.disks[k].mode = FREE;
            W.disks[k].rouses = -1;
            last = W.disks[last].rouses = k;
        }
        /* Where it lies, without the hop of the step so far. */
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

/* The sleeper of two that bears otherwise than when it fell asleep, as late steps have shown; or -1. What is about to
   sleep on it may not have it bear much more: of what lies deeper only what is awake would ever be told. */
static int roused_by(const Frozen *f) {
    int i = sleeper_of(f), awake = i == f->i ? f->j : f->i;
    if (i < 0) return -1;
    /* Of what has corners, at all places. */
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

/* Wake all of these, and what a hand has stirred. */
void rouse(void) {
    for (EACH_LIVE(i))
        if (sleeps(i) && W.disks[i].stirred) wake(i, W.t);
    for (const Frozen *f = W.frozen; f < W.frozen + W.frozen_count; f++) {
        int i = roused_by(f);
        if (i >= 0) wake(i, W.t);
    }
}

/* Whether what moves by (x, y) moves as all so far, by `u`; if there is an owner of them, which the latest becomes. */
static int moves_alike(double *u, double x, double y, int *owner, int next) {
    if (*owner >= 0 && (fabs(u[0] - x) > ALIKE * W.pace || fabs(u[1] - y) > ALIKE * W.pace)) return 0;
    u[0] = x;
    u[1] = y;
    *owner = next;
    return 1;
}

/* The velocity of the surfaces that a disk lies on is `u`, if it is to sleep; 0 if it may not. */
static int joins(const Contact *c, double *u, int *owner) {
    const Surface *s = W.surfaces + (-1 - c->j);
    double belt = c->other[1], x = belt * c->ny, y = -belt * c->nx;
    if (stirs(s) || (s->speed != 0 && s->shape != SEGMENT)) return 0;
    /* Nothing has settled that a belt will throw. */
    if (s->speed != 0 && W.until == UNTIL_SETTLED && c->owner != W.landing) return 0;
    if (fabs(W.gx * x + W.gy * y) > 1e-12 * W.g * fabs(belt)) return 0;
    return moves_alike(u, x, y, owner, c->owner);
}

/* What a contact gives i, N s. */
static void given_by(const Contact *c, double *J) {
    J[0] = pressed(c) * c->nx + c->impulse[1] * c->ny;
    J[1] = pressed(c) * c->ny - c->impulse[1] * c->nx;
}

static int holds(const Contact *c) { return c->impulse[0] != 0 || c->clings > 0; }

/* Whether two sleep and wake together: what coheres, a disk and what has corners, and few of that. */
static int is_pair(const Contact *c) {
    return c->clings > 0 || (c->cornered && c->j >= 0 && (!has_corners(W.disks + c->j) || are_few(W.contact_count)));
}

/* How far i is above j, as in `Frozen`. */
static double rise_of(const Contact *c) {
    double rise = c->nx * W.up[0] + c->ny * W.up[1];
    return is_pair(c) || fabs(rise) < LEANS ? 0 : rise;
}

static Frozen *freeze(const Contact *c) {
    Frozen *f = W.frozen + W.frozen_count++;
    *f = (Frozen){.from = INFINITY, .told = W.t + 0.5 * W.length, .rise = rise_of(c), .i = c->i, .j = c->j, .first = c->i};
    spot_of(c, f->spot);
    link_end(2 * W.frozen_count - 2);
    link_end(2 * W.frozen_count - 1);
    return f;
}

/* Note what sleepers bear in this step of what is awake. */
void note_frozen(void) {
    double middle = W.t + 0.5 * W.length, of_now = MIN(W.length * W.pace / LATELY, 1);
    for (Frozen *f = W.frozen; f < W.frozen + W.frozen_count; f++) f->felt[0] = f->felt[1] = 0;
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
    for (Frozen *f = W.frozen; f < W.frozen + W.frozen_count; f++) {
        int i = sleeper_of(f);
        if (i < 0) continue;
        for (int n = 0; n < 2; n++) f->now[n] += of_now * (f->felt[n] - f->now[n]);
        if (f->felt[0] != 0 || f->felt[1] != 0) continue;
        tell_frozen(f, i, (double[]){0, 0}, middle);
        /* It touched one that had slept before, and does so no more. */
        W.roused |= f->force[0] == 0 && f->force[1] == 0;
    }
}

/* Take a share of what a contact gave a sleeper back, that of the second half of the step. */
void untell_frozen(const Contact *c, double share) {
    int found = find_frozen(c);
    Frozen *f = W.frozen + found - 1;
    double sign = f->i == c->i ? share : -share, J[2];
    if (!found) return;
    given_by(c, J);
    tell_frozen(f, c->j, (double[]){sign * J[0], sign * J[1]}, W.t);
}

/* Forget what is frozen between two that are awake. */
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
    W.roused = 0;
    for (int end = 0; end < 2 * left; end++) link_end(end);
}

/* Tell which disks may not fall asleep now: what has not been at rest for long enough, and what lies on that. */
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
    /* What rattles in its place would wake those next to it: they wait until it touches something. */
    for (int n = 0; n < 2 * W.near_count; n++) {
        const Disk *d = W.disks + W.near[n];
        if (d->mode == FREE && !d->supports && d->rest >= d->waits) up[W.near[n ^ 1]] = 1;
    }
    for (const Frozen *f = W.frozen; f < W.frozen + W.frozen_count; f++) {
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

/* Let disks fall asleep that have been at rest for long enough, after a step's solve, and lie on nothing that is awake. */
void fall_asleep(void) {
    int ready = 0, *up = W.found, *parent = W.queue;
    if (W.roused) forget_frozen();
    for (EACH_LIVE(i)) ready |= W.disks[i].mode == FREE && W.disks[i].rest >= W.disks[i].waits;
    if (!ready || !W.sleeps || !W.contact_count || W.frozen_count + W.contact_count > 2 * W.contact_room) return;
    keep_up(up);
    /* Those that hang together, at whose root `tugged` is how their surfaces, or what they lie on, move: nothing needs it between
       two steps. */
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
        /* All that its impulses have done stays done; the rest of its hop is left out. */
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
        memcpy(f->impulse, c->impulse, sizeof f->impulse);
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
    /* What touched a sleeper sleeps elsewhere now: it gives nothing of what that counts on. */
    for (Frozen *f = W.frozen; f < W.frozen + W.frozen_count; f++) {
        if (f->from < INFINITY || !sleeps(f->i) || !sleeps(f->j)) continue;
        f->first = W.disks[f->i].slept < W.disks[f->j].slept ? f->i : f->j;
        tell_frozen(f, f->first, (double[]){0, 0}, W.t);
        for (int n = 0; n < 2; n++) f->more[n] = -f->force[n];
        f->from = W.t;
    }
    if (B.every > 0 || B.each > 0) balance_sleepers();
}
