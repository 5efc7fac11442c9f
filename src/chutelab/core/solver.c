/* Lasting contacts are solved once per step: impulses such that no gap is negative at the end of the step, and such that
   friction, within its bound, brings the slip in the middle of the step to zero.

   This is contact dynamics after Moreau and Jean, by projected Gauss-Seidel, started from the impulses of the step before.
   The gap at the end is that of the path without impulses to the true surface, so curves, ends and disks that roll over each
   other need no special cases. A particle at rest hops by g h^2/8 in each step and is back at its end; positions at the
   steps are of second order in h. */

#include "core.h"

/* Where sweeps diverge, friction is lowered of contacts that change by this share of the greatest change. */
#define FOLLOWS 0.01
/* How often friction is lowered: to a quarter each time, at last to 0. */
#define TRIES 4
/* An island of n contacts may be swept SMALL / n times as often, up to MOST_ROUNDS, if its gaps need that: disks that moving
   surfaces draw into a wedge take up to thousands of sweeps, or sink into each other. */
#define SMALL 500
#define MOST_ROUNDS 50
/* Sweeps without momentum: most solves need no more. */
#define PLAIN 6
/* Inside arcs a lone disk is solved again until its gap changes by less than FINE radii, as long as each change is less
   than SHRINKS times the last one. */
#define FINE 1e-8
#define SHRINKS 0.9
/* If the last round ends with more than this share of the change at the end of the first, the sweeps press harder each time,
   without end. */
#define CRAWLS 0.5
/* But not where surfaces drive and gaps miss what they ask for by more than so many times what is good enough. */
#define GROSS 10
/* m/s at 1 g; change at which sweeps over few contacts end if there are corners, joints or hinges. */
#define FINE_FEW 1e-11
/* The same over many contacts, as a share of that of disks: with less a pile of boxes does not come to rest. */
#define CROWD_CORNERS 0.3
/* Friction below this share of its bound holds. */
#define HOLDS 0.999
/* Where belts have pressed a contact deep, gaps may miss no more than this share of the slowest one's speed: else such a belt
   would press it deeper, a little in each step. */
#define YIELDS 0.1

/* Bodies are wedged if a drive presses one with more than so many times the momentum of their island: weight and
   soft blows do not. */
#define WEDGED 8

/* Whether a surface that moves drives a disk. */
static int drives(const Contact *c) { return c->j < 0 && c->other[1] - c->moved[1] != 0; }
/* Whether a surface drives or pushes, with any force that it takes. */
static int presses(const Contact *c) { return drives(c) || c->moved[0] > 0; }

/* Stop, for this step, the drives that are blocked by disks that cannot turn. A drive is blocked if its contact changes by
   `least` m/s or more, or if its friction is practically unbounded and holds, but the disk slips by more than `enough`. Return
   whether there is one. */
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
        c->stalls = stalled = 1;
    }
    return stalled;
}

/* Impulse beyond which the bodies of an island are wedged by its drives, N s: WEDGED times their momentum at the speed of
   the fastest one, each contact counted. On a slow one a nip that holds may bear more; so the speed is at least that of a fall
   by half a radius, which is some thirty times the weight's in a step. */
static double wedged_from(const Contact *list, int count) {
    double sum = 0, speed = 0;
    for (const Contact *c = list; c < list + count; c++) {
        const Disk *a = W.disks + c->i;
        speed = MAX(speed, sqrt(W.g * a->radius));
        if (c->j < 0) speed = MAX(speed, fabs(c->other[0]) + fabs(c->other[1]));
        sum += a->mass + (c->two ? W.disks[c->j].mass : 0);
    }
    return WEDGED * sum * speed;
}

/* Multiply the friction of rows by a factor that the last sweep changed by `least` m/s or more, or whose impulse is `most`
   N s or more. */
static void ease_friction(Contact *list, int count, double least, double most, double by) {
    for (SolverRow *r = W.rows; r < W.rows + count; r++) {
        Contact *c = list + r->from;
        if (r->change < least && r->impulse[0] < most) continue;
        c->share *= by;
        r->rough = c->share * MIN(c->friction, ROUGH);
        r->arm = c->share * c->arm;
    }
}

