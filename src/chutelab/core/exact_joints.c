/* How pieces join, for the exact engine.

   The pieces that end at a place, sorted by the angles at which they leave it, divide its surroundings into sectors. A
   disk is in one of them and can touch only the two faces that bound it. If the angle between these is pi, they are
   *flush*, and a ride on one continues on the other; if it is larger, it continues round the place; if it is smaller, the
   ride is stopped before. */

#include <stdlib.h>
#include "exact_pieces.h"

/* Share of a curvature; two pieces that leave a place in the same direction lie on each other if their curvatures differ
   by less. */
#define CIRCULAR 1e-9
/* rad; at a concave bend this slight a piece may, by rounding, end before the next one is met: it continues as the next
   one. */
#define SLIGHT 1e-7
/* Replaces the number of an end for a piece that passes through a place: first along it, then back. */
#define THROUGH 2

/* A piece as seen from a place where it ends, or which it passes; `number` counts those of the place. */
typedef struct { double angle, bend; int piece, end, number; } Ray;

static Ray *rays, *ring, *flat;

static int by_angle(const void *one, const void *other) {
    const Ray *a = one, *b = other;
    int by = compared(a->angle, b->angle);
    return by ? by : a->number - b->number;
}

static double angle_at(double x, double y) { return modulo(angle_of(y, x), TURN); }

/* List the pieces at a place as rays that leave it. */
static int list_rays(int first) {
    int count = 0;
    for (int n = first; n != NONE; n = next_there[n]) {
        const Tip *tip = O.tips + n;
        double bend = n / 2 < O.faces ? 0.0 : 1.0 / bends[n / 2 - O.faces]->radius;
        rays[count] = (Ray){ angle_at(-tip->out[0], -tip->out[1]), n % 2 ? bend : -bend, n / 2, n % 2, count };
        count++;
    }
    for (int n = first; n != NONE; n = next_there[n]) {
        const Tip *tip = O.tips + n;
        int through = O.faces + tip->rests, known = tip->rests == NONE;
        for (int k = 0; k < count; k++) known |= rays[k].piece == through;
        if (known) continue;
        /* By rounding the place isn't exactly at the top of the pulley, but the belt is flush. */
        int wheel = tip->rests == O.arcs;
        const Arc *a = wheel ? 0 : bends[tip->rests];
        double x = wheel ? tip->left[0] : tip->x - a->center[0];
        double y = wheel ? tip->left[1] : tip->y - a->center[1];
        double bend = 1.0 / (wheel ? O.all[O.pulley].bend : a->radius);
        rays[count] = (Ray){ angle_at(y, -x), -bend, through, THROUGH, count };
        count++;
        rays[count] = (Ray){ angle_at(-y, x), bend, through, THROUGH + 1, count };
        count++;
    }
    return count;
}

/* The face of a piece that is on the left as it leaves the place; the right one has the other sign. */
static int left_of(const Ray *r) { return r->end == 0 || r->end == THROUGH ? 1 : -1; }
static int tip_of(const Ray *r) { return 2 * r->piece + r->end; }

/* Sort rays of the same angle counterclockwise by curvature; of those that lie on each other keep the first. */
static int sort_by_bend(Ray *some, int count) {
    int kept = 0;
    for (int n = 0; n < count; n++) {
        Ray ray = some[n];
        int alike = 0;
        for (int k = 0; k < kept; k++)
            alike |= fabs(ray.bend - some[k].bend) <= CIRCULAR * fabs(some[k].bend);
        if (!alike) some[kept++] = ray;
    }
    for (int n = 1; n < kept; n++)
        for (int k = n; k > 0 && some[k].bend < some[k - 1].bend; k--) {
            Ray ray = some[k];
            some[k] = some[k - 1], some[k - 1] = ray;
        }
    return kept;
}

/* Sort the rays of a place that exist in an epoch into `flat`; return the number. `turns`
   becomes 1 if all have the same angle. Of those that lie on each other only the first is kept. */
