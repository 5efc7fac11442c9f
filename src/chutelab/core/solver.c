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
/* Sine of the angle between surfaces that count as one: of less nothing is left by rounding. */
#define PARALLEL 1e-7
/* Contacts; an island of fewer is swept so many times as often where its gaps need it: disks that
   moving surfaces draw into a wedge take up to thousands of sweeps, or sink into each other. */
#define SMALL 500
#define MOST_ROUNDS 50
/* Sweeps before they are hastened: most solves need no more. */
#define PLAIN 6
/* Of momentum. */
#define NOISE 1e-11
/* Times the first change: sweeps whose changes grow so far never end. */
#define DIVERGES 1e3
/* Radii by which a gap may be off where the way bends; times its last change up to which it is solved
   for once more. */
#define FINE 1e-8
#define SHRINKS 0.9
/* Times the change at the end of the first round: sweeps that have not crawled to less in the last one
   press harder by as much in each, without end. */
#define CRAWLS 0.5
/* Share of its bound up to which friction is not all used: it holds. */
#define HOLDS 0.999

/* Give a contact the normal impulse that keeps its gap closed; return by how much it changed, m/s. */
static double press(Contact *c) {
    const Disk *a = W.disks + c->i, *b = W.disks + MAX(c->j, 0);
    double x = a->vx - a->ux, y = a->vy - a->uy;
    if (c->two) {
        x -= b->vx - b->ux;
        y -= b->vy - b->uy;
    }
    double opens = x * c->nx + y * c->ny;
    if (c->hung) opens += swung_open(c);
    double given = (c->need - c->gives * c->impulse[0] - opens) * c->eases;
    double normal = MAX(c->impulse[0] + MIN(given, (c->most - opens) * c->mass[0]), 0);
    double change[3] = {normal - c->impulse[0], 0, 0};
    if (change[0] != 0) push(c, change);
    c->impulse[0] = normal;
    return fabs(change[0]) * c->light[0];
}

/* How far a change of velocity (x, y) is from keeping all gaps closed, m/s. */
static double violation(const Contact *list, int count, double x, double y) {
    double worst = 0;
    for (int n = 0; n < count; n++)
        worst = MAX(worst, asks(list + n) - x * list[n].nx - y * list[n].ny);
    return worst;
}

/* The same for all surfaces that one disk touches, at once: in a narrow wedge impulses one by one
   would take a thousand sweeps. The change of velocity becomes the one nearest to what it is without
   them that keeps all gaps closed: itself, or on the bound of one surface, or of two. */
static double press_corner(Contact *list, int count) {
    Disk *d = W.disks + list->i;
    double x = d->vx - d->ux, y = d->vy - d->uy, m = d->inv_mass;
    double best[2] = {0, 0}, rounding = 1e-15 * (fabs(x) + fabs(y)), changed = 0;
    int at[2] = {0, 0};
    for (int n = 0; n < count; n++) {
        x -= list[n].impulse[0] * m * list[n].nx;
        y -= list[n].impulse[0] * m * list[n].ny;
    }
    double least = violation(list, count, x, y);
    for (int i = 0; i < count && least > rounding; i++) {
        const Contact *c = list + i;
        double one = asks(c) - x * c->nx - y * c->ny;
        double left = violation(list, count, x + one * c->nx, y + one * c->ny);
        if (one <= 0 || left >= least) continue;
        least = left;
        best[0] = one; best[1] = 0;
        at[0] = at[1] = i;
    }
    for (int i = 0; i < count && least > rounding; i++)
        for (int j = 0; j < i && least > rounding; j++) {
            const Contact *c = list + i, *o = list + j;
            double cosine = c->nx * o->nx + c->ny * o->ny, sine = c->nx * o->ny - c->ny * o->nx;
            double one = asks(c) - x * c->nx - y * c->ny, two = asks(o) - x * o->nx - y * o->ny;
            if (fabs(sine) < PARALLEL) continue;
            double first = (one - cosine * two) / (sine * sine), then = (two - cosine * one) / (sine * sine);
            double left = violation(list, count, x + first * c->nx + then * o->nx,
                                    y + first * c->ny + then * o->ny);
            if (first < 0 || then < 0 || left >= least) continue;
            least = left;
            best[0] = first; best[1] = then;
            at[0] = i; at[1] = j;
        }
    for (int n = 0; n < count; n++) {
        double normal = (n == at[0] ? best[0] : 0) + (n == at[1] && at[1] != at[0] ? best[1] : 0);
        double change[3] = {normal / m - list[n].impulse[0], 0, 0};
        push(list + n, change);
        list[n].impulse[0] = normal / m;
        changed = MAX(changed, fabs(change[0]) * m);
    }
    return changed;
}

