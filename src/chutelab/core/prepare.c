/* Prepare a run: from what the host says of a machine, derive what the core works with. */

#include <string.h>
#include "core.h"
#include "trig.h"

/* rad, and share of a curvature; smaller differences of directions, or of curvatures, count as none. */
#define ALIKE 1e-9

/* Pieces that end at one point join smoothly if their directions there differ by at most IN_LINE (rad): a larger bend is
   one, and no step removes the error of passing it smoothly. Ends that are apart, by up to JOINED radii, are meant as one
   point and written with few digits; so may their directions be, up to SMOOTH. */
#define IN_LINE 1e-6
#define JOINED 1e-3
#define SMOOTH 1e-2

/* Greatest number of sweeps of the contact solver in a step, in a crowd and for a disk by itself. With 60 a pile of 2,000
   hardly comes to rest. */
#define SWEEPS 100
#define SWEEPS_ALONE 500

/* Whether a disk of radius r can touch both ends of an arc at once, or nearly so. */
static int is_narrow(const Surface *s, double r) {
    double half = 0.5 * s->extent;
    if (s->shape != ARC) return 0;
    return s->radius <= r || (half > 0.5 * PI && s->radius * sin(half) <= (1 + TOUCH) * r);
}

/* Split each narrow arc in two: the engine looks for one contact of a disk with a piece. */
static void split_arcs(double r) {
    int narrow = 0;
    for (int k = 0; k < W.surface_count; k++) {
        Surface *s = W.surfaces + k;
        s->material = k;
        if (s->shape == ARC && s->extent >= 2 * PI) s->shape = CIRCLE;
        narrow += is_narrow(s, r);
    }
    int to = W.surface_count += narrow;
    for (int from = to - narrow - 1; to > from + 1; from--) {
        Surface *s = W.surfaces + from;
        double half = 0.5 * s->extent;
        int parts = 1 + is_narrow(s, r);
        for (int n = parts - 1; n >= 0; n--) {
            Surface *part = W.surfaces + --to;
            *part = *s;
            if (parts == 1) continue;
            part->begin = s->begin + n * half;
            part->extent = half;
        }
    }
}

static void widen(Surface *s, double x, double y) {
    s->box[0] = MIN(s->box[0], x);
    s->box[1] = MIN(s->box[1], y);
    s->box[2] = MAX(s->box[2], x);
    s->box[3] = MAX(s->box[3], y);
}

static void derive(Surface *s) {
    double r = s->radius;
    if (s->shape == SEGMENT) {
        s->end[0] = s->x;
        s->end[1] = s->y;
        s->end[2] = s->x + s->length * s->tx;
        s->end[3] = s->y + s->length * s->ty;
    } else if (s->shape == ARC) {
        double middle = s->begin + 0.5 * s->extent, last = s->begin + s->extent;
        s->tx = cos(middle);
        s->ty = sin(middle);
        s->cos_half = cos(0.5 * s->extent);
        s->end[0] = s->x + r * cos(s->begin);
        s->end[1] = s->y + r * sin(s->begin);
        s->end[2] = s->x + r * cos(last);
        s->end[3] = s->y + r * sin(last);
    }
    s->box[0] = s->box[1] = INFINITY;
    s->box[2] = s->box[3] = -INFINITY;
    if (s->shape != CIRCLE) {
        widen(s, s->end[0], s->end[1]);
        widen(s, s->end[2], s->end[3]);
    }
    if (s->shape == SEGMENT) return;
    for (int quarter = 0; quarter < 4; quarter++) {
        double along = fmod(0.5 * PI * quarter - s->begin, 2 * PI);
        if (along < 0) along += 2 * PI;
        if (s->shape == ARC && along > s->extent) continue;
        widen(s, s->x + r * (quarter == 0) - r * (quarter == 2),
              s->y + r * (quarter == 1) - r * (quarter == 3));
    }
}

/* One end of a piece, and the unit vector in which the piece would continue there. */
static void at_end(const Surface *s, int end, double *place, double *onward) {
    double way = end ? 1 : -1;
    place[0] = s->end[2 * end];
    place[1] = s->end[2 * end + 1];
    onward[0] = way * (s->shape == SEGMENT ? s->tx : -(place[1] - s->y) / s->radius);
    onward[1] = way * (s->shape == SEGMENT ? s->ty : (place[0] - s->x) / s->radius);
}

