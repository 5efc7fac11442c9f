/* Whether particles are inside each other: at instants evenly spread over a run, where all are at once.

   What lasts for less than the time from one instant to the next is not seen. Nothing holds apart what rods and pins join, nor
   what the incoming belt carries by adhesion, which the summary describes.

   A check shares nothing with what it checks: nothing here is from the engine's files. */

#include "laws.h"

/* Instants at the least, and particles that are looked at over all of them: a hundredth of the time of a run. */
#define LOOKS 100
#define PLACES 20000

/* Find where all particles are at t, m: at infinity those that are not there. */
static void find_places(double t) {
    for (int i = 0; i < L.particle_count; i++) {
        int last = L.offsets[i + 1] - 1, *k = L.cursors + i;
        double *at = L.places + 2 * i;
        at[0] = INFINITY;
        if (last < L.offsets[i] || t < KNOT(L.offsets[i])[0] || t > KNOT(last)[0]) continue;
        while (*k < last - 1 && KNOT(*k + 1)[0] <= t) ++*k;
        const double *knot = KNOT(*k);
        double h = knot[L.row] - knot[0];
        place_at(knot, h > 0 ? (t - knot[0]) / h : 1, at, at + 1);
    }
}

/* Sort particles by x: they are nearly in the order of the instant before. */
static void sort_places(int *order) {
    for (int n = 1; n < L.particle_count; n++) {
        int i = order[n], to = n;
        for (; to > 0 && L.places[2 * order[to - 1]] > L.places[2 * i]; to--) order[to] = order[to - 1];
        order[to] = i;
    }
}

/* Whether two may be in one place: kinds that do not meet, or members of a group. */
static int may_overlap(const Body *a, const Body *b) {
    return L.passing[a->kind * L.kind_count + b->kind] || (a->group && a->group == b->group);
}

/* Find the particles that are deeper in others than by `bound`, in radii of the smaller of two: how many, the first of them,
   when and where that is, and how deep one is at most. */
void find_overlaps(double bound, Breach *found) {
    double begin = INFINITY, end = -INFINITY;
    int *order = L.order, looks = MAX(LOOKS, PLACES / MAX(L.particle_count, 1));
    for (int i = 0; i < L.particle_count; i++) {
        order[i] = i;
        L.cursors[i] = L.offsets[i];
        L.bodies[i].overlaps = 0;
        if (L.offsets[i + 1] == L.offsets[i]) continue;
        begin = MIN(begin, KNOT(L.offsets[i])[0]);
        end = MAX(end, KNOT(L.offsets[i + 1] - 1)[0]);
    }
    for (int look = 0; look <= looks && begin <= end; look++) {
        double t = look < looks ? begin + look * (end - begin) / looks : end;
        find_places(t);
        sort_places(order);
        for (int n = 0; n < L.particle_count; n++) {
            Body *a = L.bodies + order[n];
            const double *at = L.places + 2 * order[n];
            for (int m = n + 1; m < L.particle_count && at[0] < INFINITY; m++) {
                Body *b = L.bodies + order[m];
                const double *other = L.places + 2 * order[m];
                double reach = a->radius + b->radius, x = other[0] - at[0], y = other[1] - at[1];
                if (x >= a->radius + L.largest) break;
                if (x >= reach || fabs(y) >= reach) continue;
                double deep = (reach - hypot(x, y)) / MIN(a->radius, b->radius);
                if (deep <= bound || may_overlap(a, b)) continue;
                if (!found->particles) {
                    found->particle = order[n];
                    found->t = t;
                    found->x = at[0];
                    found->y = at[1];
                }
                found->amount = MAX(found->amount, deep);
                found->particles += !a->overlaps + !b->overlaps;
                a->overlaps = b->overlaps = 1;
            }
        }
    }
}