/* The most that a contact allows of friction, N s, or of rolling friction, N m s, as it is pressed. */
static double bound(const Contact *c, int rolling) {
    double rough = c->share < 1 ? c->share * MIN(c->friction, ROUGH) : c->friction;
    return (rolling ? c->share * c->arm : rough) * c->impulse[0];
}

/* Give a contact the friction that stops its slip and its rolling, as far as it is pressed. */
static double rub(Contact *c) {
    double *J = c->impulse, v[3], change[3] = {0, 0, 0};
    double most = bound(c, 0), arm = bound(c, 1);
    relative(c, 0, v);
    change[1] = MIN(MAX(J[1] - c->mass[1] * (v[1] + c->drift), -most), most) - J[1];
    change[2] = MIN(MAX(J[2] - c->mass[2] * v[2], -arm), arm) - J[2];
    if (change[1] == 0 && change[2] == 0) return 0;
    push(c, change);
    J[1] += change[1];
    J[2] += change[2];
    return MAX(fabs(change[1]) * c->light[1], fabs(change[2]) * c->light[2] * W.disks[c->i].radius);
}

/* Hasten the sweeps of a crowd: go on where they are heading to, by nonlinear conjugate gradients, of
   which two sweeps, to and fro, are the gradient (Silcowitz-Hansen, Niebe and Erleben, The Visual
   Computer 26, 2010). A pile of 2,000 takes half as many. `size` is the square of the gradient
   before, in J, or -1 at first; returns that of this one. */
static double hasten(Contact *list, int count, double size) {
    double now = 0;
    for (int n = 0; n < count && size >= 0; n++)
        for (int k = 0; k < 3; k++)
            now += square(list[n].impulse[k] - list[n].swept[k]) * list[n].light[k];
    double go = now < size ? now / size : 0;
    for (int n = 0; n < count; n++) {
        Contact *c = list + n;
        double more[3] = {0, 0, 0};
        for (int k = 0; k < 3; k++) {
            if (go > 0) more[k] = go * c->course[k];
            c->course[k] = size >= 0 ? more[k] + c->impulse[k] - c->swept[k] : 0;
            c->impulse[k] += more[k];
            c->swept[k] = c->impulse[k];
        }
        if (go > 0) push(c, more);
    }
    return now;
}

/* Take the share of all impulses at which the cost is least. The cost of impulses J, whose changes of
   velocity are W J, is 1/2 J W J + J q: what sweeps make least, one contact after the other. W J + q is
   how far the velocities are from what the contacts ask for; see docs/physics.md. Along J its slope goes
   straight from `none` to `all`; where what an overlap asks for bends it goes below that, and the share
   is a little less. Where sweeps end, the impulses do no work so on the velocities that they leave,
   however far the sweeps had come: W J + q times J is at most 0. */
static void lessen(Contact *list, int count) {
    double none = 0, all = 0, u[3], v[3], more[3];
    for (int n = 0; n < count; n++) {
        const Contact *c = list + n;
        const double *J = c->impulse;
        if (J[0] == 0 && J[1] == 0 && J[2] == 0) continue;
        relative(c, 1, u);
        relative(c, 0, v);
        none += J[1] * (u[1] + c->drift) + J[2] * u[2] - J[0] * MIN(c->need, c->most);
        all += J[1] * (v[1] + c->drift) + J[2] * v[2] + J[0] * (v[0] - u[0] - asks(c));
    }
    if (W.swings_too) lean_on_hinges(&none, &all);
    if (!(all > 0)) return;
    double less = none < 0 ? all / (all - none) : 1;
    if (W.swings_too) lessen_hinges(less);
    for (int n = 0; n < count; n++) {
        for (int k = 0; k < 3; k++) list[n].impulse[k] += more[k] = -less * list[n].impulse[k];
        push(list + n, more);
    }
}

/* Start from impulses of the step before, as far as they lower the cost: where contacts have opened,
   what had been pressed between others would throw disks out. */
static void start_warm(Contact *list, int count) {
    if (W.swings_too) start_hinges(0);
    for (int n = 0; n < count; n++) push(list + n, list[n].impulse);
    lessen(list, count);
}

/* Sweep over contacts, those of one disk with surfaces as one, until no relative velocity changes by
   more than `accurate`; the first `plain` ones are not hastened. Return by how much one changed in the
   last sweep, or INFINITY if the sweeps diverge. */
