/* The machine of a scene: its belts, plates, conveyors and free surfaces as segments and arcs.

   The height of the outgoing belt is measured from the impact of the nominal particle on the plate, and the lower end of
   the plate stays above that belt. */

#include <string.h>
#include "plan.h"

/* m of plate below the pivot if there is no outgoing belt. */
#define REACH_WITHOUT_BELT 2.0
/* m of a further plate below its pivot. */
#define REACH_HANGING 0.5
/* Least distance of the plate's lower end from the outgoing belt, in m and in radii: a disk that lies on the belt passes
   under the plate, with a radius to spare. */
#define CLEARANCE 0.05
#define CLEARANCE_RADII 3.0

Plan P;

EXPORT Plan *plan(void) { return &P; }

/* Reserve the rows of numbers, which the host fills in. It may have filled them in already: they are at the place of the
   first array and are not cleared. */
EXPORT int lay_out_plan(void) {
    P.rows = set_apart((double)P.members * P.width + P.term_width, sizeof *P.rows);
    P.terms = P.rows + P.members * P.width;
    RESERVE(P.nominal, P.members);
    RESERVE(P.movers, P.moving);
    return has_room();
}

/* The tables of a member, found by their counts. */
Tables tables_of(int member) {
    const double *row = P.rows + (long)member * P.width;
    Tables t;
#define NEXT(name, Type, count) \
    t.name = (const Type *)row, row += (count) * (int)(sizeof(Type) / sizeof(double))
    NEXT(scene, SceneKeys, 1);
    NEXT(particles, ParticleKeys, P.particles);
    NEXT(streams, StreamKeys, P.streams);
    NEXT(incoming, IncomingKeys, P.incoming);
    NEXT(plates, PlateKeys, P.plates);
    NEXT(outgoing, OutgoingKeys, P.outgoing);
    NEXT(conveyors, ConveyorKeys, P.conveyors);
    NEXT(surfaces, SurfaceKeys, P.surfaces);
    NEXT(joints, JointKeys, P.joints);
    NEXT(movers, MoverKeys, P.moving);
#undef NEXT
    t.points = row;
    t.particle = t.particles + (int)t.streams->kind;
    if (!P.incoming) t.incoming = 0;
    if (!P.outgoing) t.outgoing = 0;
    t.plate = 0;
    for (int n = P.plates - 1; n >= 0; n--)
        if (isnan(t.plates[n].pivot[0])) t.plate = t.plates + n;
    return t;
}

/* Where the pieces of this member are written, or NULL while they are counted; and how many there are. */
static Segment *segments;
static Arc *arcs;
static int segment_count, arc_count;

/* Add a segment to a surface. */
static Segment *lay_segment(int surface, double x, double y, double x1, double y1, double speed,
                            const double *gate) {
    static Segment none;
    if (!segments) {
        segment_count++;
        return &none;
    }
    double dx = x1 - x, dy = y1 - y, length = length_of(dx, dy);
    segments[segment_count] = (Segment){
        { x, y }, { x1, y1 }, { dx / length, dy / length }, length, speed, gate[0], gate[1], surface, 0,
    };
    return segments + segment_count++;
}

static void lay_arc(int surface, double x, double y, double radius, double begin, double extent,
                    double speed, const double *gate, int one_sided) {
    Arc arc = { { x, y }, radius, begin, extent, speed, gate[0], gate[1], surface, one_sided };
    if (arcs) arcs[arc_count] = arc;
    arc_count++;
}

static const double ALWAYS[] = { -INFINITY, INFINITY };

/* Add a plate that hangs from a pivot. Its segment leads upwards, so that its struck face (-cos a, -sin a) is on the
   left. */
static void lay_plate(int surface, double x, double y, double angle_deg, double below,
                      double above) {
    double sine, cosine;
    sin_cos(angle_deg * RADIANS, &sine, &cosine);
    lay_segment(surface, x + below * sine, y - below * cosine, x - above * sine, y + above * cosine,
                0.0, ALWAYS);
}

