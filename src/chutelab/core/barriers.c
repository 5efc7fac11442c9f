/* Where a track is inside a surface, or passes one: found on the whole path, not at its knots only.

   Between two knots a track is a cubic with four control points. Its distance from the line of a
   straight piece is a cubic too, the square of its distance from a centre one of degree 6: in
   Bernstein's form neither is less than its least coefficient, nor more than its largest. So most
   intervals are proven to be clear of a piece at once, all that are not are halved until they are,
   or until they are short; what is left is measured. G. Farin, Curves and Surfaces for CAGD, ch. 5, 6.

   A check shares nothing with what it checks: nothing here is from the engine's files. */

#include "laws.h"

#define PI 3.14159265358979323846

/* Intervals whose common box tells which pieces they may meet: those that follow each other are near
   each other. */
#define WIDTH 32
/* A flight of 5 m is looked at every millimetre, where it has to be. */
#define HALVINGS 12
/* Places of each interval at which it is asked whether a particle has got clear of a gate. */
#define GATED 64

typedef struct { double x[4], y[4]; } Curve;

/* An interval of a track beside a piece, while it is halved. */
static struct {
    Barrier *piece;
    int particle, number, knot; /* of the piece; of the knot before */
    double radius, limit;       /* m; how near a centre may come, where it is not to be looked at */
    int deepest;                /* the hit of this interval that passes nothing, or -1 */
} At;

static double least(const double *a, int n) {
    double found = a[0];
    for (int k = 1; k < n; k++) found = MIN(found, a[k]);
    return found;
}

static double most(const double *a, int n) {
    double found = a[0];
    for (int k = 1; k < n; k++) found = MAX(found, a[k]);
    return found;
}

/* Have a box hold another one. */
static void grow(double *box, const double *by) {
    box[0] = MIN(box[0], by[0]);
    box[1] = MIN(box[1], by[1]);
    box[2] = MAX(box[2], by[2]);
    box[3] = MAX(box[3], by[3]);
}

static void empty(double *box) {
    box[0] = box[1] = INFINITY;
    box[2] = box[3] = -INFINITY;
}

static int apart(const double *a, const double *b, double margin) {
    return a[0] >= b[2] + margin || a[2] <= b[0] - margin || a[1] >= b[3] + margin
        || a[3] <= b[1] - margin;
}

/* Pieces: where they are. */

void shape_barriers(void) {
    int count = L.piece_count * (L.family ? L.particle_count : 1);
    for (int k = 0; k < count; k++) {
        Barrier *b = L.barriers + k;
        empty(b->box);
        if (b->radius == 0) {
            b->end[0] = b->x;
            b->end[1] = b->y;
            b->end[2] = b->x + b->length * b->tx;
            b->end[3] = b->y + b->length * b->ty;
        } else {
            b->whole = b->extent >= 2 * PI;
            double last = b->begin + (b->whole ? 2 * PI : b->extent);
            b->end[0] = b->x + b->radius * cos(b->begin);
            b->end[1] = b->y + b->radius * sin(b->begin);
            b->end[2] = b->x + b->radius * cos(last);
            b->end[3] = b->y + b->radius * sin(last);
            for (int side = 0; side < 4; side++) {
                double x = side & 1 ? 0 : 1 - side, y = side & 1 ? 2 - side : 0;
                x = b->x + b->radius * x;
                y = b->y + b->radius * y;
                if (is_within(b, x, y, 0)) grow(b->box, (double[]){ x, y, x, y });
            }
        }
        grow(b->box, (double[]){ b->end[0], b->end[1], b->end[0], b->end[1] });
        grow(b->box, (double[]){ b->end[2], b->end[3], b->end[2], b->end[3] });
    }
}

static double foot(const Barrier *b, double x, double y) {
    return b->tx * (x - b->x) + b->ty * (y - b->y);
}

/* m along a bent piece, counterclockwise from its first end. */
static double along(const Barrier *b, double x, double y) {
    double turn = fmod(atan2(y - b->y, x - b->x) - b->begin, 2 * PI);
    return b->radius * (turn < 0 ? turn + 2 * PI : turn);
}

/* Distance from the line of a piece, the side on the left or outside positive, m. */
double beside(const Barrier *b, double x, double y) {
    if (b->radius == 0) return b->tx * (y - b->y) - b->ty * (x - b->x);
    return hypot(x - b->x, y - b->y) - b->radius;
}

/* Whether a place is beside a piece, and not beyond its ends, each `margin` (m) inside of what it is. */
int is_within(const Barrier *b, double x, double y, double margin) {
    if (b->radius > 0 && b->whole) return 1;
    double way = b->radius == 0 ? foot(b, x, y) : along(b, x, y);
    double length = b->radius == 0 ? b->length : b->extent * b->radius;
    return way > margin && way < length - margin;
}

