/* Where pieces are cut, for the exact engine, so that others join them at their ends. */

#include <stdlib.h>
#include "exact_pieces.h"

/* How far a place is along an arc's circle, rad from its first angle. */
static double turn_of(const Arc *a, double x, double y) {
    return modulo(angle_of(y - a->center[1], x - a->center[0]) - a->begin, TURN);
}

/* Where an end lies inside a part and its piece is tangent to the part, m along the part; else 0. For a mass point it
   need not be tangent. Particles on the incoming belt do not meet anything that begins on the belt. */
static double begins_on(const Part *p, int s, int n, double near) {
    const Tip *tip = O.tips + n;
    const double *t = p->of->tangent;
    if (n / 2 == s || (E.wheel_count && s == 0)) return 0.0;
    double dx = tip->x - p->x, dy = tip->y - p->y;
    double foot = dx * t[0] + dy * t[1];
    return fabs(t[0] * dy - t[1] * dx) <= near && foot > near && foot < p->length - near
            && (are_points || fabs(t[0] * tip->out[1] - t[1] * tip->out[0]) <= COLLINEAR)
        ? foot : 0.0;
}

/* List where other pieces begin on a part, if `feet` is given; return the number. */
static int begin_on(int s, double near, double *feet) {
    const Part *p = parts + s;
    int count = 0;
    for (int n = before(MIN(p->x, p->ex) - near); n < O.tip_count; n++) {
        if (xs[order[n]] > MAX(p->x, p->ex) + near) break;
        double foot = begins_on(p, s, order[n], near);
        if (foot && feet) feet[count] = foot;
        count += foot != 0.0;
    }
    return count;
}

/* Half the length of a chord at a distance `off` from the centre of a circle, m; 0 if it only touches the circle, NAN if
   it misses it. */
static double half_chord(double radius, double off, double near) {
    double depth = radius - fabs(off);
    return fabs(depth) <= near ? 0.0 : depth < 0.0 ? NAN : sqrt(depth * (radius + fabs(off)));
}

/* List where a part crosses other parts, within both, and arcs; return the number. */
static int cross_at(int s, double near, double *feet) {
    const Part *p = parts + s;
    const double *t = p->of->tangent;
    int count = 0;
    for (int k = 0; k < part_count; k++) {
        /* The place is computed from the same one of the two for both. */
        const Part *a = parts + MIN(s, k), *b = parts + MAX(s, k);
        const double *u = a->of->tangent, *v = b->of->tangent;
        double dx = b->x - a->x, dy = b->y - a->y, sine = u[0] * v[1] - u[1] * v[0];
        if (k == s || fabs(sine) <= COLLINEAR || (E.wheel_count && k == 0)) continue;
        double along = (dx * v[1] - dy * v[0]) / sine;
        double x = a->x + along * u[0], y = a->y + along * u[1];
        double foot = (x - p->x) * t[0] + (y - p->y) * t[1];
        const Part *other = parts + k;
        double there = (x - other->x) * other->of->tangent[0] + (y - other->y) * other->of->tangent[1];
        if (!(foot > near && foot < p->length - near && there > near && there < other->length - near)) continue;
        if (feet) feet[count] = foot;
        count++;
    }
    for (int b = 0; b < O.arcs; b++) {
        const Arc *a = bends[b];
        double dx = a->center[0] - p->x, dy = a->center[1] - p->y;
        double middle = dx * t[0] + dy * t[1], off = dx * t[1] - dy * t[0];
        double half = half_chord(a->radius, off, near);
        for (int side = -1; side <= 1; side += 2) {
            double foot = middle + side * half, x = p->x + foot * t[0], y = p->y + foot * t[1];
            if (!(foot > near && foot < p->length - near && turn_of(a, x, y) <= extent_of(a))) continue;
            if (feet) feet[count] = foot;
            count++;
        }
    }
    return count;
}

/* List where a part is to be cut, if `feet` is given; return the number. */
static int cuts_of(int s, double near, double *feet) {
    int count = begin_on(s, near, feet);
    return are_points && !(E.wheel_count && s == 0) ? count + cross_at(s, near, feet ? feet + count : 0) : count;
}

static Part part_of(const Part *whole, double low, double high) {
    const double *t = whole->of->tangent;
    Part p = *whole;
    p.x += low * t[0], p.y += low * t[1];
    p.length = high - low;
    p.ex = p.x + p.length * t[0], p.ey = p.y + p.length * t[1];
    return p;
}

/* Cut parts where other pieces begin on them: three pieces join there. For a mass point also where they cross, as it has
   no size that tells on which side it is. Return whether any were cut. */
