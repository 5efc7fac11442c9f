/* Where a track overlaps a surface, or passes through one: checked along its whole path, not only at its knots.

   Between two knots a track is a cubic with four control points. Its distance from the line of a straight piece is a
   cubic too; the square of its distance from a centre is a polynomial of degree 6. In Bernstein form neither is below its
   least coefficient or above its largest. So most intervals are proven to be clear of a piece at once. The others are
   halved until they are clear or short; short ones are measured. G. Farin, Curves and Surfaces for CAGD, ch. 5, 6.

   A check shares nothing with what it checks: nothing here is from the engine's files. */

#include "laws.h"

/* Halvings of an interval at most: a flight of 5 m is then checked every millimetre. */
#define HALVINGS 12
/* Most pieces that are looked through anew after each blow, as a track goes on to others there. */
#define FEW 8
/* Places of each interval at which the check for a particle that is clear of a gate is made. */
#define GATED 64
/* Longest distance from one check to the next, in radii, for a particle near a moving piece. */
#define STRIDE 0.05

typedef struct { Two p[4]; } Curve;

/* Lower left and upper right corner. */
typedef struct { Two low, high; } Box;

/* The interval of a track and the piece that are being checked. */
static struct {
    Barrier *piece;
    int particle, number, knot; /* of the piece; of the knot before */
    double radius, limit;       /* m; how near the centre may come without a check ... */
    double reach;               /* m; of its corners, or its radius */
    double begin, margin;       /* ... and that at the beginning; margin of boxes */
    int deepest;                /* the hit of this interval that is no passage, or -1 */
} At;

static int is_cornered(void) { return L.outline_count && L.bodies[At.particle].corners; }

PAIRED static Box all_apart(void) { return (Box){ both(INFINITY), both(-INFINITY) }; }

PAIRED static int apart(const Box *a, const double *piece, double margin) {
    return is_any((a->low >= two_at(piece + 2) + margin) | (a->high <= two_at(piece) - margin));
}

/* Paths: cubics by their control points. */

/* The sum of each of two pairs. */
PAIRED static Two sums(Two a, Two b) {
    return __builtin_shufflevector(a, b, 0, 2) + __builtin_shufflevector(a, b, 1, 3);
}

/* The path after a knot. Its cubic in time is what a recording has; where a family, of which only the ends are kept, goes
   round a circle, it is the one nearest to the circle with the same directions at its ends. */
PAIRED static Curve curve_after(const double *knot) {
    const double *next = knot + L.row;
    Two from = two_at(knot + 1), to = two_at(next + 1), v = two_at(knot + 3), w = two_at(next + 3), part;
    if (L.owned && ((const Knot *)next)->inner >= 2) {
        Two chord = to - from, squares = sums(v * v, w * w), others = sums(chord * chord, v * w);
        double turned = sqrt(0.5 + 0.5 * others[1] / sqrt(squares[0] * squares[1]));
        part = 2.0 / 3 / (1 + turned) * __builtin_elementwise_sqrt(both(others[0]) / squares);
    } else
        part = both((next[0] - knot[0]) * (1.0 / 3));
    return (Curve){{ from, from + part[0] * v, to - part[1] * w, to }};
}

PAIRED static Two place_on(const Curve *c, double share) {
    double s = share, r = 1 - s;
    return r * r * (r * c->p[0] + 3 * s * c->p[1]) + s * s * (3 * r * c->p[2] + s * c->p[3]);
}

/* Position at a share of the interval after a knot. */
PAIRED void place_at(const double *knot, double share, double *x, double *y) {
    Curve c = curve_after(knot);
    Two place = place_on(&c, share);
    *x = place[0];
    *y = place[1];
}

/* Bernstein coefficients of the square of the distance from a place, m2; the last of the seven is there twice. */
PAIRED static void square_distance(const Curve *c, Two place, Two *q) {
    Two a = c->p[0] - place, b = c->p[1] - place, d = c->p[2] - place, e = c->p[3] - place, last = e * e;
    q[0] = sums(a * a, a * b);
    q[1] = sums(0.4 * (a * d) + 0.6 * (b * b), 0.1 * (a * e) + 0.9 * (b * d));
    q[2] = sums(0.4 * (b * e) + 0.6 * (d * d), d * e);
    q[3] = sums(last, last);
}

