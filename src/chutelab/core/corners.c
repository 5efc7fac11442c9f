/* Particles with corners: convex polygons, among them boxes.

   A contact is at one place: a corner of one particle on an edge of the other, a corner on a surface, or an end of a
   surface on an edge; so two edges that lie on each other touch at two places. Each place is a contact of its own, with
   levers about the centres. A disk, or an arc seen from outside, counts as a corner with a radius. Gaps are those of the
   corner on its exact path with rotation, and an impact is at the instant at which the first gap closes. */

#include <string.h>
#include "core.h"
#include "trig.h"

/* Least number of steps in which gaps are checked over a span. A contact that begins and ends within one is left to the
   next step. */
#define STRIDES 8
/* rad; a particle that rotates by more in a span may leave something round by one corner and meet it with the next. */
#define ROLLS 0.05
/* Greatest number of iterations to the instant of an impact; bisections reach its last bit if need be ... */
#define TO_ROOT 200
/* ... and the number of faster steps before them. */
#define QUICK 20
/* Cosine of the angle between edge and surface; with a larger one, a corner near the end of a surface is on it. */
#define FLAT 0.9
/* Share of what counts as near; a smaller overlap may be rounding. */
#define DEEP 0.2
/* The same for a place beyond an end. */
#define ROUNDED 1e-6
/* Share of a speed; a smaller approach velocity may be rounding and is no impact. */
#define ROUNDS 1e-14
/* Distance, in radii of the inner circle, by which two particles of a crowd may move before their places are looked up
   again; the gap is then wrong by its square. */
#define STILL 5e-4
/* Candidates for places: corners of both. */
#define CANDIDATES (2 * MOST_CORNERS)

/* A particle or a surface at a time. A segment has two points, an arc its ends and its centre, something round its
   centre. */
typedef struct {
    double p[MOST_CORNERS][2];
    double n[MOST_CORNERS][2]; /* of a polygon: unit vectors out of its edges */
    double x, y, radius;    /* x, y: centre of a particle */
    const double *edges;    /* of a polygon: see `World.edges` */
    const Surface *s;
    int count, round;       /* number of points; the one with a radius, or -1 */
    int facing;             /* of two polygons: the edge that separates the other most, see `are_apart` */
} Shape;

/* Cosine and sine of the angle of a particle, cached for two angles of each. */
static const double *pose_of(int j, double turned, int later) {
    double *pose = W.poses + 6 * j + 3 * later;
    if (pose[0] == turned && pose[1] != pose[2]) return pose + 1;
    pose[0] = turned;
    sin_cos(fabs(turned) < 1e6 ? turned : fmod(turned, 2 * PI), pose + 2, pose + 1);
    return pose + 1;
}

