/* The machine for the exact engine: faces and circles that can be met. */

#include <stdlib.h>
#include <string.h>
#include "exact_pieces.h"

/* Margin of the boxes of faces and arcs, in `touch`. */
#define BOX_TOUCHES 64.0


Obstacles O;

Part *parts;
int part_count, are_points;
const Arc **bends;
int *bend_source;
int *order, *at_spot, *next_there;
double *xs;

static double *arena, *arena_end;

int arena_full;

/* Take room from the arena; if there is too little, note that more is needed. */
void *take_room(double count, int size) {
    double *found = arena, doubles = ceil(count * size / 8.0);
    if (doubles > arena_end - arena) {
        arena_full = 1;
        return 0;
    }
    arena += (int)doubles;
    return found;
}

static int by_x(const void *one, const void *other) {
    int a = *(const int *)one, b = *(const int *)other;
    return xs[a] < xs[b] ? -1 : xs[a] > xs[b] ? 1 : a - b;
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
int before(double x) {
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

/* Make room for the ends of all pieces and find them, sorted by place. */
static int list_tips(void) {
    O.tip_count = 2 * (part_count + O.bent);
    O.tips = take_room(O.tip_count, sizeof *O.tips);
    xs = take_room(O.tip_count, sizeof *xs);
    order = take_room(O.tip_count, sizeof *order);
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
    O.changes = take_room(2 * pieces, sizeof *O.changes);
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
    O.all = take_room(most, sizeof *O.all);
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
    forget_shared();
    arena = E.room, arena_end = E.room + E.room_size, arena_full = 0;
    parts = take_room(E.segment_count, sizeof *parts);
    bends = take_room(E.arc_count, sizeof *bends);
    bend_source = take_room(E.arc_count, sizeof *bend_source);
    if (arena_full) return 0;
    are_points = !(first->radius > 0.0);
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
    } while (cut_parts(near) || (are_points && cut_bends(near)));
    if (arena_full) return 0;
    int spots = O.tip_count;
    number_spots(near);
    at_spot = take_room(spots, sizeof *at_spot);
    next_there = take_room(spots, sizeof *next_there);
    if (arena_full) return 0;
    for (int n = 0; n < spots; n++) at_spot[n] = NONE;
    drop_doubles();
    if (!list_changes()) return 0;
    find_rests(near);
    if (!list_obstacles(!are_points)) return 0;
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