/* Solve the contacts of an island (`rounds` > 0), or of one disk (0).

   A round is `sweeps` sweeps, until changes are at most `accurate`, m/s. It is good enough as well if gaps miss what they ask
   for by at most `enough`, m/s; contacts that need finer changes than a crowd's get more rounds for them, as long as changes
   shrink: what both corners of a box ask for that friction holds in an arc differs by h^2 from what a rigid body can do, and
   each sweep then turns their friction against each other. Small changes that leave gaps open are swept on ten times as
   finely. After the last round it is good enough if the changes still shrink, but with a drive only if gaps miss no more than
   GROSS times `enough`.

   Else, and where sweeps diverge or the bodies are wedged, rigid ones may have no solution, or one with any force: they are
   driven into a wedge that locks itself. Then friction is lowered, from contacts that change or press most, until there is
   one. If a drive presses, it presses harder in each sweep: closed gaps alone prove nothing there, the changes have to end,
   too. A disk that cannot turn, held by friction that locks, would slip through if friction were lowered: it stalls the
   drive for this step, and for all impacts in it. So does a disk that is blocked on a belt with practically unbounded
   friction.

   The impulses of the step before are taken as far as they lower the cost, see `lessen`: where a contact has opened, those of
   its neighbours would throw disks out. But not in a crowd with corners: the share is that of the whole island, so for a blow
   at its top a pile would forget what it bears, and creep until sweeps have found it again. Return whether the sweeps ended
   by themselves. */
int sweep_contacts(Contact *list, int count, int rounds, int sweeps, int plain, double accurate,
                   double enough) {
    double first = INFINITY, before = INFINITY;
    int driven = 0, pressing = 0, lessened = 0, cornered = 0, ended, light = W.interact, fine = accurate < W.accurate;
    for (int n = 0; n < count; n++) {
        const Contact *c = list + n;
        driven |= drives(c);
        pressing |= presses(c);
        cornered |= c->cornered;
        /* Plain sweeps show by their changes what has to stall. */
        if (drives(c) && c->friction > ROUGH && W.disks[c->i].inertia == 0) plain = sweeps;
    }
    double wedged = driven && cornered ? wedged_from(list, count) : INFINITY, hardest = 0;
    set_rows(list, count);
    if (!cornered || count <= FEW_CONTACTS) lessen();
    for (int left = TRIES, more = rounds;;) {
        double change = light ? sweep_lightly(sweeps, plain, accurate) : INFINITY, worst;
        light &= cornered && count > FEW_CONTACTS && change < INFINITY;
        if (change == INFINITY) change = sweep_rows(sweeps, plain, accurate);
        worst = change;
        ended = change <= accurate;
        /* What sweeps by fours have brought to their end needs finer ones. */
        light &= !ended;
        keep_bounds();
        if (!ended || W.interact) lessened = lessen();
        if (left == 0) break;
        hardest = 0;
        for (int n = 0; n < count && wedged < INFINITY; n++) hardest = MAX(hardest, W.rows[n].impulse[0]);
        int locked = hardest > wedged;
        int stalled = driven && change < INFINITY && stall(list, count, INFINITY, enough);
        if (!stalled && !locked) {
            int gross = driven && change < INFINITY && left_open() > GROSS * enough;
            if (ended && (fine || (more < 2 && !gross))) break;
            if (ended) accurate *= 0.1;
            if (change < INFINITY) worst = pressing ? MAX(left_open(), change) : left_open();
            if (worst <= enough && !(fine && more > 1 && change < SHRINKS * before)) break;
            if (change < INFINITY && more > 1) {
                if (more-- == rounds) first = change;
                before = change;
                continue;
            }
            if (more == 1 && change < CRAWLS * first && !gross) break;
            worst = 0;
            for (int n = 0; n < count; n++) worst = MAX(worst, W.rows[n].change);
            stalled = driven && stall(list, count, FOLLOWS * worst, INFINITY);
        } else if (locked) worst = INFINITY;
        more = rounds;
        before = INFINITY;
        if (!stalled) {
            ease_friction(list, count, FOLLOWS * worst, locked ? FOLLOWS * hardest : INFINITY, left > 1 ? 0.25 : 0);
            left--;
        }
        begin_anew();
    }
    if ((drop_noise() || lessened) && W.interact) lessen();
    take_rows(list, count);
    return ended;
}

