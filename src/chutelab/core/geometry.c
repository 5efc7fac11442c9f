/* Gaps between disks and surfaces, speeds of surfaces, and when a disk on a parabola meets a surface or another disk. */

#include "core.h"

/* Newton steps to the point of a parabola that is nearest to a centre; they start from that of its chord, which is close. */
#define NEAREST 4

/* Whether a point is within the angle of an arc, seen from its centre at (dx, dy); always true for a circle. The arc may
   be wider than a half circle. */
static int in_angle(const Surface *s, double dx, double dy) {
    if (s->shape == CIRCLE) return 1;
    return dx * s->tx + dy * s->ty >= s->cos_half * sqrt(dx * dx + dy * dy);
}

/* Where the foot of a point lies along a piece: -1 before its first end, 1 beyond its second end, else 0. */
static int beyond(const Surface *s, double dx, double dy) {
    if (s->shape == SEGMENT) {
        double along = dx * s->tx + dy * s->ty;
        return along < 0 ? -1 : along > s->length;
    }
    return in_angle(s, dx, dy) ? 0 : s->tx * dy - s->ty * dx < 0 ? -1 : 1;
}

/* Whether a segment that is tangent to a circle hides the circle from a disk at (x, y): the disk is beside the segment,
   and the centre of the circle is on the other side of it. */
static int hides(const Surface *s, const Surface *circle, double x, double y) {
    if (s->shape != SEGMENT || beyond(s, x - s->x, y - s->y)) return 0;
    double off = (y - s->y) * s->tx - (x - s->x) * s->ty;
    return off * ((circle->y - s->y) * s->tx - (circle->x - s->x) * s->ty) < 0;
}

/* The piece whose face a disk at (x, y) is on: beyond a smooth end of `s` the piece that continues there; for a circle
   the tangent segment that hides it. So a disk doesn't feel the joint of two such pieces, even if it overlaps them a
   little. */
const Surface *face_at(const Surface *s, double x, double y) {
    if (mate_of(s, 0) < 0 && mate_of(s, 1) < 0) return s;
    if (s->shape == CIRCLE) {
        for (int n = 0; n < 2; n++)
            if (mate_of(s, n) >= 0 && hides(surface_at(s->mates[n], s->posed), s, x, y))
                return W.surfaces + s->mates[n];
        return s;
    }
    int end = beyond(s, x - s->x, y - s->y), mate = end ? mate_of(s, end > 0) : -1;
    const Surface *next = surface_at(MAX(mate, 0), s->posed);
    return mate >= 0 && !beyond(next, x - next->x, y - next->y) ? next : s;
}

/* Distance of a point from the nearer end of a piece, m, and the unit vector from that end to the point. */
static double from_end(const Surface *s, double x, double y, double *nx, double *ny) {
    double ax = x - s->end[0], ay = y - s->end[1], bx = x - s->end[2], by = y - s->end[3];
    double a = ax * ax + ay * ay, b = bx * bx + by * by, d = sqrt(MIN(a, b));
    if (b < a) { ax = bx; ay = by; }
    *nx = d > 0 ? ax / d : 0;
    *ny = d > 0 ? ay / d : 1;
    return d;
}

/* Gap between a disk and a surface, m, and the unit normal from the surface to the disk. */
double gap_to(const Surface *s, double x, double y, double r, double *nx, double *ny) {
    double dx = x - s->x, dy = y - s->y;
    if (s->shape == SEGMENT) {
        double along = dx * s->tx + dy * s->ty;
        if (along >= 0 && along <= s->length) {
            double off = dy * s->tx - dx * s->ty, side = off >= 0 ? 1 : -1;
            *nx = -side * s->ty;
            *ny = side * s->tx;
            return side * off - r;
        }
    } else if (in_angle(s, dx, dy)) {
        double d = sqrt(dx * dx + dy * dy), side = d >= s->radius ? 1 : -1;
        *nx = d > 0 ? side * dx / d : 0;
        *ny = d > 0 ? side * dy / d : 1;
        return side * (d - s->radius) - r;
    }
    return from_end(s, x, y, nx, ny) - r;
}

