/* Where tracks end: the boxes beyond which particles have left the scene. */

#include "releases.h"

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

/* The ends of an arc, and where it is level or upright. */
static void hold_arc(double *box, const Arc *arc) {
    for (int quarter = 0; quarter < 4; quarter++) {
        double way = modulo(0.5 * PI * quarter - arc->begin, 2.0 * PI);
        if (way <= arc->extent) hold_at(box, arc, arc->begin + way);
    }
    hold_at(box, arc, arc->begin);
    hold_at(box, arc, arc->begin + arc->extent);
}

/* All that a string's end can reach. */
static void hold_string(double *box, const StringKeys *string, const Start *held) {
    double x = string->from[0], y = string->from[1], length = string->length;
    if (isnan(length)) length = length_of(held->position[0] - x, held->position[1] - y);
    hold(box, x - length, y - length);
    hold(box, x + length, y + length);
}

/* Give each particle of a member its box. With gravity it has a bottom only: what flies up comes back. What
   is released below all surfaces, or hangs on a string, has not left. Where particles do not meet, each
   one's box holds its own release alone, so that it does the same alone and with others. */
void box_in(const Tables *t) {
    double all[4] = { INFINITY, INFINITY, -INFINITY, -INFINITY };
    Start *first = D.starts + (long)D.member * D.count;
    const Segment *s = P.segments + (long)D.member * P.segment_count;
    for (const Segment *end = s + P.segment_count; s < end; s++) {
        hold(all, s->start[0], s->start[1]);
        hold(all, s->start[0] + s->length * s->tangent[0], s->start[1] + s->length * s->tangent[1]);
    }
    const Arc *arc = P.arcs + (long)D.member * P.arc_count;
    for (const Arc *end = arc + P.arc_count; arc < end; arc++) hold_arc(all, arc);
    for (int n = 0; n < P.strings; n++)
        hold_string(all, t->strings + n, first + (int)t->strings[n].particle);
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
        if (t->scene->gravity == 0.0) continue;
        o->exit_box[0] = -INFINITY;
        o->exit_box[2] = o->exit_box[3] = INFINITY;
    }
}