/* Add a belt round two pulleys: forward on top, which is clockwise if it leads to the right, and back below. */
static void lay_conveyor(int surface, const ConveyorKeys *c) {
    double x0 = c->from[0], y0 = c->from[1], x1 = c->to[0], y1 = c->to[1], r = c->pulley_radius;
    double way = length_of(x1 - x0, y1 - y0), dx = (x1 - x0) / way, dy = (y1 - y0) / way;
    double clockwise = dx >= 0.0 ? 1.0 : -1.0, nx = -clockwise * dy * r, ny = clockwise * dx * r;
    lay_segment(surface, x0 + nx, y0 + ny, x1 + nx, y1 + ny, c->speed, ALWAYS);
    lay_segment(surface, x1 - nx, y1 - ny, x0 - nx, y0 - ny, c->speed, ALWAYS);
    lay_arc(surface, x0, y0, r, 0.0, 2.0 * PI, clockwise * c->speed, ALWAYS, 0);
    lay_arc(surface, x1, y1, r, 0.0, 2.0 * PI, clockwise * c->speed, ALWAYS, 0);
}

/* Add a copy of a free surface, moved by (dx, dy), that exists from gate[0] to gate[1]. */
static void lay_copy(int surface, const SurfaceKeys *s, const double *points, double dx, double dy,
                     const double *gate) {
    int last = (int)s->corners - 1;
    /* A one-sided segment is solid on the side to which it lets particles pass: its left (1) or its right (-1). */
    double sense = isnan(s->passes) ? 0.0 : s->passes < 0.0 ? -1.0 : 1.0;
    for (int n = 0; n < last; n++, points += 2) {
        double way = fabs(s->passes) == PASSES_UP ? points[2] - points[0] : points[1] - points[3];
        lay_segment(surface, points[0] + dx, points[1] + dy, points[2] + dx, points[3] + dy,
                    s->speed, gate)->one_sided = sense * way < 0.0 ? -1 : sense * way > 0.0;
    }
    if (last > 0) return;
    double first = s->from_deg * RADIANS, end = s->to_deg * RADIANS;
    lay_arc(surface, s->center[0] + dx, s->center[1] + dy, s->radius, MIN(first, end),
            fabs(end - first), s->to_deg < s->from_deg ? s->speed : -s->speed, gate, (int)sense);
}

/* Add a free surface with all its copies, for the times at which it exists. */
static void lay_surface(int surface, const SurfaceKeys *s, const double *points) {
    double opens = isnan(s->opens_at) ? INFINITY : s->opens_at;
    double closes = isnan(s->closes_at) ? -INFINITY : s->closes_at;
    double gates[2][2] = { { closes, opens }, { closes, INFINITY } };
    int times = isfinite(opens) && isfinite(closes) && opens < closes ? 2 : 1;
    if (times == 2) gates[0][0] = -INFINITY;
    const double *rows = s->repeat;
    int columns = isnan(rows[0]) ? 1 : (int)rows[0], lines = isnan(rows[3]) ? 1 : (int)rows[3];
    for (int gate = 0; gate < times; gate++)
        for (int line = 0; line < lines; line++)
            for (int column = 0; column < columns; column++) {
                double dx = 0.0, dy = 0.0;
                if (!isnan(rows[0])) dx += column * rows[1], dy += column * rows[2];
                if (!isnan(rows[3])) dx += line * rows[4], dy += line * rows[5];
                lay_copy(surface, s, points, dx, dy, gates[gate]);
            }
}

