/* Particles with corners at an instant: where they are, how far they are apart, and at which places they touch. */

#include <string.h>
#include "shape.h"
#include "trig.h"

/* Cosine of the angle between edge and surface; with a larger one, a corner near the end of a surface is on it. */
#define FLAT 0.9
/* Share of what counts as near; a smaller overlap may be rounding. */
#define DEEP 0.2
/* The same for a place beyond an end. */
#define ROUNDED 1e-6
/* rad; up to this angle five terms give its sine, and what its cosine lacks of 1, to the last bit. */
#define SMALL 0.1
#define S3 (-1 / 6.0)
#define S5 (1 / 120.0)
#define S7 (-1 / 5040.0)
#define S9 (1 / 362880.0)
#define S11 (-1 / 39916800.0)
#define C4 (-1 / 24.0)
#define C6 (1 / 720.0)
#define C8 (-1 / 40320.0)
#define C10 (1 / 3628800.0)

/* Cosine and sine of the angle of a particle. */
const double *pose_of(int j) {
    double *pose = W.poses + 3 * j, turned = W.disks[j].turned;
    if (pose[0] == turned && pose[1] != pose[2]) return pose + 1;
    pose[0] = turned;
    sin_cos(fabs(turned) < 1e6 ? turned : fmod(turned, 2 * PI), pose + 2, pose + 1);
    return pose + 1;
}

/* The same after it has rotated by a further angle. Of a small angle the series of sine and cosine end soon. */
void turn_pose(int j, double by, double *pose) {
    double x = by * by, c = x * (0.5 + x * (C4 + x * (C6 + x * (C8 + x * C10))));
    double s = by * (1 + x * (S3 + x * (S5 + x * (S7 + x * (S9 + x * S11)))));
    if (!(fabs(by) < SMALL)) {
        double turned = W.disks[j].turned + by;
        sin_cos(fabs(turned) < 1e6 ? turned : fmod(turned, 2 * PI), pose + 1, pose);
        return;
    }
    const double *now = pose_of(j);
    pose[0] = now[0] - (now[0] * c + now[1] * s);
    pose[1] = now[1] - (now[1] * c - now[0] * s);
}

/* A vector turned by an angle, of which `along` has the cosine twice, and `across` the sine, first with the other sign. */
static inline Two rotated(Two along, Two across, const double *v) {
    Two from = two(v);
    return plus(wasm_f64x2_mul(along, from), wasm_f64x2_mul(across, wasm_i64x2_shuffle(from, from, 1, 0)));
}

Shape shape_of(int j, double t) {
    /* Only the fields that it has are set. */
    Shape out;
    out.round = -1;
    out.count = 0;
    out.s = 0;
    if (j < 0) {
        const Surface *s = out.s = surface_at(-1 - j, t);
        if (s->shape != CIRCLE) {
            memcpy(out.p, s->end, sizeof s->end);
            out.count = 2;
        }
        if (s->shape == SEGMENT) return out;
        out.p[out.count][0] = s->x;
        out.p[out.count][1] = s->y;
        out.radius = s->radius;
        out.round = out.count++;
        return out;
    }
    const Disk *d = W.disks + j;
    double h = t - d->t;
    out.x = d->x + (d->vx + 0.5 * W.gx * h) * h;
    out.y = d->y + (d->vy + 0.5 * W.gy * h) * h;
    out.count = d->corners;
    if (d->corners) {
        const double *pose, *corner = W.outlines + 2 * d->outline, *edge = out.edges = W.edges + 3 * d->outline;
        double later[2];
        if (h == 0) pose = pose_of(j);
        else {
            turn_pose(j, d->spin * h, later);
            pose = later;
        }
        Two along = wasm_f64x2_splat(pose[0]), across = wasm_f64x2_make(-pose[1], pose[1]), centre = two(&out.x);
        for (int n = 0; n < d->corners; n++, corner += 2, edge += 3) {
            wasm_v128_store(out.p[n], plus(centre, rotated(along, across, corner)));
            wasm_v128_store(out.n[n], rotated(along, across, edge));
        }
        return out;
    }
    out.p[0][0] = out.x;
    out.p[0][1] = out.y;
    out.radius = d->radius;
    out.round = 0;
    out.count = 1;
    return out;
}

