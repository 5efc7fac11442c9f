/* When particles with corners meet: the instant at which the first gap closes, on the exact paths of corners with rotation. */

#include "shape.h"

/* Least number of steps in which gaps are checked over a span. A contact that begins and ends within one is left to the
   next step, except one of two tips. */
#define STRIDES 8
/* rad; in none of them either of the two rotates by more. */
#define TURNS 0.0125
/* rad; a particle that rotates by more in a span may leave something round by one corner and meet it with the next. */
#define ROLLS 0.05
/* Greatest number of iterations to the instant of an impact; bisections reach its last bit if need be ... */
#define TO_ROOT 200
/* ... and the number of faster steps before them. */
#define QUICK 20
/* Candidates for places: corners of both. */
#define CANDIDATES (2 * MOST_CORNERS)

/* Velocity of a particle at a place at t, m/s. */
static void moves_at(const Disk *d, const Shape *a, double t, const Touch *at, double *v) {
    double h = t - d->t;
    v[0] = d->vx + W.gx * h - d->spin * (at->y - a->y);
    v[1] = d->vy + W.gy * h + d->spin * (at->x - a->x);
}

/* Speed at which the gap at a place closes at t, m/s. */
static double closes_at(int i, int j, const Shape *a, const Shape *b, double t, const Touch *at) {
    double u[3], v[3];
    moves_at(W.disks + i, a, t, at, u);
    if (j >= 0) moves_at(W.disks + j, b, t, at, v);
    else carried(b->s, at->x, at->y, v);
    return (v[0] - u[0]) * at->nx + (v[1] - u[1]) * at->ny;
}

/* Bound on the speed at which two approach each other at any place within a span, m/s; INFINITY if they cannot meet in
   it. */
RARELY double fastest_of(int i, int j, double t, double span) {
    const Disk *d = W.disks + i, *o = W.disks + MAX(j, 0);
    double h = t - d->t, x = d->x + (d->vx + 0.5 * W.gx * h) * h, y = d->y + (d->vy + 0.5 * W.gy * h) * h, nx, ny;
    double u = d->vx + W.gx * h, v = d->vy + W.gy * h, turns = fabs(d->spin) * d->radius;
    if (j < 0) {
        const Surface *s = surface_at(-1 - j, t);
        double then = square(u + W.gx * span) + square(v + W.gy * span);
        double most = sqrt(MAX(u * u + v * v, then)) + turns + (stirs(s) ? s->fastest : 0);
        return gap_to(s, x, y, d->radius, &nx, &ny) > most * span ? INFINITY : most;
    }
    h = t - o->t;
    x -= o->x + (o->vx + 0.5 * W.gx * h) * h;
    y -= o->y + (o->vy + 0.5 * W.gy * h) * h;
    u -= o->vx + W.gx * h;
    v -= o->vy + W.gy * h;
    double speed = sqrt(u * u + v * v);
    if (x * x + y * y > square(d->radius + o->radius + speed * span)) return INFINITY;
    return speed + turns + fabs(o->spin) * o->radius;
}

/* The gap of a candidate, m. For a corner of a polygon, or an end of a surface, its distance outside of all edges; for a
   corner on a segment that on its side; for something round that at the place where it is. */
static double gap_at(const Shape *a, const Shape *b, double near, Touch *at) {
    int m = at->which - a->count;
    if (m < 0 && b->round < 0 && !b->s) at->gap = outside(b, a->p[at->which]);
    else if (m >= 0 && m != b->round) at->gap = outside(a, b->p[m]);
    else if (m < 0 && b->s && b->s->shape == SEGMENT) fill_in(a, b, at);
    else find_place(a, b, near, at);
    return at->gap;
}

/* The gap of a corner of polygon i outside of polygon j at t, m, and the speed at which it closes. This is `gap_at` without
   whole shapes, in the frame of j. `on` has a bit for the edge that the corner is furthest outside of, and for others of
   which it is outside by hardly less: then it is at a tip. */
