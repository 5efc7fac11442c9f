/* The laws by which every run is judged: about finite numbers, energy and ledger, and long steps; those about places are
   in barriers.c. Bounds are derived, not fitted: for the exact engine from rounding, for the others also from what can
   happen within a step.

   A check shares nothing with what it checks: nothing here is from the engine's files. */

#include <stdlib.h>
#include <string.h>
#include "laws.h"

Laws L;

/* Room for hits at first. */
#define HITS 64
/* Number of times at which the energy of all particles is summed, and of instants at which overlaps are. */
#define INSTANTS 24
/* Overlap, in radii, that the pymunk engine does not remove. */
#define SLOP 1e-3
/* How the contact engine removes overlaps in a crowd, in radii. Overlaps up to LEFT stay. Of what is beyond, a step
   removes the share PARTS, all of it from DEEP on, and at least what gravity closes; but no more than OPENS. It removes
   less by GIVES / M for each N s of impulse, in m/s, with the heaviest mass M. The square of a step is at most FALL r /
   g. */
#define LEFT 5e-4
#define PARTS 0.1
#define DEEP 0.03
#define OPENS 1e-2
#define GIVES 3e-3
#define FALL 8e-3
/* Share of the energy in play that losses of a crowd may give back in a run. */
#define HELD 1e-2
/* m/s on Earth; changes of velocity that a track of the contact engine in a crowd may leave out, or those by hops. */
#define SMOOTH 1e-4
#define EARTH 9.81
/* Share of the radius by which the cubic between two knots may differ from the path of a particle by itself in the
   contact engine, which writes a knot where it would be more. */
#define BULGE 1e-5
/* Share of the energy turned over by which the contact engine's ledger may be wrong in a crowd, as it promises. */
#define BOOKED 1e-9
/* Overlap, in radii, that the contact engine may leave in a step beyond what it asks of a solve. */
#define UNSOLVED 0.1
/* Share of the radius by which a track of the pymunk engine may be off between two knots. */
#define LEAVES_OUT 1e-4
/* Share of the radius by which the pymunk engine enlarges its disks, and so their levers. */
#define HAIR 1e-10

static int last_of(int i) { return L.offsets[i + 1] - 1; }

static int is_released(int i) { return L.offsets[i + 1] > L.offsets[i]; }

static double speed_squared(const double *knot) { return square(knot[3]) + square(knot[4]); }

static double kinetic(int i, const double *knot) {
    return 0.5 * L.bodies[i].mass * speed_squared(knot) + 0.5 * L.bodies[i].inertia * square(knot[5]);
}

static double up[2]; /* the direction against gravity */

static double height(const double *knot) { return up[0] * knot[1] + up[1] * knot[2]; } /* m */

static double potential(int i, const double *knot) { return L.bodies[i].mass * L.bodies[i].gravity * height(knot); }

/* Energy at a knot less what the ledger explains, J. */
static double unexplained(int i, const double *knot) {
    return kinetic(i, knot) + potential(i, knot) - (knot[6] - knot[7] - knot[8]);
}

/* By how much the losses of the ledger fall from the knot before to this one, J, at most 0. If the contact engine holds a
   particle by itself in a narrow wedge, impulses of any size balance each other, and along normals it seems to gain what
   friction takes: there only the sum counts. Entries in whole units may fall by one more than they did. */
static double given_back(const double *now) {
    const double *before = now - L.row;
    double normal = now[7] - before[7], slip = now[8] - before[8];
    if (L.engine == ENGINE_CONTACT && !L.interact) return normal + slip;
    return MIN(normal, slip) + L.unit;
}

/* Breaches. */

/* Knots that break a law, found in the order of particles. */
typedef struct { int particles, particle, latest, knot; } Group;

/* Sums over all particles, and the largest and least values of one. `lightness` sums 1 / mass. `size` is of pieces: the
   largest coordinate and length of segments, coordinate and radius of arcs; `belts` their largest speed. `whirl` is the
   largest speed of a corner by rotation, m/s; `reach` the largest coordinate or length of anything, m. For particles that
   do not meet also the energy that is unexplained at their ends, J, its largest change between two knots, and the least
   value of `given_back`. */
static struct {
    double mass, lightness, weight, heaviest, smallest, gravity, size[4], belts;
    double t, knot_t, place, reach, fastest, whirl, lifted, entries[3], residual, change, back;
    Group bad;
    int unreal;
} All;

