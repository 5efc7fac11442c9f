/* What a particle meets next, and when: solved, not stepped.

   A gap is a polynomial in time, positive while two things are apart. Only a crossing from positive to negative is a
   contact; the opposite one is a departure. In flight, or sliding straight, a particle may meet a face or a circle (an
   end, an arc from outside or inside, the pulley). For a ride round a circle the angle at which something stops it has a
   closed form. */

#include "exact.h"

/* Share of a speed or an acceleration along a surface; a smaller part towards the surface is rounding. */
#define PARALLEL 1e-14
/* Share of the speed; with a smaller part towards a circle, a Newton step would not improve the contact. */
#define GLANCING 1e-3
/* Least order of contact with which a circle is left for good, unless acceleration turns the path back. */
#define FROM_CURVE 2
/* Greatest number of refinements of a root: Newton's method takes about 8, bisection alone this many. */
#define REFINEMENTS 120
/* A step of Newton's method is the last if it is at most SETTLED of t, and QUADRATIC of the step before: as errors fall with
   their squares, QUADRATIC^2 of the step is left. */
#define SETTLED 1e-8
#define QUADRATIC 1e-4
/* Halvings of an interval after which a polynomial with two roots in it is practically a parabola, but still larger than
   its rounding; Newton steps to where that turns back; and greatest number of descents of a polynomial of degree 4: it
   has two, and by rounding one or two more. */
#define HALVINGS 20
#define TURNINGS 4
#define MOST_ROOTS 4
/* Share of the slope of a straight line by which a gap may differ from it, and has one zero all the same. */
#define STRAIGHT 0.25
/* rad; an obstacle this near to the present angle is met now, although by rounding it may be behind. */
#define NOW 2e-11
/* In `touch`; circles whose centres and radii differ by no more are at the same place. */
#define ALIKE 4.0

/* Time from now at which gap + rate t + acceleration t^2/2 crosses zero downwards; NaN or infinite if it never does, or did
   in the past.

   A parabola crosses any level downwards at most once, with derivative -S, where S^2 = rate^2 - 2 acceleration gap. Of
   both forms of that root, the one without cancellation is used: 2 gap / (S - rate) while closing, -(rate + S) /
   acceleration while opening. */
double descent(double gap, double rate, double acceleration) {
    if (rate > 0.0 ? acceleration >= 0.0 : gap < 0.0) return INFINITY;
    double span = fabs(rate) + sqrt(rate * rate - (acceleration + acceleration) * gap);
    /* With zero gap and rate it closes at once if the acceleration is downwards. */
    if (span == 0.0 && gap == 0.0 && acceleration < 0.0) return 0.0;
    return rate > 0.0 ? span / -acceleration : (gap + gap) / span;
}

/* A polynomial by Horner's rule, constant term first. */
double polynomial(const double *c, int count, double t) {
    double value = 0.0;
    while (count--) value = value * t + c[count];
    return value;
}

/* The root of a polynomial of degree 4 that is positive at `low`, negative at `high` (within rounding) and crosses zero
   once between: Newton's method inside a shrinking bracket, with bisection where a step would leave it. */
static double crossing(const double *c, double low, double high) {
    double above = polynomial(c, 5, low), below = polynomial(c, 5, high), step = INFINITY;
    if (!(above > 0.0)) return low;
    if (!(below < 0.0)) return high;
    double t = low + (high - low) * (above / (above - below));
    for (int n = 0; n < REFINEMENTS; n++) {
        double value = 0.0, rate = 0.0, old = t, before = step;
        for (int k = 4; k >= 0; k--) rate = rate * t + value, value = value * t + c[k];
        if (value >= 0.0) low = t;
        else high = t;
        double newton = t - value / rate;
        t = newton > low && newton < high ? newton : value == 0.0 ? t : 0.5 * (low + high);
        step = fabs(t - old);
        if (step <= 0.5 * ULP * fabs(old) || (step <= SETTLED * fabs(old) && step <= QUADRATIC * before)) break;
    }
    return t;
}