/* Whether all coefficients are at least, or at most, a bound. */
PAIRED static int all_from(const Two *a, int n, double bound) {
    Truth yes = a[0] >= bound;
    for (int k = 1; k < n; k++) yes &= a[k] >= bound;
    return is_all(yes);
}

PAIRED static int all_to(const Two *a, int n, double bound) {
    Truth yes = a[0] <= bound;
    for (int k = 1; k < n; k++) yes &= a[k] <= bound;
    return is_all(yes);
}

/* Scalar products of a vector with the vectors from a place to the control points. */
PAIRED static void along_vector(const Curve *c, Two place, Two vector, Two *found) {
    found[0] = sums((c->p[0] - place) * vector, (c->p[1] - place) * vector);
    found[1] = sums((c->p[2] - place) * vector, (c->p[3] - place) * vector);
}

/* Whether a path beyond an end is clear of it. Rounding may put the foot a little before the end; the limit allows for
   that. */
PAIRED static int is_clear_of_end(const Curve *c, const double *end, double limit) {
    double reach = MAX(limit + L.rounding, 0);
    Two q[4];
    square_distance(c, two_at(end), q);
    return all_from(q, 4, reach * reach);
}

PAIRED static int is_clear_of_line(const Curve *c, const Barrier *b, double limit) {
    Two from = two_at(&b->x), tangent = two_at(&b->tx), d[2], feet[2];
    double reach = MAX(limit, 0);
    along_vector(c, from, (Two){ -tangent[1], tangent[0] }, d);
    if (all_from(d, 2, limit) || all_to(d, 2, -limit)) return 1;
    along_vector(c, from, tangent, feet);
    if (all_to(feet, 2, -reach) || all_from(feet, 2, b->length + reach)) return 1;
    if (all_to(feet, 2, L.rounding)) return is_clear_of_end(c, b->end, limit);
    return all_from(feet, 2, b->length - L.rounding) && is_clear_of_end(c, b->end + 2, limit);
}

/* Whether a whole path is left of the ray from the centre through an end (side = 1), or right of it (-1), within
   rounding: along the arc, where a particle inside can touch it, that is at most the rounding. */
PAIRED static int is_aside(const Curve *c, const Barrier *b, const double *end, double side) {
    Two center = two_at(&b->x), out = side * (two_at(end) - center), beyond[2];
    along_vector(c, center, (Two){ -out[1], out[0] }, beyond);
    return all_from(beyond, 2, -L.rounding * MAX(b->radius - At.radius, 0));
}

PAIRED static int is_clear_of_arc(const Curve *c, const Barrier *b, double limit) {
    double outer = b->radius + limit, inner = b->radius - limit;
    Two q[4];
    square_distance(c, two_at(&b->x), q);
    /* The first coefficient tells which of both may hold. For a mass point the limit is below 0 at first, so both may. */
    if (q[0][0] >= outer * outer && all_from(q, 4, outer * outer)) return 1;
    if (inner > 0 && q[0][0] <= inner * inner && all_to(q, 4, inner * inner)) return 1;
    if (b->whole) return 0;
    /* Beyond the ends: not counterclockwise of the first end, or not clockwise of the last one; both for an arc of more
       than half a circle. */
    int not_after = is_aside(c, b, b->end, -1), not_before = is_aside(c, b, b->end + 2, 1);
    int off = b->extent > PI ? not_after && not_before : not_after || not_before;
    return off && is_clear_of_end(c, b->end, limit) && is_clear_of_end(c, b->end + 2, limit);
}

PAIRED static int is_clear(const Curve *c, const Barrier *b, double limit) {
    return b->radius == 0 ? is_clear_of_line(c, b, limit) : is_clear_of_arc(c, b, limit);
}

/* Particles with corners. */

/* Angle of a particle at a share of the interval after a knot, rad. Between knots the spin changes at a constant rate; the
   remaining difference of the angle is spread evenly. */
double angle_at(int knot, double share) {
    const double *now = KNOT(knot), *next = now + L.row;
    double h = next[0] - now[0], missed = L.angles[knot + 1] - L.angles[knot] - 0.5 * h * (now[5] + next[5]);
    return L.angles[knot] + share * (h * (now[5] + 0.5 * share * (next[5] - now[5])) + missed);
}

/* Set the corners of a particle at a share of the interval after a knot, with its centre at (x, y), in the frame of a
   piece. Return how many. */