static Breach *tell(int law, double amount, double bound) {
    Breach *one = L.breaches + L.breach_count++;
    *one = (Breach){All.knot_t, NAN, NAN, amount, bound, law, 0, -1, -1, -1, 0};
    return one;
}

static void add(Group *group, int i, int knot) {
    const double *now = KNOT(knot), *first = KNOT(group->knot);
    if (!group->particles || now[0] < first[0] || (isnan(now[0]) && !isnan(first[0]))) {
        group->knot = knot;
        group->particle = i;
    }
    group->particles += !group->particles || group->latest != i;
    group->latest = i;
}

static void tell_group(int law, const Group *group, double amount, double bound) {
    if (!group->particles) return;
    const double *knot = KNOT(group->knot);
    Breach *one = tell(law, amount, bound);
    one->t = knot[0];
    one->x = knot[1];
    one->y = knot[2];
    one->particles = group->particles;
    one->particle = group->particle;
}

/* Bounds. */

/* Find the largest sizes of pieces, and the sums over all particles. */
static void scan_machine(void) {
    sin_cos(-L.tilt, up, up + 1);
    double *start = All.size, *length = All.size + 1, *center = All.size + 2, *radius = All.size + 3;
    for (int k = 0; k < L.piece_count * members(); k++) {
        const Barrier *b = L.barriers + k;
        double *from = b->radius ? center : start;
        *from = MAX(*from, MAX(fabs(b->x), fabs(b->y)));
        *length = MAX(*length, b->length);
        *radius = MAX(*radius, b->radius);
        double haste, swift = swiftest(b, &haste);
        All.belts = MAX(All.belts, fabs(b->speed) + swift);
        L.haste = MAX(L.haste, haste);
        for (int n = 0; n < 4 && b->mover; n++) *start = MAX(*start, fabs(b->box[n]));
    }
    for (int i = 0; i < L.particle_count; i++) {
        const Body *body = L.bodies + i;
        All.mass += body->mass;
        All.lightness += 1 / body->mass;
        All.weight += body->mass * body->gravity;
        All.heaviest = MAX(All.heaviest, body->mass);
        All.gravity = MAX(All.gravity, body->gravity);
        All.smallest = i ? MIN(All.smallest, body->radius) : body->radius;
        for (int k = L.offsets[i]; k < L.offsets[i + 1] && body->corners; k++)
            All.whirl = MAX(All.whirl, fabs(KNOT(k)[5]) * L.largest);
    }
}

/* Count the numbers in a particle's track that are not finite. */
static int count_not_finite(int i) {
    int unreal = 0;
    for (int k = L.offsets[i]; k < L.offsets[i + 1]; k++) {
        int own = 0;
        for (int n = 0; n < 9; n++) own += !isfinite(KNOT(k)[n]);
        if (own) add(&All.bad, i, k);
        unreal += own;
    }
    return unreal;
}

/* Read all numbers of a particle: return whether they are finite, and update the largest of each kind. Also the energy in
   play, J: for a lone particle the most that it had or that was booked on it, for a crowd the energy turned over. */
PAIRED static int scan_track(int i) {
    if (!is_released(i)) return 1;
    const double *first = KNOT(L.offsets[i]), *last = KNOT(last_of(i));
    double mass = L.bodies[i].mass, half = 0.5 * mass, turning = 0.5 * L.bodies[i].inertia;
    double weight = mass * L.bodies[i].gravity, begin = unexplained(i, first), before = begin;
    int is_nip = L.engine == ENGINE_CONTACT && !L.interact, row = L.row;
    /* Greatest |x| and |y|; greatest change of the unexplained energy, and energy in play; greatest square of the speed;
       least of `given_back`; and the sum of all numbers, which times zero is zero if they are finite. */
    Two place = both(0), energy = both(0), fastest = both(0), back = both(0), all = both(0);
    Two old = two_at(first + 7);
    double worked = 0;
    for (const double *knot = first; knot <= last; knot += row) {
        Two at = size_of(two_at(knot + 1)), v = two_at(knot + 3), rest = two_at(knot + 5), losses = two_at(knot + 7);
        Two given = losses - old, squares = v * v, works = size_of(rest), lost = size_of(losses);
        double swift = squares[0] + squares[1], moving = half * swift + turning * square(rest[0]);
        double now = moving + weight * height(knot) - (rest[1] - losses[0] - losses[1]);
        double in_play = works[1] + lost[0] + lost[1] + weight * at[1] + moving;
        all += two_at(knot) + at + (v + rest) + losses;
        if (is_nip) given = both(given[0] + given[1]);
        place = larger(place, at);
        energy = larger(energy, size_of((Two){ now - before, in_play }));
        fastest = larger(fastest, both(swift));
        back = lesser(back, given);
        worked = MAX(worked, works[1]);
        before = now;
        old = losses;
    }
    All.t = MAX(All.t, MAX(fabs(first[0]), fabs(last[0])));
    All.knot_t = MAX(All.knot_t, last[0]);
    All.place = MAX(All.place, MAX(place[0], place[1]));
    All.fastest = MAX(All.fastest, fastest[0]);
    if (L.interact) {
        /* A pendulum may have no kinetic energy at its start. */
        L.energy += L.joined ? half * fastest[0] : kinetic(i, first);
        All.lifted += potential(i, last) - potential(i, first);
        /* A drive that starts and stops may have done no work at the end. */
        All.entries[0] += L.mover_count ? worked : last[6];
        for (int n = 1; n < 3; n++) All.entries[n] += last[6 + n];
    } else {
        L.energy += energy[1];
        All.residual += before - begin;
        All.change = MAX(All.change, energy[0]);
        All.back = MIN(All.back, MIN(back[0], back[1]));
    }
    int unreal = is_all(0 * all == 0) ? 0 : count_not_finite(i);
    All.unreal += unreal;
    return !unreal;
}