/* Where a polynomial of degree 4 that is practically a parabola turns back: Newton's method on its slope. */
static double turning_point(const double *c, double low, double high) {
    double t = 0.5 * (low + high);
    for (int n = 0; n < TURNINGS; n++) {
        double value = 0.0, rate = 0.0, half = 0.0;
        for (int k = 4; k >= 0; k--) half = half * t + rate, rate = rate * t + value, value = value * t + c[k];
        t = MIN(MAX(t - 0.5 * rate / half, low), high);
    }
    return t;
}

/* Find where a polynomial of degree 4 becomes negative between `low` and `high`, in order; return how many such t have
   been found so far. The number of sign changes of its Bernstein coefficients there is that of its roots, or larger by
   two or four: an interval that may have several is halved. If halving does not separate two roots, the value where the
   polynomial turns back tells whether it crosses zero or only touches it; the coefficients would tell rounding. */
static int isolate(const double *c, const double *bernstein, double low, double high, int halvings, double *found,
                   int count) {
    double left[5], right[5], rest[5];
    int below = bernstein[0] < 0.0, changes = 0;
    for (int n = 1; n < 5; n++) changes += (bernstein[n] < 0.0) != (bernstein[n - 1] < 0.0);
    if (changes == 0 || (changes == 1 && below) || count == MOST_ROOTS) return count;
    if (changes == 1) {
        found[count] = crossing(c, low, high);
        return count + 1;
    }
    if (!halvings) {
        double turn = turning_point(c, low, high);
        if (below) low = turn;
        else if (changes % 2 == 0) high = turn;
        if (polynomial(c, 5, low) > 0.0 && polynomial(c, 5, high) < 0.0) found[count++] = crossing(c, low, high);
        return count;
    }
    /* Coefficients of both halves, after de Casteljau. */
    for (int n = 0; n < 5; n++) rest[n] = bernstein[n];
    for (int n = 0; n < 5; n++) {
        left[n] = rest[0], right[4 - n] = rest[4 - n];
        for (int k = 0; k < 4 - n; k++) rest[k] = 0.5 * (rest[k] + rest[k + 1]);
    }
    double middle = 0.5 * (low + high);
    count = isolate(c, left, low, middle, halvings - 1, found, count);
    return isolate(c, right, middle, high, halvings - 1, found, count);
}

/* Find each t, 0 <= t <= until, at which a polynomial of degree up to 4 becomes negative, in order; infinite if there are
   no more. Touching zero without crossing it is no contact. */
static void descents(const double *c, double until, double *found) {
    static const double BERNSTEIN[5][5] = { { 1.0 }, { 1.0, 0.25 }, { 1.0, 0.5, 1.0 / 6.0 },
        { 1.0, 0.75, 0.5, 0.25 }, { 1.0, 1.0, 1.0, 1.0, 1.0 } };
    double bernstein[5] = { 0.0 }, power = 1.0;
    for (int n = 0; n < MOST_ROOTS; n++) found[n] = INFINITY;
    for (int n = 0; n < 5; n++, power *= until)
        for (int j = n; j < 5; j++) bernstein[j] += BERNSTEIN[j][n] * (c[n] * power);
    isolate(c, bernstein, 0.0, until, HALVINGS, found, 0);
}

static double first_descent(const double *c, double until) {
    double found[MOST_ROOTS];
    descents(c, until, found);
    return found[0];
}

/* Whether a direction from the centre of a circle points to its arc. */
int spans(const Obstacle *o, double x, double y) {
    if (!(o->extent < TURN)) return 1;
    return modulo(angle_of(y, x) - o->begin + FOOT, TURN) <= o->extent + 2.0 * FOOT;
}

/* Whether gates allow a circle to be met from a direction. A gate that appears inside a disk doesn't act on it until the
   disk is clear of it. The same holds for its end if the disk reaches it along the gate, which extends into the disk
   there. */