/* Key of an end for sorting: its coordinate in an oblique direction, along which few joints have the same value. Keys of
   two ends differ by at most 1.2 times their distance. */
static double rank(int end) {
    const double *place = W.surfaces[end / 2].end + 2 * (end % 2);
    return place[0] + 0.61803398875 * place[1];
}

/* Sort the ends of all segments and arcs (2 k and 2 k + 1 of surface k) into `W.ends` by `rank`, and list the circles
   except the drive pulley behind them. */
static void sort_ends(void) {
    W.end_count = 0;
    for (int k = 0; k < W.surface_count; k++)
        for (int n = 0; n < 2 && W.surfaces[k].shape != CIRCLE; n++) W.ends[W.end_count++] = 2 * k + n;
    W.circles = W.ends + W.end_count;
    W.circle_count = 0;
    for (int k = 0; k < W.surface_count; k++)
        if (W.surfaces[k].shape == CIRCLE && k != W.pulley) W.circles[W.circle_count++] = k;
    for (int step = W.end_count / 2; step > 0; step = step == 2 ? 1 : step * 5 / 11)
        for (int row = step; row < W.end_count; row++) {
            int end = W.ends[row], to = row;
            for (; to >= step && rank(W.ends[to - step]) > rank(end); to -= step) W.ends[to] = W.ends[to - step];
            W.ends[to] = end;
        }
}

/* The first entry of `W.ends` that may be at the place of an end; the last one has no larger rank than `last`. */
static int first_near(int end, double r, double *last) {
    double first = rank(end) - 2 * JOINED * r;
    int low = 0, high = W.end_count;
    *last = rank(end) + 2 * JOINED * r;
    while (low < high) {
        int middle = (low + high) / 2;
        if (rank(W.ends[middle]) < first) low = middle + 1;
        else high = middle;
    }
    return low;
}

/* Whether it moves as its file says, from the beginning on: no hinge, trigger or hand moves it. */
static int is_driven(const Mover *m) { return !(m->inertia > 0) && !m->steered && m->begins == 0; }

/* Whether two pieces stay where they are to each other: they are of one surface, do not move, or are driven alike. */
static int move_alike(const Surface *s, const Surface *next) {
    const Mover *a = W.movers + MAX(s->mover, 0), *b = W.movers + MAX(next->mover, 0);
    if (s->mover == next->mover) return 1;
    if (s->mover < 0 || next->mover < 0 || !is_driven(a) || !is_driven(b)) return 0;
    if (a->turn != b->turn || (a->turn != 0 && (a->pivot[0] != b->pivot[0] || a->pivot[1] != b->pivot[1]))) return 0;
    return a->by[0] == b->by[0] && a->by[1] == b->by[1] && a->frequency == b->frequency && a->phase == b->phase
        && a->way[0] == b->way[0] && a->way[1] == b->way[1] && a->from == b->from && a->lasts == b->lasts;
}

/* Whether two ends that are so far apart (m) and bend by so much (rad) join smoothly. */
static int is_smooth(double off, double bend, double r) {
    return off <= JOINED * r && bend <= (off > ALIKE * r ? SMOOTH : IN_LINE);
}

/* Set which piece continues smoothly beyond an end, or -1. */
static void find_mate(int k, int end, double r) {
    Surface *s = W.surfaces + k;
    double place[2], onward[2], other[2], back[2], last;
    int mate = W.surface_count;
    s->mates[end] = -1;
    s->ledges[end] = 0;
    if (s->shape == CIRCLE) return;
    at_end(s, end, place, onward);
    for (int row = first_near(2 * k + end, r, &last); row < W.end_count; row++) {
        int m = W.ends[row] / 2;
        const Surface *next = W.surfaces + m;
        if (rank(W.ends[row]) > last) break;
        if (m == k || m >= mate) continue;
        if (!move_alike(s, next) || next->one_sided != s->one_sided) continue;
        at_end(next, W.ends[row] % 2, other, back);
        double off = hypot(other[0] - place[0], other[1] - place[1]);
        if (!is_smooth(off, hypot(back[0] + onward[0], back[1] + onward[1]), r)) continue;
        s->mates[end] = mate = m;
        s->ledges[end] = off;
    }
    if (mate < W.surface_count) return;
    for (int n = 0; n < W.circle_count; n++) {
        const Surface *next = W.surfaces + W.circles[n];
        double x = place[0] - next->x, y = place[1] - next->y, reach = next->radius + JOINED * r;
        if (!move_alike(s, next) || s->one_sided) continue;
        if (fabs(x) > reach || fabs(y) > reach) continue;
        double d = hypot(x, y), off = fabs(d - next->radius);
        if (!is_smooth(off, fabs(x * onward[0] + y * onward[1]) / d, r)) continue;
        s->mates[end] = W.circles[n];
        s->ledges[end] = off;
        return;
    }
}