/* Report whether all numbers are finite, after all particles have been read. */
static int are_finite(void) {
    L.energy += fabs(All.lifted) + fabs(All.entries[0]) + fabs(All.entries[1]) + fabs(All.entries[2]);
    All.unreal += L.unreal;
    for (int n = 0; n < 3 * L.book_rows; n++) All.unreal += !isfinite(L.books[n]);
    if (All.bad.particles) tell_group(LAW_FINITE, &All.bad, All.unreal, 0);
    else if (All.unreal) tell(LAW_FINITE, All.unreal, 0);
    return !All.unreal;
}

/* Greatest acceleration of a particle towards the centre of an arc, m/s2, over those of its knots that are inside. */
static double bent_by(const Barrier *b, double r, int first, int end) {
    double inner = b->radius - r, low = MAX(inner - 0.1 * r, 0), found = 0;
    if (b->mover) return inner > 0 ? square(L.speed) / inner : 0;
    for (int k = first; k < end && inner > 0; k++) {
        const double *knot = KNOT(k);
        double far = square(knot[1] - b->x) + square(knot[2] - b->y);
        if (far < square(low) || far >= square(inner + 0.1 * r)) continue;
        if (is_within(b, knot[1], knot[2], 0)) found = MAX(found, speed_squared(knot) / inner);
    }
    return found;
}

/* The same over all particles and pieces. Outside an arc the acceleration is never above that of gravity, as a faster
   particle lifts off. No particle is inside the drive pulley. */
PAIRED static double bent_inside(void) {
    double found = 0;
    int bent = 0;
    for (int n = 0; n < L.piece_count - (L.pulley != 0); n++) bent += L.barriers[n].radius > 0;
    for (int i = 0; i < L.particle_count && bent; i++) {
        double r = L.bodies[i].radius;
        for (int first = L.offsets[i], end; first < L.offsets[i + 1]; first = end) {
            Two low = two_at(KNOT(first) + 1), high = low;
            for (end = first + 1; end < MIN(first + WIDTH, L.offsets[i + 1]); end++) {
                Two place = two_at(KNOT(end) + 1);
                low = lesser(low, place);
                high = larger(high, place);
            }
            for (int n = 0; n < L.piece_count - (L.pulley != 0); n++) {
                const Barrier *b = L.barriers + n;
                int is_off = is_any((low > two_at(b->box + 2)) | (high < two_at(b->box)));
                if (b->radius > 0 && !is_off) found = MAX(found, bent_by(b, r, first, end));
            }
        }
    }
    return found;
}

/* How far a step may take a disk beyond a surface, m. If all steps are alike (Chipmunk), a contact is found up to a step
   late, so it is the path in a step, and Chipmunk's slop. Impacts of a lone particle are resolved at their instants;
   where it stays in contact, a step goes straight on, off by less than a dt^2. On a straight surface a is g; on a rim
   also v^2 / rho, which is at most g if the disk does not lift off; inside an arc it may be more. In a crowd of the
   contact engine disks are pressed into each other. */
static double lateness(void) {
    if (L.engine == ENGINE_EXACT) return 0;
    if (L.alike) return (L.speed + All.whirl) * L.dt + SLOP * L.largest;
    if (L.interact) return PRESSED * L.largest;
    return (2 * (All.gravity + L.haste) + L.bent) * square(L.dt);
}

