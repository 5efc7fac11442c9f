/* Pieces of surfaces as the laws see them: where they are at a time, and how far a place is from them.

   A check shares nothing with what it checks: nothing here is from the engine's files. */

#include "laws.h"

/* Enlarge a box to include a place. */
static void grow(double *box, double x, double y) {
    box[0] = MIN(box[0], x);
    box[1] = MIN(box[1], y);
    box[2] = MAX(box[2], x);
    box[3] = MAX(box[3], y);
}

/* Moving pieces: they shake, travel and turn about a pivot, see `Mover`. Places are transformed into the frame of the
   piece, in which it is as written. */

/* Greatest distance of a piece from its pivot, by its box as written, m. */
static double reach_of(const Barrier *b, const Mover *m) {
    double x = MAX(fabs(b->box[0] - m->pivot[0]), fabs(b->box[2] - m->pivot[0]));
    double y = MAX(fabs(b->box[1] - m->pivot[1]), fabs(b->box[3] - m->pivot[1]));
    return length_of(x, y);
}

/* Whether its angle is recorded as states of the run: of a hinge, or turned by hand. */
static int is_swung(const Mover *m) { return m->inertia > 0 || m->steered; }

/* Enlarge the box of a piece to all that it sweeps. */
static void sweep(Barrier *b) {
    const Mover *m = L.movers + b->mover - 1;
    double reach = reach_of(b, m);
    for (int k = 0; k < 4; k++) {
        double way = m->way[k % 2], by = fabs(m->by[k % 2]), side = k < 2 ? -1 : 1;
        if (m->turn || is_swung(m)) b->box[k] = m->pivot[k % 2] + side * reach;
        b->box[k] += side * (by + MAX(side * way, 0));
    }
}

/* Greatest speed of a point of a moving piece, m/s, and its greatest acceleration, m/s2. Bounds, since they use the box
   that holds what the piece sweeps. */
double swiftest(const Barrier *b, double *haste) {
    *haste = 0;
    if (!b->mover) return 0;
    const Mover *m = L.movers + b->mover - 1;
    double rate = 2 * PI * m->frequency, by = length_of(m->by[0], m->by[1]), way = length_of(m->way[0], m->way[1]);
    double reach = reach_of(b, m), pace = m->lasts ? 2 * way / m->lasts : 0, turn = fabs(m->turn);
    if (is_swung(m))
        for (int n = m->first; n <= m->last; n++) turn = MAX(turn, fabs(L.swings[n].rate));
    *haste = rate * rate * by + (m->lasts ? 2 * pace / m->lasts : 0) + turn * turn * reach;
    return rate * by + pace + turn * reach;
}

/* The angle of a hinge at t: between two of its states a cubic, like tracks. */
static double swung_by(const Mover *m, double t) {
    const Swing *all = L.swings;
    int low = m->first, high = m->last;
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (all[middle].t <= t) low = middle;
        else high = middle;
    }
    const Swing *a = all + low, *b = all + high;
    double h = b->t - a->t, s = h > 0 ? MIN(MAX((t - a->t) / h, 0), 1) : 0, gone = b->angle - a->angle;
    return a->angle + s * (h * a->rate + s * ((3 * gone - h * (2 * a->rate + b->rate)) + s * (h * (a->rate + b->rate) - 2 * gone)));
}

/* Transform a place at t into the frame of a piece. */
void to_rest(const Barrier *b, double t, double *x, double *y) {
    if (!b->mover) return;
    const Mover *m = L.movers + b->mover - 1;
    double now = t;
    t = MAX(t - m->begins, 0);
    double swing = sin(2 * PI * m->frequency * t + m->phase), gone = m->lasts ? (t - m->from) / m->lasts : 0;
    gone = MIN(MAX(gone, 0), 1);
    gone = gone > 0.5 ? 1 - 2 * (1 - gone) * (1 - gone) : 2 * gone * gone;
    double dx = *x - m->pivot[0] - m->by[0] * swing - m->way[0] * gone;
    double dy = *y - m->pivot[1] - m->by[1] * swing - m->way[1] * gone;
    double angle = is_swung(m) ? swung_by(m, now) : m->turn * t, c = cos(angle), s = sin(angle);
    *x = m->pivot[0] + c * dx + s * dy;
    *y = m->pivot[1] - s * dx + c * dy;
}

