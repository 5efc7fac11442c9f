/* The machine for the exact engine: faces and circles that can be met, and how pieces join.

   The pieces that end at a place, sorted by the angles at which they leave it, divide its surroundings into sectors. A
   disk is in one of them and can touch only the two faces that bound it. If the angle between these is pi, they are
   *flush*, and a ride on one continues on the other; if it is larger, it continues round the place; if it is smaller, the
   ride is stopped before. */

#include <stdlib.h>
#include <string.h>
#include "exact.h"

/* Share of a curvature; two pieces that leave a place in the same direction lie on each other if their curvatures differ
   by less. */
#define CIRCULAR 1e-9
/* Margin of the boxes of faces and arcs, in `touch`. */
#define BOX_TOUCHES 64.0
/* rad; at a concave bend this slight a piece may, by rounding, end before the next one is met: it continues as the next
   one. */
#define SLIGHT 1e-7
/* Replaces the number of an end for a piece that passes through a place: first along it, then back. */
#define THROUGH 2

Obstacles O;

/* A segment, or a part of one, with its ends. */
typedef struct { double x, y, ex, ey, length; const Segment *of; int source; } Part;

/* A piece as seen from a place where it ends, or which it passes; `number` counts those of the place. */
typedef struct { double angle, bend; int piece, end, number; } Ray;

static double *arena, *arena_end;
static int arena_full;

/* Reserve room in the arena; if there is too little, note that more is needed. */
static void *reserve(double count, int size) {
    double *found = arena, doubles = ceil(count * size / 8.0);
    if (doubles > arena_end - arena) {
        arena_full = 1;
        return 0;
    }
    arena += (int)doubles;
    return found;
}

static Part *parts;
static int part_count;
static int points;        /* whether particles are mass points */
static const Arc **bends; /* those with ends first */
static int *bend_source;
static double *xs;        /* of the ends, for sorting */
static int *order;        /* ends sorted by x */
static int *at_spot;      /* first end at each spot, or -1 ... */
static int *next_there;   /* ... and the next of each */
static Ray *rays, *ring, *flat;

static double extent_of(const Arc *a) { return MIN(a->extent, TURN); }

/* How far a place is along an arc's circle, rad from its first angle. */
static double turn_of(const Arc *a, double x, double y) {
    return modulo(angle_of(y - a->center[1], x - a->center[0]) - a->begin, TURN);
}

static int by_x(const void *one, const void *other) {
    int a = *(const int *)one, b = *(const int *)other;
    return xs[a] < xs[b] ? -1 : xs[a] > xs[b] ? 1 : a - b;
}

static int compared(double a, double b) { return a < b ? -1 : a > b; }
static int ascending(const void *a, const void *b) {
    return compared(*(const double *)a, *(const double *)b);
}
static int by_angle(const void *one, const void *other) {
    const Ray *a = one, *b = other;
    int by = compared(a->angle, b->angle);
    return by ? by : a->number - b->number;
}

/* Set the places of ends, and the unit vectors out of their pieces and to the left of these. */
static void find_tips(void) {
    for (int s = 0; s < part_count; s++) {
        const Part *p = parts + s;
        const double *t = p->of->tangent;
        for (int e = 0; e < 2; e++) {
            Tip *tip = O.tips + 2 * s + e;
            tip->x = e ? p->ex : p->x, tip->y = e ? p->ey : p->y;
            tip->out[0] = e ? t[0] : -t[0], tip->out[1] = e ? t[1] : -t[1];
            tip->left[0] = -t[1], tip->left[1] = t[0];
        }
    }
    for (int b = 0; b < O.bent; b++) {
        const Arc *a = bends[b];
        for (int e = 0; e < 2; e++) {
            Tip *tip = O.tips + 2 * (part_count + b) + e;
            double up, across;
            sin_cos(e ? a->begin : a->begin + extent_of(a), &up, &across);
            tip->x = a->center[0] + a->radius * across, tip->y = a->center[1] + a->radius * up;
            tip->left[0] = across, tip->left[1] = up;
            tip->out[0] = e ? up : -up, tip->out[1] = e ? -across : across;
        }
    }
    for (int n = 0; n < O.tip_count; n++) {
        O.tips[n].rests = O.tips[n].circle = NONE;
        O.tips[n].sets[0] = O.tips[n].sets[1] = NONE;
    }
}

static void sort_tips(void) {
    for (int n = 0; n < O.tip_count; n++) xs[n] = O.tips[n].x, order[n] = n;
    qsort(order, O.tip_count, sizeof *order, by_x);
}