int is_reached(int circle, double x, double y, int epoch) {
    if (!O.change_count) return 1;
    if (!is_there(circle, epoch)) return 0;
    int clear = O.all[circle].tips == NONE;
    for (int n = O.all[circle].tips; n != NONE && !clear; n = O.tips[n].next) {
        const Tip *tip = O.tips + n;
        clear = tip->out[0] * x + tip->out[1] * y >= -O.touch && is_there(face_of(n / 2, 1), epoch);
    }
    return clear;
}

static double speed_of(const Motion *m) { return length_of(m->vx, m->vy); }
static double after_x(const Motion *m, double t) { return m->x + t * (m->vx + 0.5 * t * m->ax); }
static double after_y(const Motion *m, double t) { return m->y + t * (m->vy + 0.5 * t * m->ay); }

/* The corner, a sector between two faces, that a point is in at a time, at an end of the obstacle that it is on or
   leaves; else -1. */
static int corner_of(const Motion *m, double t) {
    int from = A.on == NONE ? A.left : A.on, side = A.on == NONE ? A.left_side : A.side;
    return A.point && from != NONE ? corner_at(from, side, after_x(m, t), after_y(m, t)) : NONE;
}

/* Whether a point cannot meet something at a time, as it is in a corner then that this doesn't bound. */
static int is_barred(const Motion *m, int k, int side, double t) {
    int corner = corner_of(m, t);
    return corner != NONE && !bounds(corner, k, side, epoch_at(A.age + t));
}

static int counts(const Motion *m, int circle, double t) {
    const Obstacle *o = O.all + circle;
    double x = after_x(m, t) - o->x, y = after_y(m, t) - o->y;
    return spans(o, x, y) && is_reached(circle, x, y, epoch_at(A.age + t)) && !is_barred(m, circle, 0, t);
}

typedef struct { Two low, high; } Box;

/* Lowest and highest coordinates of a path. */
static Box box_of(const Motion *m, double until) {
    double p[] = { m->x, m->y }, v[] = { m->vx, m->vy }, a[] = { m->ax, m->ay };
    double end[] = { after_x(m, until), after_y(m, until) };
    Box box;
    for (int k = 0; k < 2; k++) {
        box.low[k] = MIN(p[k], end[k]), box.high[k] = MAX(p[k], end[k]);
        double turn = -v[k] / a[k];
        if (!(turn > 0.0 && turn < until)) continue;
        double top = p[k] + turn * (v[k] + (0.5 * turn) * a[k]);
        box.low[k] = MIN(box.low[k], top), box.high[k] = MAX(box.high[k], top);
    }
    return box;
}

static int is_near(const Box *box, const Obstacle *o) {
    return __builtin_wasm_all_true_i64x2((box->low < two_at(o->high)) & (box->high > two_at(o->low)));
}

/* Whether a particle cannot meet something as it rides the incoming belt, at whatever height. */
static int is_under_belt(int k) {
    return A.way == RIDES_BELT && (k == 0 || k == O.pulley || k == O.tips[0].circle || k == O.tips[1].circle);
}

/* Whether a point is in a corner now that something bounds. */
static int is_bound(const Motion *m, int k, int side) {
    int corner = corner_of(m, 0.0);
    return corner != NONE && bounds(corner, k, side, epoch_at(A.age));
}

