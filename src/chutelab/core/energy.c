/* The laws about energy and ledger. */

#include <stdlib.h>
#include "laws.h"

/* Number of times at which the energy of all particles is summed, and of instants at which overlaps are. */
#define INSTANTS 24
/* How the contact engine removes overlaps in a crowd, in radii. Overlaps up to LEFT stay. Of what is beyond, a step
   removes the share PARTS, all of it from DEEP on, and at least what gravity closes; but no more than OPENS. It removes
   less by GIVES / M for each N s of impulse, in m/s, with the heaviest mass M. */
#define LEFT 5e-4
#define PARTS 0.1
#define DEEP 0.03
#define OPENS 1e-2
#define GIVES 3e-3
/* Overlap, in radii, that the contact engine may leave in a step beyond what it asks of a solve. */
#define UNSOLVED 0.1

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
        int own = knot_before(i, t);
        for (int k = n + 1; k < count && at[2 * there[k]] <= x + 2 * L.largest; k++) {
            int j = there[k];
            sum += sum_opened(depth_at(i, own, j, knot_before(j, t), t), MIN(r, L.bodies[j].radius), step);
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
int is_even(double most) { return All.change <= most && All.back >= -most; }

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
void judge_books(double bound) {
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