/* Distance from the nearest point of a piece, m. */
double distance(const Barrier *b, double x, double y) {
    if (b->radius == 0) {
        double way = MIN(MAX(foot(b, x, y), 0), b->length);
        return hypot(x - b->x - way * b->tx, y - b->y - way * b->ty);
    }
    if (b->whole || along(b, x, y) <= b->extent * b->radius) return fabs(beside(b, x, y));
    return MIN(hypot(x - b->end[0], y - b->end[1]), hypot(x - b->end[2], y - b->end[3]));
}

/* Paths: cubics by their control points. */

static void curve_after(const double *knot, Curve *c) {
    const double *next = knot + L.row;
    double third = (next[0] - knot[0]) / 3;
    c->x[0] = knot[1];
    c->y[0] = knot[2];
    c->x[1] = knot[1] + third * knot[3];
    c->y[1] = knot[2] + third * knot[4];
    c->x[2] = next[1] - third * next[3];
    c->y[2] = next[2] - third * next[4];
    c->x[3] = next[1];
    c->y[3] = next[2];
}

/* Where a particle is at a share of the interval after a knot. */
void place_at(const double *knot, double share, double *x, double *y) {
    Curve c;
    curve_after(knot, &c);
    double s = share, r = 1 - s;
    *x = r * r * (r * c.x[0] + 3 * s * c.x[1]) + s * s * (3 * r * c.x[2] + s * c.x[3]);
    *y = r * r * (r * c.y[0] + 3 * s * c.y[1]) + s * s * (3 * r * c.y[2] + s * c.y[3]);
}

/* Coefficients of the square of the distance from a place, m2. */
static void square_distance(const Curve *c, double x0, double y0, double *q) {
    double x[4], y[4];
    for (int k = 0; k < 4; k++) {
        x[k] = c->x[k] - x0;
        y[k] = c->y[k] - y0;
    }
#define DOT(i, j) (x[i] * x[j] + y[i] * y[j])
    q[0] = DOT(0, 0);
    q[1] = DOT(0, 1);
    q[2] = 0.4 * DOT(0, 2) + 0.6 * DOT(1, 1);
    q[3] = 0.1 * DOT(0, 3) + 0.9 * DOT(1, 2);
    q[4] = 0.4 * DOT(1, 3) + 0.6 * DOT(2, 2);
    q[5] = DOT(2, 3);
    q[6] = DOT(3, 3);
#undef DOT
}

/* Whether none of some coefficients is less, or none more, than a bound. */
static int all_from(const double *a, int n, double bound) {
    int yes = 1;
    for (int k = 0; k < n; k++) yes &= a[k] >= bound;
    return yes;
}

static int all_to(const double *a, int n, double bound) {
    int yes = 1;
    for (int k = 0; k < n; k++) yes &= a[k] <= bound;
    return yes;
}

/* Whether a path that is beyond an end, by rounding not quite, is clear of the piece: from where that is met
   to the end it is no more than rounding. */
static int is_clear_of_end(const Curve *c, const double *end, double limit) {
    double q[7], reach = MAX(limit + L.rounding, 0);
    square_distance(c, end[0], end[1], q);
    return all_from(q, 7, reach * reach);
}

static int is_clear_of_line(const Curve *c, const Barrier *b, double limit) {
    double d[4], feet[4], reach = MAX(limit, 0);
    for (int k = 0; k < 4; k++) d[k] = beside(b, c->x[k], c->y[k]);
    if (all_from(d, 4, limit) || all_to(d, 4, -limit)) return 1;
    for (int k = 0; k < 4; k++) feet[k] = foot(b, c->x[k], c->y[k]);
    if (all_to(feet, 4, -reach) || all_from(feet, 4, b->length + reach)) return 1;
    if (all_to(feet, 4, L.rounding)) return is_clear_of_end(c, b->end, limit);
    return all_from(feet, 4, b->length - L.rounding) && is_clear_of_end(c, b->end + 2, limit);
}

/* Whether all of a path is left of the ray from the centre through an end, or right of it, but for rounding:
   by no more than that along the arc where a particle inside can touch it. */
static int is_aside(const Curve *c, const Barrier *b, const double *end, double side) {
    double off = L.rounding * MAX(b->radius - At.radius, 0);
    for (int k = 0; k < 4; k++) {
        double x = c->x[k] - b->x, y = c->y[k] - b->y;
        if (side * ((end[0] - b->x) * y - (end[1] - b->y) * x) < -off) return 0;
    }
    return 1;
}