/* Distance of a point from a piece, m, positive on its left (on the outside of an arc). Beyond an end of an arc, of the
   tangent there. */
static double beside(const Surface *s, double x, double y) {
    double dx = x - s->x, dy = y - s->y, nx, ny;
    if (s->shape == SEGMENT) return dy * s->tx - dx * s->ty;
    double away = sqrt(dx * dx + dy * dy);
    if (in_angle(s, dx, dy)) return away - s->radius;
    double off = from_end(s, x, y, &nx, &ny);
    return (off * (nx * dx + ny * dy) - off * off) / s->radius;
}

/* Gap at time t between a disk at (x, y) and the nearest piece of a chain, m. `side` tells on which side of that piece
   the centre is: above 0 on the solid one, 0 if both are solid. At a corner, where two pieces are equally near, the sum
   over both decides. */
double chain_gap(const Surface *s, const Disk *d, double x, double y, double t, double *side) {
    int first = (int)(s - W.surfaces), k = first;
    double least = INFINITY, clear = INFINITY, nx, ny;
    do {
        const Surface *piece = surface_at(k, t);
        double gap = gap_to(piece, x, y, d->radius, &nx, &ny), own = piece->one_sided * beside(piece, x, y);
        if (gap <= least) *side = gap < least ? own : *side + own;
        least = MIN(gap, least);
        if (has_corners(d)) clear = MIN(clear, clear_of_corners(d, x, y, k, t));
        k = piece->chain;
    } while (k != first);
    return has_corners(d) ? clear : least;
}

/* Time from d->t until a disk that passes a one-sided surface is clear of it on the solid side, INFINITY if not within
   the span. The search advances by steps in which the disk cannot reach the surface. */
double clear_after(const Surface *s, const Disk *d, double span) {
    double most = sqrt(d->vx * d->vx + d->vy * d->vy) + W.g * span + W.fastest, side;
    if (has_corners(d)) most += fabs(d->spin) * d->radius;
    for (double h = 0;;) {
        double x = d->x + (d->vx + 0.5 * W.gx * h) * h, y = d->y + (d->vy + 0.5 * W.gy * h) * h;
        double gap = chain_gap(s, d, x, y, d->t + h, &side);
        if (gap >= 0 && side > 0) return h;
        if (!(h < span && most > 0)) return INFINITY;
        h = MIN(h + MAX(fabs(gap), TOUCHING * d->radius) / most, span);
    }
}

/* Speed of the surface along (ny, -nx) at a contact with normal n of a disk at (x, y), m/s.

   One rule holds for faces, ends and circles: on its left (a circle: outside) the surface runs at `speed`, on the other
   side at -`speed`. On both faces of a segment that is the velocity of the belt; round an end it is that of an end
   roller, see `find_crown`. */
double surface_speed(const Surface *s, double nx, double ny, double x, double y, double r) {
    double side, dx = x - s->x, dy = y - s->y;
    int end = s->shape == CIRCLE ? 0 : beyond(s, dx, dy);
    const double *crown = s->crown + 2 * (end > 0);
    if (end) side = nx * crown[0] + ny * crown[1];
    else if (s->shape == SEGMENT) side = ny * s->tx - nx * s->ty;
    else side = nx * dx + ny * dy - r;
    return side >= 0 ? s->speed : -s->speed;
}

/* Curvature of the path of a disk's centre while the disk stays in contact, 1/m; positive round an outside. */
double bending(const Surface *s, double x, double y, double r) {
    double dx = x - s->x, dy = y - s->y;
    if (s->shape == SEGMENT) {
        double along = dx * s->tx + dy * s->ty;
        return along >= 0 && along <= s->length ? 0 : 1 / r;
    }
    if (!in_angle(s, dx, dy)) return 1 / r;
    double inside = s->radius - r;
    if (dx * dx + dy * dy >= s->radius * s->radius) return 1 / (s->radius + r);
    return inside > 0 ? -1 / inside : 0;
}

