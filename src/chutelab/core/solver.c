/* Lasting contacts, once a step: impulses such that no gap is negative at the step's end, and that
   friction, within its bound, brings the slip in the middle of the step to zero.

   Contact dynamics after Moreau and Jean: projected Gauss-Seidel, started from the impulses of the
   step before. The gap at the end is that of the path without impulses, to the true surface: so
   curves, ends and rolling over each other need no cases. What rests hops by g h^2/8 in each step
   and is where it was at its end; positions at the steps are of second order in h. */

#include "core.h"

/* Of the greatest change where sweeps diverge: contacts that change by so much are lowered. */
#define FOLLOWS 0.01
/* Times that friction is lowered, to a quarter and at last to nothing. */
#define TRIES 4
/* Contacts; an island of fewer is swept so many times as often where its gaps need it: disks that
   moving surfaces draw into a wedge take up to thousands of sweeps, or sink into each other. */
#define SMALL 500
#define MOST_ROUNDS 50
/* Sweeps before they are hastened: most solves need no more. */
#define PLAIN 6
/* Radii by which a gap may be off where the way bends; times its last change up to which it is solved
   for once more. */
#define FINE 1e-8
#define SHRINKS 0.9
/* Times the change at the end of the first round: sweeps that have not crawled to less in the last one
   press harder by as much in each, without end. */
#define CRAWLS 0.5
/* m/s on Earth; changes at which sweeps over a few contacts of what has corners, joints or hinges end. */
#define FINE_FEW 1e-11
/* ... and over many, of those of disks: a pile of boxes hangs together by more, and else does not come to rest. */
#define CROWD_CORNERS 0.3
/* ... and the share of their sweeps that it gets while something in it stirs: what others would do, the next step does
   as well. */
#define FEWER 0.5
/* Share of its bound up to which friction is not all used: it holds. */
#define HOLDS 0.999

/* Whether a surface that moves drives a disk. */
static int drives(const Contact *c) { return c->j < 0 && c->other[1] - c->moved[1] != 0; }
/* Whether a surface runs or comes on, as hard as it must. */
static int presses(const Contact *c) { return drives(c) || c->moved[0] > 0; }

/* Stall the drives, for this step, of disks that do not turn and that block them: contacts that change by
   `least`, m/s, or more, and rough ones that slip by more than `enough` though their friction is not all used.
   Return whether there is one. */
static int stall(Contact *list, int count, double least, double enough) {
    int stalled = 0;
    for (SolverRow *r = W.rows; r < W.rows + count; r++) {
        Contact *c = list + r->from;
        if (W.disks[c->i].inertia > 0 || !drives(c)) continue;
        int holds = r->impulse[0] > 0 && fabs(r->impulse[1]) < HOLDS * c->friction * r->impulse[0];
        int slips = c->friction > ROUGH && holds && fabs(slip_of(r)) > enough;
        if (!slips && r->change < least) continue;
        r->free[1] += c->other[1] - c->moved[1];
        r->spin += c->other[2] - c->moved[2];
        c->other[1] = c->moved[1];
        c->other[2] = c->moved[2];
        stalled = 1;
    }
    return stalled;
}

/* Lower the friction, to a share of it, of rows that the last sweep changed by `least` m/s or more. */
static void ease_friction(Contact *list, int count, double least, double by) {
    for (SolverRow *r = W.rows; r < W.rows + count; r++) {
        Contact *c = list + r->from;
        if (r->change < least) continue;
        c->share *= by;
        r->rough = c->share * MIN(c->friction, ROUGH);
        r->arm = c->share * c->arm;
    }
}

/* Solve contacts by `sweeps` until changes are `accurate`; if gaps are closed but for `enough`, m/s, less
   will do, but not before the last round if they are to be finer than a crowd's. A crowd is swept again, up to so
   many rounds, of which the last is good enough if it crawls, and more finely where small changes leave gaps
   open. By itself (0 rounds), and where sweeps diverge,
   rigid bodies with all of the friction may have no solution, driven into a wedge that locks itself:
   there it is lowered until they have one. Gaps tell nothing of that where a drive presses: it presses
   harder in each sweep, so there the changes have to end, too. A disk that cannot turn is held where
   friction locks, and would slip away from a lower one: it stalls the drive, for this step, and so does
   one that others block on a belt that grips without bound, which never slips.

   They begin with the impulses of the step before, as far as these lower the cost: where contacts have
   opened, what had been pressed between others would throw disks out. */