/* When a face of a segment is met from a side, at most `until`; else infinite. */
static double meet_face(const Motion *m, int k, int side, double until) {
    const Obstacle *o = O.all + k;
    int shared = is_shared(A.joint, k, side < 0), same = (A.left == k && A.left_side == side) || shared;
    if ((A.left == k || shared) && !(same && A.order <= 1)) return INFINITY;
    int beside = same || is_bound(m, k, side), grazing = 0;
    double dx = m->x - o->x, dy = m->y - o->y, gap = side * (dx * o->nx + dy * o->ny) - A.given->radius;
    double rate = side * (m->vx * o->nx + m->vy * o->ny), fall = side * (m->ax * o->nx + m->ay * o->ny);
    if (fabs(gap) <= O.touch || beside) {
        gap = 0.0;
        grazing = fabs(rate) <= PARALLEL * speed_of(m);
        if (grazing && !same) rate = 0.0;
        if (grazing && fabs(fall) <= PARALLEL * length_of(m->ax, m->ay)) fall = 0.0;
    }
    double time = descent(gap, rate, fall);
    if (!(time <= until) || is_barred(m, k, side, time)) return INFINITY;
    /* How far along the segment the contact is. */
    double pace = m->vx * o->tx + m->vy * o->ty, push = m->ax * o->tx + m->ay * o->ty, over = FOOT * o->length;
    double foot = dx * o->tx + dy * o->ty + time * (pace + (0.5 * time) * push);
    if (!(foot >= -over && foot <= over + o->length)) return INFINITY;
    /* A particle that grazes the end while moving outwards does not lie on the face. */
    if (grazing && ((foot <= over && pace < 0.0) || (foot >= o->length - over && pace > 0.0)))
        return INFINITY;
    return O.change_count && !is_there(k, epoch_at(A.age + time)) ? INFINITY : time;
}

/* Improve the time of a contact by a Newton step on the distance itself, whose rounding does not grow with the length of
   the flight, as that of the polynomial does. For a contact that is being left, the polynomial divided by t is better on
   paths shorter than rho. */
static double polish(const Motion *m, const Obstacle *o, double t, int apart) {
    if (!isfinite(t)) return t;
    double x = m->x - o->x + t * (m->vx + 0.5 * t * m->ax), vx = m->vx + t * m->ax;
    double y = m->y - o->y + t * (m->vy + 0.5 * t * m->ay), vy = m->vy + t * m->ay;
    double distance = length_of(x, y), sense = sign_of(o->rho), rho = fabs(o->rho);
    double rate = sense * (x * vx + y * vy) / distance;
    if (!(rate < -GLANCING * length_of(vx, vy)) || !(apart || -rate * t > rho)) return t;
    return MAX(t - sense * (distance - rho) / rate, 0.0);
}

/* When a path comes past the end of an arc along its face, before `until`; else infinite.

   Before that the arc is not beside the particle, and the gap to its circle may have any sign. If the gap is zero at the
   instant at which the arc comes to be beside it, there is no crossing from positive to negative: it is a contact if the
   gap falls from there. */
static double enter(const Motion *m, int k, double until) {
    const Obstacle *o = O.all + k;
    double first = INFINITY, dx = m->x - o->x, dy = m->y - o->y;
    for (int end = 1; end >= 0; end--) {
        /* Unit vectors from the centre to the end, and out of the arc there. */
        const Tip *tip = O.tips + 2 * (O.faces + (k - O.first_arc) % O.arcs) + end;
        double across = tip->left[0], up = tip->left[1], ax = tip->out[0], ay = tip->out[1];
        double ahead = has_edge(A.joint, k, end) ? 0.0 : ax * dx + ay * dy;
        double time = descent(ahead, ax * m->vx + ay * m->vy, ax * m->ax + ay * m->ay);
        if (!(time > 0.0 && time < until)) continue;
        double x = dx + time * (m->vx + 0.5 * time * m->ax), vx = m->vx + time * m->ax;
        double y = dy + time * (m->vy + 0.5 * time * m->ay), vy = m->vy + time * m->ay;
        if (!(fabs(across * x + up * y - fabs(o->rho)) <= O.touch)) continue;
        if (!is_reached(k, x, y, epoch_at(A.age + time))) continue;
        /* The gap divided by the time since then: this removes its zero at that time. */
        double sense = sign_of(o->rho), gap[] = { sense * 2.0 * (x * vx + y * vy),
            sense * (vx * vx + vy * vy + (x * m->ax + y * m->ay)),
            sense * (vx * m->ax + vy * m->ay), sense * 0.25 * (m->ax * m->ax + m->ay * m->ay), 0.0 };
        double met = time + (gap[0] < 0.0 ? 0.0 : first_descent(gap, until - time));
        if (met < first && !is_barred(m, k, 0, met)) first = met;
    }
    return first;
}