/* Add the incoming belt, the damping plate and the outgoing belt. Return the number of the next surface. */
static int lay_transfer(const Tables *t, Nominal *found) {
    const IncomingKeys *belt = t->incoming;
    const PlateKeys *plate = t->plate;
    const OutgoingKeys *out = t->outgoing;
    double dx, dy, top = belt->pulley_radius, r = t->particle->radius, height = NAN;
    int surface = 0, hangs = out && out->drop_from == FROM_IMPACT;
    up_belt(belt, &dx, &dy);
    double x = -top * dy, y = top * dx;
    lay_segment(surface++, x - belt->length * dx, y - belt->length * dy, x, y, belt->speed, ALWAYS);
    if (hangs && isnan(found->hit[1])) found->contradiction = NO_IMPACT;
    if (out) height = hangs ? found->hit[1] - out->drop - r : top - out->drop;
    if (plate) {
        double sine, cosine, below = plate->below;
        sin_cos(plate->angle_deg * RADIANS, &sine, &cosine);
        x = top + plate->distance;
        y = plate->pivot_height;
        if (isnan(below) && out) {
            double lowest = height + MAX(CLEARANCE, CLEARANCE_RADII * r);
            below = MAX((y - lowest) / cosine, 0.0);
        } else if (isnan(below)) {
            below = REACH_WITHOUT_BELT;
        }
        found->below = below;
        found->along = (y - found->hit[1]) * -cosine + (x - found->hit[0]) * sine;
        found->off = found->along > plate->above ? HIT_ABOVE
            : found->along < -below ? HIT_BELOW : SOUND;
        if (found->contradiction == SOUND && below + plate->above <= 0.0)
            found->contradiction = NO_LENGTH;
        else if (found->contradiction == SOUND && hangs)
            found->contradiction = found->off;
        lay_plate(surface++, x, y, plate->angle_deg, below, plate->above);
    }
    if (out)
        lay_segment(surface++, out->start, height, out->start + out->length, height, out->speed,
                    ALWAYS);
    return surface;
}

/* Add all surfaces of a member, in the order of the ledger. */
static void lay_all(const Tables *t, Nominal *found) {
    const double *points = t->points;
    int surface = t->incoming ? lay_transfer(t, found) : 0;
    for (int n = 0; n < P.plates; n++) {
        const PlateKeys *plate = t->plates + n;
        if (isnan(plate->pivot[0])) continue;
        lay_plate(surface++, plate->pivot[0], plate->pivot[1], plate->angle_deg,
                  isnan(plate->below) ? REACH_HANGING : plate->below, plate->above);
    }
    for (int n = 0; n < P.conveyors; n++) lay_conveyor(surface++, t->conveyors + n);
    for (int n = 0; n < P.surfaces; n++) {
        lay_surface(surface++, t->surfaces + n, points);
        points += 2 * (int)t->surfaces[n].corners;
    }
}

/* Whether a surface moves. */
int is_moved(const Tables *t, int surface) {
    for (int n = 0; n < P.moving; n++)
        if (t->movers[n].surface == surface) return 1;
    return 0;
}

/* Find the pivot of a moving surface if none is given: that of a plate, else its first point, or the centre of an arc. */
static void find_pivot(const Tables *t, int surface, double *pivot) {
    const double *found = 0, *points = t->points;
    int next = P.incoming, damps = t->incoming && t->plate;
    if (damps && surface == next) {
        pivot[0] = t->incoming->pulley_radius + t->plate->distance;
        pivot[1] = t->plate->pivot_height;
        return;
    }
    next += damps + (t->incoming && t->outgoing);
    for (int n = 0; n < P.plates; n++)
        if (!isnan(t->plates[n].pivot[0]) && surface == next++) found = t->plates[n].pivot;
    next += P.conveyors;
    for (int n = 0; n < P.surfaces; n++) {
        const SurfaceKeys *s = t->surfaces + n;
        if (surface == next++) found = s->corners ? points : s->center;
        points += 2 * (int)s->corners;
    }
    pivot[0] = found[0];
    pivot[1] = found[1];
}

/* Add a piece of even density to the sums of length, length times place, and length times squared distance from the
   pivot. Its middle is at (x, y); `wide` is its own mean square distance from there. */
static void weigh_piece(const Mover *m, double length, double x, double y, double wide, double *sums) {
    x -= m->pivot[0];
    y -= m->pivot[1];
    sums[0] += length;
    sums[1] += length * x;
    sums[2] += length * y;
    sums[3] += length * (x * x + y * y + wide);
}