/* Distance of a whole shape outside of an edge, m; negative if it is partly inside. */
static double clear_of(const Shape *a, int edge, const Shape *b) {
    double least = INFINITY;
    if (b->round < 0) {
        Two from = two(a->p[edge]), out = two(a->n[edge]);
        for (int n = 0; n < b->count; n++) {
            Two off = wasm_f64x2_mul(minus(two(b->p[n]), from), out);
            least = smaller(least, wasm_f64x2_extract_lane(off, 0) + wasm_f64x2_extract_lane(off, 1));
        }
        return least;
    }
    for (int n = 0; n < b->count; n++)
        least = smaller(least, off_edge(a, edge, b->p[n]) - (n == b->round ? b->radius : 0));
    return least;
}

/* Whether the centre of a particle is between a segment and the piece that is next to it: at an end, on one side, as the
   rows of `beside` are. */
static int is_in_hollow(const Shape *a, const Surface *s, int row) {
    const double *end = s->end + row / 2 * 2;
    double x = a->x - end[0], y = a->y - end[1], inwards = row < 2 ? 1 : -1, side = row % 2 ? -1 : 1;
    double off = side * (y * s->tx - x * s->ty);
    return off > 0 && inwards * (x * s->tx + y * s->ty) > off * s->hollows[row];
}

/* The edge that a corner of `b` is on. If the corner is outside of `a` by `near`, that is the edge that it is furthest
   outside of. Else it is the edge that faces `b` (see `are_apart`): with another one, a particle that overlaps by more than
   the distance of its corners would be pressed sideways. At an end of a surface, the line by which the surface continues
   from there, as long as the inner radius of `a`, counts for that, and at a ridge that of the piece next to it: so a corner
   that slides off the end stays on the edge on which it came. */
static int edge_under(const Shape *a, const Shape *b, const double *q, double near) {
    double off, best = -INFINITY, on = near / TOUCH;
    int found = furthest(a, q, &off);
    if (off >= near) return found;
    if (!b->s) return a->facing;
    Shape end;
    end.count = 2;
    end.round = -1;
    double x = b->s->tx, y = b->s->ty;
    if (b->s->shape == ARC) {
        x = (q[1] - b->s->y) / b->radius;
        y = (b->s->x - q[0]) / b->radius;
        if (x * b->s->tx + y * b->s->ty < 0) on = -on;
    } else if (q != b->p[0]) on = -on;
    memcpy(end.p[0], q, sizeof end.p[0]);
    end.p[1][0] = q[0] + on * x;
    end.p[1][1] = q[1] + on * y;
    for (int row = q == b->p[0] ? 0 : 2, last = row + 1; row <= last && b->s->shape == SEGMENT; row++) {
        if (b->s->beside[row] < 0 || is_in_hollow(a, b->s, row)) continue;
        double far = b->s->hollows[row], sine = 1 / sqrt(1 + far * far), off = fabs(on) * sine;
        if (row % 2) off = -off;
        end.p[end.count][0] = q[0] + on * far * sine * x - off * y;
        end.p[end.count++][1] = q[1] + on * far * sine * y + off * x;
    }
    for (int e = 0; e < a->count; e++) {
        double clear = clear_of(a, e, &end);
        if (clear <= best) continue;
        best = clear;
        found = e;
    }
    return found;
}

/* Whether two polygons are apart by more than `by` along an edge of the first one. If not, note the edge that separates
   them most. */
static int are_apart_along(Shape *a, const Shape *b, double by) {
    double off[MOST_CORNERS], best;
    int found = 0;
    /* A particle as a whole is out by less than its centre is. The edge that its centre is furthest out of comes first. */
    for (int e = 0; e < a->count && !b->s; e++) {
        off[e] = off_edge(a, e, &b->x);
        if (off[e] > off[found]) found = e;
    }
    best = clear_of(a, found, b);
    if (best > by) return 1;
    for (int e = 0, first = found; e < a->count; e++) {
        if (e == first || (!b->s && off[e] < best)) continue;
        double clear = clear_of(a, e, b);
        if (clear > by) return 1;
        if (clear < best || (clear == best && e > found)) continue;
        best = clear;
        found = e;
    }
    a->facing = found;
    a->clear = best;
    return 0;
}