/* Number of ends whose x is below a value. */
static int before(double x) {
    int low = 0, high = O.tip_count;
    while (low < high) {
        int middle = (low + high) / 2;
        if (xs[order[middle]] < x) low = middle + 1;
        else high = middle;
    }
    return low;
}

/* The largest coordinate of the surfaces. */
static double size_of_surfaces(void) {
    double size = 0.0;
    for (int n = 0; n < O.tip_count; n++)
        size = MAX(size, MAX(fabs(O.tips[n].x), fabs(O.tips[n].y)));
    for (int b = 0; b < O.arcs; b++)
        for (int k = 0; k < 2; k++)
            size = MAX(size, fabs(bends[b]->center[k]) + bends[b]->radius);
    return size;
}

static double size_for(const Lone *p) {
    return MAX(O.size, MAX(fabs(p->position[0]), fabs(p->position[1])));
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
            && (points || fabs(t[0] * tip->out[1] - t[1] * tip->out[0]) <= COLLINEAR)
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
    return points && !(E.wheel_count && s == 0) ? count + cross_at(s, near, feet ? feet + count : 0) : count;
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
static int cut_parts(double near) {
    int found = 0, count = 0;
    for (int s = 0; s < part_count; s++) found += cuts_of(s, near, 0);
    if (!found) return 0;
    double *feet = reserve(found + 1, sizeof *feet);
    Part *cut = reserve(part_count + found, sizeof *cut);
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
static int cut_bends(double near) {
    int found = 0, count = 0;
    for (int b = 0; b < O.arcs; b++) found += cuts_of_bend(b, near, 0);
    if (!found) return 0;
    double *turns = reserve(found + 3, sizeof *turns);
    Arc *cut = reserve(O.arcs + 2 * found, sizeof *cut);
    const Arc **kept = reserve(O.arcs + 2 * found, sizeof *kept);
    int *source = reserve(O.arcs + 2 * found, sizeof *source);
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

/* Make room for the ends of all pieces and find them, sorted by place. */
static int list_tips(void) {
    O.tip_count = 2 * (part_count + O.bent);
    O.tips = reserve(O.tip_count, sizeof *O.tips);
    xs = reserve(O.tip_count, sizeof *xs);
    order = reserve(O.tip_count, sizeof *order);
    if (arena_full) return 0;
    find_tips();
    sort_tips();
    O.size = size_of_surfaces();
    return 1;
}

/* Number the places where pieces begin and end; ends within the tolerance share a place. */
static void number_spots(double tolerance) {
    for (int n = 0, first = 0; n < O.tip_count; n++) {
        Tip *tip = O.tips + order[n];
        tip->spot = order[n];
        while (tip->x - xs[order[first]] > tolerance) first++;
        for (int m = first; m < n; m++)
            if (fabs(tip->y - O.tips[order[m]].y) <= tolerance) {
                tip->spot = O.tips[order[m]].spot;
                break;
            }
    }
}

static double came_of(int piece) {
    return piece < part_count ? parts[piece].of->appears : bends[piece - part_count]->appears;
}
static double went_of(int piece) {
    return piece < part_count ? parts[piece].of->vanishes : bends[piece - part_count]->vanishes;
}
static int stays(int piece) { return isinf(came_of(piece)) && isinf(went_of(piece)); }

/* Of parts that lie on each other keep the first, which also counts first if two are met at once. A gate that closes
   again is there twice, at different times. */
static void drop_doubles(void) {
    int kept = 0;
    for (int s = 0; s < part_count; s++) {
        const Tip *a = O.tips + 2 * s;
        int doubled = 0;
        for (int k = 0; k < kept && !doubled; k++) {
            const Tip *b = O.tips + 2 * k;
            int same = (a[0].spot == b[0].spot && a[1].spot == b[1].spot)
                || (a[0].spot == b[1].spot && a[1].spot == b[0].spot);
            doubled = same && came_of(s) == came_of(k) && went_of(s) == went_of(k);
        }
        if (doubled) continue;
        parts[kept] = parts[s];
        O.tips[2 * kept] = a[0], O.tips[2 * kept + 1] = a[1];
        kept++;
    }
    for (int n = 2 * part_count; kept < part_count && n < O.tip_count; n++)
        O.tips[n - 2 * (part_count - kept)] = O.tips[n];
    O.tip_count -= 2 * (part_count - kept);
    part_count = kept;
}

/* List when gates appear or vanish, each time once. */
static int list_changes(void) {
    int pieces = part_count + O.arcs, count = 0;
    O.changes = reserve(2 * pieces, sizeof *O.changes);
    if (arena_full) return 0;
    for (int p = 0; p < pieces; p++) {
        if (isfinite(came_of(p))) O.changes[count++] = came_of(p);
        if (isfinite(went_of(p))) O.changes[count++] = went_of(p);
    }
    qsort(O.changes, count, sizeof *O.changes, ascending);
    O.change_count = 0;
    O.owned_in = NONE;
    for (int n = 0; n < count; n++)
        if (!n || O.changes[n] > O.changes[O.change_count - 1]) O.changes[O.change_count++] = O.changes[n];
    return 1;
}

/* Find which ends lie on an arc, other than at its ends: they cannot be met, and neither can the end of the belt on the
   pulley. */
static void find_rests(double near) {
    sort_tips();
    for (int b = 0; b < O.arcs; b++) {
        const Arc *a = bends[b];
        if (O.change_count && !stays(part_count + b)) continue;
        for (int k = before(a->center[0] - a->radius - 2.0 * near); k < O.tip_count; k++) {
            Tip *tip = O.tips + order[k];
            if (tip->x > a->center[0] + a->radius + near) break;
            double x = tip->x - a->center[0], y = tip->y - a->center[1];
            if (!(fabs(length_of(x, y) - a->radius) <= near)) continue;
            double extent = extent_of(a), edge = extent < TURN ? near / a->radius : 0.0;
            double turn = modulo(angle_of(y, x) - a->begin, TURN);
            if (turn >= edge && turn <= extent - edge) tip->rests = MAX(tip->rests, b);
        }
    }
    if (E.wheel_count) O.tips[1].rests = O.arcs;
}

static double turning_of(int piece) {
    const Arc *a = bends[piece - part_count];
    return -a->speed / a->radius;
}

static void place_of_piece(Obstacle *o, int piece) {
    if (piece < part_count) {
        const Segment *s = parts[piece].of;
        o->speed = s->speed, o->surface = s->surface, o->source = parts[piece].source;
    } else {
        const Arc *a = bends[piece - part_count];
        o->speed = a->speed, o->surface = a->surface, o->source = bend_source[piece - part_count];
    }
    o->came = came_of(piece), o->went = went_of(piece);
}

/* For disks, make a circle round each place where pieces end, and list the ends at it. (A mass point meets it with
   probability zero.) Pieces that always exist come first. */
static int make_ends(int disks) {
    int count = 0;
    for (int n = O.tip_count - 1; n >= 0; n--) {
        int spot = O.tips[n].spot;
        next_there[n] = at_spot[spot], at_spot[spot] = n;
    }
    for (int late = 0; late < 2; late++)
        for (int n = 0; disks && n < O.tip_count; n++) {
            if (O.tips[n].rests != NONE || O.tips[n].circle != NONE || stays(n / 2) == late) continue;
            Obstacle *o = O.all + O.faces + count;
            o->met = END, o->x = O.tips[n].x, o->y = O.tips[n].y;
            place_of_piece(o, n / 2);
            for (int k = at_spot[O.tips[n].spot]; k != NONE; k = next_there[k])
                if (O.tips[k].rests == NONE)
                    O.tips[k].circle = O.faces + count, O.tips[k].next = o->tips, o->tips = k;
            /* The list is in reverse order: the last one that sets it is the first end. */
            for (int k = o->tips; k != NONE; k = O.tips[k].next)
                o->turning = k / 2 < O.faces ? 0.0 : turning_of(k / 2);
            count++;
        }
    return count;
}

/* Set the least and largest x and y of the directions to an arc. */
static void bound_directions(Obstacle *o) {
    for (int k = 0; k < 2; k++) o->least[k] = 1.0, o->most[k] = -1.0;
    for (int n = -2; n < 4; n++) {
        double turn = n < 0 ? -(n + 1) * o->extent : modulo(0.5 * PI * n - o->begin, TURN), way[2];
        if (!(turn <= o->extent)) continue;
        sin_cos(o->begin + turn, way + 1, way);
        for (int k = 0; k < 2; k++) o->least[k] = MIN(o->least[k], way[k]), o->most[k] = MAX(o->most[k], way[k]);
    }
}

static int list_obstacles(int disks) {
    int most = part_count + O.tip_count + 2 * O.arcs + 1;
    O.all = reserve(most, sizeof *O.all);
    if (arena_full) return 0;
    for (int k = 0; k < most; k++)
        O.all[k] = (Obstacle){ .extent = TURN, .tips = NONE, .members = NONE, .handovers = NONE };
    O.faces = part_count;
    for (int s = 0; s < part_count; s++) {
        Obstacle *o = O.all + s;
        const double *t = parts[s].of->tangent;
        o->met = FACE, o->x = parts[s].x, o->y = parts[s].y, o->length = parts[s].length;
        o->tx = t[0], o->ty = t[1], o->nx = -t[1], o->ny = t[0];
        place_of_piece(o, s);
    }
    O.first_arc = O.faces + make_ends(disks);
    for (int k = 0; k < 2 * O.arcs; k++) {
        Obstacle *o = O.all + O.first_arc + k;
        int piece = O.faces + k % O.arcs;
        const Arc *a = bends[k % O.arcs];
        o->met = k < O.arcs ? OUTSIDE : INSIDE;
        o->x = a->center[0], o->y = a->center[1], o->bend = a->radius;
        o->begin = a->begin, o->extent = extent_of(a);
        bound_directions(o);
        place_of_piece(o, piece);
        o->turning = turning_of(piece);
    }
    O.count = O.first_arc + 2 * O.arcs;
    O.pulley = NONE;
    return 1;
}

static void list_pulley(const Wheel *wheel) {
    Obstacle *o = O.all + O.count;
    O.pulley = O.count++;
    o->met = WHEEL;
    o->bend = wheel->radius, o->speed = wheel->speed, o->surface = wheel->surface;
    o->came = -INFINITY, o->went = INFINITY;
    o->source = E.segment_count + E.arc_count;
}

int face_of(int piece, int face) {
    if (piece < O.faces) return piece;
    if (piece == O.faces + O.arcs) return face > 0 ? O.pulley : NONE;
    return O.first_arc + piece - O.faces + (face > 0 ? 0 : O.arcs);
}

static double angle_at(double x, double y) { return modulo(angle_of(y, x), TURN); }

/* List the pieces at a place as rays that leave it. */
static int list_rays(int first) {
    int count = 0;
    for (int n = first; n != NONE; n = next_there[n]) {
        const Tip *tip = O.tips + n;
        double bend = n / 2 < O.faces ? 0.0 : 1.0 / bends[n / 2 - O.faces]->radius;
        rays[count] = (Ray){ angle_at(-tip->out[0], -tip->out[1]), n % 2 ? bend : -bend, n / 2, n % 2, count };
        count++;
    }
    for (int n = first; n != NONE; n = next_there[n]) {
        const Tip *tip = O.tips + n;
        int through = O.faces + tip->rests, known = tip->rests == NONE;
        for (int k = 0; k < count; k++) known |= rays[k].piece == through;
        if (known) continue;
        /* By rounding the place isn't exactly at the top of the pulley, but the belt is flush. */
        int wheel = tip->rests == O.arcs;
        const Arc *a = wheel ? 0 : bends[tip->rests];
        double x = wheel ? tip->left[0] : tip->x - a->center[0];
        double y = wheel ? tip->left[1] : tip->y - a->center[1];
        double bend = 1.0 / (wheel ? O.all[O.pulley].bend : a->radius);
        rays[count] = (Ray){ angle_at(y, -x), -bend, through, THROUGH, count };
        count++;
        rays[count] = (Ray){ angle_at(-y, x), bend, through, THROUGH + 1, count };
        count++;
    }
    return count;
}

/* The face of a piece that is on the left as it leaves the place; the right one has the other sign. */
static int left_of(const Ray *r) { return r->end == 0 || r->end == THROUGH ? 1 : -1; }
static int tip_of(const Ray *r) { return 2 * r->piece + r->end; }

/* Sort rays of the same angle counterclockwise by curvature; of those that lie on each other keep the first. */
static int sort_by_bend(Ray *some, int count) {
    int kept = 0;
    for (int n = 0; n < count; n++) {
        Ray ray = some[n];
        int alike = 0;
        for (int k = 0; k < kept; k++)
            alike |= fabs(ray.bend - some[k].bend) <= CIRCULAR * fabs(some[k].bend);
        if (!alike) some[kept++] = ray;
    }
    for (int n = 1; n < kept; n++)
        for (int k = n; k > 0 && some[k].bend < some[k - 1].bend; k--) {
            Ray ray = some[k];
            some[k] = some[k - 1], some[k - 1] = ray;
        }
    return kept;
}

/* Sort the rays of a place that exist in an epoch into `flat`; return the number. `turns`
   becomes 1 if all have the same angle. Of those that lie on each other only the first is kept. */
static int sort_rays(int count, int epoch, int *turns) {
    int some = 0, kept = 0, last = 0;
    for (int n = 0; n < count; n++)
        if (is_there(face_of(rays[n].piece, 1), epoch)) ring[some++] = rays[n];
    qsort(ring, some, sizeof *ring, by_angle);
    for (int n = 1; n < some; n++)
        if (!(ring[n].angle - ring[last].angle <= COLLINEAR)) last = n;
    *turns = last == 0;
    if (last && ring[0].angle + TURN - ring[last].angle <= COLLINEAR) {
        /* An angle just below a full turn is the same as one just above 0. */
        int first = 1;
        while (first < last && ring[first].angle - ring[0].angle <= COLLINEAR) first++;
        *turns = first == last;
        for (int n = 0; n < first; n++) flat[kept++] = ring[n];
        for (int n = last; n < some; n++) flat[kept++] = ring[n];
        kept = sort_by_bend(flat, kept);
        for (int n = first; n < last; n++) ring[n - first] = ring[n];
        some = last - first;
    }
    for (int n = 0; n < some;) {
        int begin = kept, first = n;
        while (n < some && ring[n].angle - ring[first].angle <= COLLINEAR) flat[kept++] = ring[n++];
        kept = begin + sort_by_bend(flat + begin, kept - begin);
    }
    return kept;
}

/* Angle from a ray to the next one counterclockwise. */
static double angle_after(int n, int count, int turns) {
    if (count == 1 || (turns && n == count - 1)) return TURN;
    double angle = modulo(flat[(n + 1) % count].angle - flat[n].angle, TURN);
    return TURN - angle <= COLLINEAR ? 0.0 : angle;
}

static void go_onward(Onward *to, const Ray *r, int face, const Ray *other, int onto, int meets) {
    if (r->end < THROUGH)
        to[2 * tip_of(r) + (face < 0)] = (Onward){ face_of(other->piece, onto), onto, meets };
}

/* Find what bounds a sector together with a face at its end, and on what a slide along the face continues there: on that
   if it is flush, else on the circle round the end, with side 0, as it is open. */
static void find_onward(int epoch) {
    Onward *to = O.onward + epoch * 2 * O.tip_count, *opposite = O.opposite + epoch * 2 * O.tip_count;
    for (int n = 0; n < 2 * O.tip_count; n++) {
        to[n] = (Onward){ O.tips[n / 2].circle, 0, 0 };
        opposite[n] = (Onward){ NONE, 0, 0 };
    }
    for (int n = 0; n < O.tip_count; n++) {
        if (at_spot[O.tips[n].spot] != n) continue;
        int turns, count = sort_rays(list_rays(n), epoch, &turns);
        for (int k = 0; k < count; k++) {
            double angle = angle_after(k, count, turns);
            const Ray *right = flat + k, *left = flat + (k + 1) % count;
            int meets = angle < PI - SLIGHT;
            go_onward(opposite, right, left_of(right), left, -left_of(left), meets);
            go_onward(opposite, left, -left_of(left), right, left_of(right), meets);
            if (!(angle > COLLINEAR && angle <= PI + COLLINEAR)) continue;
            go_onward(to, right, left_of(right), left, -left_of(left), meets);
            go_onward(to, left, -left_of(left), right, left_of(right), meets);
        }
    }
}

/* Set the crowns of an epoch: unit vectors to the middle of that half of an end that belongs to the left face. At a free
   end it is the piece's left normal. At a joint the rim between two pieces belongs to one face of both, however wide it is, and its
   middle bisects the angle between them: it has the direction of the sum of both normals and both ways out. */
static void find_crowns(int epoch) {
    double *crowns = O.crowns + 2 * epoch * O.tip_count;
    for (int n = 0; n < 2 * O.tip_count; n++) crowns[n] = 0.0;
    for (int n = 0; n < O.tip_count; n++) {
        if (at_spot[O.tips[n].spot] != n) continue;
        int first = n, other = NONE, begins = 0, turns, count = sort_rays(list_rays(n), epoch, &turns);
        while (first != NONE && (O.tips[first].circle == NONE || !is_there(face_of(first / 2, 1), epoch)))
            first = next_there[first];
        if (first == NONE) continue;
        for (int k = 0; k < count; k++) {
            const Ray *one = flat + k, *two = flat + (k + 1) % count;
            if (one == two || angle_after(k, count, turns) < PI - COLLINEAR) continue;
            if (one->end >= THROUGH || two->end >= THROUGH) continue;
            if (tip_of(one) == first) other = tip_of(two), begins = 1;
            else if (tip_of(two) == first) other = tip_of(one), begins = 0;
        }
        const Tip *tip = O.tips + first, *next = other == NONE ? 0 : O.tips + other;
        double sign = next && other % 2 != first % 2 ? 1.0 : -1.0, way = begins == first % 2 ? -1.0 : 1.0;
        for (int k = 0; k < 2; k++) {
            double more = next ? sign * next->left[k] + way * (tip->out[k] + next->out[k]) : 0.0;
            crowns[2 * tip->spot + k] = tip->left[k] + more;
        }
    }
}

static void join(int set, int obstacle, int faces, int edge) {
    for (int m = O.sets[set]; m != NONE; m = O.members[m].next)
        if (O.members[m].obstacle == obstacle) {
            O.members[m].faces |= faces, O.members[m].edges |= edge;
            return;
        }
    Obstacle *o = O.all + obstacle;
    O.members[O.member_count] = (Member){ set, obstacle, faces, edge, O.sets[set], o->members };
    O.sets[set] = o->members = O.member_count++;
}

/* Find the sets of what a disk touches at once where faces end: faces that share a place and the normal there, and the
   circle round it. */
static void find_sets(void) {
    double(*normals)[2] = (double(*)[2])flat;
    for (int n = 0; n < O.tip_count; n++) {
        if (at_spot[O.tips[n].spot] != n) continue;
        int first = O.set_count, count = list_rays(n);
        for (int k = 0; k < 2 * count; k++) {
            const Ray *r = rays + k / 2;
            int face = k % 2 ? -1 : 1, set = first, end = r->end < THROUGH;
            double x, y;
            if (r->end > THROUGH) continue;
            if (end) x = O.tips[tip_of(r)].left[0], y = O.tips[tip_of(r)].left[1];
            else sin_cos(r->angle, &x, &y), x = -x;
            x *= face, y *= face;
            while (set < O.set_count
                   && !(fabs(normals[set - first][0] - x) <= COLLINEAR
                        && fabs(normals[set - first][1] - y) <= COLLINEAR))
                set++;
            if (set == O.set_count) {
                normals[set - first][0] = x, normals[set - first][1] = y;
                O.sets[O.set_count++] = NONE;
            }
            int own = face_of(r->piece, face);
            if (own != NONE)
                join(set, own, own < O.faces ? 1 + k % 2 : 3, end && own >= O.faces ? 1 + r->end : 0);
            if (!end) continue;
            Tip *tip = O.tips + tip_of(r);
            tip->sets[k % 2] = set;
            if (tip->circle != NONE) join(set, tip->circle, 3, 0);
        }
    }
}

static void hand_over(int obstacle, int tip, int face, int onto) {
    Obstacle *o = O.all + obstacle;
    O.handovers[O.handover_count] = (Handover){ tip, face, onto, o->handovers };
    o->handovers = O.handover_count++;
}

/* Find where rides round circles continue on other pieces; the last one found comes first. */
static void find_handovers(void) {
    for (int n = O.tip_count - 1; n >= 0; n--)
        for (int k = 0; k < 2; k++) {
            int face = n % 2 ? 1 - k : k;
            Onward next = O.onward[2 * n + face];
            if (n / 2 >= O.faces) hand_over(face_of(n / 2, face ? -1 : 1), n, face, 0);
            if (O.tips[n].rests != NONE && next.obstacle != NONE && !next.meets) hand_over(next.obstacle, n, face, 1);
            if (O.tips[n].circle != NONE) hand_over(O.tips[n].circle, n, face, 1);
        }
}

static int find_joints(void) {
    int tips = O.tip_count, epochs = O.change_count + 1;
    O.onward = reserve(2.0 * tips * epochs, sizeof *O.onward);
    O.opposite = reserve(2.0 * tips * epochs, sizeof *O.opposite);
    O.crowns = reserve(2.0 * tips * epochs, sizeof *O.crowns);
    O.members = reserve(16 * tips, sizeof *O.members);
    O.sets = reserve(6 * tips, sizeof *O.sets);
    O.handovers = reserve(6 * tips, sizeof *O.handovers);
    if (arena_full) return 0;
    O.set_count = O.member_count = O.handover_count = 0;
    for (int epoch = 0; epoch < epochs; epoch++) {
        find_onward(epoch);
        find_crowns(epoch);
    }
    find_sets();
    find_handovers();
    O.stops = reserve(4.0 * O.faces + O.handover_count + 2 + 2.0 * (O.count - O.faces), sizeof *O.stops);
    return !arena_full;
}

/* Whether the machine of a member is that of another, but for speeds of straight pieces and the pulley, and materials. */
static int is_like(int member, int other) {
    const Segment *one = E.segments + member * E.segment_count, *two = E.segments + other * E.segment_count;
    const Wheel *v = E.wheels + member, *w = E.wheels + other;
    const Lone *p = E.lones + member * E.each, *q = E.lones + other * E.each;
    if ((p->radius > 0.0) != (q->radius > 0.0) || size_for(p) != size_for(q)) return 0;
    if (E.wheel_count && (v->radius != w->radius || v->incline != w->incline)) return 0;
    for (int s = 0; s < E.segment_count; s++) {
        Segment same = two[s];
        same.speed = one[s].speed;
        if (memcmp(&same, one + s, sizeof same)) return 0;
    }
    return !memcmp(E.arcs + member * E.arc_count, E.arcs + other * E.arc_count, E.arc_count * sizeof(Arc));
}

/* Set the speeds of straight pieces and the pulley, which are all that differs from the member before. */
static void set_speeds(int member) {
    for (int k = 0; k < O.first_arc; k++)
        if (O.all[k].source < E.segment_count)
            O.all[k].speed = E.segments[member * E.segment_count + O.all[k].source].speed;
    if (E.wheel_count) O.all[O.pulley].speed = E.wheels[member].speed;
    O.stops_on = NONE;
}

/* Build the obstacles of a member of a family, or of a single machine; return 0 if there is no room for them. */
int lay_obstacles(int member) {
    const Segment *segments = E.segments + member * E.segment_count;
    const Arc *arcs = E.arcs + member * E.arc_count;
    const Lone *first = E.lones + member * E.each;
    if (E.laid && is_like(member, E.laid - 1)) {
        set_speeds(member);
        return 1;
    }
    arena = E.room, arena_end = E.room + E.room_size, arena_full = 0;
    parts = reserve(E.segment_count, sizeof *parts);
    bends = reserve(E.arc_count, sizeof *bends);
    bend_source = reserve(E.arc_count, sizeof *bend_source);
    if (arena_full) return 0;
    points = !(first->radius > 0.0);
    O.fitted = NAN;
    part_count = E.segment_count, O.arcs = E.arc_count, O.bent = 0;
    for (int s = 0; s < part_count; s++) {
        const Segment *g = segments + s;
        const double *t = g->tangent;
        parts[s] = (Part){ g->start[0], g->start[1], g->start[0] + g->length * t[0],
                           g->start[1] + g->length * t[1], g->length, g, s };
    }
    for (int whole = 0, b = 0; whole < 2; whole++)
        for (int k = 0; k < E.arc_count; k++)
            if ((arcs[k].extent >= TURN) == whole) {
                bends[b] = arcs + k, bend_source[b++] = E.segment_count + k;
                O.bent += !whole;
            }
    double near;
    do {
        if (!list_tips()) return 0;
        near = JOINT * size_for(first);
    } while (cut_parts(near) || (points && cut_bends(near)));
    if (arena_full) return 0;
    int spots = O.tip_count;
    number_spots(near);
    at_spot = reserve(spots, sizeof *at_spot);
    next_there = reserve(spots, sizeof *next_there);
    rays = reserve(3 * spots, sizeof *rays);
    ring = reserve(3 * spots, sizeof *ring);
    flat = reserve(6 * spots, sizeof *flat);
    if (arena_full) return 0;
    for (int n = 0; n < spots; n++) at_spot[n] = NONE;
    drop_doubles();
    if (!list_changes()) return 0;
    find_rests(near);
    if (!list_obstacles(!points)) return 0;
    if (E.wheel_count) list_pulley(E.wheels + member);
    return find_joints();
}

/* Fit the obstacles to the radius and the release of the present particle. */
void fit_obstacles(void) {
    double r = A.given->radius, touch = ULP * (TOUCH_ULPS * size_for(A.given) + E.far);
    if (r == O.fitted && touch == O.touch) return;
    O.touch = touch, O.fitted = r, O.stops_on = NONE;
    for (int k = 0; k < O.count; k++) {
        Obstacle *o = O.all + k;
        double reach = r + BOX_TOUCHES * touch, x = o->x, y = o->y;
        if (o->met == FACE) x += o->length * o->tx, y += o->length * o->ty;
        else if (o->met == INSIDE) {
            double room = o->bend - r;
            o->rho = room > touch ? -room : NAN;
        } else
            o->rho = o->bend + r;
        /* The box of a circle that is met from outside is smaller than the circle: touching it is no contact. */
        if (o->met != FACE) reach = isnan(o->rho) ? -INFINITY : fabs(o->rho - touch);
        o->low[0] = MIN(o->x, x) - reach, o->low[1] = MIN(o->y, y) - reach;
        o->high[0] = MAX(o->x, x) + reach, o->high[1] = MAX(o->y, y) + reach;
        for (int n = 0; n < 2 && o->extent < TURN; n++) {
            double at = n ? o->y : o->x;
            o->low[n] = MAX(o->low[n], at + fabs(o->rho) * o->least[n] - BOX_TOUCHES * touch);
            o->high[n] = MIN(o->high[n], at + fabs(o->rho) * o->most[n] + BOX_TOUCHES * touch);
        }
    }
}

/* Number of changes of gates up to an age of the particle. */
int epoch_at(double t) {
    int count = 0;
    while (count < O.change_count && O.changes[count] - A.given->release <= t) count++;
    return count;
}

static int is_open(const Obstacle *o, int piece, double since) {
    return piece < 0 ? o->came <= since && o->went > since : came_of(piece) <= since && went_of(piece) > since;
}

/* Whether an obstacle exists in an epoch; an end shared by pieces does while any of them does. */
int is_there(int obstacle, int epoch) {
    if (!O.change_count) return 1;
    const Obstacle *o = O.all + obstacle;
    double since = epoch ? O.changes[epoch - 1] : -INFINITY;
    int there = is_open(o, NONE, since);
    for (int n = o->tips; n != NONE && !there; n = O.tips[n].next) there = is_open(o, n / 2, since);
    return there;
}

/* Give each end the belt and the material of a piece there that exists in an epoch: of the first one, but rather of one
   that always exists. */
void own_ends(int epoch) {
    double since = epoch ? O.changes[epoch - 1] : -INFINITY;
    for (int k = O.faces; k < O.count; k++) {
        Obstacle *o = O.all + k;
        int owner = NONE;
        for (int n = o->tips; n != NONE && o->met == END; n = O.tips[n].next) {
            int before = owner == NONE || (stays(n / 2) != stays(owner / 2) ? stays(n / 2) : n < owner);
            if (before && is_open(o, n / 2, since)) owner = n;
        }
        if (owner == NONE) continue;
        place_of_piece(o, owner / 2);
        o->turning = owner / 2 < O.faces ? 0.0 : turning_of(owner / 2);
    }
    O.owned_in = epoch;
}

static const Member *member_of(int set, int obstacle) {
    for (int m = set == NONE ? NONE : O.sets[set]; m != NONE; m = O.members[m].next)
        if (O.members[m].obstacle == obstacle) return O.members + m;
    return 0;
}

/* Whether an obstacle, or a face of a segment (0 left, 1 right), is in a set. */
int is_shared(int set, int obstacle, int face) {
    const Member *m = member_of(set, obstacle);
    return m && (m->faces & (1 << face)) != 0;
}

/* Whether an end (0, 1) of an arc is at the place of a set. */
int has_edge(int set, int obstacle, int edge) {
    const Member *m = member_of(set, obstacle);
    return m && (m->edges & (1 << edge)) != 0;
}

/* The other face of an arc, or -1. */
static int back_of(int circle) {
    if (circle < O.first_arc || circle >= O.first_arc + 2 * O.arcs) return NONE;
    return circle < O.first_arc + O.arcs ? circle + O.arcs : circle - O.arcs;
}

/* Whether something touches a circle without being met, since both are in one set: they are tangent there, and have no
   other point in common. For a mass point both faces of a piece are at the same place. */
int is_beside(int circle, int obstacle, int face) {
    int point = O.arcs && A.given->radius <= O.touch;
    for (int k = 0; k < 1 + point; k++) {
        int c = k ? back_of(circle) : circle;
        for (int m = c == NONE ? NONE : O.all[c].members; m != NONE; m = O.members[m].alike) {
            int set = O.members[m].set;
            if (is_shared(set, obstacle, face)) return 1;
            if (!point) continue;
            if (is_shared(set, obstacle, 1 - face)) return 1;
            int back = back_of(obstacle);
            if (back != NONE && is_shared(set, back, face)) return 1;
        }
    }
    return 0;
}

/* The corner that a mass point is in when it touches a face, or a circle, at a place: the number 2 tip + face of the
   sector beside the end there; else -1. */
int corner_at(int obstacle, int side, double x, double y) {
    int piece = obstacle, inside = side < 0;
    if (obstacle >= O.faces) {
        int bend = obstacle - O.first_arc;
        inside = bend >= O.arcs;
        if (inside) bend -= O.arcs;
        if (bend < 0 || bend >= O.bent) return NONE;
        piece = O.faces + bend;
    }
    for (int tip = 2 * piece; tip < 2 * piece + 2; tip++)
        if (MAX(fabs(x - O.tips[tip].x), fabs(y - O.tips[tip].y)) <= CLEAR * O.touch) return 2 * tip + inside;
    return NONE;
}

/* Whether a face, or a circle, is one of the two that bound the sector of a corner. */
int bounds(int corner, int obstacle, int side, int epoch) {
    int face = corner % 2 ? -1 : 1;
    Onward one = { face_of(corner / 4, face), face, 0 }, two = O.opposite[2 * epoch * O.tip_count + corner];
    return (one.obstacle == obstacle && (obstacle >= O.faces || one.side == side))
        || (two.obstacle == obstacle && (obstacle >= O.faces || two.side == side));
}