/* Whether two circles are at the same place; for a point, also both faces of an arc. */
static int is_alike(int k, int left) {
    const Obstacle *a = O.all + k, *b = O.all + left;
    double near = ALIKE * O.touch;
    return left >= O.faces && fabs(a->x - b->x) <= near && fabs(a->y - b->y) <= near
        && fabs(A.point ? fabs(a->rho) - fabs(b->rho) : a->rho - b->rho) <= near;
}

/* When a circle is met, at or before `until`; else infinite. */
static double meet_circle(const Motion *m, int k, double until) {
    const Obstacle *o = O.all + k;
    double dx = m->x - o->x, dy = m->y - o->y, rho = fabs(o->rho), sense = sign_of(o->rho);
    double distance = length_of(dx, dy), sum = dx * m->vx + dy * m->vy;
    if (!(rho >= 0.0)) return INFINITY;
    /* d + v t + a t^2/2|^2 - rho^2 as a polynomial of t; from inside with the opposite sign. */
    double gap[] = { (distance - rho) * (distance + rho), 2.0 * sum,
        m->vx * m->vx + m->vy * m->vy + (dx * m->ax + dy * m->ay), m->vx * m->ax + m->vy * m->ay,
        0.25 * (m->ax * m->ax + m->ay * m->ay) };
    for (int n = 0; n < 5; n++) gap[n] *= sense;
    /* Arcs that lie on each other, or on the pulley, are left together. */
    int leaving = A.left == k || (O.arcs && is_alike(k, A.left)) || is_shared(A.joint, k, 0);
    int beside = is_bound(m, k, 0), touching = fabs(distance - rho) <= O.touch || beside;
    /* The direction from the centre is uncertain by the rounding of the places over rho. */
    double uncertain = 2.0 * (PARALLEL * rho + O.touch) * speed_of(m);
    if (touching && fabs(gap[1]) <= uncertain && !leaving) gap[1] = 0.0;
    int closing = touching && gap[1] < 0.0;
    int order = leaving ? A.order : touching && !closing ? 1 : 0, falls = 0, rises = 0;
    if (closing && !leaving && counts(m, k, 0.0)) return 0.0;
    for (int n = 0; n < order; n++) {
        for (int c = 0; c < 4; c++) gap[c] = gap[c + 1];
        gap[4] = 0.0;
    }
    for (int n = 0; n < 5; n++) falls |= gap[n] < 0.0, rises |= gap[n] > 0.0;
    double t = INFINITY;
    /* Otherwise it has passed the circle for good, or never approaches it. */
    if ((gap[0] >= 0.0 || rises) && falls) {
        double found[MOST_ROOTS];
        descents(gap, until, found);
        for (int n = MOST_ROOTS - 1; n >= 0; n--) {
            double s = found[n];
            if (!isfinite(s) || !counts(m, k, s)) continue;
            t = s;
        }
        t = polish(m, o, t, order == 0);
    }
    return o->extent < TURN ? MIN(t, enter(m, k, until)) : t;
}

/* Whether a particle cannot meet a circle because of what it touches or has just left. */
static int is_hidden(const Motion *m, int k) {
    int left = A.left;
    if (A.on != NONE && is_beside(k, A.on, A.side < 0)) return 1;
    if (left == NONE) return 0;
    const Obstacle *o = O.all + left;
    if (left >= O.faces)
        /* It left the circle tangentially and its speed does not fall: all terms of the gap grow. */
        return left == k && A.order >= FROM_CURVE && m->vx * m->ax + m->vy * m->ay >= 0.0
            && !(O.arcs && o->rho < 0.0);
    /* A face that is left with an acceleration away from it hides its own two ends, like a face that is slid on. */
    return (O.tips[2 * left].circle == k || O.tips[2 * left + 1].circle == k)
        && A.left_side * (m->ax * o->nx + m->ay * o->ny) >= 0.0;
}