static Shape shape_of(int j, double t) {
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
        const double *pose = pose_of(j, d->turned + d->spin * h, h != 0), *corner = W.outlines + 2 * d->outline;
        const double *edge = out.edges = W.edges + 3 * d->outline;
        double c = pose[0], s = pose[1];
        for (int n = 0; n < d->corners; n++, corner += 2, edge += 3) {
            out.p[n][0] = out.x + c * corner[0] - s * corner[1];
            out.p[n][1] = out.y + s * corner[0] + c * corner[1];
            out.n[n][0] = c * edge[0] - s * edge[1];
            out.n[n][1] = s * edge[0] + c * edge[1];
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

/* Unit vector out of an edge of a polygon, and the length of the edge. */
static double out_of(const Shape *a, int edge, double *n) {
    n[0] = a->n[edge][0];
    n[1] = a->n[edge][1];
    return a->edges[3 * edge + 2];
}

static double off_edge(const Shape *a, int edge, const double *q) {
    return (q[0] - a->p[edge][0]) * a->n[edge][0] + (q[1] - a->p[edge][1]) * a->n[edge][1];
}

/* The edge that a point is furthest outside of, and its distance from that edge, m. */
static int furthest(const Shape *a, const double *q, double *off) {
    int found = 0;
    for (int n = 0; n < a->count; n++) {
        double one = off_edge(a, n, q);
        if (n && one <= *off) continue;
        *off = one;
        found = n;
    }
    return found;
}

/* Distance of a whole shape outside of an edge, m; negative if it is partly inside. */
static double clear_of(const Shape *a, int edge, const Shape *b) {
    double least = INFINITY;
    for (int n = 0; n < b->count; n++)
        least = MIN(least, off_edge(a, edge, b->p[n]) - (n == b->round ? b->radius : 0));
    return least;
}

/* The edge that a corner of `b` is on. If the corner is outside of `a` by `near`, that is the edge that it is furthest
   outside of. Else it is the edge that separates the two most: with another one, a particle that overlaps by more than
   the distance of its corners would be pressed sideways. At an end of a surface, the line by which the surface continues
   from there, as long as the inner radius of `a`, counts for that: so a corner that slides off the end stays on the edge
   on which it came. */
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
    double best = -INFINITY;
    for (int e = 0; e < a->count; e++) {
        /* The particle as a whole is out by less than its centre is. */
        if (!b->s && off_edge(a, e, &b->x) < best) continue;
        double clear = clear_of(a, e, b);
        if (clear > by) return 1;
        if (clear <= best) continue;
        best = clear;
        a->facing = e;
    }
    return 0;
}

/* Whether a polygon and something else are apart by more than `by`: along an edge of either, or inside an arc. */
static int are_apart(Shape *a, Shape *b, double by) {
    if (are_apart_along(a, b, by)) return 1;
    if (!b->s) return b->round < 0 && are_apart_along(b, a, by);
    double low = INFINITY, high = -INFINITY;
    for (int n = 0; n < a->count; n++) {
        double x = a->p[n][0] - b->s->x, y = a->p[n][1] - b->s->y;
        double off = b->round < 0 ? y * b->s->tx - x * b->s->ty : x * x + y * y;
        low = MIN(low, off);
        high = MAX(high, off);
    }
    if (b->round < 0) return low > by || high < -by;
    return by < b->radius && high < square(b->radius - by);
}

/* Fill in a place from its candidate `which` (corners of `a`, then points of `b`) and from what this is on: the number of
   an edge; for a corner on a segment the side, 1 or -1; on an arc 0, the inside; for a point with a radius also -1 -
   corner of `a`. */
static void fill_in(const Shape *a, const Shape *b, Touch *t) {
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

/* The side of a segment that a corner is on: usually its own. If the line from the corner to the centre, which is inside
   the particle, crosses the segment, the corner has passed through, and its side is that of the centre. This also holds
   up to `near` beyond an end at which another segment continues to that side, since a corner that overlaps two walls is
   beyond the end of each. */
static int side_of(const Shape *a, const Surface *s, int corner, double near) {
    double x = a->p[corner][0] - s->x, y = a->p[corner][1] - s->y, u = a->x - s->x, v = a->y - s->y;
    double off = y * s->tx - x * s->ty, mid = v * s->tx - u * s->ty, both = fabs(off) + fabs(mid);
    int own = off >= 0 ? 1 : -1, centre = mid >= 0 ? 1 : -1;
    if (own == centre) return own;
    double cut = ((x * s->tx + y * s->ty) * fabs(mid) + (u * s->tx + v * s->ty) * fabs(off)) / both;
    int hollow = centre > 0 ? 1 : 2, sunk = fabs(off) <= near;
    double low = sunk && (s->hollows[0] & hollow) ? -near : 0, high = sunk && (s->hollows[1] & hollow) ? near : 0;
    return cut >= low && cut <= s->length + high ? centre : own;
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

/* How far beyond an end of a segment a corner may be and still be on the segment: only rounding, unless the segment
   continues smoothly. */
static double past_end(const Surface *s, int end, double near) { return mate_of(s, end) < 0 ? ROUNDED * near : near; }

/* Find what a candidate is on, and fill in its place; return 0 if it doesn't touch there. */
static int find_place(const Shape *a, const Shape *b, double near, Touch *t) {
    double off, n[2];
    if (t->which < a->count) {
        const double *q = a->p[t->which];
        if (b->s && b->s->shape == SEGMENT) {
            double along = (q[0] - b->s->x) * b->s->tx + (q[1] - b->s->y) * b->s->ty;
            t->on = side_of(a, b->s, t->which, near);
            fill_in(a, b, t);
            return along >= -past_end(b->s, 0, near) && along <= b->s->length + past_end(b->s, 1, near);
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
static int overlap(const Shape *a, const Shape *b) {
    return clear_of(a, a->facing, b) < 0 && clear_of(b, b->facing, a) < 0;
}

/* The place of two polygons that overlap although no corner is inside the other one: a tip has passed through a tip, and
   only edges cross. It is the deepest corner at the edge that separates them most. */
static void find_crossing(const Shape *a, const Shape *b, Touch *t) {
    int own = clear_of(a, a->facing, b) >= clear_of(b, b->facing, a), deepest = 0;
    const Shape *edge = own ? a : b, *other = own ? b : a;
    for (int n = 1; n < other->count; n++)
        if (off_edge(edge, edge->facing, other->p[n]) < off_edge(edge, edge->facing, other->p[deepest])) deepest = n;
    t->which = own ? a->count + deepest : deepest;
    t->on = edge->facing;
    fill_in(a, b, t);
}

/* List the places at which a polygon and another shape have a gap below `within`, up to MOST_TOUCHES. */
static int list_places_of(Shape *a, Shape *b, double near, double within, Touch *list) {
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
            /* A corner that slides off an end leaves on the edge that is on the end. */
            if (b->s && b->round < 0 && now->gap <= 0) list[n] = *now;
        }
        count += !known;
    }
    if (!count && both && overlap(a, b)) find_crossing(a, b, list + count++);
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
        if (then.which - a.count == b.round) find_place(&a, &b, near, &then);
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

/* Bound on the centripetal acceleration of a corner, m/s2. */
double whirl_of(const Disk *d) { return d->corners ? d->spin * d->spin * d->radius : 0; }

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
    if (m < 0 && b->round < 0 && !b->s) furthest(b, a->p[at->which], &at->gap);
    else if (m >= 0 && m != b->round) furthest(a, b->p[m], &at->gap);
    else if (m < 0 && b->s && b->s->shape == SEGMENT) fill_in(a, b, at);
    else find_place(a, b, near, at);
    return at->gap;
}

/* Lower bound, m, of the gap that a corner of one polygon has to the other within a span, from its gap and speed at an
   edge at t. The rotation of both accelerates it by at most `bends`, m/s2. */
static double least_gap(int i, int j, const Shape *a, const Shape *b, double t, double span, double bends, Touch *at) {
    double off;
    at->on = at->which < a->count ? furthest(b, a->p[at->which], &off) : furthest(a, b->p[at->which - a->count], &off);
    fill_in(a, b, at);
    return at->gap - (closes_at(i, j, a, b, t, at) + 0.5 * bends * span) * span;
}

/* The instant within (low, high] at which the gap of a candidate closes, from `above` 0 to `below`. False position with
   the Illinois rule, which halves the value at an end that stays, then bisection, until at a speed of `most` the way from
   end to end is as small as the rounding of a place. The gap itself doesn't tell: of a corner that comes down beside an
   edge in line with its own it stays at 0, however deep the corner is. */
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

/* Whether a place at which two touch at t closes faster than `soft`. */
static int closes_faster(int i, int j, Shape *a, Shape *b, double t, double within, double soft) {
    Touch places[MOST_TOUCHES];
    int count = list_places_of(a, b, TOUCH * inner_of(i, j), within, places);
    for (int n = 0; n < count; n++)
        if (closes_at(i, j, a, b, t, places + n) > soft) return 1;
    return 0;
}

/* The instant within (low, high] from which on a touching place closes faster than `soft`, for a particle that rolls from
   a corner onto an edge round a disk or an arc: it touches all the time. */
static double rolls_at(int i, int j, double low, double high, double soft) {
    for (int n = 0; n < QUICK; n++) {
        double middle = 0.5 * (low + high);
        Shape a = shape_of(i, middle), b = shape_of(j, middle);
        if (closes_faster(i, j, &a, &b, middle, TOUCHING * inner_of(i, j), soft)) high = middle;
        else low = middle;
    }
    return high;
}

/* The instant between two times at which particle i, which has corners, meets j faster than `soft`, or INFINITY; `most`
   is the bound of `fastest_of`. */
double meet_corners(int i, int j, double from, double until, double most, double soft) {
    double span = until - from, small = inner_of(i, j), near = TOUCH * small;
    double h = 0, first = INFINITY, gap[CANDIDATES];
    int sides[MOST_CORNERS], in_reach[CANDIDATES], many = 0, closed, clear;
    if (!(span > 0) || most <= soft) return INFINITY;
    Shape a = shape_of(i, from), b = shape_of(j, from);
    int count = a.count + b.count, on_segment = b.s && b.s->shape == SEGMENT, both = !b.s && b.round < 0;
    double turn = both ? fabs(W.disks[i].spin) + fabs(W.disks[j].spin) : 0;
    double bends = turn * (2 * most + 4 * turn * MAX(W.disks[i].radius, both ? W.disks[j].radius : 0));
    if (are_apart(&a, &b, most * span + near)) return INFINITY;
    closed = both && overlap(&a, &b);
    clear = both && !closed;
    /* On something round all corners are one candidate: when one leaves, the next may arrive. */
    int rolls = b.round >= 0 && span * (fabs(W.disks[i].spin) + (j < 0 ? 0 : fabs(W.disks[j].spin))) > ROLLS;
    for (int c = 0; c < count; c++) {
        Touch now = {.which = c};
        /* Its side does not change within a step. */
        if (on_segment && c < a.count) now.on = sides[c] = side_of(&a, b.s, c, near);
        gap[c] = gap_at(&a, &b, near, &now);
        closed |= gap[c] <= 0;
        if (gap[c] > most * span) continue;
        /* A closed gap to another polygon closes no faster than is left to the next step; on a surface it may, since
           surfaces may turn. */
        if (!both || (gap[c] > 0 && least_gap(i, j, &a, &b, from, span, bends, &now) <= 0)) in_reach[many++] = c;
    }
    if (closed && closes_faster(i, j, &a, &b, from, 0, soft)) return from;
    while (h < span && first == INFINITY && many) {
        double least = INFINITY, last = from + h;
        for (int n = 0; n < many; n++) {
            if (gap[in_reach[n]] > 0) least = MIN(least, gap[in_reach[n]]);
            else if (rolls && in_reach[n] == a.count + b.round) least = 0;
        }
        h = MIN(h + MAX(least / most, span / STRIDES), span);
        double t = h < span ? from + h : until;
        Shape a2 = shape_of(i, t), b2 = shape_of(j, t);
        for (int n = 0; n < many; n++) {
            int c = in_reach[n];
            Touch now = {.which = c};
            if (on_segment && c < a.count) now.on = sides[c];
            double before = gap[c];
            /* The surface may have been moved to the time of another root. */
            if (j < 0) b2.s = surface_at(-1 - j, t);
            gap[c] = gap_at(&a2, &b2, near, &now);
            if (before <= 0 && gap[c] < before && c - a.count == b.round
                && closes_faster(i, j, &a2, &b2, t, TOUCHING * small, soft))
                first = MIN(first, rolls_at(i, j, last, t, soft));
            if (!(before > 0 && gap[c] <= 0)) continue;
            double then = root_of(i, j, &now, last, t, before, gap[c], most);
            if (then >= first) continue;
            Shape a3 = shape_of(i, then), b3 = shape_of(j, then);
            if (closes_faster(i, j, &a3, &b3, then, TOUCHING * small, soft)) first = then;
        }
        /* A tip that passes through a tip within a stride is inside nothing after it, but edges cross then. */
        if (!clear || first < INFINITY || most * (t - last) < near) continue;
        clear = are_apart(&a2, &b2, 0);
        if (clear) continue;
        double then = overlap_at(i, j, last, t);
        Shape a3 = shape_of(i, then), b3 = shape_of(j, then);
        if (closes_faster(i, j, &a3, &b3, then, TOUCHING * small, soft)) first = then;
    }
    return first;
}

/* ------------------------------------------------------------------------------------------ contacts */

/* Set the levers of a contact about both centres, and how an impulse along and across its normal acts through rotation,
   1/kg. */
static void take_levers(Contact *c, const Touch *t, double *rotation) {
    const Disk *a = W.disks + c->i, *b = W.disks + MAX(c->j, 0);
    const double *pose = pose_of(c->i, a->turned, 0);
    double x = t->x - a->x, y = t->y - a->y, cosine = pose[0], sine = pose[1];
    c->own[0] = x * c->ny - y * c->nx;
    c->own[1] = -(x * c->nx + y * c->ny);
    c->spot[0] = cosine * x + sine * y;
    c->spot[1] = cosine * y - sine * x;
    c->others[0] = c->others[1] = 0;
    if (c->j >= 0) {
        x = t->x - b->x;
        y = t->y - b->y;
        c->others[0] = y * c->nx - x * c->ny;
        c->others[1] = x * c->nx + y * c->ny;
    }
    for (int n = 0; n < 2; n++) {
        rotation[n] = square(c->own[n]) * a->inv_inertia;
        if (c->two) rotation[n] += square(c->others[n]) * b->inv_inertia;
    }
}

/* Positions and angles of both partners of a contact; 0 for a surface. */
static void pose_now(const Contact *c, double *pose) {
    const Disk *d = W.disks + c->i, *o = W.disks + MAX(c->j, 0);
    memcpy(pose, (double[]){d->x, d->y, d->turned, c->j < 0 ? 0 : o->x, c->j < 0 ? 0 : o->y, c->j < 0 ? 0 : o->turned},
           6 * sizeof(double));
}

/* Note the pose at which a place was looked up, and the number of places then. */
static void note_look(Contact *c, int places) {
    c->looked[0] = c->gap;
    c->places = places;
    pose_now(c, c->looked + 1);
}

/* Acceleration along the normal at which a contact would open without forces, m/s2. */
double opens_by(const Contact *c) {
    const Disk *a = W.disks + c->i, *b = W.disks + MAX(c->j, 0);
    double up = square(a->spin) * c->own[1], pull;
    if (c->j >= 0) return up + square(b->spin) * c->others[1];
    Disk place = *a;
    place.x += c->own[0] * c->ny - c->own[1] * c->nx;
    place.y += -c->own[0] * c->nx - c->own[1] * c->ny;
    up += W.gx * c->nx + W.gy * c->ny;
    return up - pulled(surface_at(-1 - c->j, a->t), &place, c->nx, c->ny, &pull);
}

/* Fill in a contact at a place of particle i, which has corners, from the present states of both. */
RARELY void describe_touch(Contact *c, int i, int j, const Touch *t) {
    const Disk *a = W.disks + i, *b = W.disks + MAX(j, 0);
    const Pair *pair = j < 0 ? surface_pair(a, -1 - j) : pair_of(a->kind, b->kind);
    double rotation[2], mass = a->inv_mass, turn = a->inv_inertia;
    *c = (Contact){.nx = t->nx, .ny = t->ny, .gap = t->gap, .most = INFINITY, .share = 1, .i = i, .j = j, .cornered = 1,
                   .owner = W.owner_count, .rest = pair->restitution, .falls = pair->falls, .friction = pair->friction};
    c->two = j >= 0 && b->mode == FREE;
    take_levers(c, t, rotation);
    note_look(c, t->many);
    if (c->two) {
        mass += b->inv_mass;
        turn += b->inv_inertia;
    }
    for (int n = 0; n < 2; n++) c->mass[n] = 1 / (mass + rotation[n]);
    c->mass[2] = turn > 0 ? 1 / turn : 0;
    c->pull = -square(a->spin) * c->own[0];
    if (j >= 0) {
        const double *v = motion_of(b);
        c->pull -= square(b->spin) * c->others[0];
        if (sleeps(j)) c->pull += W.gx * c->ny - W.gy * c->nx;
        c->other[0] = v[0] * c->nx + v[1] * c->ny;
        c->other[1] = v[0] * c->ny - v[1] * c->nx;
        c->arm = b->corners ? 0 : pair->rolling * b->radius;
        return;
    }
    const Surface *s = surface_at(-1 - j, a->t);
    c->owner = s->owner;
    c->other[1] = surface_speed(s, c->nx, c->ny, t->x, t->y, 0);
    c->pull += W.gx * c->ny - W.gy * c->nx;
    if (s->mover < 0) return;
    Disk place = *a;
    double v[3], pull;
    place.x = t->x;
    place.y = t->y;
    place.vx -= a->spin * (t->y - a->y);
    place.vy += a->spin * (t->x - a->x);
    place.radius = 0;
    carried(s, t->x - c->gap * c->nx, t->y - c->gap * c->ny, v);
    c->moved[0] = v[0] * c->nx + v[1] * c->ny;
    c->moved[1] = v[0] * c->ny - v[1] * c->nx;
    c->moved[2] = v[2];
    for (int n = 0; n < 3; n++) c->other[n] += c->moved[n];
    pulled(s, &place, c->nx, c->ny, &pull);
    c->pull -= pull;
    if (is_hung(-1 - j)) hang_on(c, W.movers + s->mover, &place);
}

/* The contact of the step before that was at about the same place of particle i. */
RARELY const Contact *place_before(const Contact *c) {
    const Contact *found = 0;
    double least = INFINITY;
    for (int k = W.disks[c->i].before; k >= 0; k = W.earlier[k].next) {
        const Contact *o = W.earlier + k;
        if (o->j != c->j) continue;
        double off = length_of(o->spot[0] - c->spot[0], o->spot[1] - c->spot[1]);
        if (off >= least) continue;
        least = off;
        found = o;
    }
    return least <= 0.5 * W.disks[c->i].inner ? found : 0;
}

/* Change of the gap of a contact by the motion of both since the place was looked up, m; NaN if they moved by more than
   STILL of a radius. */
static double gap_change_since(const Contact *c) {
    double pose[6], size = W.disks[c->i].radius, turns;
    pose_now(c, pose);
    for (int n = 0; n < 6; n++) pose[n] -= c->looked[n + 1];
    if (c->j >= 0) size = MAX(size, W.disks[c->j].radius);
    turns = size * (fabs(pose[2]) + fabs(pose[5]));
    if (!(fabs(pose[0] - pose[3]) + fabs(pose[1] - pose[4]) + turns <= STILL * inner_of(c->i, c->j))) return NAN;
    return (pose[0] - pose[3]) * c->nx + (pose[1] - pose[4]) * c->ny + c->own[0] * pose[2] + c->others[0] * pose[5];
}

/* If two of a crowd have hardly moved since their places were looked up, list their contacts of the step before and by how
   much the gaps have changed; return 0 if the places have to be looked up. */
RARELY int list_still(int i, int j, double h, const Contact **list, double *changes) {
    const Disk *a = W.disks + i, *b = W.disks + MAX(j, 0);
    const Surface *s = W.surfaces + (j < 0 ? -1 - j : 0);
    int count = 0;
    int moves = j < 0 ? s->mover >= 0 || s->shape != SEGMENT : b->mode != FREE && !sleeps(j);
    if (moves || are_few(W.earlier_count)) return 0;
    double turns = fabs(a->spin) * a->radius + (j < 0 ? 0 : fabs(b->spin) * b->radius);
    if (turns * h > STILL * inner_of(i, j)) return 0;
    for (int k = a->before; k >= 0 && count < MOST_TOUCHES; k = W.earlier[k].next)
        if (W.earlier[k].j == j) list[count++] = W.earlier + k;
    if (!count || list[0]->places != count || list[0]->two != (j >= 0 && b->mode == FREE)) return 0;
    for (int n = 0; n < count; n++)
        if (isnan(changes[n] = gap_change_since(list[n]))) return 0;
    return count;
}

/* Fill in a contact from that of the step before, whose gap has changed by `change` since its place was looked up. */
RARELY void go_on_with(Contact *c, const Contact *last, double change, double h) {
    double u[3];
    *c = *last;
    c->gap = c->looked[0] + change;
    c->most = INFINITY;
    c->share = 1;
    c->gives = c->parts = c->clings = 0;
    c->leaves = 0;
    if (c->j >= 0) {
        const double *v = motion_of(W.disks + c->j);
        c->other[0] = v[0] * c->nx + v[1] * c->ny;
        c->other[1] = v[0] * c->ny - v[1] * c->nx;
    }
    relative(c, 0, u);
    c->free_gap = c->gap + (u[0] + (c->j < 0 || sleeps(c->j) ? 0.5 * h * (W.gx * c->nx + W.gy * c->ny) : 0)) * h;
}

/* ------------------------------------------------------------------------------------------ impacts */

/* List the places at which two touch now as contacts: where a gap is closed, or where a contact lasts. */
RARELY int list_struck(int i, int j, double t, Contact *list) {
    Touch places[MOST_TOUCHES];
    double least = inner_of(i, j);
    int lasts = 0, count = 0;
    for (int link = W.disks[i].links; link >= 0; link = W.links[link]) {
        const Contact *c = W.contacts + link / 2;
        lasts |= c->i == i && c->j == j && c->impulse[0] > 0;
    }
    double within = (lasts ? TOUCH : TOUCHING) * least, span = 2 * SOON * W.step, most = 0;
    /* A particle with joints is struck at the beginning of a step, if its impact would be just after it. */
    if (is_tied(i) || is_tied(j)) most = fastest_of(i, j, t, span);
    if (most < INFINITY) within = MAX(within, most * span);
    int found = list_touches(i, j, t, within, t, places);
    for (int n = 0; n < found; n++) {
        Contact *c = list + count++;
        describe_touch(c, i, j, places + n);
        c->drift = 0;
    }
    return count;
}

/* Before an impact, bring the contacts of an island from their hops to the smooth path: else the velocity of the hop,
   which is of first order in the step, would enter the impact. Impulses of the step that are not due yet are taken back,
   those that are due are given. This is done once a step, as the step ends soon after. Not in a crowd, which is not
   solved again at each impact; not for contacts with a moving surface, which has to press as hard as it moves, or that
   had an impact at the beginning of the step; and not with joints, whose pull is constant over the step. */
static void end_hops(int i, double t) {
    const Contact *first = 0, *end = W.contacts + W.contact_count;
    int count = 0, many = 0, stamp = W.step_count + 1;
    double past = W.tracks[i].lasted > 1 ? W.length_before : 0;
    for (int link = W.disks[i].links; link >= 0 && !first; link = W.links[link]) first = W.contacts + link / 2;
    if (!first || t <= W.t || !are_few(W.contact_count) || W.disks[i].smooth == stamp) return;
    W.disks[i].smooth = stamp;
    int island = first->island;
    while (first > W.contacts && first[-1].island == island) first--;
    for (const Contact *c = first; c < end && c->island == island; c++) {
        double u[3], whirl = whirl_of(W.disks + c->i) + (c->j < 0 ? 0 : whirl_of(W.disks + c->j));
        relative(c, 1, u);
        int is_blow = u[0] < -W.soft - 2 * whirl * W.step, moves = c->j < 0 && stirs(W.surfaces + (-1 - c->j));
        int tied = is_tied(c->i) || is_tied(c->j);
        count += is_blow || moves || tied ? FEW_CONTACTS + 1 : 1;
    }
    if (count > FEW_CONTACTS) return;
    for (const Contact *c = first; c < first + count; c++) {
        Disk *a = W.disks + c->i, *b = W.disks + MAX(c->j, 0);
        if (a->mode != FREE || (c->j >= 0 && b->mode != FREE)) continue;
        double u[3], v[3], given[3], change[3];
        Contact last = *c;
        advance(a, t);
        if (c->two) advance(b, t);
        was_moved(c->i);
        a->smooth = stamp;
        if (c->two) {
            was_moved(c->j);
            b->smooth = stamp;
        }
        if (c->impulse[0] == 0) continue;
        for (int n = 0; n < 3; n++)
            last.impulse[n] = change[n] = -c->impulse[n] * (W.length - 2 * (t - W.t)) / (past + W.length);
        relative(&last, 0, u);
        push(&last, change);
        relative(&last, 0, v);
        share_out(&last, u, v, 0, last.entries, given);
        bear_contact(&last, 1, t, t);
        keep_impulse(&last, 1, t, t);
        W.earlier[many++] = last;
    }
    /* As in a step, only the sum of the losses has a meaning. */
    pool(W.earlier, many, 0);
    for (const Contact *c = W.earlier; c < W.earlier + many; c++)
        book(W.disks[c->i].entries, c->two ? W.disks[c->j].entries : 0, c->owner, c->entries);
    give_back(W.earlier, many);
    W.step_end = MIN(W.step_end, MAX(t, W.t + SHORTEST * W.step));
}

/* Whether a released particle touches a surface with hardly any normal velocity. */
RARELY int lies_flat(int i, int k) {
    const Disk *d = W.disks + i;
    Touch places[MOST_TOUCHES];
    int found = list_touches(i, -1 - k, d->t, TOUCHING * d->inner, d->t, places), lies = found > 0;
    for (int n = 0; n < found; n++) {
        Contact c;
        double u[3];
        describe_touch(&c, i, -1 - k, places + n);
        relative(&c, 0, u);
        lies &= fabs(u[0]) <= -opens_by(&c) * W.dt;
    }
    return lies;
}

/* Resolve the impact of particle i, which has corners, with j, at all places at which they touch. */
RARELY void strike_corners(int i, int j, double t) {
    Disk *a = W.disks + i, *b = W.disks + MAX(j, 0);
    Contact list[MOST_TOUCHES], *main = list;
    double u[MOST_TOUCHES][3], back[MOST_TOUCHES], fastest = 0, J[2] = {0, 0};
    int impacts = MAX(a->impacts, j >= 0 ? b->impacts : 0), rests = 0;
    if (j < 0 && is_hung(-1 - j)) strike_hinge(W.surfaces[-1 - j].mover, t);
    end_hops(i, t);
    if (j >= 0 && b->mode == FREE) end_hops(j, t);
    int answers = is_tied(i) || is_tied(j);
    if (answers) strike_joints(i, j);
    int count = list_struck(i, j, t, list), two = j >= 0 && b->mode == FREE;
    for (int n = 0; n < count; n++) {
        const Contact *c = list + n;
        relative(c, 0, u[n]);
        fastest = MAX(fastest, -u[n][0]);
        double rest = c->rest, approach = MAX(-u[n][0], 0), drawn = pressed_by_joints(c), press = drawn - opens_by(c);
        if (c->falls * approach > 1) rest /= sqrt(sqrt(c->falls * approach));
        back[n] = rest * approach;
        int calm = j >= 0 ? approach < W.soft && (a->supports || b->supports || !two) : back[n] <= press * W.step;
        calm |= drawn > 0 && back[n] <= drawn * W.step;
        int ends = rest < 1 && (impacts >= JAM || (impacts >= FEW && approach < SLOW * W.g * W.dt));
        if (approach > 0 && (calm || ends)) back[n] = 0;
        rests |= approach > 0 && back[n] == 0;
    }
    /* An impact that was foreseen, but does not happen, is counted, so that it is left to the next step in the end. */
    was_moved(i);
    if (!(fastest > ROUNDS * (fabs(a->vx) + fabs(a->vy)))) return;
    if (two) was_moved(j);
    double before[3] = {a->vx, a->vy, a->spin}, lost, normal = 0, slip = 0;
    if (answers) begin_answers();
    for (int again = 1; again;) {
        double wanted[MOST_TOUCHES];
        memcpy(wanted, back, sizeof back);
        find_matrix(list, count, fastest, answers);
        lost = solve_with_energy(list, count, wanted, u);
        int lets_go = answers && let_go_again();
        again = lets_go || hold_hinge(list, count, u, back);
        for (int n = 0; n < count && again; n++) {
            double *J = list[n].impulse, none[3] = {-J[0], -J[1], -J[2]};
            if (lets_go) push(list + n, none);
            else give_all(list + n, none);
            J[0] = J[1] = J[2] = 0;
        }
    }
    for (int n = 0; n < count; n++) {
        Contact *c = list + n;
        double v[3], given[3];
        relative(c, 0, v);
        share_out(c, u[n], v, 0, c->entries, given);
        normal += MAX(c->entries[1], 0);
        slip += MAX(c->entries[2], 0);
        if (given[0] != 0) book(a->entries, 0, W.ride_owner, given);
    }
    /* Only the sum has a meaning where one impulse changes the velocity at another place. */
    double by = normal + slip > 0 ? MAX(lost, 0) / (normal + slip) : 0;
    for (int n = 0; n < count; n++) {
        Contact *c = list + n;
        for (int k = 1; k < 3; k++) c->entries[k] = by * MAX(c->entries[k], 0);
        book(a->entries, two ? b->entries : 0, c->owner, c->entries);
        if (j < 0) W.drives[c->owner] += driven(c, 0);
        if (j < 0 && c->impulse[0] > 0) hold(a, -1 - j);
        bear_contact(c, 1, t, t);
        if (c->impulse[0] > main->impulse[0]) main = c;
    }
    if (main->hung) leave_struck(main->hung - 1);
    for (int n = 0; n < count; n++) {
        const Contact *c = list + n;
        double x = c->impulse[0] * c->nx + c->impulse[1] * c->ny, y = c->impulse[0] * c->ny - c->impulse[1] * c->nx;
        J[0] += x * main->nx + y * main->ny;
        J[1] += x * main->ny - y * main->nx;
    }
    if (answers) end_blow();
    a->since = t;
    if (two) b->since = t;
    W.impact_count++;
    int landing = j < 0 && main->owner == W.landing && !a->landed;
    int told = landing || fastest > W.soft || W.g == 0 || (j < 0 && a->on != main->owner);
    if (told)
        write_event(j >= 0 ? COLLISION : landing ? LANDING : IMPACT, i, MAX(j, -1), main->owner, t, &a->x, before,
                    &a->vx, J[0], J[1]);
    for (int n = 0; n < count; n++)
        if (!told || count > 1) keep_impulse(list + n, 1, t, t);
        else keep_carried(list + n, 1, t, t);
    if (landing) a->landed = 1;
    if (j < 0) {
        a->on = main->owner;
        a->slips = 1;
    }
    /* A place that comes to rest is a contact from the next step on, which begins soon; in a crowd it may hop until then. */
    if (rests && are_few(W.contact_count)) W.step_end = MIN(W.step_end, MAX(t, W.t + SHORTEST * W.step));
}