/* Error of the energy by rounding, as a share of the energy in play. Every contact rounds it. For particles that do not
   meet, the energy in play includes their weight times the largest length, because a height is only as exact as the
   coordinates that it comes from, even if it is small itself (a disk in an arc that is hardly wider). In a stepped engine
   each contact also changes the energy by the weight times `late`, where an overlap is removed; the impulses themselves
   are booked exactly. */
static double energy_share(void) {
    double share = EPS * (ROUNDINGS + A_CONTACT * (double)L.contacts), touched = MAX(1, L.contacts);
    if (L.engine == ENGINE_EXACT) return share;
    if (L.interact && L.engine == ENGINE_CONTACT) return BOOKED;
    share += EPS * A_CONTACT * L.steps;
    if (L.engine != ENGINE_CONTACT) share += touched * HAIR;
    return share + (L.energy ? touched * All.heaviest * All.gravity * L.late / L.energy : 0);
}

/* Energy that the removal of overlaps may give, J: at most what lifts all particles by the greatest overlap, against
   pushes by hand, too. On a surface that accelerates by a they also hop by a h^2 / 8 in a step h, with a h^2 at most FALL
   r. For lone particles a knot in contact has the mean velocity of a step, which differs from its ledger by half a step's
   acceleration: that of gravity along the path, and that of an arc across it. Two that a cohesion F holds hop by it with
   the energy (F h)^2 / 4 m, half of m being the mass of their relative motion; each has three such contacts. */
static double energy_parted(void) {
    if (L.engine == ENGINE_EXACT) return 0;
    if (!L.interact) {
        double across = 0.5 * square(0.5 * L.bent * L.dt);
        return All.heaviest * (L.speed * (All.gravity + L.haste) * L.dt + across);
    }
    double hop = L.alike ? 0 : MIN(FALL * All.smallest, L.haste * square(L.dt)) / 8;
    double allowed = All.mass * ((All.gravity + L.hastened) * L.late + L.haste * hop);
    if (!L.alike) allowed += 0.75 * square(L.cohesion * L.dt) * All.lightness;
    if (L.alike) {
        /* The pymunk engine leaves out contacts that move a track by less than LEAVES_OUT of the radius. A cubic with an
           end velocity that is off by w is off by 4/27 w tau in place, where tau is a step or more. */
        double off = 27.0 / 4 * LEAVES_OUT * L.largest / L.dt;
        allowed += 2 * All.heaviest * L.speed * off;
    }
    return allowed;
}

/* Set how deep a disk may be in a surface, from what has been read so far and an acceleration inside arcs. The rounding
   of the clock moves a particle, too: by half an ulp of t times its speed. */
static void find_allowed(double bent) {
    const double *start = All.size, *length = All.size + 1, *center = All.size + 2, *radius = All.size + 3;
    L.speed = MAX(sqrt(All.fastest), All.belts);
    All.reach = MAX(MAX(L.largest, *start + *length), All.place);
    if (*radius) All.reach = MAX(All.reach, *center + *radius + L.largest);
    L.length = MAX(All.reach, L.speed * All.t);
    L.rounding = ROUNDINGS * EPS * L.length;
    L.arcs = (ON_ARCS + L.loose) * (L.largest + *radius);
    L.bent = bent;
    L.late = lateness();
    int lone = L.engine == ENGINE_CONTACT && !L.interact;
    L.allowed = L.rounding + L.arcs + L.late + (lone ? BULGE * L.largest : 0);
}

/* Longest step of a crowd, s: with gravity it is short enough for its hops. */
static double longest_step(void) {
    return All.gravity > 0 ? MIN(L.dt, sqrt(FALL * All.smallest / All.gravity)) : L.dt;
}

static void find_bounds(void) {
    find_allowed(L.engine == ENGINE_EXACT ? 0 : bent_inside());
    if (!L.interact) L.energy += All.weight * All.reach;
    L.energy_bound = energy_share();
    L.parted = energy_parted();
    L.held = L.parted + HELD * L.energy;
    /* m v w: in a crowd a track may leave out a change w of the velocity. */
    double swift = All.gravity > 0 ? sqrt(All.gravity / EARTH) : 1;
    int crowd = L.interact && L.engine == ENGINE_CONTACT;
    L.untold = crowd ? All.mass * L.speed * MAX(SMOOTH * swift, All.gravity * longest_step()) : 0;
    /* In a file entries and kinetic energies of all are off by up to so much each, see results/packing.py. */
    L.untold += 2 * L.unit * sqrt(L.particle_count);
}