/* Make a surface a hinge. Its mass is distributed evenly along it; if only an inertia is given, it has no weight. */
static void lay_hinge(const MoverKeys *k, Mover *m) {
    double sums[4] = { 0.0, 0.0, 0.0, 0.0 };
    for (const Segment *s = P.segments; s < P.segments + P.segment_count; s++) {
        double half = 0.5 * s->length;
        if (s->surface != m->surface) continue;
        weigh_piece(m, s->length, s->start[0] + half * s->tangent[0], s->start[1] + half * s->tangent[1],
                    half * half / 3.0, sums);
    }
    for (const Arc *a = P.arcs; a < P.arcs + P.arc_count; a++) {
        double half = 0.5 * a->extent, middle = a->begin + half, mean = a->radius * sine(half) / half;
        if (a->surface != m->surface) continue;
        weigh_piece(m, a->extent * a->radius, a->center[0] + mean * cosine(middle), a->center[1] + mean * sine(middle),
                    a->radius * a->radius - mean * mean, sums);
    }
    double mass = m->mass = isnan(k->mass) ? 0.0 : k->mass;
    m->inertia = isnan(k->inertia) ? mass * sums[3] / sums[0] : k->inertia;
    m->gyration = sqrt(sums[3] / sums[0]);
    for (int n = 0; n < 2; n++) m->moment[n] = mass * sums[1 + n] / sums[0];
    m->spring = isnan(k->spring) ? 0.0 : k->spring;
    m->damper = isnan(k->damper) ? 0.0 : k->damper;
    m->rest = isnan(k->rest_deg) ? 0.0 : k->rest_deg * RADIANS;
    m->stops[0] = isnan(k->stops_deg[0]) ? -INFINITY : k->stops_deg[0] * RADIANS;
    m->stops[1] = isnan(k->stops_deg[1]) ? INFINITY : k->stops_deg[1] * RADIANS;
    if (isnan(k->torque)) return;
    m->motor[0] = k->speed_deg * RADIANS;
    m->motor[1] = k->torque;
}

/* Set how surfaces move; a key that is not given is no motion. */
static void lay_movers(const Tables *t) {
    for (int n = 0; n < P.moving; n++) {
        const MoverKeys *k = t->movers + n;
        Mover *m = P.movers + n;
        *m = (Mover){ .pivot = { k->pivot[0], k->pivot[1] }, .surface = (int)k->surface };
        if (isnan(k->pivot[0])) find_pivot(t, m->surface, m->pivot);
        if (!isnan(k->frequency)) {
            m->frequency = k->frequency;
            m->phase = k->phase_deg * RADIANS;
            memcpy(m->by, k->by, sizeof m->by);
        }
        if (!isnan(k->in)) {
            m->from = k->at;
            m->lasts = k->in;
            m->way[0] = k->to[0] - m->pivot[0];
            m->way[1] = k->to[1] - m->pivot[1];
        }
        if (!isnan(k->turn)) m->turn = k->turn * RADIANS;
        if (k->hangs == 1.0) lay_hinge(k, m);
    }
}

/* Add all surfaces of a member, or count them if no arrays are reserved yet. */
static void build_member(int member) {
    Tables t = tables_of(member);
    Nominal found = { .along = NAN, .below = NAN };
    fly_nominal(&t, &found);
    segment_count = arc_count = 0;
    lay_all(&t, &found);
    P.nominal[member] = found;
}

/* Build the machines of all members, which have equal numbers of pieces, and reserve the arrays of the drawing. */
EXPORT int build(void) {
    segments = 0;
    arcs = 0;
    if (!P.rows && !lay_out_plan()) return 0;
    build_member(0);
    P.segment_count = segment_count;
    P.arc_count = arc_count;
    RESERVE(P.segments, (double)P.members * segment_count);
    RESERVE(P.arcs, (double)P.members * arc_count);
    for (int member = 0; member < P.members && has_room(); member++) {
        segments = P.segments + (long)member * P.segment_count;
        arcs = P.arcs + (long)member * P.arc_count;
        build_member(member);
    }
    Tables first = tables_of(0);
    lay_movers(&first);
    lay_out_drawing();
    if (has_room()) draw_if_told();
    return has_room();
}