/* Let that edge of a polygon face another one that is most opposite to the facing edge of that one. */
static void face(Shape *a, const Shape *b) {
    const double *n = b->n[b->facing];
    double most = INFINITY;
    for (int e = 0; e < a->count; e++) {
        double alike = a->n[e][0] * n[0] + a->n[e][1] * n[1];
        if (alike >= most) continue;
        most = alike;
        a->facing = e;
    }
}

/* Whether a polygon and something else are apart by more than `by`: along an edge of either, or inside an arc. If two
   polygons are not, of all edges the one that separates them most faces the other polygon, and the edge opposite faces it.
   The best edge of the other polygon alone may be on its far side, if it is thin: all its edges overlap more there. */
int are_apart(Shape *a, Shape *b, double by) {
    if (are_apart_along(a, b, by) || (b->round < 0 && !b->s && are_apart_along(b, a, by))) return 1;
    if (!b->s) {
        if (b->round < 0 && a->clear >= b->clear) face(b, a);
        else if (b->round < 0) face(a, b);
        return 0;
    }
    double low = INFINITY, high = -INFINITY;
    for (int n = 0; n < a->count; n++) {
        double x = a->p[n][0] - b->s->x, y = a->p[n][1] - b->s->y;
        double off = b->round < 0 ? y * b->s->tx - x * b->s->ty : x * x + y * y;
        low = MIN(low, off);
        high = MAX(high, off);
    }
    if (b->round < 0) {
        b->clear = MAX(low, -high);
        return b->clear > by;
    }
    return by < b->radius && high < square(b->radius - by);
}

/* Fill in a place from its candidate `which` (corners of `a`, then points of `b`) and from what this is on: the number of
   an edge; for a corner on a segment the side, 1 or -1; on an arc 0, the inside; for a point with a radius also -1 -
   corner of `a`. */
void fill_in(const Shape *a, const Shape *b, Touch *t) {
    double n[2];
    if (t->which < a->count) {
        const double *q = a->p[t->which];
        t->x = q[0];
        t->y = q[1];
        if (!b->s) {
            out_of(b, t->on, n);
            t->gap = off_edge(b, t->on, q);
        } else if (b->s->shape == SEGMENT) {
            n[0] = -t->on * b->s->ty;
            n[1] = t->on * b->s->tx;
            t->gap = (q[0] - b->s->x) * n[0] + (q[1] - b->s->y) * n[1];
        } else {
            double x = b->s->x - q[0], y = b->s->y - q[1], d = sqrt(x * x + y * y);
            n[0] = x / d;
            n[1] = y / d;
            t->gap = b->radius - d;
        }
    } else {
        int m = t->which - a->count;
        const double *q = b->p[m];
        double r = m == b->round ? b->radius : 0;
        if (t->on >= 0) {
            out_of(a, t->on, n);
            t->gap = off_edge(a, t->on, q) - r;
            n[0] = -n[0];
            n[1] = -n[1];
        } else {
            double x = a->p[-1 - t->on][0] - q[0], y = a->p[-1 - t->on][1] - q[1], d = sqrt(x * x + y * y);
            t->gap = d - r;
            n[0] = x / d;
            n[1] = y / d;
        }
        t->x = q[0] + r * n[0];
        t->y = q[1] + r * n[1];
    }
    t->nx = n[0];
    t->ny = n[1];
}

/* Whether a point of a shape is on the inside of an arc: its own position decides, unless the line from it to the centre,
   which is inside the shape, crosses the arc once. Outside the circle are both where a shape lies over the opening: then
   the line may enter the circle through the arc, and leave it through the opening. */
static int is_inside(const Shape *a, const Surface *s, double px, double py) {
    double x = px - s->x, y = py - s->y, u = a->x - s->x, v = a->y - s->y;
    double off = x * x + y * y - square(s->radius);
    int own = off <= 0, centre = u * u + v * v < square(s->radius), result = own;
    if (own && centre) return own;
    u -= x;
    v -= y;
    double whole = u * u + v * v, half = x * u + y * v, root = half * half - whole * off;
    if (own == centre && !(half < 0 && whole > -half && root > 0)) return own;
    root = sqrt(root);
    for (int side = own ? 1 : -1; side <= (centre ? -1 : 1); side += 2) {
        double cut = (side * root - half) / whole;
        if (s->shape == CIRCLE || (x + cut * u) * s->tx + (y + cut * v) * s->ty >= s->cos_half * s->radius) result = !result;
    }
    return result;
}

/* Whether a corner has passed through a piece: the line from it to the centre, which is inside the particle, crosses the
   piece. */