/* Places. */

static int goes_through(int n) {
    const Hit *hit = L.hits + n;
    for (int k = n; k >= 0 && L.hits[k].particle == hit->particle; k--) {
        if (L.hits[k].passes && L.hits[k].piece == hit->piece) return 1;
    }
    for (int k = n; k < L.hit_count && L.hits[k].particle == hit->particle; k++) {
        if (L.hits[k].passes && L.hits[k].piece == hit->piece) return 1;
    }
    return 0;
}

static void tell_hits(int passes) {
    const Hit *first = 0;
    double deepest = 0;
    int count = 0, particles = 0, latest = -1;
    for (int n = 0; n < L.hit_count; n++) {
        const Hit *hit = L.hits + n;
        if (hit->passes != passes || (!passes && goes_through(n))) continue;
        if (!first || hit->t < first->t) first = hit;
        deepest = MAX(deepest, hit->depth);
        particles += hit->particle != latest;
        latest = hit->particle;
        count++;
    }
    if (!first) return;
    Breach *one = tell(passes ? LAW_THROUGH : LAW_INSIDE, passes ? count : deepest,
                       passes ? 0 : L.allowed);
    long row = first->piece + member_of(first->particle) * L.piece_count;
    one->t = first->t;
    one->x = first->x;
    one->y = first->y;
    one->particles = particles;
    one->particle = first->particle;
    one->surface = L.barriers[row].surface;
    one->piece = first->piece;
}

/* What may overlap is bound in radii of the smaller of two. Two that meet in steps that are all alike may come as late as
   either of them at a surface. */
static void judge_overlaps(void) {
    double bound = L.alike ? MAX(PRESSED, 2 * L.late / All.smallest) : PRESSED;
    Breach found = {.particle = -1};
    find_overlaps(bound, &found);
    if (!found.particles) return;
    Breach *one = tell(LAW_APART, found.amount, bound);
    one->t = found.t;
    one->x = found.x;
    one->y = found.y;
    one->particles = found.particles;
    one->particle = found.particle;
}

/* Energy. */

/* The last knot of a particle at or before a time, but never the last of all; -1 if the particle isn't there then. */
static int knot_before(int i, double t) {
    int low = L.offsets[i], high = last_of(i);
    if (high < low || t < KNOT(low)[0] || t > KNOT(high)[0]) return -1;
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (KNOT(middle)[0] <= t) low = middle;
        else high = middle;
    }
    return low;
}

/* Unexplained energy of a particle at a time between two knots, J, on the cubic of its track. */
static double unexplained_at(int i, const double *knot, double t) {
    const double *next = knot + L.row;
    double now[9], h = next[0] - knot[0], share = h > 0 ? (t - knot[0]) / h : 1;
    place_at(knot, share, now + 1, now + 2);
    for (int n = 3; n < 9; n++) now[n] = knot[n] + share * (next[n] - knot[n]);
    /* The cubic's velocity is that which changes evenly, and a parabola that makes up for the rest of the way. */
    for (int n = 0; n < 2 && h > 0; n++) {
        double rest = (next[1 + n] - knot[1 + n]) / h - 0.5 * (knot[3 + n] + next[3 + n]);
        now[3 + n] += 6 * share * (1 - share) * rest;
    }
    return unexplained(i, now);
}

/* Unexplained energy of all particles together on their tracks, J: the greatest, over some times, of its lower bound. It
   isn't recorded when a particle got energy from another between its knots, only how much: at any time between two knots
   it has at least the least of the values at both and of that on the track, which may be lower while a joint takes
   energy. */
static double risen(void) {
    double found = 0;
    int end = L.offsets[L.particle_count], stride = MAX(1, end / INSTANTS);
    for (int n = 0; n < end; n += stride) {
        double t = KNOT(n)[0], sum = 0;
        for (int i = 0; i < L.particle_count; i++) {
            if (!is_released(i)) continue;
            const double *first = KNOT(L.offsets[i]), *last = KNOT(last_of(i));
            int k = knot_before(i, t);
            if (last[0] < t) {
                sum += unexplained(i, last) - unexplained(i, first);
            } else if (k >= 0) {
                double ends = MIN(unexplained(i, KNOT(k)), unexplained(i, KNOT(k + 1)));
                sum += MIN(ends, unexplained_at(i, KNOT(k), t)) - unexplained(i, first);
            }
        }
        found = MAX(found, sum);
    }
    return found;
}