static double corner_gap(int i, int corner, int j, double t, double near, double *closes, int *on) {
    const Disk *d = W.disks + i, *o = W.disks + j;
    const double *at = W.outlines + 2 * (d->outline + corner), *point = W.outlines + 2 * o->outline;
    const double *edge = W.edges + 3 * o->outline, *best = edge;
    double h = t - d->t, k = t - o->t, pose[2], other[2], gap = -INFINITY;
    turn_pose(i, d->spin * h, pose);
    turn_pose(j, o->spin * k, other);
    double x = pose[0] * at[0] - pose[1] * at[1], y = pose[1] * at[0] + pose[0] * at[1];
    double u = d->vx + W.gx * h - o->vx - W.gx * k - d->spin * y, v = d->vy + W.gy * h - o->vy - W.gy * k + d->spin * x;
    x += d->x + (d->vx + 0.5 * W.gx * h) * h - (o->x + (o->vx + 0.5 * W.gx * k) * k);
    y += d->y + (d->vy + 0.5 * W.gy * h) * h - (o->y + (o->vy + 0.5 * W.gy * k) * k);
    u += o->spin * y;
    v -= o->spin * x;
    double along = other[0] * x + other[1] * y, across = other[0] * y - other[1] * x;
    for (int n = 0; n < o->corners; n++, point += 2, edge += 3) {
        double off = (along - point[0]) * edge[0] + (across - point[1]) * edge[1];
        if (off > gap) {
            *on = (off - gap <= near ? *on : 0) | 1 << n;
            gap = off;
            best = edge;
        } else if (gap - off <= near) *on |= 1 << n;
    }
    *closes = -(best[0] * (other[0] * u + other[1] * v) + best[1] * (other[0] * v - other[1] * u));
    return gap;
}

/* The same for a candidate of two polygons; `count` is the number of corners of the first one. */
static double candidate_gap(int i, int j, int count, int which, double t, double near, double *closes, int *on) {
    return which < count ? corner_gap(i, which, j, t, near, closes, on) : corner_gap(j, which - count, i, t, near, closes, on);
}

/* A time within (low, high) at which a corner of a polygon that is outside of another one at both is inside it, and its gap
   then; or `high`. The search goes to where the gap changes from closing to opening. */
static double dip_of(int i, int j, int which, double low, double high, double *gap) {
    double closes, end = high;
    int on;
    for (int n = 0; n < QUICK; n++) {
        double t = 0.5 * (low + high), then = candidate_gap(i, j, W.disks[i].corners, which, t, 0, &closes, &on);
        if (then <= 0) {
            *gap = then;
            return t;
        }
        if (closes > 0) low = t;
        else high = t;
    }
    return end;
}

/* The instant within (low, high] at which the gap of a corner of a polygon to another one closes, from `above` 0 to `below`,
   by Newton's method. Each step goes a little beyond the root, so that the root is between the last two; the search ends when
   the way from one to the other at a speed of `most` is as small as the rounding of a place. */
static double corner_root(int i, int j, int which, double low, double high, double above, double below, double most) {
    double rounding = EPS * (fabs(W.disks[i].x) + fabs(W.disks[i].y)), more = MAX(0.25 * rounding / most, EPS * high), closes;
    int on;
    double t = high + (high - low) * below / (above - below);
    for (int n = 0; n < TO_ROOT && (high - low) * most > rounding; n++) {
        if (n >= QUICK || !(t > low && t < high)) t = 0.5 * (low + high);
        if (!(t > low && t < high)) break;
        double gap = candidate_gap(i, j, W.disks[i].corners, which, t, 0, &closes, &on);
        if (gap > 0) low = t;
        else high = t;
        t += gap / closes + (gap > 0 ? more : -more);
        if (n >= 2) more *= 4;
    }
    return high;
}

/* The same for any other candidate, by false position with the Illinois rule, which halves the value at an end that stays,
   then by bisection. The gap itself doesn't tell how near the root is: of a corner that comes down beside an edge in line with
   its own it stays at 0, however deep the corner is. */
static double root_of(int i, int j, Touch *at, double low, double high, double above, double below, double most) {
    double near = TOUCH * inner_of(i, j), rounding = EPS * (fabs(W.disks[i].x) + fabs(W.disks[i].y));
    for (int n = 0, side = 0; n < TO_ROOT && (high - low) * most > rounding; n++) {
        double middle = n < QUICK ? high + (high - low) * below / (above - below) : 0.5 * (low + high);
        if (!(middle > low && middle < high)) middle = 0.5 * (low + high);
        if (!(middle > low && middle < high)) break;
        Shape a = shape_of(i, middle), b = shape_of(j, middle);
        double gap = gap_at(&a, &b, near, at);
        if (gap > 0) {
            low = middle;
            above = gap;
            if (side > 0) below *= 0.5;
            side = 1;
        } else {
            high = middle;
            below = gap;
            if (side < 0) above *= 0.5;
            side = -1;
        }
    }
    return high;
}