/* When a point that moves on a parabola comes within `reach` of the centre at the origin (side = 1), or from within to
   `reach` away from it (side = -1), and its speed of approach then. INFINITY if not within the span, or if it is there
   already and does not approach.

   The chord of the parabola gives a bracket and a first guess, Newton's method the root. If both ends of the chord are
   outside, the parabola can still come within reach between them, as it is off the chord by at most g h^2/8: then its
   nearest point is checked. From inside this is not checked, so a hop that touches the circle only between two places
   that are clear of it is missed; its speed of approach is at most what gravity gives in half the span. */
static double meet_round(double x, double y, double vx, double vy, double reach, double side,
                         double span, double *approach) {
    double c = side * (x * x + y * y - reach * reach);
    *approach = 0;
    if (c <= 0) {
        double d = sqrt(x * x + y * y);
        *approach = d > 0 ? -side * (x * vx + y * vy) / d : 0;
        return *approach > 0 ? 0 : INFINITY;
    }
    double cx = vx + 0.5 * W.gx * span, cy = vy + 0.5 * W.gy * span;
    double ex = x + cx * span, ey = y + cy * span;
    double last = side * (ex * ex + ey * ey - reach * reach);
    double a = cx * cx + cy * cy, b = x * cx + y * cy, low = 0, high = span, h;
    double root = b * b - a * (x * x + y * y - reach * reach);
    if (last > 0) {
        double bend = reach + 0.125 * W.g * span * span, px, py;
        if (side < 0 || b >= 0) return INFINITY;
        high = MIN(-b / a, span);
        if (square(x + cx * high) + square(y + cy * high) >= bend * bend) return INFINITY;
        for (int n = 0;; n++) {
            px = x + (vx + 0.5 * W.gx * high) * high;
            py = y + (vy + 0.5 * W.gy * high) * high;
            if (px * px + py * py < reach * reach) break;
            double wx = vx + W.gx * high, wy = vy + W.gy * high;
            double curve = wx * wx + wy * wy + px * W.gx + py * W.gy;
            double next = MIN(MAX(high - (px * wx + py * wy) / curve, 0), span);
            if (n == NEAREST || !(curve > 0) || next == high) return INFINITY;
            high = next;
        }
    }
    if (root < 0) root = 0;
    /* Of both forms of the root, the one without cancellation. */
    if (side > 0) h = c / (-b + sqrt(root));
    else h = b > 0 ? c / (b + sqrt(root)) : (-b + sqrt(root)) / a;
    if (!(h >= low && h <= high)) h = high;
    for (int n = 0; n < 60; n++) {
        double px = x + (vx + 0.5 * W.gx * h) * h, py = y + (vy + 0.5 * W.gy * h) * h;
        double wx = vx + W.gx * h, wy = vy + W.gy * h;
        double f = side * (px * px + py * py - reach * reach), slope = 2 * side * (px * wx + py * wy);
        *approach = -0.5 * slope / reach;
        if (f > 0) low = h;
        else high = h;
        double next = slope < 0 ? h - f / slope : 0.5 * (low + high);
        if (!(next > low && next < high)) next = f == 0 ? h : 0.5 * (low + high);
        if (fabs(next - h) <= 1e-16 * span || next == low || next == high) break;
        h = next;
    }
    return h;
}

/* The same for a plane, from the gap, its rate and its acceleration. */
static double meet_face(double gap, double rate, double pull, double span, double *approach) {
    *approach = 0;
    if (gap <= 0 && rate <= 0) {
        *approach = -rate;
        return 0;
    }
    if (rate > 0 && pull >= 0) return INFINITY;
    double root = rate * rate - 2 * pull * MAX(gap, 0);
    if (root < 0) return INFINITY;
    root = sqrt(root);
    /* The form without cancellation: it returns after moving away, or it approaches at once. */
    double h = rate > 0 ? (rate + root) / -pull : 2 * gap / (root - rate);
    if (!(h <= span)) return INFINITY;
    *approach = root;
    return h;
}