static double sum_opened(double depth, double least, double step) {
    double deep = depth / least, beyond = MAX(deep - LEFT, 0), share = MIN(MAX(PARTS, deep / DEEP), 1) * beyond;
    share = MAX(share, MIN(beyond, 2 * All.gravity * square(step) / least));
    return depth > 0 ? square(MIN(share, OPENS) * least / step) : 0;
}

/* Sort the numbers of rows by the first number of each row. */
static const double *Rows;
static int Row;

static int compare(const void *one, const void *other) {
    double a = Rows[(long)*(const int *)one * Row], b = Rows[(long)*(const int *)other * Row];
    return (a > b) - (a < b);
}

static void sort(int *numbers, int count, const double *rows, int row) {
    Rows = rows;
    Row = row;
    qsort(numbers, count, sizeof(int), compare);
}

/* Energy that the removal of overlaps may give in a step at a time, J. A solve raises the kinetic energy by at most the
   sum of J a, where J is the impulse of a contact and a the speed at which it is to open. An overlap d opens like a
   spring: a = p d / h - c J, with c = GIVES / M. So J a is at most (p d / h)^2 / (4 c). The host may ask for it once the
   run has been judged. */
EXPORT double opened(double t) {
    double step = longest_step(), sum = 0, *at = L.places;
    int *there = L.order, count = 0;
    for (int i = 0; i < L.particle_count; i++) {
        int k = knot_before(i, t);
        if (k < 0) continue;
        const double *knot = KNOT(k);
        double h = knot[L.row] - knot[0];
        place_at(knot, h > 0 ? (t - knot[0]) / h : 1, at + 2 * i, at + 2 * i + 1);
        there[count++] = i;
    }
    sort(there, count, at, 2);
    for (int n = 0; n < count; n++) {
        int i = there[n];
        double x = at[2 * i], y = at[2 * i + 1], r = L.bodies[i].radius;
        for (int k = n + 1; k < count && at[2 * there[k]] <= x + 2 * L.largest; k++) {
            int j = there[k];
            double depth = r + L.bodies[j].radius - length_of(at[2 * j] - x, at[2 * j + 1] - y);
            sum += sum_opened(depth, MIN(r, L.bodies[j].radius), step);
        }
        for (int k = 0; k < L.piece_count; k++) {
            const Barrier *b = L.barriers + k;
            double u = x, v = y;
            if (t < b->appears || t >= b->vanishes) continue;
            if (x < b->box[0] - r || x > b->box[2] + r || y < b->box[1] - r || y > b->box[3] + r) {
                continue;
            }
            to_rest(b, t, &u, &v);
            sum += sum_opened(r - distance(b, u, v), r, step);
        }
    }
    return All.heaviest / (4 * GIVES) * sum;
}

/* An instant of a crowd, and all that is given back then, J. */
typedef struct { double t, given; } Instant;

/* Find the instants at which more energy is given back than overlaps may give, among those at which most is given back.
   In a crowd of the contact engine only the sum over an instant counts. */
static int beyond_overlaps(double most, Instant *worst, double *least) {
    int count = 0, found = 0, bad = 0, *rows = L.order;
    for (int i = 0; i < L.particle_count; i++) {
        for (int k = L.offsets[i] + 1; k < L.offsets[i + 1]; k++) {
            if (given_back(KNOT(k)) < -most) rows[count++] = k;
        }
    }
    sort(rows, count, L.knots, L.row);
    for (int n = 0; n < count;) {
        Instant now = {KNOT(rows[n])[0], 0};
        for (; n < count && KNOT(rows[n])[0] == now.t; n++) now.given += given_back(KNOT(rows[n]));
        if (found == INSTANTS && now.given >= worst[found - 1].given) continue;
        int at = found < INSTANTS ? found++ : found - 1;
        for (; at > 0 && worst[at - 1].given > now.given; at--) worst[at] = worst[at - 1];
        worst[at] = now;
    }
    for (int n = 0; n < found; n++) {
        double allowed = most + MAX(opened(worst[n].t), opened(worst[n].t - L.dt));
        if (worst[n].given >= -allowed) continue;
        if (!bad) *least = allowed;
        worst[bad++] = worst[n];
    }
    return bad;
}

/* Whether no lone particle's unexplained energy changes, and no loss falls, from one knot to the next by more than so
   much. */
static int is_even(double most) { return All.change <= most && All.back >= -most; }