void sweep_contacts(Contact *list, int count, int rounds, int sweeps, int plain, double accurate,
                    double enough) {
    double first = INFINITY;
    int driven = 0, pressing = 0, lessened = 0, light = W.interact, fine = accurate < W.accurate;
    for (int n = 0; n < count; n++) {
        const Contact *c = list + n;
        driven |= drives(c);
        pressing |= presses(c);
        /* What may have to stall tells so by how it changes, sweep by sweep. */
        if (drives(c) && c->friction > ROUGH && W.disks[c->i].inertia == 0) plain = sweeps;
    }
    set_rows(list, count);
    lessen();
    for (int left = TRIES, more = rounds;;) {
        double change = light ? sweep_lightly(sweeps, plain, accurate) : INFINITY, worst;
        if (change == INFINITY) change = sweep_rows(sweeps, plain, accurate);
        light = 0;
        worst = change;
        int ended = change <= accurate;
        if (!ended) keep_bounds();
        if (!ended || W.interact) lessened = lessen();
        if (left == 0) break;
        int stalled = driven && change < INFINITY && stall(list, count, INFINITY, enough);
        if (!stalled) {
            if (ended && (more < 2 || fine)) break;
            if (ended) accurate *= 0.1;
            if (change < INFINITY) worst = pressing ? MAX(left_open(), change) : left_open();
            if (worst <= enough && !(fine && more > 1)) break;
            if (change < INFINITY && more > 1) {
                if (more-- == rounds) first = change;
                continue;
            }
            if (more == 1 && change < CRAWLS * first) break;
            worst = 0;
            for (int n = 0; n < count; n++) worst = MAX(worst, W.rows[n].change);
            stalled = driven && stall(list, count, FOLLOWS * worst, INFINITY);
        }
        more = rounds;
        if (!stalled) {
            ease_friction(list, count, FOLLOWS * worst, left > 1 ? 0.25 : 0);
            left--;
        }
        begin_anew();
    }
    if ((drop_noise() || lessened) && W.interact) lessen();
    take_rows(list, count);
}

/* What the impulses of a step change of a gap at its end, m, but for the straight way along its normal:
   the surface may bend, and friction changes how far the disk gets on it. */
static double bends(const Contact *c, double h) {
    double u[3], v[3], hollow = 0, later;
    if (c->leaves || c->need == -INFINITY || is_flat(W.surfaces + (-1 - c->j))) return 0;
    later = gap_later(c, h, &hollow);
    if (!(hollow < 0)) return 0;
    relative(c, 1, u);
    relative(c, 0, v);
    return later - c->free_gap - h * (v[0] - u[0]);
}

/* Solve the contacts of a disk by itself so that gaps are closed where its impulses lead to: again with
   what bends, as long as that changes less each time. Else it would sink into a hollow, step by step. */
static void solve_alone(Contact *list, int count) {
    double h = W.step_end - W.t, r = W.disks[list->i].radius;
    for (double last = INFINITY;;) {
        double most = 0;
        sweep_contacts(list, count, 0, W.sweeps, W.sweeps, W.accurate, MAX(W.accurate, 1e-9 * W.pace));
        for (int n = 0; n < count; n++) most = MAX(most, fabs(bends(list + n, h) - list[n].bend));
        if (most <= FINE * r || most >= SHRINKS * last) return;
        last = most;
        for (int n = 0; n < count; n++) {
            double bend = bends(list + n, h);
            list[n].need -= (bend - list[n].bend) / h;
            list[n].bend = bend;
        }
    }
}

/* Where the slip of a disk by itself turns round within a step, since friction cannot hold it, the
   friction turns too. The sweeps would bring the slip to zero, which is wrong in first order. */
static void turn_slip(Contact *c) {
    double h = W.step_end - W.t, past = W.tracks[c->i].lasted ? 0.5 * W.length_before : 0, u[3], v[3];
    double span = past + 0.5 * h, pull = c->pull, hold = c->friction * c->impulse[0];
    relative(c, 1, u);
    relative(c, 0, v);
    double from = u[1] - pull * past, to = v[1] + c->drift, rate = hold / (c->mass[1] * span);
    if (c->j >= 0 || c->leaves || fabs(pull) <= rate || from * pull >= 0 || to * from > 1e-12 * from * from)
        return;
    double slow = pull + (pull > 0 ? rate : -rate), fast = pull - (pull > 0 ? rate : -rate);
    double change[3] = {0, c->mass[1] * (fast * (span + from / slow) - to), 0};
    if (-from / slow > span || fabs(c->impulse[1] + change[1]) > hold) return;
    push(c, change);
    c->impulse[1] += change[1];
}

/* Sort the contacts by islands of disks that touch each other, in the order in which these begin;
   within one they keep theirs. What the contacts of the step before were is not needed any more. */