static int corners_at(int knot, double share, double x, double y, const Barrier *b, double (*p)[2]) {
    const Body *body = L.bodies + At.particle;
    double t = KNOT(knot)[0] + share * (KNOT(knot + 1)[0] - KNOT(knot)[0]), angle = angle_at(knot, share);
    double c = cos(angle), s = sin(angle);
    for (int n = 0; n < body->corners; n++) {
        const double *q = L.outlines + 2 * (body->outline + n);
        p[n][0] = x + c * q[0] - s * q[1];
        p[n][1] = y + s * q[0] + c * q[1];
        to_rest(b, t, p[n], p[n] + 1);
    }
    return body->corners;
}

/* Add an edge of a particle to how far it is beyond an arc, m: outside the circle, and inside it. Only what is next to a
   place where the edge crosses the arc counts, and not if the end of the arc may be inside the particle there. */
static void add_edge(const Barrier *b, const double *q, const double *r, double *beyond) {
    double x = q[0] - b->x, y = q[1] - b->y, ex = r[0] - q[0], ey = r[1] - q[1];
    double a = ex * ex + ey * ey, half = x * ex + y * ey, root = half * half - a * (x * x + y * y - b->radius * b->radius);
    for (int side = -1; side <= 1 && root > 0; side += 2) {
        double share = (-half + side * sqrt(root)) / a;
        if (share < 0 || share > 1 || !is_within(b, q[0] + share * ex, q[1] + share * ey, L.allowed)) continue;
        /* Outside is an end of the edge; deepest inside the place nearest to the centre. */
        const double *out = side < 0 ? q : r;
        double deepest = MIN(MAX(-half / a, 0), 1);
        beyond[0] = MAX(beyond[0], length_of(out[0] - b->x, out[1] - b->y) - b->radius);
        beyond[1] = MAX(beyond[1], b->radius - length_of(x + deepest * ex, y + deepest * ey));
    }
}

/* How deep a polygon is in a piece, m. For a straight piece the least overlap over all
   separating axes, below 0 if it is clear. For an arc how far the polygon is outside its circle, or inside it, or how deep
   an end of the arc is in it, whichever is least; else 0. */
static double deep_in(const Barrier *b, double (*p)[2], int count) {
    double clear = -INFINITY, low = INFINITY, high = -INFINITY, beyond[2] = {0, 0}, ends[2] = {INFINITY, INFINITY};
    for (int n = 0; n < count; n++) {
        const double *q = p[n], *r = p[n + 1 < count ? n + 1 : 0];
        double ex = r[0] - q[0], ey = r[1] - q[1], size = length_of(ex, ey), off[2];
        for (int k = 0; k < 2; k++) {
            off[k] = ((b->end[2 * k] - q[0]) * ey - (b->end[2 * k + 1] - q[1]) * ex) / size;
            ends[k] = MIN(ends[k], -off[k]);
        }
        clear = MAX(clear, MIN(off[0], off[1]));
        if (b->radius > 0) add_edge(b, q, r, beyond);
        else {
            low = MIN(low, beside(b, q[0], q[1]));
            high = MAX(high, beside(b, q[0], q[1]));
        }
    }
    if (b->radius == 0) return -MAX(clear, MAX(low, -high));
    double far = MIN(beyond[0], beyond[1]), end = b->whole ? 0 : MAX(ends[0], ends[1]);
    return end > 0 ? far > 0 ? MIN(far, end) : end : far;
}

/* Hits. */

static double side_margin(void) { return MAX(L.rounding, (ON_ARCS + L.loose) * L.largest); }

static int is_there(const Barrier *b, double t) { return t >= b->appears && t < b->vanishes; }

static Hit *add_hit(double t, double x, double y, double depth, int passes) {
    static Hit lost;
    Hit *hit = L.hit_count < L.hit_room ? L.hits + L.hit_count : &lost;
    L.hit_count++;
    *hit = (Hit){t, x, y, depth, At.particle, At.number, passes, 0};
    return hit;
}

/* Time from which a particle on which a gate has closed is clear of it; overlaps count from then on. */
static double clear_from(void) {
    const Barrier *b = At.piece;
    for (int k = L.offsets[At.particle]; k < L.offsets[At.particle + 1] - 1; k++) {
        const double *knot = KNOT(k);
        double h = knot[L.row] - knot[0];
        for (int n = 0; n <= GATED; n++) {
            double x, y, t = knot[0] + h * n / GATED;
            if (t < b->appears) continue;
            place_at(knot, (double)n / GATED, &x, &y);
            if (distance(b, x, y) >= At.radius) return t;
        }
    }
    return INFINITY;
}