/* The instant within (low, high] at which two polygons begin to overlap. */
static double overlap_at(int i, int j, double low, double high) {
    for (;;) {
        double middle = 0.5 * (low + high);
        if (!(middle > low && middle < high)) return high;
        Shape a = shape_of(i, middle), b = shape_of(j, middle);
        if (are_apart(&a, &b, 0)) low = middle;
        else high = middle;
    }
}

/* Whether a place at which two touch at t closes faster than `soft`, and than what is left of two particles there. */
static int closes_faster(int i, int j, Shape *a, Shape *b, double t, double within, double soft) {
    Touch places[MOST_TOUCHES];
    int count = list_places_of(a, b, TOUCH * inner_of(i, j), within, places);
    for (int n = 0; n < count; n++) {
        double fast = closes_at(i, j, a, b, t, places + n);
        if (fast > soft && (j < 0 || fast > left_by_corners(i, j, places[n].gap, t))) return 1;
    }
    return 0;
}

/* Whether a corner of one polygon that is inside the other, or may be, moves faster than `soft` relative to it at t. Else no
   gap that is closed closes faster. */
static int may_close(int i, int j, const Shape *a, const Shape *b, double t, double soft) {
    for (int c = 0; c < a->count + b->count; c++) {
        const double *q = c < a->count ? a->p[c] : b->p[c - a->count];
        Touch at = {.x = q[0], .y = q[1]};
        double u[2], v[2];
        if ((c < a->count ? off_edge(b, b->facing, q) : off_edge(a, a->facing, q)) > 0) continue;
        moves_at(W.disks + i, a, t, &at, u);
        moves_at(W.disks + j, b, t, &at, v);
        if (!(square(u[0] - v[0]) + square(u[1] - v[1]) <= square(soft))) return 1;
    }
    return 0;
}

/* The instant within (low, high] from which on a touching place closes faster than `soft`, for what touches all the time:
   a particle that rolls from a corner onto an edge round a disk or an arc, and tips that pass while edges touch elsewhere. */
static double closes_from(int i, int j, double low, double high, double soft) {
    for (int n = 0; n < QUICK; n++) {
        double middle = 0.5 * (low + high);
        Shape a = shape_of(i, middle), b = shape_of(j, middle);
        if (closes_faster(i, j, &a, &b, middle, TOUCHING * inner_of(i, j), soft)) high = middle;
        else low = middle;
    }
    return high;
}

/* The instant between two times at which particle i, which has corners, meets j faster than `soft`, or INFINITY; `most`
   is the bound of `fastest_of`. Two particles may be left to the next step up to a faster approach, see `left_by_corners`. */