static int sort_rays(int count, int epoch, int *turns) {
    int some = 0, kept = 0, last = 0;
    for (int n = 0; n < count; n++)
        if (is_there(face_of(rays[n].piece, 1), epoch)) ring[some++] = rays[n];
    qsort(ring, some, sizeof *ring, by_angle);
    for (int n = 1; n < some; n++)
        if (!(ring[n].angle - ring[last].angle <= COLLINEAR)) last = n;
    *turns = last == 0;
    if (last && ring[0].angle + TURN - ring[last].angle <= COLLINEAR) {
        /* An angle just below a full turn is the same as one just above 0. */
        int first = 1;
        while (first < last && ring[first].angle - ring[0].angle <= COLLINEAR) first++;
        *turns = first == last;
        for (int n = 0; n < first; n++) flat[kept++] = ring[n];
        for (int n = last; n < some; n++) flat[kept++] = ring[n];
        kept = sort_by_bend(flat, kept);
        for (int n = first; n < last; n++) ring[n - first] = ring[n];
        some = last - first;
    }
    for (int n = 0; n < some;) {
        int begin = kept, first = n;
        while (n < some && ring[n].angle - ring[first].angle <= COLLINEAR) flat[kept++] = ring[n++];
        kept = begin + sort_by_bend(flat + begin, kept - begin);
    }
    return kept;
}

/* Angle from a ray to the next one counterclockwise. */
static double angle_after(int n, int count, int turns) {
    if (count == 1 || (turns && n == count - 1)) return TURN;
    double angle = modulo(flat[(n + 1) % count].angle - flat[n].angle, TURN);
    return TURN - angle <= COLLINEAR ? 0.0 : angle;
}

static void go_onward(Onward *to, const Ray *r, int face, const Ray *other, int onto, int meets) {
    if (r->end < THROUGH)
        to[2 * tip_of(r) + (face < 0)] = (Onward){ face_of(other->piece, onto), onto, meets };
}

/* Find what bounds a sector together with a face at its end, and on what a slide along the face continues there: on that
   if it is flush, else on the circle round the end, with side 0, as it is open. */
static void find_onward(int epoch) {
    Onward *to = O.onward + epoch * 2 * O.tip_count, *opposite = O.opposite + epoch * 2 * O.tip_count;
    for (int n = 0; n < 2 * O.tip_count; n++) {
        to[n] = (Onward){ O.tips[n / 2].circle, 0, 0 };
        opposite[n] = (Onward){ NONE, 0, 0 };
    }
    for (int n = 0; n < O.tip_count; n++) {
        if (at_spot[O.tips[n].spot] != n) continue;
        int turns, count = sort_rays(list_rays(n), epoch, &turns);
        for (int k = 0; k < count; k++) {
            double angle = angle_after(k, count, turns);
            const Ray *right = flat + k, *left = flat + (k + 1) % count;
            int meets = angle < PI - SLIGHT;
            go_onward(opposite, right, left_of(right), left, -left_of(left), meets);
            go_onward(opposite, left, -left_of(left), right, left_of(right), meets);
            if (!(angle > COLLINEAR && angle <= PI + COLLINEAR)) continue;
            go_onward(to, right, left_of(right), left, -left_of(left), meets);
            go_onward(to, left, -left_of(left), right, left_of(right), meets);
        }
    }
}

/* Set the crowns of an epoch: unit vectors to the middle of that half of an end that belongs to the left face. At a free
   end it is the piece's left normal. At a joint the rim between two pieces belongs to one face of both, however wide it is, and its
   middle bisects the angle between them: it has the direction of the sum of both normals and both ways out. */
static void find_crowns(int epoch) {
    double *crowns = O.crowns + 2 * epoch * O.tip_count;
    for (int n = 0; n < 2 * O.tip_count; n++) crowns[n] = 0.0;
    for (int n = 0; n < O.tip_count; n++) {
        if (at_spot[O.tips[n].spot] != n) continue;
        int first = n, other = NONE, begins = 0, turns, count = sort_rays(list_rays(n), epoch, &turns);
        while (first != NONE && (O.tips[first].circle == NONE || !is_there(face_of(first / 2, 1), epoch)))
            first = next_there[first];
        if (first == NONE) continue;
        for (int k = 0; k < count; k++) {
            const Ray *one = flat + k, *two = flat + (k + 1) % count;
            if (one == two || angle_after(k, count, turns) < PI - COLLINEAR) continue;
            if (one->end >= THROUGH || two->end >= THROUGH) continue;
            if (tip_of(one) == first) other = tip_of(two), begins = 1;
            else if (tip_of(two) == first) other = tip_of(one), begins = 0;
        }
        const Tip *tip = O.tips + first, *next = other == NONE ? 0 : O.tips + other;
        double sign = next && other % 2 != first % 2 ? 1.0 : -1.0, way = begins == first % 2 ? -1.0 : 1.0;
        for (int k = 0; k < 2; k++) {
            double more = next ? sign * next->left[k] + way * (tip->out[k] + next->out[k]) : 0.0;
            crowns[2 * tip->spot + k] = tip->left[k] + more;
        }
    }
}