static int is_clear_of_bow(const Curve *c, const Barrier *b, double limit) {
    double q[7], outer = b->radius + limit, inner = b->radius - limit;
    square_distance(c, b->x, b->y, q);
    if (all_from(q, 7, outer * outer) || (inner > 0 && all_to(q, 7, inner * inner))) return 1;
    if (b->whole) return 0;
    /* Beyond the ends: not counterclockwise of the first, or not clockwise of the last; of an arc of
       more than half a circle neither. */
    int not_after = is_aside(c, b, b->end, -1), not_before = is_aside(c, b, b->end + 2, 1);
    int off = b->extent > PI ? not_after && not_before : not_after || not_before;
    return off && is_clear_of_end(c, b->end, limit) && is_clear_of_end(c, b->end + 2, limit);
}

static int is_clear(const Curve *c) {
    return At.piece->radius == 0 ? is_clear_of_line(c, At.piece, At.limit)
                                 : is_clear_of_bow(c, At.piece, At.limit);
}

/* Hits. */

static double side_margin(void) { return MAX(L.rounding, ON_ARCS * L.largest); }

static int is_there(const Barrier *b, double t) { return t >= b->appears && t < b->vanishes; }

static Hit *add_hit(double t, double x, double y, double depth, int passes) {
    static Hit lost;
    Hit *hit = L.hit_count < L.hit_room ? L.hits + L.hit_count : &lost;
    L.hit_count++;
    *hit = (Hit){t, x, y, depth, At.particle, At.number, passes, 0};
    return hit;
}

/* From when on nothing is forgiven to a particle in a gate that shut on it: it is clear of it then. */
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

/* How deep a particle may be in a piece as it began there, m: as deep as it was at its release; and
   without bound in a gate that shut on it, as long as it has not been clear of it since. */
static double forgiven(double t) {
    const double *first = KNOT(L.offsets[At.particle]);
    int gate = At.piece->appears > first[0];
    if (!gate) return MAX(At.radius - distance(At.piece, first[1], first[2]), 0);
    if (isnan(At.piece->clear)) At.piece->clear = clear_from();
    return t > At.piece->clear ? 0 : INFINITY;
}

/* From now on only places of this interval that are deeper than that, and passages, are looked for: what
   has come to the very middle of a piece may still pass it. */
static void ask_for(double depth) {
    if (At.radius > 0) At.limit = MAX(At.radius - depth, L.rounding);
}

/* What is left of an interval: note it if it is bad. */
static void measure(const Curve *c, double begin, double size) {
    const Barrier *b = At.piece;
    double deep[2], x[2] = {c->x[0], c->x[3]}, y[2] = {c->y[0], c->y[3]};
    for (int n = 0; n < 2; n++) deep[n] = At.radius - distance(b, x[n], y[n]);
    int at = deep[1] > deep[0];
    int passes = (beside(b, x[0], y[0]) > 0) != (beside(b, x[1], y[1]) > 0)
        && is_within(b, 0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1]), side_margin());
    const double *knot = KNOT(At.knot);
    double t = knot[0] + (begin + size * at) * (knot[L.row] - knot[0]);
    if (!(passes || deep[at] > L.allowed) || !is_there(b, t) || t < b->appears + L.dt) return;
    double spared = forgiven(t);
    if (!((passes && spared < INFINITY) || deep[at] > spared + L.allowed)) return;
    double depth = deep[at] - MIN(spared, At.radius);
    if (!passes) ask_for(deep[at] + L.rounding);
    if (passes) {
        /* Each passage counts, and of all the rest of an interval the deepest place. */
        add_hit(t, x[at], y[at], depth, 1);
    } else if (At.deepest < 0) {
        At.deepest = L.hit_count;
        add_hit(t, x[at], y[at], depth, 0);
    } else if (At.deepest < L.hit_room && depth > L.hits[At.deepest].depth) {
        L.hits[At.deepest] = (Hit){t, x[at], y[at], depth, At.particle, At.number, 0, 0};
    }
}

static void halve(const double *a, double *first, double *last) {
    double middle = 0.5 * (a[1] + a[2]);
    first[0] = a[0];
    first[1] = 0.5 * (a[0] + a[1]);
    first[2] = 0.5 * (first[1] + middle);
    last[3] = a[3];
    last[2] = 0.5 * (a[2] + a[3]);
    last[1] = 0.5 * (middle + last[2]);
    first[3] = last[0] = 0.5 * (first[2] + last[1]);
}