/* Find what a particle meets first, and whether that is at or before `until` (s from now, finite), which then becomes the
   time of the contact. The side is that of a face, 0 for a circle.

   It finds faces within a segment's length, ends of segments (for a disk), arcs and the pulley. By design it misses a
   point that hits the end of a segment, and anything that the particle overlaps already. */
int first_contact(const Motion *m, double *until, int *obstacle, int *side) {
    Box box = box_of(m, *until);
    double first = INFINITY, soonest = INFINITY;
    int circle = NONE;
    for (int k = 0; k < O.faces; k++) {
        if (k == A.on || !is_near(&box, O.all + k) || is_under_belt(k)) continue;
        for (int face = 1; face >= -1; face -= 2) {
            double time = meet_face(m, k, face, *until);
            if (time < first) first = time, *obstacle = k, *side = face;
        }
    }
    int hits = first <= *until;
    if (hits) *until = first, box = box_of(m, first);
    for (int k = O.faces; k < O.count; k++) {
        if (!is_near(&box, O.all + k) || is_under_belt(k) || is_hidden(m, k)) continue;
        double time = meet_circle(m, k, *until);
        if (time < soonest) soonest = time, circle = k;
    }
    /* A circle counts only if it is met before the face, or, without a face, at the latest at `until`. */
    if (circle == NONE || !(soonest < *until || (!hits && soonest == *until))) return hits;
    *until = soonest, *obstacle = circle, *side = 0;
    return 1;
}

/* The distance to the box of a particle's centre in contact with an obstacle. */
static double distance_to_box(const Obstacle *o) {
    Two place = two_at(&A.x), off = larger(larger(two_at(o->low) - place, place - two_at(o->high)), (Two){ 0.0, 0.0 });
    return length_of(off[0], off[1]);
}

/* A length of path on which a particle cannot meet anything but the obstacle that it touches and leaves, come past its ends,
   or leave the scene; if it is shorter than `way`, a length up to `way`. */
static double clearance(double way) {
    const double *box = A.given->exit_box, *up = A.given->up;
    double least = INFINITY, radius = A.given->radius;
    int back = back_of(A.left);
    for (int n = 0; n < 2; n++) {
        double place = (n ? -up[0] : up[1]) * A.x + up[n] * A.y;
        least = MIN(least, MIN(place - box[n], box[2 + n] - place));
    }
    for (int n = 0; n < O.tip_count && least > way; n++)
        least = MIN(least, length_of(A.x - O.tips[n].x, A.y - O.tips[n].y) - radius);
    for (int k = 0; k < O.count && least > way; k++) {
        const Obstacle *o = O.all + k;
        /* The other face of an arc is behind its own. */
        if (k == A.left || k == back || o->met == END || !(fabs(o->rho) >= 0.0 || o->met == FACE)) continue;
        double x = A.x - o->x, y = A.y - o->y;
        double off = o->met == FACE ? fabs(x * o->nx + y * o->ny) - radius : length_of(x, y) - fabs(o->rho);
        least = MIN(least, MAX(fabs(off), distance_to_box(o)));
    }
    return least - O.touch;
}

/* Whether a particle that hops on an obstacle can go so far without meeting anything else; then that length is used up. */
int is_free(double way) {
    if (way > A.free) A.free = clearance(way);
    if (way > A.free) return 0;
    A.free -= way;
    return 1;
}

/* When a particle that an obstacle has thrown off is back on it, if it cannot meet anything else before that, and the hop is
   short; else infinite. The gap to a circle, over the time, is a straight line then, but for a small share. */
