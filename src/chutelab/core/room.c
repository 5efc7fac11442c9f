/* Where disks can be released without overlapping a surface that exists then, and the boxes outside which tracks end. */

#include "releases.h"

/* Share of the largest coordinate; a smaller overlap of a release is rounding, and is left to the engines. */
#define ROUNDING (64.0 * 0x1p-52)

/* A piece of a surface: a segment, an arc, or neither. Neither is a pulley, which is solid. */
typedef struct {
    const Segment *segment;
    const Arc *arc;
    double x, y, radius;       /* m; of an arc or pulley */
    double appears, vanishes;  /* s */
    double box[4];             /* m; left, bottom, right, top */
    int surface;
} Piece;

static const Tables *t;
static const Segment *segments;
static const Arc *arcs;

void enter_room(const Tables *tables) {
    t = tables;
    segments = P.segments + (long)D.member * P.segment_count;
    arcs = P.arcs + (long)D.member * P.arc_count;
}

static Piece straight_piece(const Segment *s) {
    const double *a = s->start, *b = s->end;
    return (Piece){
        s, 0, 0.0, 0.0, 0.0, s->appears, s->vanishes,
        { MIN(a[0], b[0]), MIN(a[1], b[1]), MAX(a[0], b[0]), MAX(a[1], b[1]) }, s->surface,
    };
}

static Piece round_piece(const Arc *arc, double x, double y, double r, int surface) {
    /* Rounding must not exclude a piece that just touches. */
    double reach = r + ROUNDING * (MAX(fabs(x), fabs(y)) + r);
    return (Piece){
        0, arc, x, y, r, arc ? arc->appears : -INFINITY, arc ? arc->vanishes : INFINITY,
        { x - reach, y - reach, x + reach, y + reach }, surface,
    };
}

/* Number of pieces: segments, arcs, the drive pulley, and two pulleys for each conveyor. */
static int piece_count(void) {
    return P.segment_count + P.arc_count + P.incoming + 2 * P.conveyors;
}

static Piece piece_of(int k) {
    if (k < P.segment_count) return straight_piece(segments + k);
    const Arc *arc = arcs + (k -= P.segment_count);
    if (k < P.arc_count)
        return round_piece(arc, arc->center[0], arc->center[1], arc->radius, arc->surface);
    if ((k -= P.arc_count) < P.incoming) return round_piece(0, 0.0, 0.0, t->incoming->pulley_radius, 0);
    /* The arcs of conveyors, two each, come before all other arcs. */
    arc = arcs + (k - P.incoming);
    return round_piece(0, arc->center[0], arc->center[1], arc->radius, arc->surface);
}

/* List the pieces whose boxes overlap a box. */
static void list_pieces(double left, double bottom, double right, double top) {
    D.listed_count = 0;
    for (int k = 0; k < piece_count(); k++) {
        Piece p = piece_of(k);
        if (p.box[2] > left && p.box[0] < right && p.box[3] > bottom && p.box[1] < top)
            D.listed[D.listed_count++] = k;
    }
}

/* Whether a disk may touch a piece, or seem to because of rounding. */
static int is_beside(const Piece *p, double x, double y, double reach) {
    double room = reach + ON_BELT + ROUNDING * (fabs(x) + fabs(y));
    return p->box[2] > x - room && p->box[0] < x + room && p->box[3] > y - room
        && p->box[1] < y + room;
}

static void nearest_on_segment(const Segment *s, double x, double y, double *place) {
    double x0 = s->start[0], y0 = s->start[1], dx = s->end[0] - x0, dy = s->end[1] - y0;
    double square = dx * dx + dy * dy, along = (x - x0) * dx + (y - y0) * dy;
    double share = MIN(MAX(along / (square > 0.0 ? square : 1.0), 0.0), 1.0);
    place[0] = x0 + share * dx;
    place[1] = y0 + share * dy;
}

/* An end of an arc, relative to its centre. It is rounded as its coordinates are, so that it is the point that others
   share. */