/* Whether particles lie on each other as a pile does, with all energy that losses give back from overlaps: no surface moves,
   no joint pulls, and the incoming belt carries none by adhesion, which may be deep in others as it leaves. */
static int is_pile(void) {
    int plain = L.interact && L.engine == ENGINE_CONTACT;
    plain &= !(L.mover_count || L.joined);
    for (int i = 0; i < L.particle_count && plain; i++) plain = !L.bodies[i].group;
    return plain;
}

/* Judge energy and ledger. For lone particles the unexplained energy must not change from knot to knot. Particles that
   meet give energy to each other, so for them it is the sum over all, at the steps of the contact engine and on the tracks
   at some times, and what its solves gained. Losses must not fall, except by what the removal of overlaps gives; if many
   fall at one instant, by what the overlaps of that instant give. Nor may the sums of a pile fall for long. */
static void judge_books(double bound) {
    double most = bound + L.parted, least = most, rise = 0, back = 0, residual = All.residual, low = 0;
    int crowd = L.interact && L.engine == ENGINE_CONTACT, count = 0, surface = -1;
    int is_sound = !L.interact && is_even(most);
    Group rises = {0}, backs = {0};
    Instant instants[INSTANTS];
    if (crowd) is_sound = !(count = beyond_overlaps(most, instants, &least));
    for (int i = 0; i < L.particle_count && (L.interact || !is_sound); i++) {
        if (!is_released(i)) continue;
        double first = unexplained(i, KNOT(L.offsets[i])), before = first;
        if (L.interact) residual += unexplained(i, KNOT(last_of(i))) - first;
        for (int k = L.offsets[i] + 1; k < L.offsets[i + 1] && !is_sound; k++) {
            double own = given_back(KNOT(k));
            int told = own < -most;
            if (told && crowd) {
                told = 0;
                for (int n = 0; n < count; n++) told |= KNOT(k)[0] == instants[n].t;
            }
            if (told) {
                back = crowd ? instants[0].given : MIN(back, own);
                add(&backs, i, k);
            }
            if (L.interact) continue;
            double now = unexplained(i, KNOT(k)), change = fabs(now - before);
            before = now;
            if (change <= most) continue;
            rise = MAX(rise, change);
            add(&rises, i, k);
        }
    }
    /* The engine's sums at its steps are exact, tracks are not. */
    double summed = MAX(L.gained, L.risen), exact = bound + 2 * L.unit * sqrt(L.particle_count);
    if (L.interact && summed > exact) {
        tell(LAW_ENERGY, summed, exact);
    } else if (L.interact) {
        rise = risen();
        if (rise > most + L.untold) tell(LAW_ENERGY, rise, most + L.untold);
    }
    tell_group(LAW_ENERGY, &rises, rise, most);
    tell_group(LAW_LOSSES, &backs, back, -least);
    for (int n = 0; n < L.book_rows; n++) {
        double loss = MIN(L.books[3 * n + 1], L.books[3 * n + 2]);
        if (loss >= low) continue;
        low = loss;
        surface = n % L.surface_count;
    }
    if (low < -most) tell(LAW_LOSSES, low, -most)->surface = surface;
    if (is_pile() && L.regained > bound + L.held) tell(LAW_LOSSES, -L.regained, -bound - L.held);
    if (fabs(residual) > bound) tell(LAW_LEDGER, fabs(residual), bound);
    if (L.interact && L.unsolved > UNSOLVED) tell(LAW_SOLVED, L.unsolved, UNSOLVED);
}

/* If Chipmunk finds contacts only at the ends of steps, no particle may move past one in a step. A particle that flies
   where nothing is does no harm: only those that may reach a surface, or another particle, in a step are judged. */
static void judge_steps(void) {
    double box[4] = {INFINITY, INFINITY, -INFINITY, -INFINITY}, way = 0, radius = 1;
    if (!L.alike || L.speed * L.dt < All.smallest || !(L.piece_count || L.interact)) return;
    for (int k = 0; k < L.piece_count; k++) {
        const double *own = L.barriers[k].box;
        for (int n = 0; n < 2; n++) {
            box[n] = MIN(box[n], own[n]);
            box[n + 2] = MAX(box[n + 2], own[n + 2]);
        }
    }
    Group bad = {0};
    for (int i = 0; i < L.particle_count; i++) {
        double r = L.bodies[i].radius;
        for (int k = L.offsets[i]; k < L.offsets[i + 1]; k++) {
            const double *knot = KNOT(k);
            double own = sqrt(speed_squared(knot)) * L.dt, reach = r + own;
            if (own < r) continue;
            if (L.piece_count && (knot[1] < box[0] - reach || knot[1] > box[2] + reach
                || knot[2] < box[1] - reach || knot[2] > box[3] + reach)) continue;
            add(&bad, i, k);
            if (own * radius <= way * r) continue;
            way = own;
            radius = r;
        }
    }
    tell_group(LAW_STEP, &bad, way, radius);
}