static int has_passed(const Shape *a, const Surface *s, const double *q) {
    double x = q[0] - s->x, y = q[1] - s->y, u = a->x - s->x, v = a->y - s->y;
    if (s->shape != SEGMENT) return is_inside(a, s, q[0], q[1]) != (x * x + y * y <= square(s->radius));
    double off = y * s->tx - x * s->ty, mid = v * s->tx - u * s->ty, both = fabs(off) + fabs(mid);
    double cut = (x * s->tx + y * s->ty) * fabs(mid) + (u * s->tx + v * s->ty) * fabs(off);
    return (off >= 0) != (mid >= 0) && cut >= 0 && cut <= s->length * both;
}

/* How far beyond an end of a segment a corner on one of its sides, 1 or -1, is still on the segment: a little if the segment
   continues smoothly there, and by rounding; without bound if the corner has passed through one of two pieces between which
   the centre is, as then it is beyond the end of either. If a piece is next to it there and the centre is not between them,
   that one is in between: not at all. */
static double past_end(const Shape *a, const Surface *s, const double *q, int end, int side, double near) {
    int row = 2 * end + (side < 0);
    if (mate_of(s, end) >= 0) return near;
    if (s->beside[row] < 0) return ROUNDED * near;
    if (!is_in_hollow(a, s, row)) return 0;
    return has_passed(a, s, q) || has_passed(a, surface_at(s->beside[row], s->posed), q) ? INFINITY : ROUNDED * near;
}

/* The side of a segment that a corner is on: its own, or that of the centre if the corner has passed through the segment,
   also a little beyond an end, see `past_end`. It has not if the line crosses the piece next to it as well, at a ridge. */
int side_of(const Shape *a, const Surface *s, int corner, double near) {
    const double *q = a->p[corner];
    double x = q[0] - s->x, y = q[1] - s->y, u = a->x - s->x, v = a->y - s->y;
    double off = y * s->tx - x * s->ty, mid = v * s->tx - u * s->ty, both = fabs(off) + fabs(mid);
    int own = off >= 0 ? 1 : -1, centre = mid >= 0 ? 1 : -1;
    if (own == centre) return own;
    double cut = ((x * s->tx + y * s->ty) * fabs(mid) + (u * s->tx + v * s->ty) * fabs(off)) / both;
    double past = MAX(-cut, cut - s->length);
    if (past > 0) return past <= past_end(a, s, q, cut > 0, centre, near) ? centre : own;
    for (int end = 0; end < 2; end++) {
        int next = s->beside[2 * end + (centre < 0)];
        if (next >= 0 && has_passed(a, surface_at(next, s->posed), q)) return own;
    }
    return centre;
}

/* Find what a candidate is on, and fill in its place; return 0 if it doesn't touch there. */
int find_place(const Shape *a, const Shape *b, double near, Touch *t) {
    double off, n[2];
    if (t->which < a->count) {
        const double *q = a->p[t->which];
        if (b->s && b->s->shape == SEGMENT) {
            double along = (q[0] - b->s->x) * b->s->tx + (q[1] - b->s->y) * b->s->ty;
            t->on = side_of(a, b->s, t->which, near);
            fill_in(a, b, t);
            double past = MAX(-along, along - b->s->length);
            return past <= 0 || past <= past_end(a, b->s, q, along > 0, t->on, near);
        }
        if (b->s) {
            double x = q[0] - b->s->x, y = q[1] - b->s->y, d = sqrt(x * x + y * y);
            t->on = 0;
            fill_in(a, b, t);
            if (!is_inside(a, b->s, q[0], q[1])) return 0;
            return b->s->shape == CIRCLE || x * b->s->tx + y * b->s->ty >= b->s->cos_half * d;
        }
        if (b->round >= 0) {
            t->gap = INFINITY;
            return 0;
        }
        t->on = edge_under(b, a, q, near);
        fill_in(a, b, t);
        double length = out_of(b, t->on, n), along = n[0] * (q[1] - b->p[t->on][1]) - n[1] * (q[0] - b->p[t->on][0]);
        return along >= -near && along <= length + near;
    }
    int m = t->which - a->count;
    const double *q = b->p[m];
    double best = INFINITY;
    if (m != b->round) {
        t->on = edge_under(a, b, q, near);
        double length = out_of(a, t->on, n), along = n[0] * (q[1] - a->p[t->on][1]) - n[1] * (q[0] - a->p[t->on][0]);
        fill_in(a, b, t);
        return along >= 0 && along <= length && !(b->s && mate_of(b->s, m) >= 0);
    }
    t->on = furthest(a, q, &off);
    for (int e = 0; e < a->count && off > 0; e++) {
        double length = out_of(a, e, n), x = q[0] - a->p[e][0], y = q[1] - a->p[e][1];
        double along = n[0] * y - n[1] * x, away = x * n[0] + y * n[1];
        int inside = along >= 0 && along <= length;
        double d = inside ? fabs(away) : sqrt(x * x + y * y);
        if (d >= best || (inside && away < 0)) continue;
        best = d;
        t->on = inside ? e : -1 - e;
    }
    fill_in(a, b, t);
    if (!b->s) return 1;
    if (is_inside(a, b->s, t->x + t->gap * t->nx, t->y + t->gap * t->ny)) return 0;
    return b->s->shape == CIRCLE || t->nx * b->s->tx + t->ny * b->s->ty >= b->s->cos_half;
}