/* How deep a particle may be in a piece because it began there, m: as deep as at its release; without bound in a gate
   that closed on it, until it is clear of the gate. */
static double forgiven(double t) {
    const double *first = KNOT(L.offsets[At.particle]);
    int gate = At.piece->appears > first[0];
    if (!gate) return MAX(At.radius - distance(At.piece, first[1], first[2]), 0);
    if (isnan(At.piece->clear)) At.piece->clear = clear_from();
    return t > At.piece->clear ? 0 : INFINITY;
}

/* From now on, search this interval only for deeper places and for passages: a centre that is on the piece may still pass
   it. */
static void look_deeper_than(double depth) {
    if (At.radius > 0) At.limit = MAX(At.radius - depth, L.rounding);
}

/* Measure an interval that is as short as it gets: add a hit if it is a breach. */
PAIRED static void measure(const Curve *c, double begin, double size) {
    const Barrier *b = At.piece;
    double deep[2], x[2] = { c->p[0][0], c->p[3][0] }, y[2] = { c->p[0][1], c->p[3][1] };
    for (int n = 0; n < 2; n++) deep[n] = At.radius - distance(b, x[n], y[n]);
    int at = deep[1] > deep[0];
    double off = beside(b, x[0], y[0]), beyond = beside(b, x[1], y[1]);
    double share = off / (off - beyond); /* of the way, to where it meets the line or the circle */
    int passes = (off > 0) != (beyond > 0)
        && is_within(b, x[0] + share * (x[1] - x[0]), y[0] + share * (y[1] - y[0]), side_margin());
    const double *knot = KNOT(At.knot);
    double t = knot[0] + (begin + size * at) * (knot[L.row] - knot[0]);
    if (!(passes || deep[at] > L.allowed) || !is_there(b, t) || t < b->appears + L.dt) return;
    double spared = forgiven(t);
    if (!((passes && spared < INFINITY) || deep[at] > spared + L.allowed)) return;
    double depth = deep[at] - MIN(spared, At.radius);
    if (!passes) look_deeper_than(deep[at] + L.rounding);
    if (passes) {
        /* Each passage counts; of the other places of an interval only the deepest. */
        add_hit(t, x[at], y[at], depth, 1);
    } else if (At.deepest < 0) {
        At.deepest = L.hit_count;
        add_hit(t, x[at], y[at], depth, 0);
    } else if (At.deepest < L.hit_room && depth > L.hits[At.deepest].depth) {
        L.hits[At.deepest] = (Hit){t, x[at], y[at], depth, At.particle, At.number, 0, 0};
    }
}

PAIRED static void halve(const Two *a, Two *first, Two *last) {
    Two middle = 0.5 * (a[1] + a[2]);
    first[0] = a[0];
    first[1] = 0.5 * (a[0] + a[1]);
    first[2] = 0.5 * (first[1] + middle);
    last[3] = a[3];
    last[2] = 0.5 * (a[2] + a[3]);
    last[1] = 0.5 * (middle + last[2]);
    first[3] = last[0] = 0.5 * (first[2] + last[1]);
}

PAIRED static void halve_until_clear(const Curve *c, double begin, double size, int halvings) {
    if (is_clear(c, At.piece, At.limit)) return;
    if (halvings == HALVINGS) {
        measure(c, begin, size);
        return;
    }
    Curve first, last;
    halve(c->p, first.p, last.p);
    halve_until_clear(&first, begin, 0.5 * size, halvings + 1);
    halve_until_clear(&last, begin + 0.5 * size, 0.5 * size, halvings + 1);
}