static void settle(const Curve *c, double begin, double size, int halvings) {
    if (is_clear(c)) return;
    if (halvings == HALVINGS) {
        measure(c, begin, size);
        return;
    }
    Curve first, last;
    halve(c->x, first.x, last.x);
    halve(c->y, first.y, last.y);
    settle(&first, begin, 0.5 * size, halvings + 1);
    settle(&last, begin + 0.5 * size, 0.5 * size, halvings + 1);
}

/* Look at an interval beside one piece that its box is not clear of. */
static void look(const Curve *c, Barrier *b, int number, int knot) {
    At.piece = b;
    At.number = number;
    At.knot = knot;
    At.deepest = -1;
    At.limit = At.radius > 0 ? MAX(At.radius - L.allowed, 0) : -L.allowed;
    if (is_clear(c)) return;
    double t = KNOT(knot)[0], next = KNOT(knot + 1)[0];
    if (next < b->appears + L.dt || t > b->vanishes) return;
    if (L.pulley && number == 0) {
        /* The incoming belt ends on the pulley: beyond it that is what is near. */
        int beyond = 1;
        for (int k = 0; k < 4; k++) beyond = beyond && foot(b, c->x[k], c->y[k]) >= b->length;
        if (beyond) return;
    }
    double spared = forgiven(next);
    if (spared == INFINITY) return;
    ask_for(L.allowed + spared);
    settle(c, 0, 1, 0);
}

/* Where a mass point comes to a piece from one side and goes on on the other: such a passage at a knot,
   as where a blow does not turn a point back, is in no interval. */
static void turn(const Curve *c, Barrier *pieces, int first, int knot) {
    const double *now = KNOT(knot);
    for (int k = 0; k < L.piece_count; k++) {
        const Barrier *b = pieces + k;
        double far = 0, before = pieces[k].side;
        for (int n = 0; n < 4; n++) {
            double d = beside(b, c->x[n], c->y[n]);
            if (fabs(d) > fabs(far)) far = d;
        }
        pieces[k].side = far;
        if (first || MIN(fabs(far), fabs(before)) <= L.allowed || (far > 0) == (before > 0)) continue;
        if (!is_within(b, now[1], now[2], side_margin()) || !is_there(b, now[0])
            || distance(b, now[1], now[2]) > L.allowed) continue;
        At.number = k;
        add_hit(now[0], now[1], now[2], 0, 1);
    }
}

/* An interval of a track: its path, and the box about that. */
typedef struct { Curve path; double box[4]; int knot; } Interval;

/* Look at some intervals that follow each other, in a common box. */
static void look_at_all(const Interval *some, int count, const double *box, Barrier *pieces) {
    double margin = MAX(At.radius - L.allowed, 0);
    int near = 0;
    for (int k = 0; k < L.piece_count; k++) {
        if (!apart(box, pieces[k].box, margin)) pieces[near++].near = k;
    }
    for (int k = 0; k < near; k++) {
        Barrier *b = pieces + pieces[k].near;
        for (int n = 0; n < count; n++) {
            if (!apart(some[n].box, b->box, margin)) look(&some[n].path, b, pieces[k].near, some[n].knot);
        }
    }
}

/* Find where a particle is deeper in surfaces than is allowed, or passes them: one place, or each passage,
   for each interval beside each piece; return whether there is any. What stood in the way of a gate as it
   shut is spared until it is clear of it; what overlapped at its release may go on doing so, no deeper. */
int find_hits(int i) {
    Interval some[WIDTH];
    Barrier *pieces = L.barriers + (L.family ? i * L.piece_count : 0);
    double box[4];
    int count = 0, first = 1, before = L.hit_count;
    if (!L.piece_count) return 0;
    At.particle = i;
    At.radius = L.bodies[i].radius;
    for (int k = 0; k < L.piece_count; k++) pieces[k].clear = NAN;
    empty(box);
    for (int k = L.offsets[i]; k < L.offsets[i + 1] - 1; k++) {
        const double *a = KNOT(k), *b = a + L.row;
        if (a[0] == b[0] && a[1] == b[1] && a[2] == b[2]) continue;
        Interval *now = some + count++;
        curve_after(a, &now->path);
        now->knot = k;
        now->box[0] = least(now->path.x, 4);
        now->box[1] = least(now->path.y, 4);
        now->box[2] = most(now->path.x, 4);
        now->box[3] = most(now->path.y, 4);
        grow(box, now->box);
        if (At.radius == 0) turn(&now->path, pieces, first, k);
        first = 0;
        if (count == WIDTH) {
            look_at_all(some, count, box, pieces);
            empty(box);
            count = 0;
        }
    }
    look_at_all(some, count, box, pieces);
    return L.hit_count > before;
}