double inner_of(int i, int j) { return j < 0 ? W.disks[i].inner : MIN(W.disks[i].inner, W.disks[j].inner); }

/* Whether two polygons overlap, after `are_apart` has found the edges that separate them most. */
int overlap(const Shape *a, const Shape *b) { return a->clear < 0 && b->clear < 0; }

/* Find the place of two polygons that overlap where a tip has passed through a tip: no corner is inside there, and only edges
   cross. It is the deepest corner at the edge that separates the two most, beyond an end of this edge. Return whether there
   is one: not if the corner is among the `count` places of the list, nor the tip at that end, which is inside then. */
static int find_crossing(const Shape *a, const Shape *b, double near, const Touch *list, int count, Touch *t) {
    int own = a->clear >= b->clear, deepest = 0;
    const Shape *edge = own ? a : b, *other = own ? b : a;
    for (int n = 1; n < other->count; n++)
        if (off_edge(edge, edge->facing, other->p[n]) < off_edge(edge, edge->facing, other->p[deepest])) deepest = n;
    t->which = own ? a->count + deepest : deepest;
    t->on = edge->facing;
    fill_in(a, b, t);
    const double *q = other->p[deepest], *begin = edge->p[t->on];
    double n[2], length = out_of(edge, t->on, n), along = n[0] * (q[1] - begin[1]) - n[1] * (q[0] - begin[0]);
    int last = along > 0.5 * length ? (t->on + 1) % edge->count : t->on, tip = own ? last : a->count + last;
    for (int k = 0; k < count; k++) {
        if (list[k].which == t->which || (list[k].which == tip && list[k].gap <= 0)) return 0;
        if (length_of(list[k].x - t->x, list[k].y - t->y) <= near) return 0;
    }
    return 1;
}

/* List the places at which a polygon and another shape have a gap below `within`, up to MOST_TOUCHES. */
int list_places_of(Shape *a, Shape *b, double near, double within, Touch *list) {
    int count = 0, both = !b->s && b->round < 0;
    if (are_apart(a, b, within + near)) return 0;
    for (int c = 0; c < a->count + b->count && count < MOST_TOUCHES; c++) {
        Touch *now = list + count;
        now->which = c;
        /* On any edge its gap is at least as large. */
        if (both && (c < a->count ? off_edge(b, b->facing, a->p[c]) : off_edge(a, a->facing, b->p[c - a->count])) > within)
            continue;
        if (!find_place(a, b, near, now) || now->gap > within) continue;
        /* Near corners of both particles it may be inside by another edge, although the particles are apart. */
        if (!b->s && now->gap < -DEEP * near && are_apart(a, b, 0)) continue;
        int known = 0;
        for (int n = 0; n < count && c >= a->count; n++) {
            if (length_of(list[n].x - now->x, list[n].y - now->y) > near) continue;
            if (c - a->count == b->round && list[n].nx * now->nx + list[n].ny * now->ny <= FLAT) continue;
            known = 1;
            /* A corner that slides off an end leaves on the edge that is on the end. Of two tips, the one on the edge that
               separates the particles most counts. */
            if ((b->s && b->round < 0 && now->gap <= 0) || (both && a->clear > b->clear)) list[n] = *now;
        }
        count += !known;
    }
    if (both && count < MOST_TOUCHES && overlap(a, b)) count += find_crossing(a, b, near, list, count, list + count);
    for (int n = 0; n < count; n++) list[n].many = count;
    return count;
}

