/* How deep a piece of a surface lies in a box or polygon, and how the polygon must move to be clear of it.

   Polygons are convex. A point lies as deep in one as the nearest line through two neighbouring corners is away;
   outside this is negative. On a segment or arc the deepest point is an end, a point at which two sides are equally
   near, or, on an arc, the point furthest behind a side. So all of these are looked at, and a piece overlaps the
   polygon exactly if one of them is inside. All is done in the polygon's frame, with its centroid as the origin. */

#include "releases.h"

static const double *corners; /* m; of the polygon, counterclockwise */
static int many;              /* its number of corners */
static double sin_angle, cos_angle;   /* of its angle */
static Clearance best;        /* of the deepest point yet, in the polygon's frame */

/* A side: its outward normal, and its distance from the centroid, m. */
typedef struct { double x, y, far; } Side;

static Side side_of(int n) {
    const double *a = corners + 2 * n, *b = corners + 2 * ((n + 1) % many);
    double dx = b[0] - a[0], dy = b[1] - a[1], length = length_of(dx, dy);
    return (Side){ dy / length, -dx / length, (a[0] * dy - a[1] * dx) / length };
}

/* How far a point is behind a side, m. */
static double behind(Side s, double x, double y) { return s.far - (s.x * x + s.y * y); }

/* How deep a point is in the polygon, m, and its nearest side. */
static double depth_of(double x, double y, Side *nearest) {
    double depth = INFINITY;
    for (int n = 0; n < many && depth > best.depth; n++) {
        Side s = side_of(n);
        double own = behind(s, x, y);
        if (own < depth) depth = own, *nearest = s;
    }
    return depth;
}

/* Keep a point of a piece if it is the deepest yet. The polygon is clear of it when all corners are behind the tangent
   there, whose normal is (nx, ny); at an end of a piece, without a normal, when the point is on the nearest side. */
static void look_at(double x, double y, double nx, double ny) {
    Side s;
    double depth = depth_of(x, y, &s), most = -INFINITY;
    if (!(depth > best.depth)) return;
    if (nx == 0.0 && ny == 0.0) nx = s.x, ny = s.y;
    double sense = nx * s.x + ny * s.y < 0.0 ? -1.0 : 1.0;
    nx *= sense;
    ny *= sense;
    for (int n = 0; n < many; n++) most = MAX(most, corners[2 * n] * nx + corners[2 * n + 1] * ny);
    most -= x * nx + y * ny;
    best = (Clearance){ depth, -nx * most, -ny * most };
}

static void to_frame(const Start *o, const double *place, double *own) {
    double dx = place[0] - o->position[0], dy = place[1] - o->position[1];
    own[0] = cos_angle * dx + sin_angle * dy;
    own[1] = cos_angle * dy - sin_angle * dx;
}

static void look_along_segment(const double *a, const double *b) {
    double dx = b[0] - a[0], dy = b[1] - a[1], length = length_of(dx, dy);
    for (int i = 1; i < many; i++)
        for (int j = 0; j < i; j++) {
            Side s = side_of(i), o = side_of(j);
            double apart = behind(o, a[0], a[1]) - behind(s, a[0], a[1]);
            double share = apart / ((o.x - s.x) * dx + (o.y - s.y) * dy);
            if (share > 0.0 && share < 1.0)
                look_at(a[0] + share * dx, a[1] + share * dy, dy / length, -dx / length);
        }
    look_at(a[0], a[1], 0.0, 0.0);
    look_at(b[0], b[1], 0.0, 0.0);
}

/* Look at the point of an arc in the direction (x, y) from its centre, if the arc has one there. */
static void look_from_center(const Arc *arc, double angle, const double *center, double x, double y) {
    if (modulo(angle_of(y, x) + angle - arc->begin, 2.0 * PI) > arc->extent) return;
    look_at(center[0] + arc->radius * x, center[1] + arc->radius * y, x, y);
}

static void look_along_arc(const Arc *arc, double angle, const double *center) {
    for (int i = 0; i < many; i++) {
        Side s = side_of(i);
        look_from_center(arc, angle, center, -s.x, -s.y);
        for (int j = 0; j < i; j++) {
            /* Both sides are equally near in the directions u with r (s - o) u = `apart`, for the normals s and o. */
            Side o = side_of(j);
            double x = s.x - o.x, y = s.y - o.y, length = length_of(x, y);
            double apart = behind(s, center[0], center[1]) - behind(o, center[0], center[1]);
            double along = apart / (arc->radius * length), across = sqrt((1.0 - along) * (1.0 + along));
            if (!(fabs(along) <= 1.0)) continue;
            x /= length;
            y /= length;
            look_from_center(arc, angle, center, along * x - across * y, along * y + across * x);
            look_from_center(arc, angle, center, along * x + across * y, along * y - across * x);
        }
    }
    for (int n = 0; n < 2 && arc->extent < 2.0 * PI; n++) {
        double x, y;
        sin_cos(arc->begin + n * arc->extent - angle, &y, &x);
        look_at(center[0] + arc->radius * x, center[1] + arc->radius * y, 0.0, 0.0);
    }
}

/* How deep a solid disk overlaps the polygon: by its radius more than its centre is inside. */
static void look_at_disk(const double *center, double radius) {
    Side s;
    double depth = depth_of(center[0], center[1], &s), nearest = INFINITY, x = 0.0, y = 0.0;
    for (int n = 0; n < many && depth < 0.0; n++) {
        const double *a = corners + 2 * n, *b = corners + 2 * ((n + 1) % many);
        double dx = b[0] - a[0], dy = b[1] - a[1];
        double along = ((center[0] - a[0]) * dx + (center[1] - a[1]) * dy) / (dx * dx + dy * dy);
        along = MIN(MAX(along, 0.0), 1.0);
        dx = a[0] + along * dx - center[0];
        dy = a[1] + along * dy - center[1];
        double far = length_of(dx, dy);
        if (far < nearest) nearest = far, x = dx / far, y = dy / far;
    }
    if (depth >= 0.0) nearest = -depth, x = -s.x, y = -s.y;
    double deep = radius - nearest;
    best = (Clearance){ deep, x * deep, y * deep };
}

Clearance clear_polygon(const Start *o, const double *outline, int count, const Segment *segment, const Arc *arc,
                        const double *center, double radius) {
    double first[2], last[2];
    corners = outline;
    many = count;
    best = (Clearance){ -INFINITY, 0.0, 0.0 };
    sin_cos(o->angle, &sin_angle, &cos_angle);
    to_frame(o, segment ? segment->start : center, first);
    if (segment) {
        to_frame(o, segment->end, last);
        look_along_segment(first, last);
    } else if (arc) {
        look_along_arc(arc, o->angle, first);
    } else {
        look_at_disk(first, radius);
    }
    double x = best.x, y = best.y;
    best.x = cos_angle * x - sin_angle * y;
    best.y = cos_angle * y + sin_angle * x;
    return best;
}