/* Move an end to the end of the first piece that ends at the same place within rounding, so that both are one point. */
static void share_end(int k, int n, double near, double r) {
    double *end = W.surfaces[k].end + 2 * n, last;
    int first = 2 * k;
    for (int row = first_near(2 * k + n, r, &last); row < W.end_count; row++) {
        const double *other = W.surfaces[W.ends[row] / 2].end + 2 * (W.ends[row] % 2);
        if (rank(W.ends[row]) > last) break;
        if (!move_alike(W.surfaces + k, W.surfaces + W.ends[row] / 2)) continue;
        if (W.ends[row] < first && fabs(end[0] - other[0]) <= near && fabs(end[1] - other[1]) <= near)
            first = W.ends[row];
    }
    if (first == 2 * k) return;
    end[0] = W.surfaces[first / 2].end[2 * (first % 2)];
    end[1] = W.surfaces[first / 2].end[2 * (first % 2) + 1];
}

/* Curvature of a piece as it is followed outwards at an end, 1/m; positive to the left. */
static double curl_of(const Surface *s, int end) {
    return s->shape == SEGMENT ? 0 : (end ? -1 : 1) / s->radius;
}

/* Set the crown of an end: the unit vector to the middle of that half of its rim that belongs to the left side of the
   piece (of an arc, its outside); the other half belongs to the other side. At a free end it is the normal on that side.
   Where other pieces end at the same point, a disk rolls round it only if the angle between two neighbours is above pi:
   then all of that rim, even if it is wider than a quarter turn, belongs to the side that faces it, and its middle
   bisects that angle. */
static void find_crown(int k, int n, double r) {
    Surface *s = W.surfaces + k;
    double place[2], out[2], there[2], back[2], last, least = INFINITY, most = -INFINITY;
    double sense = (s->shape == SEGMENT) == n ? 1 : -1, lies[2][2], *crown = s->crown + 2 * n;
    at_end(s, n, place, out);
    crown[0] = -sense * out[1];
    crown[1] = sense * out[0];
    s->beside[2 * n] = s->beside[2 * n + 1] = -1;
    for (int row = first_near(2 * k + n, r, &last); row < W.end_count && rank(W.ends[row]) <= last; row++) {
        const Surface *next = W.surfaces + W.ends[row] / 2;
        int end = W.ends[row] % 2;
        at_end(next, end, there, back);
        if (W.ends[row] == 2 * k + n || there[0] != place[0] || there[1] != place[1]) continue;
        if (!move_alike(s, next) || next->there == ABSENT) continue;
        double left = back[0] * s->ty - back[1] * s->tx;
        int corner = 2 * n + (left < 0);
        double narrow = (out[0] * back[0] + out[1] * back[1]) / fabs(left);
        if (s->shape == SEGMENT && fabs(left) > ALIKE && (s->beside[corner] < 0 || narrow > s->hollows[corner])) {
            s->hollows[corner] = narrow;
            s->beside[corner] = W.ends[row] / 2;
        }
        double bends = curl_of(next, end) - curl_of(s, n);
        double turn = atan2(out[0] * back[1] - out[1] * back[0], out[0] * back[0] + out[1] * back[1]);
        if (fabs(turn) <= ALIKE) {
            if (fabs(bends) <= ALIKE * fabs(curl_of(s, n))) continue;
            turn = bends > 0 ? 0 : 2 * PI;
        } else if (turn < 0) turn += 2 * PI;
        for (int side = 0; side < 2; side++) {
            if (side ? turn <= most : turn >= least) continue;
            lies[side][0] = back[0];
            lies[side][1] = back[1];
        }
        least = MIN(least, turn);
        most = MAX(most, turn);
    }
    int right = least < PI - ALIKE;
    if (least == INFINITY || (right && most > PI + ALIKE)) return;
    double way = right ? -1 : 1;
    const double *other = lies[right];
    crown[0] += sense * (other[1] - way * (out[0] + other[0]));
    crown[1] -= sense * (other[0] + way * (out[1] + other[1]));
}