static void end_of_arc(const Arc *arc, double angle, double *end) {
    double dx, dy;
    sin_cos(angle, &dy, &dx);
    end[0] = (arc->center[0] + arc->radius * dx) - arc->center[0];
    end[1] = (arc->center[1] + arc->radius * dy) - arc->center[1];
}

static void nearest_on_arc(const Arc *arc, double x, double y, double *place) {
    double dx = x - arc->center[0], dy = y - arc->center[1], first[2], last[2], *end = place;
    if (!(length_of(dx, dy) > 0.0)) dx = 1.0, dy = 0.0;
    if (modulo(angle_of(dy, dx) - arc->begin, 2.0 * PI) <= arc->extent) {
        double far = length_of(dx, dy);
        place[0] = arc->radius * dx / far;
        place[1] = arc->radius * dy / far;
    } else {
        end_of_arc(arc, arc->begin, first);
        end_of_arc(arc, arc->begin + arc->extent, last);
        end = length_of(dx - first[0], dy - first[1]) <= length_of(dx - last[0], dy - last[1])
            ? first : last;
    }
    place[0] = end[0] + arc->center[0];
    place[1] = end[1] + arc->center[1];
}

/* The point of a piece that is nearest to a place; for a pulley its axis. */
static void nearest_point(const Piece *p, double x, double y, double *place) {
    place[0] = p->x;
    place[1] = p->y;
    if (p->segment) nearest_on_segment(p->segment, x, y, place);
    if (p->arc) nearest_on_arc(p->arc, x, y, place);
}

/* Mark places where a disk would overlap a surface, whether or not that exists at the time. Return how many pairs were
   checked. */
int take_what_is_in_surfaces(Place *places, int count, double radius) {
    double box[4] = { INFINITY, INFINITY, -INFINITY, -INFINITY }, point[2];
    for (const Place *o = places; o < places + count; o++) {
        box[0] = MIN(box[0], o->x);
        box[1] = MIN(box[1], o->y);
        box[2] = MAX(box[2], o->x);
        box[3] = MAX(box[3], o->y);
    }
    list_pieces(box[0] - radius, box[1] - radius, box[2] + radius, box[3] + radius);
    for (int n = 0; n < D.listed_count; n++) {
        Piece p = piece_of(D.listed[n]);
        double reach = p.segment || p.arc ? radius : p.radius + radius;
        for (Place *o = places; o < places + count; o++) {
            if (o->taken || !is_beside(&p, o->x, o->y, radius)) continue;
            nearest_point(&p, o->x, o->y, point);
            if (!(length_of(o->x - point[0], o->y - point[1]) >= reach)) o->taken = 1;
        }
    }
    return D.listed_count * count;
}

/* Corners of a kind of particles. */
static const double *outline_of(int kind) {
    const double *first = D.corners;
    for (int n = 0; n < kind; n++) first += 2 * (int)t->particles[n].corners;
    return first;
}

/* Move a release out of a piece. An overlap up to ON_BELT is moved, as ten written digits may cause it; a larger one is
   refused, and the deepest is reported. */
static void clear_release(const Piece *p, int stream, int i, double *deepest, Refusal *refusal) {
    Start *o = D.starts + (long)D.member * D.count + i;
    double x = o->position[0], y = o->position[1], reach = o->radius, point[2];
    /* A moving surface may be elsewhere then: the engine delays the release instead. */
    if (is_moved(t, p->surface)) return;
    if (!(p->appears <= o->t && o->t < p->vanishes) || !is_beside(p, x, y, o->radius)) return;
    nearest_point(p, x, y, point);
    double dx = x - point[0], dy = y - point[1], distance = length_of(dx, dy);
    /* A mass point may start inside a pulley. */
    if (!p->segment && !p->arc) reach = reach > 0.0 ? p->radius + reach : 0.0;
    int kind = (int)t->streams[stream].kind, corners = (int)t->particles[kind].corners;
    double depth = reach - distance, center[2] = { p->x, p->y };
    double rounding = ROUNDING * MAX(MAX(fabs(point[0]), fabs(point[1])), MAX(fabs(x), fabs(y)));
    dx *= depth / distance;
    dy *= depth / distance;
    if (corners) {
        Clearance found = clear_polygon(o, outline_of(kind), corners, p->segment, p->arc, center, p->radius);
        if (!(found.depth > rounding)) return;
        dx = found.x;
        dy = found.y;
        depth = length_of(dx, dy);
    }
    if (!(depth > rounding)) return;
    if (depth > MAX(ON_BELT, rounding) && depth >= *deepest) {
        *deepest = depth;
        *refusal = (Refusal){ distance, distance + depth, RELEASE_INSIDE, stream, i, p->surface };
    }
    o->position[0] = x + dx;
    o->position[1] = y + dy;
}