/* Check an interval beside a piece whose box it overlaps. */
PAIRED static void check_interval(const Curve *c, Barrier *b, int number, int knot) {
    if (is_clear(c, b, At.begin)) return;
    /* On the rim of a circle, the coefficients of a long interval are below the real distance; those of its halves hardly
       are. */
    Curve half, rest;
    halve(c->p, half.p, rest.p);
    if (is_clear(&half, b, At.begin) && is_clear(&rest, b, At.begin)) return;
    At.piece = b;
    At.number = number;
    At.knot = knot;
    At.deepest = -1;
    At.limit = At.begin;
    double t = KNOT(knot)[0], next = KNOT(knot + 1)[0];
    if (next < b->appears + L.dt || t > b->vanishes) return;
    if (L.pulley && number == 0) {
        /* The incoming belt ends on the pulley: beyond that end the pulley is near, not the belt. */
        Two feet[2];
        along_vector(c, two_at(&b->x), two_at(&b->tx), feet);
        if (all_from(feet, 2, b->length)) return;
    }
    double spared = forgiven(next);
    if (spared == INFINITY) return;
    look_deeper_than(L.allowed + spared);
    halve_until_clear(c, 0, 1, 0);
}

/* The side of a piece on which a path first leaves it, followed from its beginning or back from its end: 1 or -1; 0 if it
   stays on the piece or passes its ends. */
PAIRED static int side_of(const Barrier *b, const Curve *c, int is_end) {
    for (double share = 1.0 / (1 << HALVINGS); share <= 1; share *= 2) {
        Two place = place_on(c, is_end ? 1 - share : share);
        double d = beside(b, place[0], place[1]);
        if (fabs(d) <= L.allowed) continue;
        return is_within(b, place[0], place[1], side_margin()) ? (d > 0) - (d < 0) : 0;
    }
    return 0;
}

/* Add a hit where a mass point reaches a piece at a knot from one side and continues on the other: if an impact doesn't
   turn a point back, no interval contains the passage. */
PAIRED static void check_knot(const Curve *before, const Curve *after, const Barrier *pieces, int knot) {
    const double *now = KNOT(knot);
    for (int k = 0; k < L.piece_count; k++) {
        const Barrier *b = pieces + k;
        if (distance(b, now[1], now[2]) > L.allowed || !is_there(b, now[0])) continue;
        if (side_of(b, before, 1) * side_of(b, after, 0) >= 0) continue;
        At.number = k;
        add_hit(now[0], now[1], now[2], 0, 1);
    }
}

/* An interval of a track: its path, and the box round it. */
typedef struct { Curve path; Box box; int knot; } Interval;

/* Check consecutive intervals, first by their common box, and begin with none. */
PAIRED static void check_intervals(const Interval *some, int *count, Box *box, Barrier *pieces) {
    for (int k = 0; k < L.piece_count && *count; k++) {
        Barrier *b = pieces + k;
        if (b->mover || b->one_sided || apart(box, b->box, At.margin)) continue;
        for (const Interval *now = some; now < some + *count; now++)
            if (*count == 1 || !apart(&now->box, b->box, At.margin)) check_interval(&now->path, b, k, now->knot);
    }
    *box = all_apart();
    *count = 0;
}

/* Check an interval of a track beside a moving piece or a one-sided chain, in steps in which the particle cannot come too
   near, or in which both move by STRIDE radii at most. `spared` is how deep the particle may be: on the side that lets it
   pass as deep as it is, then on the other side, until it is clear, deeper than is allowed. */
PAIRED static void check_beside_moving(const Interval *now, Barrier *b, int number, double *spared) {
    const double *knot = KNOT(now->knot);
    const Two *p = now->path.p;
    double h = knot[L.row] - knot[0], way = 0, haste, share = 0, before = 0, corners[MOST_CORNERS][2];
    for (int n = 0; n < 3; n++) way = MAX(way, 3 * length_of(p[n + 1][0] - p[n][0], p[n + 1][1] - p[n][1]));
    way += h * swiftest(b, &haste);
    if (is_cornered()) way += h * At.reach * MAX(fabs(knot[5]), fabs(knot[L.row + 5]));
    At.deepest = -1;
    for (int last = 0; !last;) {
        Two place = place_on(&now->path, share);
        double t = knot[0] + share * h, x = place[0], y = place[1];
        to_rest(b, t, &x, &y);
        double gap, off;
        const Barrier *near = nearest(b, x, y, &gap, &off);
        double depth = At.radius - gap, least = b->one_sided ? -L.allowed : 0;
        At.number = number + (int)(near - b);
        if (is_cornered()) {
            int count = corners_at(now->knot, share, place[0], place[1], b, corners);
            depth = -INFINITY;
            for (int n = 0; n < MAX(b->chain, 1); n++) depth = MAX(depth, deep_in(b + n, corners, count));
            gap -= At.reach - At.margin;
        }
        int there = is_there(b, t) && t >= b->appears + L.dt;
        if (isnan(*spared)) *spared = b->appears > KNOT(L.offsets[At.particle])[0] ? INFINITY : MAX(depth, 0);
        if (there && depth <= least && !(b->one_sided && off < 0)) *spared = 0;
        int passes = before * off < 0 && fabs(off - before) < At.radius && is_within(near, x, y, side_margin());
        if (there && *spared < INFINITY && (passes || depth > *spared + L.allowed)) {
            int at = passes ? -1 : At.deepest;
            if (passes || at < 0) add_hit(t, place[0], place[1], depth, passes);
            if (!passes && at < 0) At.deepest = L.hit_count - 1;
            if (at >= 0 && at < L.hit_room && depth > L.hits[at].depth)
                L.hits[at] = (Hit){t, place[0], place[1], depth, At.particle, At.number, 0, 0};
        }
        if (b->one_sided && off < 0) *spared = INFINITY;
        before = there ? off : 0;
        last = share >= 1;
        share = MIN(share + MAX(gap - At.margin, STRIDE * At.radius) / way, 1);
    }
}