/* Reserve the arrays that the host fills in. */
EXPORT int lay_out_world(void) {
    W.material_count = W.surface_count;
    RESERVE(W.disks, W.disk_count);
    RESERVE(W.surfaces, 2.0 * W.surface_count);
    RESERVE(W.pairs, (double)W.kind_count * (W.kind_count + W.material_count));
    RESERVE(W.movers, W.mover_count);
    RESERVE(W.triggers, W.trigger_count);
    RESERVE(W.joints, W.joint_count);
    RESERVE(W.outlines, 2.0 * W.outline_count);
    return has_room();
}

static void make_near_room(int room) {
    W.near_room = room;
    RESERVE(W.near, 2.0 * room);
    RESERVE(W.near_links, 2.0 * room);
}

/* Make room for contacts; those of the step before and those of sleepers are kept. */
static void make_contact_room(int room) {
    const Contact *old = W.earlier;
    const Frozen *frozen = W.frozen;
    const int *links = W.frozen_links;
    W.contact_room = room;
    RESERVE(W.contacts, room);
    RESERVE(W.earlier, room);
    RESERVE(W.links, 2.0 * room);
    RESERVE(W.frozen, 2.0 * room);
    RESERVE(W.frozen_links, 4.0 * room);
    RESERVE(W.borders, 2.0 * room);
    W.border_count = -1;
    RESERVE(W.rows, room + 3.0 * W.mover_count);
    RESERVE(W.levers, W.outline_count || W.mover_count ? room + 3.0 * W.mover_count : 0);
    W.four_room = W.interact ? room / 4 : 0;
    RESERVE(W.fours, W.four_room);
    RESERVE(W.roll_fours, W.four_room);
    RESERVE(W.lever_fours, W.outline_count || W.mover_count ? W.four_room : 0);
    if (has_room() && W.earlier_count) memcpy(W.earlier, old, W.earlier_count * sizeof(Contact));
    if (!has_room() || !W.frozen_count) return;
    memcpy(W.frozen, frozen, W.frozen_count * sizeof(Frozen));
    memcpy(W.frozen_links, links, 2 * W.frozen_count * sizeof(int));
}

/* Double the room for states of hinges; return whether there is memory. */
int stretch_swings(void) {
    W.swing_work = stretch(W.swing_work, 3 * W.swing_count, 3 * W.swing_room, sizeof *W.swing_work);
    return W.swing_work && STRETCH(W.swings, W.swing_count, W.swing_room);
}

/* Double the room for what is full. */
int make_room(int full) {
    if (full == FULL_NEAR) make_near_room(2 * W.near_room);
    if (full == FULL_CONTACTS) make_contact_room(2 * W.contact_room);
    if (full == FULL_KNOTS) STRETCH(W.knots, W.knot_count, W.knot_room);
    if (full == FULL_SWINGS) stretch_swings();
    if (full == FULL_TOTALS) STRETCH(W.totals, W.total_count, W.total_room);
    if (full == FULL_EVENTS) STRETCH(W.events, W.event_count, W.event_room);
    return has_room();
}

/* Reserve all arrays that the core works with, except `spared`. */
static int lay_out_work(void) {
    int n = W.disk_count, crowd = W.interact, room = 2 * W.surface_count, rides = 0;
    for (int i = 0; i < n; i++) rides |= W.disks[i].rides;
    for (W.bucket_count = 1; crowd && W.bucket_count <= 4 * n + 16;) W.bucket_count *= 2;
    W.cell_room = crowd ? 12 * n + 64 : 1;
    RESERVE(W.tracks, n);
    RESERVE(W.balance, crowd ? 10.0 * n : 0);
    RESERVE(W.solver_bodies, n + 1.0 + W.mover_count);
    RESERVE(W.edges, 3.0 * W.outline_count);
    RESERVE(W.poses, W.outline_count ? 3.0 * n : 0);
    RESERVE(W.light_bodies, n + 1.0 + W.mover_count);
    RESERVE(W.joint_rows, W.joint_row_count);
    RESERVE(W.joint_matrix, (double)W.joint_row_count * W.joint_row_count);
    RESERVE(W.waits, crowd ? (double)WAITS * n : WAITS);
    RESERVE(W.books, 3.0 * (W.owner_count + 1));
    RESERVE(W.drives, W.owner_count);
    RESERVE(W.cells, W.cell_room);
    RESERVE(W.heads, W.bucket_count);
    RESERVE(W.heap, n);
    RESERVE(W.queue, n + 1);
    RESERVE(W.moved, n);
    RESERVE(W.found, 2.0 * n);
    RESERVE(W.live, n);
    RESERVE(W.nearby, (double)MAX_NEARBY * n);
    RESERVE(W.everything, room);
    RESERVE(W.ends, 2.0 * room);
    W.knot_room = (rides ? 100 : 30) * n + 200;
    W.event_room = 40 * n + 1200;
    W.total_room = crowd ? 1024 : 1;
    W.swing_room = W.hinges ? 1024 + 8 * W.mover_count : 0;
    RESERVE(W.swings, W.swing_room);
    RESERVE(W.swing_work, 3.0 * W.swing_room);
    W.knots = set_apart(W.knot_room, sizeof *W.knots);
    RESERVE(W.totals, W.total_room);
    W.events = set_apart(W.event_room, sizeof *W.events);
    make_contact_room(8 * n + 16);
    make_near_room(crowd ? 16 * n + 16 : 1);
    return has_room();
}