/* When a disk meets an end of a piece. This counts only if the foot of the disk is beyond the end; before it, the face is
   in the way. */
static double meet_ends(const Surface *s, const Disk *d, double span, double *approach) {
    double first = INFINITY;
    for (int e = 0; e < 4; e += 2) {
        double speed, x = d->x - s->end[e], y = d->y - s->end[e + 1];
        double h = meet_round(x, y, d->vx, d->vy, d->radius, 1, span, &speed);
        if (h >= first) continue;
        x += (d->vx + 0.5 * W.gx * h) * h;
        y += (d->vy + 0.5 * W.gy * h) * h;
        if (s->shape == SEGMENT) {
            double along = x * s->tx + y * s->ty;
            if (e == 0 ? along > 0 : along < 0) continue;
        } else if (in_angle(s, x + s->end[e] - s->x, y + s->end[e + 1] - s->y)) continue;
        if (face_at(s, x + s->end[e], y + s->end[e + 1]) != s) continue;
        first = h;
        *approach = speed;
    }
    return first;
}

/* When a disk meets a circle from inside. If it first moves inwards (it enters through the opening of an arc, or leaves a
   place where it touches), only the path after its point nearest to the centre counts; if it is not inside even there, it
   never meets it. A disk that overlaps the circle even at that point meets it where it is as deep again as at the start. */
static double meet_inside(const Surface *s, const Disk *d, double span, double *approach) {
    double x = d->x - s->x, y = d->y - s->y, vx = d->vx, vy = d->vy, t = 0, reach = s->radius - d->radius;
    double in = x * vx + y * vy, away = x * x + y * y;
    if (in < 0) {
        t = MIN(-in / (vx * vx + vy * vy), span);
        x += (vx + 0.5 * W.gx * t) * t;
        y += (vy + 0.5 * W.gy * t) * t;
        vx += W.gx * t;
        vy += W.gy * t;
        if (x * x + y * y > reach * reach && away < square(s->radius)) reach = sqrt(away);
    }
    if (x * x + y * y >= s->radius * s->radius) return INFINITY;
    return t + meet_round(x, y, vx, vy, reach, -1, span - t, approach);
}

/* Time from d->t until a disk meets a surface, INFINITY if not within the span. */
double meet_surface(const Surface *s, const Disk *d, double span, double *approach) {
    if (stirs(s)) return meet_moving((int)(s - W.surfaces), d, span, approach);
    double dx = d->x - s->x, dy = d->y - s->y, r = d->radius;
    double sweep = (sqrt(d->vx * d->vx + d->vy * d->vy) + W.g * span) * span;
    *approach = 0;
    if (s->shape == SEGMENT) {
        double off = dy * s->tx - dx * s->ty, rate = d->vy * s->tx - d->vx * s->ty;
        double side = off >= 0 ? 1 : -1, gap = side * off - r;
        double along = dx * s->tx + dy * s->ty;
        double pull = side * (W.gy * s->tx - W.gx * s->ty);
        rate *= side;
        if (gap > sweep || along < -sweep - r || along > s->length + sweep + r) return INFINITY;
        double h = meet_face(gap, rate, pull, span, approach);
        if (h < INFINITY) {
            double run = d->vx * s->tx + d->vy * s->ty, draw = W.gx * s->tx + W.gy * s->ty;
            double there = along + (run + 0.5 * draw * h) * h;
            if (there >= 0 && there <= s->length) return h;
        }
        if (along > sweep + r && along < s->length - sweep - r) return INFINITY;
        return meet_ends(s, d, span, approach);
    }
    double away = sqrt(dx * dx + dy * dy), side = away >= s->radius ? 1 : -1;
    if (side * (away - s->radius) > sweep + r) return INFINITY;
    /* The first of outside, inside and ends: a disk that enters through an opening may meet an end first. */
    double first = INFINITY, speed;
    for (; side >= -1; side -= 2) {
        double h = INFINITY;
        if (side > 0) h = meet_round(dx, dy, d->vx, d->vy, s->radius + r, 1, span, &speed);
        else if (s->radius > r) h = meet_inside(s, d, span, &speed);
        if (h < first) {
            double px = dx + (d->vx + 0.5 * W.gx * h) * h, py = dy + (d->vy + 0.5 * W.gy * h) * h;
            if (in_angle(s, px, py)) {
                first = h;
                *approach = speed;
            }
        }
        if (s->shape == CIRCLE) return first;
    }
    double h = meet_ends(s, d, span, &speed);
    if (h >= first) return first;
    *approach = speed;
    return h;
}