int cut_parts(double near) {
    int found = 0, count = 0;
    for (int s = 0; s < part_count; s++) found += cuts_of(s, near, 0);
    if (!found) return 0;
    double *feet = take_room(found + 1, sizeof *feet);
    Part *cut = take_room(part_count + found, sizeof *cut);
    if (arena_full) return 0;
    for (int s = 0; s < part_count; s++) {
        int many = cuts_of(s, near, feet);
        double low = 0.0;
        if (!many) cut[count++] = parts[s];
        else {
            qsort(feet, many, sizeof *feet, ascending);
            feet[many] = parts[s].length;
            for (int n = 0; n <= many; low = feet[n++])
                if (feet[n] - low > near) cut[count++] = part_of(parts + s, low, feet[n]);
        }
    }
    parts = cut, part_count = count;
    return 1;
}

/* Note where an arc is to be cut, rad from its first angle, if a place on its circle lies within the arc. */
static int note_turn(int b, double x, double y, double near, double *turns, int count) {
    double extent = extent_of(bends[b]), edge = near / bends[b]->radius, turn = turn_of(bends[b], x, y);
    if (extent < TURN && !(turn > edge && turn < extent - edge)) return count;
    if (turns) turns[count] = turn;
    return count + 1;
}

/* List where an arc is to be cut for a mass point, if `turns` is given: where pieces end on it, and where it crosses
   arcs. Return the number. */
static int cuts_of_bend(int b, double near, double *turns) {
    const Arc *a = bends[b];
    int count = 0;
    for (int n = 0; n < O.tip_count; n++) {
        double x = O.tips[n].x, y = O.tips[n].y;
        if (fabs(length_of(x - a->center[0], y - a->center[1]) - a->radius) <= near)
            count = note_turn(b, x, y, near, turns, count);
    }
    for (int k = 0; k < O.arcs; k++) {
        /* The places are computed from the same one of the two for both. */
        const Arc *one = bends[MIN(b, k)], *two = bends[MAX(b, k)];
        double dx = two->center[0] - one->center[0], dy = two->center[1] - one->center[1];
        double apart = length_of(dx, dy), sum = one->radius + two->radius;
        double along = 0.5 * (apart + (one->radius - two->radius) * sum / apart);
        double half = half_chord(one->radius, along, near);
        if (isnan(half)) continue;
        for (int side = -1; side <= 1; side += 2) {
            double x = one->center[0] + (along * dx - side * half * dy) / apart;
            double y = one->center[1] + (along * dy + side * half * dx) / apart;
            if (turn_of(bends[k], x, y) <= extent_of(bends[k])) count = note_turn(b, x, y, near, turns, count);
        }
    }
    return count;
}

/* Cut arcs where it would have to be known on which side of another piece a mass point is. A full circle is also cut on
   the opposite side, as a part of it has two ends. Return whether any were cut. */
int cut_bends(double near) {
    int found = 0, count = 0;
    for (int b = 0; b < O.arcs; b++) found += cuts_of_bend(b, near, 0);
    if (!found) return 0;
    double *turns = take_room(found + 3, sizeof *turns);
    Arc *cut = take_room(O.arcs + 2 * found, sizeof *cut);
    const Arc **kept = take_room(O.arcs + 2 * found, sizeof *kept);
    int *source = take_room(O.arcs + 2 * found, sizeof *source);
    if (arena_full) return 0;
    int before = O.arcs;
    for (int whole = 0; whole < 2; whole++)
        for (int b = 0; b < O.arcs; b++) {
            int many = cuts_of_bend(b, near, turns);
            double extent = extent_of(bends[b]), low = 0.0;
            if ((extent >= TURN && !many) != whole) continue;
            if (extent >= TURN && many) {
                turns[many] = modulo(turns[0] + PI, TURN), many++;
                qsort(turns, many, sizeof *turns, ascending);
                low = turns[many - 1] - TURN;
                extent = turns[many - 1], many--;
            } else
                qsort(turns, many, sizeof *turns, ascending);
            turns[many] = extent;
            for (int n = 0; n <= many; low = turns[n++]) {
                if (!((turns[n] - low) * bends[b]->radius > near)) continue;
                cut[count] = *bends[b];
                if (many) cut[count].begin += low, cut[count].extent = turns[n] - low;
                kept[count] = cut + count, source[count] = bend_source[b], count++;
            }
        }
    bends = kept, bend_source = source, O.arcs = count, O.bent = 0;
    for (int b = 0; b < count; b++) O.bent += bends[b]->extent < TURN;
    return count > before;
}