static double least_radius(void) {
    double least = INFINITY;
    for (int i = 0; i < W.disk_count; i++) least = MIN(least, W.disks[i].radius);
    return least;
}

/* Set the crowns of pieces that do not move, by the pieces that exist: those of a moving one exist together. */
void find_crowns(void) {
    double least = least_radius();
    for (int k = 0; k < 2 * W.surface_count; k++)
        if (W.surfaces[k / 2].shape != CIRCLE && W.surfaces[k / 2].mover < 0) find_crown(k / 2, k % 2, least);
}

/* Find which pieces continue where another one ends. A moving piece is only joined to those that move alike. */
void join_surfaces(void) {
    double least = least_radius();
    for (int k = 0; k < W.surface_count; k++) W.surfaces[k].mover = find_mover(W.surfaces + k);
    sort_ends();
    for (int k = 0; k < 2 * W.surface_count; k++)
        if (W.surfaces[k / 2].shape != CIRCLE) share_end(k / 2, k % 2, TOUCHING * least, least);
    for (int k = 0; k < W.surface_count; k++)
        for (int end = 0; end < 2; end++) {
            find_mate(k, end, least);
            if (W.surfaces[k].shape != CIRCLE) find_crown(k, end, least);
        }
    for (int k = 0; k < 2 * W.surface_count; k++) {
        int mate = W.surfaces[k / 2].mates[k % 2], *of = W.surfaces[MAX(mate, 0)].mates;
        if (W.surfaces[k / 2].shape == CIRCLE || mate < 0 || W.surfaces[mate].shape != CIRCLE) continue;
        W.surfaces[mate].ledges[of[0] >= 0] = W.surfaces[k / 2].ledges[k % 2];
        of[of[0] >= 0] = k / 2;
    }
}

/* Let the pieces of a one-sided surface share a column of `spared` if each begins where the one before ends. */
static void chain_pieces(double near) {
    for (int k = 1; k < W.surface_count; k++) {
        Surface *s = W.surfaces + k, *last = s - 1;
        int meets = 0;
        if (!s->one_sided || s->owner != last->owner || s->opens != last->opens || s->shape != last->shape) continue;
        for (int n = 0; n < 4; n++) {
            const double *a = s->end + n / 2 * 2, *b = last->end + n % 2 * 2;
            meets |= fabs(a[0] - b[0]) <= near && fabs(a[1] - b[1]) <= near;
        }
        if (!meets) continue;
        s->gate = last->gate;
        s->chain = last->chain;
        last->chain = k;
    }
}

/* List the joints of each disk, and the rows of each joint. */
static void join_disks(void) {
    int row = 0;
    for (int i = 0; i < W.disk_count; i++) W.disks[i].tie = -1;
    for (int n = 0; n < W.joint_count; n++) {
        Joint *j = W.joints + n;
        j->row = row;
        W.joint_rows[row++].joint = n;
        if (j->kind == PIN) W.joint_rows[row++].joint = n;
        W.passes |= j->kind == ROD || j->kind == PIN;
        for (int end = 0; end < 1 + (j->other >= 0); end++) {
            Disk *d = W.disks + (end ? j->other : j->particle);
            j->next[end] = d->tie;
            d->tie = 2 * n + end;
        }
    }
}

/* Set the edges of a particle, the radius of the largest circle round its centre that no edge cuts, and that of the
   circle of its area. */