/* By how much the impulses of a step change the gap at its end, m, other than along the straight path: the surface bends, and
   friction changes how far the disk gets along it. */
static double bends(const Contact *c, double h) {
    double u[3], v[3], hollow = 0, later;
    if (c->leaves || c->need == -INFINITY || is_flat(W.surfaces + (-1 - c->j))) return 0;
    later = gap_later(c, h, &hollow);
    if (!(hollow < 0)) return 0;
    relative(c, 1, u);
    relative(c, 0, v);
    return later - c->free_gap - h * (v[0] - u[0]);
}

/* Solve the contacts of a lone disk such that its gaps are closed at the place that its impulses lead to, by repeating the solve
   as long as corrections shrink. Else it would sink into the inside of an arc, step by step. The next step begins with the
   corrections that the last solve leaves. */
static void solve_alone(Contact *list, int count) {
    double h = W.step_end - W.t, r = W.disks[list->i].radius;
    for (double last = INFINITY;;) {
        double most = 0;
        sweep_contacts(list, count, 0, W.sweeps, W.sweeps, W.accurate, MAX(W.accurate, 1e-9 * W.pace));
        for (int n = 0; n < count; n++) most = MAX(most, fabs(bends(list + n, h) - list[n].bend));
        int ends = most <= FINE * r || most >= SHRINKS * last;
        for (int n = 0; n < count; n++) {
            double bend = bends(list + n, h);
            if (!ends) list[n].need -= (bend - list[n].bend) / h;
            list[n].bend = bend;
        }
        if (ends) return;
        last = most;
    }
}

/* Change of the gap of a corner inside an arc at the end of the step by its impulses, m, other than along its normal. */
static double bends_off(const Contact *c, double h) {
    double u[3], v[3];
    if (!c->is_corner || W.surfaces[-1 - c->j].shape == SEGMENT) return 0;
    relative(c, 1, u);
    relative(c, 0, v);
    return bent_gap(c, h) - c->free_gap - h * (v[0] - u[0]);
}

/* The same for an island with corners inside arcs, whose normals lean on the velocities that the impulses lead to. The next
   step begins with what the last solve leaves. */
static void solve_bent(Contact *list, int count, int rounds, int sweeps, double accurate, double enough, double fine) {
    double h = W.step_end - W.t;
    for (double last = INFINITY;;) {
        double most = 0;
        sweep_contacts(list, count, rounds, sweeps, PLAIN, accurate, enough);
        for (int n = 0; n < count; n++) {
            Contact c = list[n];
            if (!(c.cornered && c.turns > 0)) continue;
            double leans = h * fabs(lean_again(&c, h)), bends = fabs(bends_off(list + n, h) - c.bend);
            most = MAX(most, MAX(leans, bends));
        }
        int ends = most <= fine || !(most < SHRINKS * last);
        for (Contact *c = list; c < list + count; c++) {
            if (!(c->cornered && c->turns > 0)) continue;
            if (!ends) lean_again(c, h);
            double bend = bends_off(c, h);
            if (!ends) c->need -= (bend - c->bend) / h;
            c->bend = bend;
        }
        if (ends) return;
        last = most;
    }
}

/* Where the slip of a lone disk reverses within a step because friction cannot hold it, friction reverses at that instant.
   The sweeps would bring the slip to zero, which is wrong in first order. */
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

/* Sort the contacts by islands of disks that touch each other; within an island they keep their order. This overwrites the
   contacts of the step before, which are not needed any more. */