/* Places of pieces. */

/* Whether a piece begins at an end of the piece before it, of the same surface. */
static int follows(const Barrier *b) {
    const Barrier *last = b - 1;
    if (b->surface != last->surface || b->appears != last->appears || (b->radius > 0) != (last->radius > 0)) return 0;
    for (int n = 0; n < 4; n++) {
        const double *one = b->end + n / 2 * 2, *other = last->end + n % 2 * 2;
        if (length_of(one[0] - other[0], one[1] - other[1]) <= 1e-9 * L.largest) return 1;
    }
    return 0;
}

void shape_barriers(void) {
    int count = L.piece_count * members();
    for (int k = 0; k < count; k++) {
        Barrier *b = L.barriers + k;
        b->box[0] = b->box[1] = INFINITY;
        b->box[2] = b->box[3] = -INFINITY;
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
                if (is_within(b, x, y, 0)) grow(b->box, x, y);
            }
        }
        grow(b->box, b->end[0], b->end[1]);
        grow(b->box, b->end[2], b->end[3]);
        if (b->mover) sweep(b);
    }
    for (int k = count - 1, n = 1; k >= 0; k--, n++) {
        Barrier *b = L.barriers + k;
        int goes_on = k > 0 && b->one_sided && follows(b);
        b->chain = goes_on || !b->one_sided ? 0 : n;
        if (!goes_on) n = 0;
    }
}

static double foot(const Barrier *b, double x, double y) {
    return b->tx * (x - b->x) + b->ty * (y - b->y);
}

/* Distance along an arc, counterclockwise from its first end, m. */
static double along(const Barrier *b, double x, double y) {
    double turn = fmod(atan2(y - b->y, x - b->x) - b->begin, 2 * PI);
    return b->radius * (turn < 0 ? turn + 2 * PI : turn);
}

/* Distance from the line or circle of a piece, m; positive on the left, or outside. */
double beside(const Barrier *b, double x, double y) {
    if (b->radius == 0) return b->tx * (y - b->y) - b->ty * (x - b->x);
    return length_of(x - b->x, y - b->y) - b->radius;
}

/* Whether the foot of a place is on the piece, more than `margin` (m) from its ends. */
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
        return length_of(x - b->x - way * b->tx, y - b->y - way * b->ty);
    }
    if (b->whole || along(b, x, y) <= b->extent * b->radius) return fabs(beside(b, x, y));
    return MIN(length_of(x - b->end[0], y - b->end[1]), length_of(x - b->end[2], y - b->end[3]));
}

/* `beside`, but beyond the ends of an arc the distance from the tangent there, m. */
static double aside(const Barrier *b, double x, double y) {
    if (b->radius == 0 || b->whole || along(b, x, y) <= b->extent * b->radius) return beside(b, x, y);
    int last = length_of(x - b->end[0], y - b->end[1]) > length_of(x - b->end[2], y - b->end[3]);
    const double *end = b->end + 2 * last;
    return ((x - end[0]) * (end[0] - b->x) + (y - end[1]) * (end[1] - b->y)) / b->radius;
}

/* The nearest piece of a one-sided chain, or the moving piece: its distance, and how far the place is on its solid side
   (or on its left), m. At a corner, where two are equally near, the sum of both counts. */
const Barrier *nearest(const Barrier *b, double x, double y, double *gap, double *off) {
    const Barrier *found = b;
    *gap = INFINITY;
    for (int n = 0; n < MAX(b->chain, 1); n++) {
        double away = distance(b + n, x, y), side = b->one_sided ? b[n].one_sided * aside(b + n, x, y) : beside(b, x, y);
        int is_corner = fabs(away - *gap) <= EPS * ROUNDINGS * (away + fabs(x) + fabs(y));
        if (is_corner) *off += side;
        if (is_corner || away > *gap) continue;
        *gap = away;
        *off = side;
        found = b + n;
    }
    return found;
}