/* Time until two disks at a relative place (x, y) with a relative velocity (u, v) are `reach` apart. Both fall with the
   same acceleration, so their relative path is straight. */
double meet_disk(double x, double y, double u, double v, double reach, double span,
                 double *approach) {
    double b = x * u + y * v, c = x * x + y * y - reach * reach;
    *approach = 0;
    if (b >= 0) return INFINITY;
    if (c <= 0) {
        *approach = -b / sqrt(x * x + y * y);
        return 0;
    }
    double a = u * u + v * v, root = b * b - a * c;
    if (root <= 0) return INFINITY;
    root = sqrt(root);
    double h = c / (-b + root);
    if (h > span) return INFINITY;
    *approach = root / reach;
    return h;
}

/* Time for which a disk that flies alone needs no step, s, but not less than `least`: until it could reach an arc or an
   end, or crosses the line of a segment. */
double free_span(const Disk *d, double least) {
    double span = INFINITY, v = sqrt(d->vx * d->vx + d->vy * d->vy), r = d->radius;
    for (int k = 0; k < W.surface_count && span > least; k++) {
        const Surface *s = surface_at(k, d->t);
        double rounds[3][3], dx = d->x - s->x, dy = d->y - s->y, nx, ny;
        int count = 0;
        if (s->opens > d->t) span = MIN(span, s->opens - d->t);
        if (s->closes > d->t) span = MIN(span, s->closes - d->t);
        if (is_spared(s, d) && (!s->one_sided || gap_to(s, d->x, d->y, r, &nx, &ny) < 0)) span = 0;
        if (stirs(s)) {
            span = MIN(span, box_span(s, d));
            continue;
        }
        if (s->shape == SEGMENT) {
            double off = dy * s->tx - dx * s->ty, side = off >= 0 ? 1 : -1, speed;
            double rate = side * (d->vy * s->tx - d->vx * s->ty);
            double pull = side * (W.gy * s->tx - W.gx * s->ty);
            double h = meet_face(side * off - r, rate, pull, INFINITY, &speed);
            if (h < INFINITY) span = MIN(span, h + 0.5 * least);
        } else {
            rounds[count][0] = dx; rounds[count][1] = dy; rounds[count++][2] = s->radius;
        }
        if (s->shape != CIRCLE)
            for (int e = 0; e < 4; e += 2) {
                rounds[count][0] = d->x - s->end[e];
                rounds[count][1] = d->y - s->end[e + 1];
                rounds[count++][2] = 0;
            }
        for (int n = 0; n < count; n++) {
            double x = rounds[n][0], y = rounds[n][1];
            double room = fabs(sqrt(x * x + y * y) - rounds[n][2]) - r;
            if (room <= 0) span = 0;
            else if (W.g > 0) span = MIN(span, 2 * room / (v + sqrt(v * v + 2 * W.g * room)));
            else if (v > 0) span = MIN(span, room / v);
        }
    }
    return MAX(span, least);
}