static void sort_by_islands(void) {
    int *parent = W.queue, *first = W.moved, *next = W.links;
    for (EACH_LIVE(i)) {
        parent[i] = i;
        first[i] = -1;
    }
    for (int n = 0; n < W.contact_count; n++)
        if (W.contacts[n].two) parent[island_of(W.contacts[n].i)] = island_of(W.contacts[n].j);
    /* All disks that touch hinges are one island. */
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
    /* A linked list of contacts for each island. */
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

/* Measure how well the impulses solve the step. `unsolved`: the overlap, in radii, that they leave beyond what is asked for.
   `gained`: by how much they break the law K(v) - K(u) + K(v - u) <= J s + sum J_n a_n - J_t d_t (docs/physics.md, "The law of
   a solve"); the left side is summed over disks, the right side over contacts. */
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
    /* A step that is solved again counts once. */
    W.gained += MAX(gained, 0) - (again ? last : 0);
    last = MAX(gained, 0);
}

void solve_contacts(int again) {
    int swings = 0;
    if (W.interact) sort_by_islands();
    for (int from = 0, to = 0; from < W.contact_count; from = to) {
        Contact *list = W.contacts + from;
        double least = INFINITY, heaviest = 0, slowest = INFINITY;
        int driven = 0, sunk = 0, pushed = 0, cornered = 0, tied = 0, rests = 0, bent = 0, halved = 1;
        W.swings_too = 0;
        for (; to < W.contact_count && (!W.interact || W.contacts[to].island == list->island); to++) {
            const Contact *c = W.contacts + to;
            const Disk *a = W.disks + c->i, *b = W.disks + (c->j >= 0 ? c->j : c->i);
            least = MIN(least, MIN(a->radius, b->radius));
            heaviest = MAX(heaviest, MAX(a->mass, b->mass));
            driven |= presses(c);
            if (drives(c)) slowest = MIN(slowest, fabs(c->other[1] - c->moved[1]));
            sunk |= c->gap < -SUNK * inner_of(c->i, c->j);
            pushed |= c->moved[0] > 0;
            W.swings_too |= c->hung > 0;
            cornered |= c->cornered;
            bent |= c->cornered && c->turns > 0;
            rests |= sleeps(c->j);
            tied |= is_tied(c->i) || is_tied(c->j);
        }
        swings |= W.swings_too;
        for (const Contact *c = list; c < W.contacts + to && !again; c++)
            halved &= c->clings == 0 && (c->cornered || c->turns == 0);
        halved &= tied && !rests && W.interact && !W.swings_too && to - from <= FEW_CONTACTS;
        for (int n = from; n < to && !again; n++) {
            Contact *c = W.contacts + n;
            c->halved = W.disks[c->i].halved = halved;
            if (halved) straighten(c);
            if (c->j >= 0) W.disks[c->j].halved = halved;
        }
        /* A drive presses with any force, so no spring would stop it. There the spring gives way by no more than what removes
           the overlap, and friction is lowered if need be. */
        for (int n = from; n < to && !again; n++) {
            W.contacts[n].gives /= heaviest;
            if (!driven) W.contacts[n].parts = INFINITY;
        }
        double accurate = W.accurate, enough = W.skip * least;
        int few = to - from <= FEW_CONTACTS && (!rests || are_few(W.contact_count));
        if ((cornered || tied || W.swings_too) && few) accurate = FINE_FEW * W.pace;
        else if (cornered) accurate = CROWD_CORNERS * accurate;
        /* Between a surface that pushes and sleepers, which do not give way, there may be no room: they wake. */
        for (Contact *c = list; c < list + to - from && pushed && rests; c++)
            if (sleeps(c->j)) W.disks[c->j].stirred = 1;
        /* Sweeps that go on do not part what a belt has pressed deep: it locks. */
        int locks = sunk && slowest < INFINITY;
        if (locks) enough = MIN(enough, YIELDS * slowest);
        int rounds = locks || (pushed && rests) ? 1 : MIN(MAX(SMALL / (to - from), 1), MOST_ROUNDS);
        if (bent) solve_bent(list, to - from, rounds, W.sweeps, accurate, enough, FINE * least);
        else if (W.interact) sweep_contacts(list, to - from, rounds, W.sweeps, PLAIN, accurate, enough);
        else solve_alone(list, to - from);
    }
    if (!W.interact && W.contact_count == 1) turn_slip(W.contacts);
    W.swings_too = swings;
    check_solve(again);
    W.solve_count++;
}