/* The same for particle i, which has corners, and j at t; and the gaps of the places at `later`. */
RARELY int list_touches(int i, int j, double t, double within, double later, Touch *list) {
    double near = TOUCH * inner_of(i, j);
    Shape a = shape_of(i, t), b = shape_of(j, t);
    int count = list_places_of(&a, &b, near, within, list);
    if (!(later > t) || !count) return count;
    a = shape_of(i, later);
    b = shape_of(j, later);
    for (int n = 0; n < count; n++) {
        Touch then = list[n];
        /* Something round may move round a corner meanwhile. */
        if (b.round >= 0 && then.which - a.count == b.round) find_place(&a, &b, near, &then);
        else fill_in(&a, &b, &then);
        list[n].later = then.gap;
    }
    return count;
}

/* Distance between a shape and an arc, m, by separating axes: the circle of the arc, or the edges of the shape from the
   part between the arc's ends. Negative if they overlap. */
static double clear_of_arc(const Shape *a, const Surface *s) {
    double far = 0, near = INFINITY, n[2], out;
    const double centre[2] = {s->x, s->y};
    for (int e = 0; e < a->count; e++) {
        const double *p = a->p[e], *q = a->p[e + 1 < a->count ? e + 1 : 0];
        double length = out_of(a, e, n), x = s->x - p[0], y = s->y - p[1], along = n[0] * y - n[1] * x;
        double over = MIN(MAX(along, 0), length) / length;
        near = MIN(near, hypot(x - over * (q[0] - p[0]), y - over * (q[1] - p[1])));
        far = MAX(far, hypot(x, y));
    }
    furthest(a, centre, &out);
    double clear = MAX(s->radius - far, (out > 0 ? near : 0) - s->radius);
    for (int e = 0; e < a->count && s->shape == ARC; e++) {
        out_of(a, e, n);
        double least = MIN(off_edge(a, e, s->end), off_edge(a, e, s->end + 2));
        if (-n[0] * s->tx - n[1] * s->ty >= s->cos_half) least = off_edge(a, e, centre) - s->radius;
        clear = MAX(clear, least);
    }
    return clear;
}

/* Distance between a particle with corners, as it is at t but moved to (x, y), and a surface, m, over all separating
   axes; negative if they overlap. */
RARELY double clear_of_corners(const Disk *d, double x, double y, int k, double t) {
    Shape a = shape_of((int)(d - W.disks), t), b = shape_of(-1 - k, t);
    double low = INFINITY, high = -INFINITY, clear;
    for (int n = 0; n < a.count; n++) {
        a.p[n][0] += x - a.x;
        a.p[n][1] += y - a.y;
    }
    if (b.s->shape != SEGMENT) return clear_of_arc(&a, b.s);
    for (int n = 0; n < a.count; n++) {
        double off = (a.p[n][1] - b.s->y) * b.s->tx - (a.p[n][0] - b.s->x) * b.s->ty;
        low = MIN(low, off);
        high = MAX(high, off);
    }
    clear = MAX(low, -high);
    for (int e = 0; e < a.count; e++) clear = MAX(clear, clear_of(&a, e, &b));
    return clear;
}

/* Whether two particles, one with corners, would overlap by more than `deep` at t with the first one moved to (x, y). */
RARELY int would_overlap(int i, double x, double y, int j, double t, double deep) {
    Shape a = shape_of(i, W.disks[i].t), b = shape_of(j, t);
    double clear = -INFINITY;
    for (int n = 0; n < a.count; n++) {
        a.p[n][0] += x - a.x;
        a.p[n][1] += y - a.y;
    }
    a.x = x;
    a.y = y;
    const Shape *one = a.round < 0 ? &a : &b, *other = a.round < 0 ? &b : &a;
    if (other->round >= 0) {
        Touch now = {.which = one->count};
        find_place(one, other, 0, &now);
        return now.gap < -deep;
    }
    for (int e = 0; e < a.count; e++) clear = MAX(clear, clear_of(&a, e, &b));
    for (int e = 0; e < b.count; e++) clear = MAX(clear, clear_of(&b, e, &a));
    return clear < -deep;
}