static double sweep(Contact *list, int count, int sweeps, int plain, double accurate) {
    double first = 0, worst = 0, size = 0;
    for (int n = 0; n < sweeps; n++) {
        if (n >= plain && (n - plain) % 2 == 0) size = hasten(list, count, n == plain ? -1 : size);
        worst = 0;
        for (int m = 0, many; m < count; m += many) {
            /* To and fro, so that what one end of a pile does reaches the other in one sweep; in the
               last one surfaces come last, which do not give way. */
            int to = (sweeps - n) % 2;
            Contact *c = list + (to ? m : count - 1 - m), *last = c;
            for (many = 1; c->j < 0 && !W.swings_too && m + many < count; many++, last += to ? 1 : -1)
                if ((to ? last + 1 : last - 1)->i != c->i || (to ? last + 1 : last - 1)->j >= 0) break;
            if (!to) c = last;
            double change = many > 1 ? press_corner(c, many) : press(c);
            for (int k = 0; k < many; k++) {
                c[k].change = rub(c + k);
                change = MAX(change, c[k].change);
            }
            if (many > 1) press_corner(c, many);
            worst = MAX(worst, change);
        }
        if (W.swings_too) worst = MAX(worst, turn_hinges());
        W.sweep_count++;
        if (n == 0) first = worst;
        if (worst <= accurate) return worst;
        if (!(worst <= DIVERGES * (first + W.soft + W.skip * W.disks[list->i].radius))) return INFINITY;
    }
    return worst;
}

/* Whether a surface that moves drives a disk. */
static int drives(const Contact *c) { return c->j < 0 && c->other[1] - c->moved[1] != 0; }

/* Stall the drives, for this step, of disks that do not turn and that block them: contacts that change by
   `least`, m/s, or more, and rough ones that slip by more than `enough` though their friction is not all used.
   Return whether there is one. */
static int stall(Contact *list, int count, double least, double enough) {
    int stalled = 0;
    for (int n = 0; n < count; n++) {
        Contact *c = list + n;
        double v[3];
        if (W.disks[c->i].inertia > 0 || !drives(c)) continue;
        relative(c, 0, v);
        int holds = c->impulse[0] > 0 && fabs(c->impulse[1]) < HOLDS * c->friction * c->impulse[0];
        int slips = c->friction > ROUGH && holds && fabs(v[1] + c->drift) > enough;
        if (!slips && c->change < least) continue;
        c->other[1] = c->moved[1];
        c->other[2] = c->moved[2];
        stalled = 1;
    }
    return stalled;
}

/* Take back friction beyond what contacts allow: sweeps that did not come to an end have pressed less
   since. */
static void keep_bounds(Contact *list, int count) {
    for (int n = 0; n < count; n++) {
        Contact *c = list + n;
        double more[3] = {0, 0, 0};
        for (int k = 1; k < 3; k++) {
            double most = bound(c, k == 2);
            more[k] = MIN(MAX(c->impulse[k], -most), most) - c->impulse[k];
            c->impulse[k] += more[k];
        }
        if (more[1] != 0 || more[2] != 0) push(c, more);
    }
}

/* Solve contacts by `sweeps` until changes are `accurate`; if gaps are closed but for `enough`, m/s, less
   will do. A crowd is swept again, up to so many rounds, of which the last is good enough if it crawls,
   and more finely where small changes leave gaps open. By itself (0 rounds), and where sweeps diverge,
   rigid bodies with all of the friction may have no solution, driven into a wedge that locks itself:
   there it is lowered until they have one. Gaps tell nothing of that where a drive presses: it presses
   harder in each sweep, so there the changes have to end, too. A disk that cannot turn is held where
   friction locks, and would slip away from a lower one: it stalls the drive, for this step, and so does
   one that others block on a belt that grips without bound, which never slips. */