/* Reserve the arrays that the host fills in, and those of the results. */
EXPORT int lay_out_laws(void) {
    int crowd = L.interact && L.engine == ENGINE_CONTACT;
    RESERVE(L.knots, (double)L.knot_count * L.row);
    RESERVE(L.angles, L.outline_count ? L.knot_count : 1);
    RESERVE(L.outlines, 2.0 * L.outline_count);
    RESERVE(L.offsets, L.particle_count + 1);
    RESERVE(L.bodies, L.particle_count);
    RESERVE(L.barriers, (double)L.piece_count * members());
    RESERVE(L.books, 3.0 * L.book_rows);
    RESERVE(L.movers, L.mover_count);
    RESERVE(L.swings, L.swing_count);
    RESERVE(L.breaches, BREACHES);
    RESERVE(L.order, crowd ? MAX(L.knot_count, L.particle_count) : L.interact ? L.particle_count : 1);
    RESERVE(L.places, crowd ? 2.0 * L.particle_count : 1);
    RESERVE(L.paths, L.interact ? L.particle_count : 1);
    RESERVE(L.passing, L.kind_count * (double)L.kind_count);
    return has_room();
}

/* Find the knots of a particle: they follow those of the one before. */
static void find_track(int i) {
    int k = L.offsets[i];
    while (k < L.knot_count && ((const Knot *)KNOT(k))->disk == i) k++;
    L.offsets[i + 1] = k;
}

/* Prepare to read tracks: find what the machine alone tells. */
static void begin_judging(void) {
    L.breach_count = L.hit_count = 0;
    L.energy = 0;
    L.haste = L.hastened;
    memset(&All, 0, sizeof All);
    shape_barriers();
    scan_machine();
    find_allowed(0);
}

/* Judge a run, if there is room for all hits. First each particle is checked once, while its knots are in the cache: an
   overlap that is allowed for the particle alone is allowed in the whole run. If there is a larger one, or if steps are
   all alike, so that every contact may overlap, all are checked again. */
static void judge_all(void) {
    int again = L.alike;
    begin_judging();
    for (int i = 0; i < L.particle_count; i++) {
        if (L.owned) find_track(i);
        if (scan_track(i) && !again) again = find_hits(i);
    }
    if (!are_finite()) return; /* The other laws mean nothing if a number is not finite. */
    find_bounds();
    L.hit_count = 0;
    for (int i = 0; i < L.particle_count && again; i++) find_hits(i);
    if (L.hit_count > L.hit_room) return;
    /* A crowd at rest turns over no energy, but its heights are rounded all the same; with joints, which pull to and fro,
       once in each step. */
    double rounds = L.interact ? EPS * All.weight * All.reach * (L.joined ? sqrt(MAX(L.steps, 1)) : 1) : 0;
    double bound = L.energy_bound * L.energy + rounds;
    tell_hits(1);
    tell_hits(0);
    if (L.interact) judge_overlaps();
    judge_books(bound);
    judge_steps();
}

/* Judge a run: report each law that it breaks once, that of losses up to twice, in the order of the laws. */
EXPORT int judge(void) {
    for (int room = HITS; room; room = L.hit_count > room ? L.hit_count : 0) {
        RESERVE(L.hits, room);
        if (!has_room()) return 0;
        L.hit_room = room;
        judge_all();
    }
    return 1;
}

/* Judge particles of the exact engine up to `end` while others still run, each while its knots are in the cache; return
   whether nothing stands out. Knots of the last call are not needed any more. */
int judge_some(int end) {
    if (!L.judged) begin_judging();
    for (; L.judged < end; L.judged++) {
        find_track(L.judged);
        if (!scan_track(L.judged) || find_hits(L.judged)) return 0;
    }
    return 1;
}

/* Judge such a run as a whole; return 0 if that needs all its knots. */
int judge_rest(void) {
    if (!are_finite()) return 0;
    find_bounds();
    double bound = L.energy_bound * L.energy;
    if (!is_even(bound)) return 0;
    judge_books(bound);
    return 1;
}

EXPORT Laws *laws(void) { return &L; }