double hop(const Motion *m, double until) {
    if (A.left == NONE || A.order != 1 || A.point || O.change_count) return INFINITY;
    const Obstacle *o = O.all + A.left;
    double speed = speed_of(m), t = INFINITY;
    if (o->met == FACE) {
        double rate = A.left_side * (m->vx * o->nx + m->vy * o->ny), fall = A.left_side * (m->ax * o->nx + m->ay * o->ny);
        if (rate > PARALLEL * speed && fall < -PARALLEL * length_of(m->ax, m->ay)) t = descent(0.0, rate, fall);
    } else {
        double dx = m->x - o->x, dy = m->y - o->y, sense = sign_of(o->rho);
        double gap[] = { sense * 2.0 * (dx * m->vx + dy * m->vy),
            sense * (m->vx * m->vx + m->vy * m->vy + (dx * m->ax + dy * m->ay)),
            sense * (m->vx * m->ax + m->vy * m->ay), sense * 0.25 * (m->ax * m->ax + m->ay * m->ay) };
        double line = -gap[0] / gap[1], most = 2.0 * line, step = INFINITY;
        if (!(gap[0] > 0.0 && most > 0.0 && fabs(gap[2]) * most + fabs(gap[3]) * most * most < STRAIGHT * -gap[1]))
            return INFINITY;
        for (t = line; fabs(step) > SETTLED * t; t -= step)
            step = polynomial(gap, 4, t) / (gap[1] + t * (2.0 * gap[2] + t * 3.0 * gap[3]));
    }
    double way = t * (speed + 0.5 * t * length_of(m->ax, m->ay));
    return t > 0.0 && t < until && is_free(way) ? t : INFINITY;
}

/* Whether a point that rides round a circle cannot meet something at a place: see `is_barred`. */
static int is_across(int circle, int k, int side, double x, double y, int epoch) {
    int corner = A.point ? corner_at(circle, 0, x, y) : NONE;
    return corner != NONE && !bounds(corner, k, side, epoch);
}

/* Note a place where a ride may end, by an obstacle whose gap falls with phi at the rate `closing` there. */
static void note_stop(double closing, Bound what) { O.stops[O.stop_count++] = (Stop){ closing, what }; }