/* Check a whole track beside moving and one-sided pieces, and for a particle with corners beside all pieces. */
PAIRED static void check_moving_pieces(int i, Barrier *pieces) {
    for (int k = 0; k < L.piece_count; k++) {
        double spared = NAN;
        if (pieces[k].one_sided ? !pieces[k].chain : !(pieces[k].mover || is_cornered())) continue;
        for (int n = L.offsets[i]; n < L.offsets[i + 1] - 1; n++) {
            Interval now = { .path = curve_after(KNOT(n)), .knot = n };
            const Two *p = now.path.p;
            now.box.low = lesser(lesser(p[0], p[1]), lesser(p[2], p[3]));
            now.box.high = larger(larger(p[0], p[1]), larger(p[2], p[3]));
            int away = 1;
            for (int m = 0; m < MAX(pieces[k].chain, 1); m++) away &= apart(&now.box, pieces[k + m].box, At.reach);
            if (KNOT(n)[0] == KNOT(n)[L.row] || away) continue;
            check_beside_moving(&now, pieces + k, k, &spared);
        }
    }
}

/* Find where a particle overlaps surfaces by more than is allowed, or passes through them: the deepest place, and each
   passage, for each interval beside each piece. Return whether there is any. A particle on which a gate closed is exempt
   until it is clear of it; an overlap at the release may remain, but not grow. */
PAIRED int find_hits(int i) {
    Interval some[WIDTH];
    Barrier *pieces = L.barriers + member_of(i) * L.piece_count;
    Box box = all_apart();
    Curve last;
    int count = 0, first = 1, before = L.hit_count;
    if (!L.piece_count) return 0;
    At.particle = i;
    At.radius = L.bodies[i].radius;
    At.margin = MAX(At.radius - L.allowed, 0);
    At.begin = At.radius > 0 ? At.margin : -L.allowed;
    At.reach = is_cornered() ? L.largest : At.radius;
    for (int k = 0; k < L.piece_count; k++) pieces[k].clear = NAN;
    for (int k = L.offsets[i]; k < L.offsets[i + 1] - 1 && !is_cornered(); k++) {
        const double *a = KNOT(k), *b = a + L.row;
        if (a[0] == b[0] && a[1] == b[1] && a[2] == b[2]) {
            if (L.piece_count <= FEW) check_intervals(some, &count, &box, pieces);
            continue;
        }
        Interval *now = some + count++;
        const Two *p = now->path.p;
        now->path = curve_after(a);
        now->knot = k;
        now->box.low = lesser(lesser(p[0], p[1]), lesser(p[2], p[3]));
        now->box.high = larger(larger(p[0], p[1]), larger(p[2], p[3]));
        box.low = lesser(box.low, now->box.low);
        box.high = larger(box.high, now->box.high);
        if (At.radius == 0) {
            if (!first) check_knot(&last, &now->path, pieces, k);
            last = now->path;
            first = 0;
        }
        if (count == WIDTH) check_intervals(some, &count, &box, pieces);
    }
    check_intervals(some, &count, &box, pieces);
    check_moving_pieces(i, pieces);
    return L.hit_count > before;
}