double meet_corners(int i, int j, double from, double until, double most, double soft) {
    double span = until - from, small = inner_of(i, j), near = TOUCH * small;
    double h = 0, first = INFINITY, gap[CANDIDATES], closes, deep = 0, checked = from;
    int on[CANDIDATES], in_reach[CANDIDATES], many = 0, closed;
    if (!(span > 0) || most <= soft) return INFINITY;
    Shape a = shape_of(i, from), b = shape_of(j, from);
    int count = a.count + b.count, on_segment = b.s && b.s->shape == SEGMENT, both = !b.s && b.round < 0;
    double fastest = MAX(fabs(W.disks[i].spin), j < 0 ? 0 : fabs(W.disks[j].spin)), least_stride = span / STRIDES;
    double turn = both ? fabs(W.disks[i].spin) + fabs(W.disks[j].spin) : 0;
    double bends = turn * (2 * most + 4 * turn * MAX(W.disks[i].radius, both ? W.disks[j].radius : 0));
    if (fastest > 0) least_stride = MIN(least_stride, TURNS / fastest);
    if (are_apart(&a, &b, most * span + near)) return INFINITY;
    closed = (both || on_segment) && overlap(&a, &b);
    if (closed) deep = MAX(a.clear, b.clear);
    /* On something round all corners are one candidate: when one leaves, the next may arrive. */
    int rolls = b.round >= 0 && span * (fabs(W.disks[i].spin) + (j < 0 ? 0 : fabs(W.disks[j].spin))) > ROLLS;
    for (int c = 0; c < count; c++) {
        Touch now = {.which = c};
        /* On any edge its gap is at least as large. */
        if (both && (c < a.count ? off_edge(&b, b.facing, a.p[c]) : off_edge(&a, a.facing, b.p[c - a.count])) > most * span)
            continue;
        /* Its side does not change within a step. */
        if (on_segment && c < a.count) now.on = on[c] = side_of(&a, b.s, c, near);
        gap[c] = gap_at(&a, &b, near, &now);
        closed |= gap[c] <= 0;
        if (gap[c] > most * span) continue;
        if (both) candidate_gap(i, j, a.count, c, from, near, &closes, on + c);
        /* Rotation of both accelerates a corner's gap to an edge by at most `bends`. A closed one closes faster than is left
           to the next step only by that. */
        if (!both || (gap[c] > 0 ? gap[c] <= (closes + 0.5 * bends * span) * span : bends * span > soft)) in_reach[many++] = c;
    }
    if (closed && (!both || may_close(i, j, &a, &b, from, soft)) && closes_faster(i, j, &a, &b, from, 0, soft)) return from;
    while (h < span && first == INFINITY && many) {
        double least = INFINITY, last = from + h;
        for (int n = 0; n < many; n++) {
            if (gap[in_reach[n]] > 0) least = MIN(least, gap[in_reach[n]]);
            else if (both || (rolls && in_reach[n] == a.count + b.round)) least = 0;
        }
        h = MIN(h + MAX(least / most, least_stride), span);
        double t = h < span ? from + h : until;
        Shape a2, b2;
        int passes = 0;
        if (!both) a2 = shape_of(i, t), b2 = shape_of(j, t);
        for (int n = 0; n < many; n++) {
            int c = in_reach[n];
            Touch now = {.which = c};
            if (on_segment && c < a.count) now.on = on[c];
            double before = gap[c];
            int edge = on[c];
            /* The surface may have been moved to the time of another root. */
            if (j < 0) b2.s = surface_at(-1 - j, t);
            gap[c] = both ? candidate_gap(i, j, a.count, c, t, near, &closes, on + c) : gap_at(&a2, &b2, near, &now);
            if (before <= 0 && gap[c] < before && b.round >= 0 && c - a.count == b.round
                && closes_faster(i, j, &a2, &b2, t, TOUCHING * small, soft))
                first = MIN(first, closes_from(i, j, last, t, soft));
            /* It closes fast enough at the end of the stride, which is soon enough. */
            if (both && before <= 0 && gap[c] < before && closes > soft && closes > left_by_corners(i, j, gap[c], t))
                first = MIN(first, t);
            int is_near = MIN(before, gap[c]) <= most * (t - last), is_end = on_segment && c >= a.count;
            int at_tip = both && (on[c] != edge || on[c] & (on[c] - 1)) && is_near;
            passes |= at_tip || (is_end && is_near);
            double end = t, least = gap[c];
            /* It may have come in by one edge and gone out by the next. */
            if (at_tip && before > 0 && least > 0 && closes < 0 && before + least <= most * (t - last))
                end = dip_of(i, j, c, last, t, &least);
            if (!(before > 0 && least <= 0)) continue;
            double then = both ? corner_root(i, j, c, last, end, before, least, most)
                               : root_of(i, j, &now, last, t, before, least, most);
            if (then >= first) continue;
            Shape a3 = shape_of(i, then), b3 = shape_of(j, then);
            if (closes_faster(i, j, &a3, &b3, then, TOUCHING * small, soft)) first = then;
        }
        /* A tip that passes through a tip, from one edge beyond the next, or through an end of a segment is inside nothing
           after it, but edges cross then, also before a corner enters. */
        if (!passes || most * (t - checked) < near) continue;
        double end = MIN(t, first);
        a2 = shape_of(i, end);
        b2 = shape_of(j, end);
        double then_deep = are_apart(&a2, &b2, first < INFINITY ? -TOUCHING * small : 0) ? 0 : MAX(a2.clear, b2.clear);
        if (then_deep < 0 && deep == 0) {
            double then = overlap_at(i, j, checked, end);
            Shape a3 = shape_of(i, then), b3 = shape_of(j, then);
            if (closes_faster(i, j, &a3, &b3, then, TOUCHING * small, soft)) first = then;
        } else if (then_deep < deep && closes_faster(i, j, &a2, &b2, end, TOUCHING * small, soft))
            first = closes_from(i, j, checked, end, soft);
        deep = then_deep;
        checked = end;
    }
    return first;
}