static void sort_by_islands(void) {
    int *parent = W.queue, *first = W.moved, *next = W.links;
    for (EACH_LIVE(i)) {
        parent[i] = i;
        first[i] = -1;
    }
    for (int n = 0; n < W.contact_count; n++)
        if (W.contacts[n].two) parent[island_of(W.contacts[n].i)] = island_of(W.contacts[n].j);
    /* What touches hinges is one island. */
    for (int n = 0, hung = -1; n < W.contact_count && W.hinges; n++) {
        if (!W.contacts[n].hung) continue;
        if (hung >= 0) parent[island_of(W.contacts[n].i)] = island_of(hung);
        hung = W.contacts[n].i;
    }
    int one = 1, root = W.contact_count ? island_of(W.contacts[0].i) : -1;
    for (int n = 0; n < W.contact_count; n++) {
        W.contacts[n].island = island_of(W.contacts[n].i);
        one &= W.contacts[n].island == root;
    }
    if (one) return;
    /* Of each island a list of its contacts, which begins with its last. */
    for (int n = W.contact_count - 1; n >= 0; n--) {
        int k = W.contacts[n].island;
        next[n] = first[k];
        first[k] = n;
    }
    int count = 0;
    for (int n = 0; n < W.contact_count; n++) {
        int k = W.contacts[n].island;
        for (int m = first[k]; m >= 0; m = next[m]) W.earlier[count++] = W.contacts[m];
        first[k] = -1;
    }
    Contact *c = W.contacts;
    W.contacts = W.earlier;
    W.earlier = c;
}

/* Note how far the step's impulses are from solving it: the overlap, in radii, that they leave beyond what is
   asked for, and by how much they break the law of energy: the kinetic energy after them, less that
   before, plus that of the change itself, is at most what moving surfaces give and what the contacts
   ask for. What is on its left is summed over disks, what is on its right over contacts. */
static void check_solve(int again) {
    static double last;
    double gained = 0, h = W.step_end - W.t;
    for (EACH_LIVE(i)) {
        const Disk *d = W.disks + i;
        if (d->mode != FREE) continue;
        double x = d->vx - d->ux - d->kick[0], y = d->vy - d->uy - d->kick[1], w = d->spin - d->uspin;
        gained += d->mass * (x * d->vx + y * d->vy) + d->inertia * w * d->spin;
    }
    for (int n = 0; n < W.contact_count; n++) {
        const Contact *c = W.contacts + n;
        const double *J = c->impulse;
        double u[3], v[3], radius = W.disks[c->i].radius;
        if (c->j >= 0) radius = MIN(radius, W.disks[c->j].radius);
        relative(c, 1, u);
        relative(c, 0, v);
        W.unsolved = MAX(W.unsolved, h * (u[0] + asks(c, J[0]) - v[0]) / radius);
        if (J[0] == 0 && c->clings == 0) continue;
        gained += c->clings * v[0];
        gained -= J[0] * (u[0] + asks(c, J[0])) - J[1] * c->drift + J[2] * c->other[2];
        gained -= c->two ? 0 : pressed(c) * c->other[0] + J[1] * c->other[1];
        if (c->hung) gained += hinge_share(c);
    }
    if (W.swings_too) gained += gained_by_hinges();
    /* What is solved for again counts once. */
    W.gained += MAX(gained, 0) - (again ? last : 0);
    last = MAX(gained, 0);
}

void solve_contacts(int again) {
    int swings = 0;
    if (W.interact) sort_by_islands();
    for (int from = 0, to = 0; from < W.contact_count; from = to) {
        Contact *list = W.contacts + from;
        double least = INFINITY, heaviest = 0;
        int driven = 0, cornered = 0, tied = 0, stirred = 0;
        W.swings_too = 0;
        for (; to < W.contact_count && (!W.interact || W.contacts[to].island == list->island); to++) {
            const Contact *c = W.contacts + to;
            const Disk *a = W.disks + c->i, *b = W.disks + (c->j >= 0 ? c->j : c->i);
            least = MIN(least, MIN(a->radius, b->radius));
            heaviest = MAX(heaviest, MAX(a->mass, b->mass));
            driven |= presses(c);
            W.swings_too |= c->hung > 0;
            cornered |= c->cornered;
            tied |= is_tied(c->i) || is_tied(c->j);
            stirred |= (a->supports && a->rest == 0) || (b->supports && b->rest == 0);
        }
        swings |= W.swings_too;
        /* A drive presses as hard as it must: there no spring would hold, so that it gives no more than
           what parts, and friction is lowered. */
        for (int n = from; n < to && !again; n++) {
            W.contacts[n].gives /= heaviest;
            if (!driven) W.contacts[n].parts = INFINITY;
        }
        double accurate = W.accurate;
        int sweeps = W.sweeps;
        if ((cornered || tied || W.swings_too) && to - from <= FEW_CONTACTS) accurate = FINE_FEW * W.pace;
        else if (cornered) {
            accurate = CROWD_CORNERS * accurate;
            if (stirred) sweeps = (int)(FEWER * sweeps);
        }
        if (W.interact)
            sweep_contacts(list, to - from, MIN(MAX(SMALL / (to - from), 1), MOST_ROUNDS), sweeps,
                           PLAIN, accurate, W.skip * least);
        else solve_alone(list, to - from);
    }
    if (!W.interact && W.contact_count == 1) turn_slip(W.contacts);
    W.swings_too = swings;
    check_solve(again);
    W.solve_count++;
}