static void join(int set, int obstacle, int faces, int edge) {
    for (int m = O.sets[set]; m != NONE; m = O.members[m].next)
        if (O.members[m].obstacle == obstacle) {
            O.members[m].faces |= faces, O.members[m].edges |= edge;
            return;
        }
    Obstacle *o = O.all + obstacle;
    O.members[O.member_count] = (Member){ set, obstacle, faces, edge, O.sets[set], o->members };
    O.sets[set] = o->members = O.member_count++;
}

/* Find the sets of what a disk touches at once where faces end: faces that share a place and the normal there, and the
   circle round it. */
static void find_sets(void) {
    double(*normals)[2] = (double(*)[2])flat;
    for (int n = 0; n < O.tip_count; n++) {
        if (at_spot[O.tips[n].spot] != n) continue;
        int first = O.set_count, count = list_rays(n);
        for (int k = 0; k < 2 * count; k++) {
            const Ray *r = rays + k / 2;
            int face = k % 2 ? -1 : 1, set = first, end = r->end < THROUGH;
            double x, y;
            if (r->end > THROUGH) continue;
            if (end) x = O.tips[tip_of(r)].left[0], y = O.tips[tip_of(r)].left[1];
            else sin_cos(r->angle, &x, &y), x = -x;
            x *= face, y *= face;
            while (set < O.set_count
                   && !(fabs(normals[set - first][0] - x) <= COLLINEAR
                        && fabs(normals[set - first][1] - y) <= COLLINEAR))
                set++;
            if (set == O.set_count) {
                normals[set - first][0] = x, normals[set - first][1] = y;
                O.sets[O.set_count++] = NONE;
            }
            int own = face_of(r->piece, face);
            if (own != NONE)
                join(set, own, own < O.faces ? 1 + k % 2 : 3, end && own >= O.faces ? 1 + r->end : 0);
            if (!end) continue;
            Tip *tip = O.tips + tip_of(r);
            tip->sets[k % 2] = set;
            if (tip->circle != NONE) join(set, tip->circle, 3, 0);
        }
    }
}

static void hand_over(int obstacle, int tip, int face, int onto) {
    Obstacle *o = O.all + obstacle;
    O.handovers[O.handover_count] = (Handover){ tip, face, onto, o->handovers };
    o->handovers = O.handover_count++;
}

/* Find where rides round circles continue on other pieces; the last one found comes first. */
static void find_handovers(void) {
    for (int n = O.tip_count - 1; n >= 0; n--)
        for (int k = 0; k < 2; k++) {
            int face = n % 2 ? 1 - k : k;
            Onward next = O.onward[2 * n + face];
            if (n / 2 >= O.faces) hand_over(face_of(n / 2, face ? -1 : 1), n, face, 0);
            if (O.tips[n].rests != NONE && next.obstacle != NONE && !next.meets) hand_over(next.obstacle, n, face, 1);
            if (O.tips[n].circle != NONE) hand_over(O.tips[n].circle, n, face, 1);
        }
}

/* Find how pieces join; return 0 if there is no room for it. */
int find_joints(void) {
    int tips = O.tip_count, epochs = O.change_count + 1;
    rays = take_room(3 * tips, sizeof *rays);
    ring = take_room(3 * tips, sizeof *ring);
    flat = take_room(6 * tips, sizeof *flat);
    O.onward = take_room(2.0 * tips * epochs, sizeof *O.onward);
    O.opposite = take_room(2.0 * tips * epochs, sizeof *O.opposite);
    O.crowns = take_room(2.0 * tips * epochs, sizeof *O.crowns);
    O.members = take_room(16 * tips, sizeof *O.members);
    O.sets = take_room(6 * tips, sizeof *O.sets);
    O.handovers = take_room(6 * tips, sizeof *O.handovers);
    if (arena_full) return 0;
    O.set_count = O.member_count = O.handover_count = 0;
    for (int epoch = 0; epoch < epochs; epoch++) {
        find_onward(epoch);
        find_crowns(epoch);
    }
    find_sets();
    find_handovers();
    O.stops = take_room(4.0 * O.faces + O.handover_count + 2 + 2.0 * (O.count - O.faces), sizeof *O.stops);
    return !arena_full;
}