/* List the pieces that releases of a member may overlap. */
static void list_near_releases(void) {
    double box[4] = { INFINITY, INFINITY, -INFINITY, -INFINITY };
    const Start *o = D.starts + (long)D.member * D.count;
    for (const Start *end = o + D.count; o < end; o++)
        for (int n = 0; n < 2; n++) {
            box[n] = MIN(box[n], o->position[n] - o->radius);
            box[2 + n] = MAX(box[2 + n], o->position[n] + o->radius);
        }
    list_pieces(box[0], box[1], box[2], box[3]);
}

/* Move the releases of a member out of all pieces that exist then. Return 1 when done, 0 if the looks of this call are
   used up. */
int clear_releases(void) {
    Refusal *refusal = D.refusals + D.member;
    if (!D.is_begun) list_near_releases(), D.next = 0;
    D.is_begun = 1;
    for (; D.next < D.listed_count && !refusal->why; D.next++) {
        if (D.left <= 0) return 0;
        D.left -= D.count;
        Piece p = piece_of(D.listed[D.next]);
        double deepest = -INFINITY;
        for (int stream = 0, i = 0; stream < P.streams; stream++) {
            int last = i + (int)t->streams[stream].count;
            int rides = P.incoming && p.surface == 0 && D.carried[D.member * P.streams + stream];
            for (; i < last; i++)
                if (!rides) clear_release(&p, stream, i, &deepest, refusal);
        }
    }
    return 1;
}

/* Boxes outside which a particle has left the scene. */

static void hold(double *box, double x, double y) {
    box[0] = MIN(box[0], x);
    box[1] = MIN(box[1], y);
    box[2] = MAX(box[2], x);
    box[3] = MAX(box[3], y);
}

static void hold_at(double *box, const Arc *arc, double angle) {
    double dx, dy;
    sin_cos(angle, &dy, &dx);
    hold(box, arc->center[0] + arc->radius * dx, arc->center[1] + arc->radius * dy);
}

/* Enlarge a box by the ends of an arc, and by its points where it is level or upright. */
static void hold_arc(double *box, const Arc *arc) {
    for (int quarter = 0; quarter < 4; quarter++) {
        double way = modulo(0.5 * PI * quarter - arc->begin, 2.0 * PI);
        if (way <= arc->extent) hold_at(box, arc, arc->begin + way);
    }
    hold_at(box, arc, arc->begin);
    hold_at(box, arc, arc->begin + arc->extent);
}

/* How far a joint lets a particle move from its other end, at most. A spring is assumed to stretch to at most STRETCHES
   times its length. */
#define STRETCHES 3.0
static int runs_over(const JointKeys *joint) {
    return joint->kind == STRING && !isnan(joint->other) && !isnan(joint->from[0]);
}

static double reach_of(const JointKeys *joint, const Start *first) {
    const double *at = first[(int)joint->particle].position, *from = joint->from;
    double away = length_of(at[0] - from[0], at[1] - from[1]);
    if (!isnan(joint->other)) {
        const double *other = first[(int)joint->other].position;
        if (runs_over(joint)) away += length_of(other[0] - from[0], other[1] - from[1]);
        else away = length_of(at[0] - other[0], at[1] - other[1]);
    }
    double length = isnan(joint->length) ? away : MAX(joint->length, away);
    return joint->kind == SPRING ? STRETCHES * length : length;
}