/* List what may stop a ride round a circle on the half `side`, among what exists in an epoch. */
static void list_stops(int circle, int side, int epoch) {
    const Obstacle *c = O.all + circle;
    double facing = sign_of(c->rho), rho = c->rho;
    O.stop_count = 0, O.stops_on = circle, O.stops_side = side, O.stops_epoch = epoch, O.stops_rho = rho;
    Two center = two_at(&c->x);
    Box box = { center - fabs(rho), center + fabs(rho) };
    if (c->extent < TURN)
        box = (Box){ larger(box.low, two_at(c->low) - O.touch), lesser(box.high, two_at(c->high) + O.touch) };
    for (int k = 0; k < O.faces; k++)
        for (int n = 0; n < 2 && is_near(&box, O.all + k); n++) {
            const Obstacle *o = O.all + k;
            int face = n ? -1 : 1;
            /* The gap to a face is rho (cos(phi - tilt) - level). */
            double height = (o->x - c->x) * o->nx + (o->y - c->y) * o->ny;
            double level = (face * height + A.given->radius) / rho;
            /* A ride that only touches it goes on. */
            if (!(fabs(level) < 1.0) || is_beside(circle, k, n) || !is_there(k, epoch)) continue;
            double tilt = angle_of(face * o->nx, face * o->ny), half = angle_of_cosine(level);
            for (int sign = -1; sign <= 1; sign += 2) {
                double angle = tilt + sign * half, up, across;
                sin_cos(angle, &up, &across);
                double x = c->x + rho * up, y = c->y + rho * across;
                double foot = (x - o->x) * o->tx + (y - o->y) * o->ty;
                if (foot >= 0.0 && foot <= o->length && !is_across(circle, k, face, x, y, epoch))
                    note_stop(facing * sine(angle - tilt), (Bound){ angle, k, face, 0, NONE });
            }
        }
    for (int h = c->handovers; h != NONE; h = O.handovers[h].next) {
        const Handover *over = O.handovers + h;
        const Tip *tip = O.tips + over->tip;
        int face = over->face ? -1 : 1, number = face_of(over->tip / 2, face);
        if (!is_there(number, epoch)) continue;
        double tilt = angle_of(tip->out[0], tip->out[1]);
        double angle = (face > 0) == (over->tip % 2 > 0) ? tilt - 0.5 * PI : tilt + 0.5 * PI;
        double closing = facing * sine(angle - tilt);
        int joint = tip->sets[over->face];
        Onward onward = O.onward[2 * (epoch * O.tip_count + over->tip) + over->face];
        if (over->onto) note_stop(closing, (Bound){ angle, number, face, 1, joint });
        else note_stop(-closing, (Bound){ angle, onward.obstacle, onward.side, !onward.meets, joint });
    }
    if (c->met == END && c->speed != 0.0) {
        const double *crown = crown_of(c, epoch);
        double tilt = angle_of(crown[0], crown[1]);
        for (int sign = -1; sign <= 1; sign += 2) {
            double angle = tilt + sign * 0.5 * PI;
            note_stop(side * sine(angle - tilt), (Bound){ angle, circle, -side, 1, NONE });
        }
    }
    for (int k = O.faces; k < O.count; k++) {
        const Obstacle *o = O.all + k;
        /* The gap to a circle grows with -cos(phi - tilt). */
        double x = o->x - c->x, y = o->y - c->y, distance = length_of(x, y);
        if (k == circle || !is_near(&box, o) || !(distance > O.touch) || is_beside(circle, k, 0)) continue;
        double level = (rho * rho + distance * distance - o->rho * o->rho) / (2.0 * rho * distance);
        if (!(fabs(level) < 1.0)) continue;
        double half = angle_of_cosine(level), tilt = angle_of(x, y);
        for (int sign = -1; sign <= 1; sign += 2) {
            double angle = tilt + sign * half, up, across;
            sin_cos(angle, &up, &across);
            double away_x = rho * up - x, away_y = rho * across - y;
            if (!spans(o, away_x, away_y) || !is_reached(k, away_x, away_y, epoch)) continue;
            if (is_across(circle, k, 0, o->x + away_x, o->y + away_y, epoch)) continue;
            note_stop(-sign_of(o->rho) * facing * sine(angle - tilt), (Bound){ angle, k, 0, 0, NONE });
        }
    }
}

/* Find what stops a ride round a circle backwards and forwards, which is now at phi on the half `side`, among what exists
   in an epoch. Particles of one radius have the same stops, so they are kept. */
void find_bounds(int circle, int side, double phi, int epoch, Bound *found) {
    if (circle != O.stops_on || side != O.stops_side || epoch != O.stops_epoch || O.all[circle].rho != O.stops_rho)
        list_stops(circle, side, epoch);
    double off = O.touch / fabs(O.all[circle].rho);
    for (int way = 0; way < 2; way++) found[way] = (Bound){ way ? INFINITY : -INFINITY, NONE, 0, 0, NONE };
    for (const Stop *s = O.stops; s < O.stops + O.stop_count; s++)
        for (int way = 0; way < 2; way++) {
            double sign = way ? 1.0 : -1.0;
            if (!(sign * s->closing > 0.0)) continue;
            /* In a tight hollow, or where the two hardly cross, the rounding of places is a larger angle. */
            double now = MAX(NOW, MIN(off / fabs(s->closing), sqrt(2.0 * off)));
            double ahead = MAX(modulo(sign * (s->what.angle - phi) + now, TURN) - now, 0.0);
            double place = phi + sign * ahead;
            if (!(sign * (place - found[way].angle) < 0.0)) continue;
            found[way] = s->what, found[way].angle = place;
        }
}