static void measure(Disk *d) {
    const double *p = W.outlines + 2 * d->outline;
    double twice = 0, *edge = W.edges + 3 * d->outline;
    d->inner = d->broad = d->radius;
    for (int n = 0; n < d->corners; n++, edge += 3) {
        const double *a = p + 2 * n, *b = p + 2 * ((n + 1) % d->corners);
        double x = b[0] - a[0], y = b[1] - a[1], cross = a[0] * y - a[1] * x, length = sqrt(x * x + y * y);
        d->inner = MIN(d->inner, cross / length);
        twice += cross;
        edge[0] = y / length;
        edge[1] = -x / length;
        edge[2] = length;
    }
    if (d->corners) d->broad = sqrt(0.5 * twice / PI);
}

/* Prepare a run after the host has filled in what is marked [in]. Return 0 if there is no memory. */
EXPORT int prepare(void) {
    W.passes = W.hinges = W.joint_row_count = 0;
    for (int i = 0; i < W.kind_count * W.kind_count; i++)
        W.passes |= pair_of(i / W.kind_count, i % W.kind_count)->restitution < 0;
    for (int k = 0; k < W.mover_count; k++) W.hinges += W.movers[k].inertia > 0;
    /* Hinges, triggers, joints and corners are only solved with all disks together. */
    if (W.hinges || W.trigger_count || W.joint_count || W.outline_count) W.interact = 1;
    for (int k = 0; k < W.trigger_count; k++) W.triggers[k].t = INFINITY;
    for (Mover *m = W.movers; m < W.movers + W.mover_count; m++) {
        if (!m->inertia) m->rate = m->turn;
        m->begins = is_triggered(m->surface, STARTS) ? INFINITY : 0;
    }
    for (int n = 0; n < W.joint_count; n++) W.joint_row_count += 1 + (W.joints[n].kind == PIN);
    if (!lay_out_work()) return 0;
    join_disks();
    double least = INFINITY, most = 0, s = sin(W.ride_incline), c = cos(W.ride_incline);
    int alone = !W.interact;
    for (int i = 0; i < W.disk_count; i++) {
        Disk *d = W.disks + i;
        least = MIN(least, d->radius);
        most = MAX(most, d->radius);
        measure(d);
        if (!d->rides) continue;
        d->ride_x = d->x * c + d->y * s;
        d->ride_rho = d->y * c - d->x * s;
        d->ride_speed = d->vx * c + d->vy * s;
    }
    split_arcs(most);
    W.gate_count = 0;
    for (int k = 0; k < W.surface_count; k++) {
        Surface *piece = W.surfaces + k;
        derive(piece);
        int goes = piece->closes < INFINITY || is_triggered(piece->owner, GOES);
        piece->gate = piece->opens > -INFINITY || goes || piece->one_sided ? W.gate_count++ : -1;
        piece->chain = k;
        memcpy(piece->swept, piece->box, sizeof piece->swept);
        W.everything[k] = k;
    }
    chain_pieces(TOUCHING * least);
    RESERVE(W.spared, (double)W.disk_count * W.gate_count);
    if (!has_room()) return 0;
    for (int k = 0; k < W.surface_count; k++) W.surfaces[k].there = THERE;
    join_surfaces();
    for (int k = 0; k < W.surface_count; k++)
        if (W.surfaces[k].mover >= 0) prepare_mover(W.surfaces + k);
    W.ledge = INFINITY;
    sin_cos(-W.tilt, W.up, W.up + 1);
    W.gx = -W.g * W.up[0];
    W.gy = -W.g * W.up[1];
    W.sweeps = alone ? SWEEPS_ALONE : SWEEPS;
    W.sleeps = !alone;
    W.smooth_x = alone ? 2e-7 : 1e-4;
    W.hops = alone ? 0 : 1;
    W.pace = W.g > 0 ? sqrt(W.g / EARTH) : 1;
    W.smooth_v = 1e-4 * W.pace;
    W.accurate = (alone ? 1e-15 : 3e-4) * W.pace;
    /* Sweeps end at a tenth of the speed below which disks count as at rest, else their remaining errors would keep a
       pile awake. */
    if (!alone && W.g > 0) W.accurate = 0.1 * REST * sqrt(W.g * least);
    for (int k = 0; k < W.mover_count; k++)
        if (W.movers[k].inertia > 0) prepare_hinge(W.movers + k);
    return 1;
}