/* Enlarge a box by all places that joints let particles reach: round a fixed end by the length of the joint, else round
   the release by twice the length of all joints together. */
static void hold_joints(double *box, const Start *first) {
    double all = 0.0;
    for (int n = 0; n < P.joints; n++) all += reach_of(t->joints + n, first);
    for (const JointKeys *joint = t->joints; joint < t->joints + P.joints; joint++) {
        int fixed = isnan(joint->other) || runs_over(joint);
        const double *at = fixed ? joint->from : first[(int)joint->particle].position;
        double reach = fixed ? reach_of(joint, first) : 2.0 * all;
        hold(box, at[0] - reach, at[1] - reach);
        hold(box, at[0] + reach, at[1] + reach);
    }
}

/* Enlarge the box `all` by the region that a moving surface sweeps; `box` holds the surface before it moves. */
static void hold_swept(double *all, double *box, const Mover *m) {
    double x = MAX(fabs(box[0] - m->pivot[0]), fabs(box[2] - m->pivot[0]));
    double y = MAX(fabs(box[1] - m->pivot[1]), fabs(box[3] - m->pivot[1])), reach = length_of(x, y);
    for (int n = 0; n < 4; n++) {
        double way = m->way[n % 2], by = fabs(m->by[n % 2]);
        if (m->turn != 0.0 || m->inertia > 0.0) box[n] = m->pivot[n % 2] + (n < 2 ? -reach : reach);
        box[n] += n < 2 ? MIN(way, 0.0) - by : MAX(way, 0.0) + by;
    }
    hold(all, box[0], box[1]);
    hold(all, box[2], box[3]);
}

static void hold_segment(double *box, const Segment *s) {
    hold(box, s->start[0], s->start[1]);
    hold(box, s->start[0] + s->length * s->tangent[0], s->start[1] + s->length * s->tangent[1]);
}

/* If gravity pulls to a side with less than this share of g, that is rounding. */
#define LEVEL 1e-9

/* Set the exit box of each particle of a member. With gravity it has only those sides to which gravity pulls. It includes
   the release, so a particle that is released below all surfaces or hangs on a string has not left. If particles do not
   meet, each box includes only the particle's own release, so that it does the same alone as with others. */
void box_in(void) {
    double all[4] = { INFINITY, INFINITY, -INFINITY, -INFINITY }, down[2];
    Start *first = D.starts + (long)D.member * D.count;
    sin_cos(t->scene->gravity_deg * RADIANS, down, down + 1);
    down[1] = -down[1];
    for (int n = 0; n < P.segment_count; n++) hold_segment(all, segments + n);
    for (int n = 0; n < P.arc_count; n++) hold_arc(all, arcs + n);
    for (const Mover *m = P.movers; m < P.movers + P.moving; m++) {
        double box[4] = { INFINITY, INFINITY, -INFINITY, -INFINITY };
        for (int n = 0; n < P.segment_count; n++)
            if (segments[n].surface == m->surface) hold_segment(box, segments + n);
        for (int n = 0; n < P.arc_count; n++)
            if (arcs[n].surface == m->surface) hold_arc(box, arcs + n);
        hold_swept(all, box, m);
    }
    hold_joints(all, first);
    if (t->incoming) {
        double radius = t->incoming->pulley_radius;
        hold(all, -radius, -radius);
        hold(all, radius, radius);
    }
    for (int i = 0; i < D.count && t->scene->crowded != 0.0; i++)
        hold(all, first[i].position[0], first[i].position[1]);
    for (Start *o = first; o < first + D.count; o++) {
        for (int n = 0; n < 4; n++) o->exit_box[n] = all[n];
        hold(o->exit_box, o->position[0], o->position[1]);
        for (int n = 0; n < 4; n++) o->exit_box[n] += n < 2 ? -EXIT_MARGIN : EXIT_MARGIN;
        for (int n = 0; n < 4 && t->scene->gravity > 0.0; n++) {
            double side = n < 2 ? -1.0 : 1.0;
            if (!(side * down[n % 2] > LEVEL)) o->exit_box[n] = side * INFINITY;
        }
    }
}
