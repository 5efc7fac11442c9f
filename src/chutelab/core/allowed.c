/* What the laws allow in a run: its tracks are read once, for what is largest and for sums, and bounds follow from that.

   Bounds are derived, not fitted: for the exact engine from rounding, for the others also from what can happen within a
   step. */

#include "laws.h"

/* Overlap, in radii, that the pymunk engine does not remove. */
#define SLOP 1e-3
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
/* The square of a step of a crowd in the contact engine is at most FALL r / g. */
#define FALL 8e-3
/* Share of the radius by which a track of the pymunk engine may be off between two knots. */
#define LEAVES_OUT 1e-4
/* Share of the radius by which the pymunk engine enlarges its disks, and so their levers. */
#define HAIR 1e-10
/* Radii by which a particle may be off the circle on which it moves inside an arc. */
#define OFF_CIRCLE 0.1

struct Sums All;

static double kinetic(int i, const double *knot) {
    return 0.5 * L.bodies[i].mass * speed_squared(knot) + 0.5 * L.bodies[i].inertia * square(knot[5]);
}

static double up[2]; /* the direction against gravity */

static double height(const double *knot) { return up[0] * knot[1] + up[1] * knot[2]; } /* m */

static double potential(int i, const double *knot) { return L.bodies[i].mass * L.bodies[i].gravity * height(knot); }

/* Energy at a knot less what the ledger explains, J. */
double unexplained(int i, const double *knot) {
    return kinetic(i, knot) + potential(i, knot) - (knot[6] - knot[7] - knot[8]);
}

/* By how much the losses of the ledger fall from the knot before to this one, J, at most 0. If the contact engine holds a
   particle by itself in a narrow wedge, impulses of any size balance each other, and along normals it seems to gain what
   friction takes: there only the sum counts. Entries in whole units may fall by one more than they did. */
double given_back(const double *now) {
    const double *before = now - L.row;
    double normal = now[7] - before[7], slip = now[8] - before[8];
    if (L.engine == ENGINE_CONTACT && !L.interact) return normal + slip;
    return MIN(normal, slip) + L.unit;
}

/* Find the largest sizes of pieces, and the sums over all particles. */
void scan_machine(void) {
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
        if (body->corners) All.cornered += body->mass * body->radius;
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
PAIRED int scan_track(int i) {
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
int are_finite(void) {
    L.energy += fabs(All.lifted) + fabs(All.entries[0]) + fabs(All.entries[1]) + fabs(All.entries[2]);
    All.unreal += L.unreal;
    for (int n = 0; n < 3 * L.book_rows; n++) All.unreal += !isfinite(L.books[n]);
    if (All.bad.particles) tell_group(LAW_FINITE, &All.bad, All.unreal, 0);
    else if (All.unreal) tell(LAW_FINITE, All.unreal, 0);
    return !All.unreal;
}

/* Greatest acceleration of a particle towards the centre of an arc, m/s2, over those of its knots that are inside. */
static double bent_by(const Barrier *b, double r, int first, int end) {
    double inner = b->radius - r, low = MAX(inner - OFF_CIRCLE * r, 0), found = 0;
    if (b->mover) return inner > 0 ? square(L.speed) / inner : 0;
    for (int k = first; k < end && inner > 0; k++) {
        const double *knot = KNOT(k);
        double far = square(knot[1] - b->x) + square(knot[2] - b->y);
        if (far < square(low) || far >= square(inner + OFF_CIRCLE * r)) continue;
        if (is_within(b, knot[1], knot[2], 0)) found = MAX(found, speed_squared(knot) / inner);
    }
    return found;
}

/* The same over all particles and pieces. The centre of a particle that an arc bends is beside the arc, by its radius.
   Outside an arc the acceleration is never above that of gravity, as a faster particle lifts off. No particle is inside
   the drive pulley. */
PAIRED static double bent_inside(void) {
    double found = 0;
    int bent = 0;
    for (int n = 0; n < L.piece_count - (L.pulley != 0); n++) bent += L.barriers[n].radius > 0;
    for (int i = 0; i < L.particle_count && bent; i++) {
        double r = L.bodies[i].radius;
        Two reach = both((1 + OFF_CIRCLE) * r);
        for (int first = L.offsets[i], end; first < L.offsets[i + 1]; first = end) {
            Two low = two_at(KNOT(first) + 1), high = low;
            for (end = first + 1; end < MIN(first + WIDTH, L.offsets[i + 1]); end++) {
                Two place = two_at(KNOT(end) + 1);
                low = lesser(low, place);
                high = larger(high, place);
            }
            for (int n = 0; n < L.piece_count - (L.pulley != 0); n++) {
                const Barrier *b = L.barriers + n;
                int is_off = is_any((low - reach > two_at(b->box + 2)) | (high + reach < two_at(b->box)));
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
   r. A corner that comes back by rotation hops no faster than by a weight, without gravity by that on Earth: by a h / 2
   with (a h)^2 at most g FALL r. For lone particles a knot in contact has the mean velocity of a step, which differs from its ledger by half a step's
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
    if (!L.alike && All.gravity == 0) allowed += EARTH * FALL / 8 * All.cornered;
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
void find_allowed(double bent) {
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
double longest_step(void) {
    return All.gravity > 0 ? MIN(L.dt, sqrt(FALL * All.smallest / All.gravity)) : L.dt;
}

void find_limits(void) {
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