void sweep_contacts(Contact *list, int count, int rounds, int sweeps, int plain, double accurate,
                    double enough) {
    double first = INFINITY;
    for (int left = TRIES, more = rounds;;) {
        double change = sweep(list, count, sweeps, plain, accurate), worst = change;
        int ended = change <= accurate;
        if (!ended) keep_bounds(list, count);
        if (!ended || W.interact) lessen(list, count);
        if (left == 0) break;
        int stalled = change < INFINITY && stall(list, count, INFINITY, enough);
        if (!stalled) {
            if (ended && more < 2) break;
            if (ended) accurate *= 0.1;
            if (change < INFINITY) {
                worst = 0;
                for (int n = 0; n < count; n++) {
                    const Contact *c = list + n;
                    double u[3], v[3];
                    relative(c, 1, u);
                    relative(c, 0, v);
                    worst = MAX(worst, asks(c) - v[0] + u[0]);
                    if (drives(c)) worst = MAX(worst, change);
                }
            }
            if (worst <= enough) break;
            if (change < INFINITY && more > 1) {
                if (more-- == rounds) first = change;
                continue;
            }
            if (more == 1 && change < CRAWLS * first) break;
            worst = 0;
            for (int n = 0; n < count; n++) worst = MAX(worst, list[n].change);
            stalled = stall(list, count, FOLLOWS * worst, INFINITY);
        }
        more = rounds;
        for (int n = 0; n < count; n++) {
            Contact *c = list + n;
            Disk *a = W.disks + c->i, *b = W.disks + MAX(c->j, 0);
            if (!stalled && c->change >= FOLLOWS * worst) c->share = left > 1 ? 0.25 * c->share : 0;
            a->vx = a->ux;
            a->vy = a->uy;
            a->spin = a->uspin;
            if (c->two) {
                b->vx = b->ux;
                b->vy = b->uy;
                b->spin = b->uspin;
            }
            c->impulse[0] = c->impulse[1] = c->impulse[2] = 0;
        }
        if (W.swings_too) start_hinges(1);
        left -= !stalled;
    }
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
    for (int i = W.low; i < W.high; i++) {
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
    /* Of each island a list of its contacts, which begins with its last. */
    for (int n = W.contact_count - 1; n >= 0; n--) {
        int k = island_of(W.contacts[n].i);
        next[n] = first[k];
        first[k] = n;
    }
    int count = 0;
    for (int n = 0; n < W.contact_count; n++) {
        int k = island_of(W.contacts[n].i);
        for (int m = first[k]; m >= 0; m = next[m]) {
            W.earlier[count] = W.contacts[m];
            W.earlier[count++].island = k;
        }
        first[k] = -1;
    }
    Contact *c = W.contacts;
    W.contacts = W.earlier;
    W.earlier = c;
}

/* Note by how much the step's impulses break their law: the kinetic energy after them, less that
   before, plus that of the change itself, is at most what moving surfaces give and what the contacts
   ask for. What is on its left is summed over disks, what is on its right over contacts. */
static void check_energy(int solves_hinges) {
    double gained = 0;
    for (int i = W.low; i < W.high; i++) {
        const Disk *d = W.disks + i;
        if (d->mode != FREE) continue;
        double x = d->vx - d->ux, y = d->vy - d->uy, w = d->spin - d->uspin;
        gained += d->mass * (x * d->vx + y * d->vy) + d->inertia * w * d->spin;
    }
    for (int n = 0; n < W.contact_count; n++) {
        const Contact *c = W.contacts + n;
        const double *J = c->impulse;
        double u[3];
        if (J[0] == 0) continue;
        relative(c, 1, u);
        gained -= J[0] * (u[0] + asks(c)) - J[1] * c->drift + J[2] * c->other[2];
        gained -= c->two ? 0 : J[0] * c->other[0] + J[1] * c->other[1];
        if (c->hung) gained += hinge_share(c);
    }
    if (solves_hinges) gained += gained_by_hinges();
    W.gained += MAX(gained, 0);
}

void solve_contacts(void) {
    int swings = 0;
    if (W.interact) sort_by_islands();
    for (int from = 0, to = 0; from < W.contact_count; from = to) {
        Contact *list = W.contacts + from;
        double least = INFINITY, heaviest = 0;
        int driven = 0;
        W.swings_too = 0;
        for (; to < W.contact_count && (!W.interact || W.contacts[to].island == list->island); to++) {
            const Contact *c = W.contacts + to;
            const Disk *a = W.disks + c->i, *b = W.disks + (c->j >= 0 ? c->j : c->i);
            least = MIN(least, MIN(a->radius, b->radius));
            heaviest = MAX(heaviest, MAX(a->mass, b->mass));
            driven |= !c->two && c->other[1] - c->moved[1] != 0;
            W.swings_too |= c->hung > 0;
        }
        swings |= W.swings_too;
        /* A drive presses as hard as it must: there no spring would hold, and friction is lowered. */
        for (int n = from; n < to; n++) {
            Contact *c = W.contacts + n;
            if (c->gives == 0) continue;
            c->gives *= driven ? 0 : 1 / heaviest;
            c->eases = 1 / (c->light[0] + c->gives);
        }
        start_warm(list, to - from);
        if (W.interact)
            sweep_contacts(list, to - from, MIN(MAX(SMALL / (to - from), 1), MOST_ROUNDS), W.sweeps,
                           PLAIN, W.accurate, W.skip * least);
        else solve_alone(list, to - from);
        for (int n = from; n < to; n++) {
            /* Rounding does not press; with endless friction even that would pull. */
            Contact *c = W.contacts + n;
            const Disk *a = W.disks + c->i;
            if (c->impulse[0] >= NOISE * c->mass[0] * (fabs(a->vx) + fabs(a->vy))) continue;
            for (int k = 0; k < 3; k++) c->impulse[k] = -c->impulse[k];
            push(c, c->impulse);
            c->impulse[0] = c->impulse[1] = c->impulse[2] = 0;
        }
        if (W.interact) lessen(list, to - from);
    }
    if (!W.interact && W.contact_count == 1) turn_slip(W.contacts);
    W.swings_too = swings;
    check_energy(swings);
    W.solve_count++;
}
