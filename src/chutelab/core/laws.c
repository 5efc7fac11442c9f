/* The laws by which every run is judged, in their order, and what is told of each that it breaks. Those about places are in
   hits.c and overlaps.c, those about energy in energy.c, and what they allow is in allowed.c.

   A check shares nothing with what it checks: nothing here is from the engine's files. */

#include <string.h>
#include "laws.h"

Laws L;

/* Room for hits at first. */
#define HITS 64

Breach *tell(int law, double amount, double bound) {
    Breach *one = L.breaches + L.breach_count++;
    *one = (Breach){All.knot_t, NAN, NAN, amount, bound, law, 0, -1, -1, -1, 0};
    return one;
}

void add(Group *group, int i, int knot) {
    const double *now = KNOT(knot), *first = KNOT(group->knot);
    if (!group->particles || now[0] < first[0] || (isnan(now[0]) && !isnan(first[0]))) {
        group->knot = knot;
        group->particle = i;
    }
    group->particles += !group->particles || group->latest != i;
    group->latest = i;
}

void tell_group(int law, const Group *group, double amount, double bound) {
    if (!group->particles) return;
    const double *knot = KNOT(group->knot);
    Breach *one = tell(law, amount, bound);
    one->t = knot[0];
    one->x = knot[1];
    one->y = knot[2];
    one->particles = group->particles;
    one->particle = group->particle;
}

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
    find_limits();
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
    find_limits();
    double bound = L.energy_bound * L.energy;
    if (!is_even(bound)) return 0;
    judge_books(bound);
    return 1;
}

EXPORT Laws *laws(void) { return &L; }
