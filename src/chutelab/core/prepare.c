/* From what a host says of a machine to what the core works with. */

#include "core.h"

#define PI 3.14159265358979323846

/* Radii, rad: pieces whose ends are no further apart and whose directions there differ by no more
   are one smooth surface, as one whose points are written with some digits is meant to be. */
#define JOINED 1e-3
#define SMOOTH 1e-2

/* m/s2; gravity for which bounds on speeds and times are written: others have `W.pace` of them. */
#define EARTH 9.81

/* Most sweeps of the contact solver in a step: with 60 a pile of 2,000 hardly comes to rest. */
#define SWEEPS 100
#define SWEEPS_ALONE 500

/* Whether a disk of radius r can touch both ends of an arc at a time, or nearly. */
static int is_narrow(const Surface *s, double r) {
    double half = 0.5 * s->extent;
    if (s->shape != ARC) return 0;
    return s->radius <= r || (half > 0.5 * PI && s->radius * sin(half) <= (1 + TOUCH) * r);
}

/* A piece is met in one place at a time: make two of each narrow arc. */
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

/* One end of a piece, and the unit vector by which the piece would go on there. */
static void at_end(const Surface *s, int end, double *place, double *onward) {
    double way = end ? 1 : -1;
    place[0] = s->end[2 * end];
    place[1] = s->end[2 * end + 1];
    onward[0] = way * (s->shape == SEGMENT ? s->tx : -(place[1] - s->y) / s->radius);
    onward[1] = way * (s->shape == SEGMENT ? s->ty : (place[0] - s->x) / s->radius);
}

/* Which piece goes on smoothly beyond an end: an arc, or beyond a segment an arc or circle; or -1. */
static int mate_of(int k, int end, double r) {
    const Surface *s = W.surfaces + k;
    double place[2], onward[2], other[2], back[2];
    at_end(s, end, place, onward);
    for (int m = 0; m < W.surface_count; m++) {
        const Surface *next = W.surfaces + m;
        if (m == k || next->shape == CIRCLE || (next->shape == SEGMENT && s->shape == SEGMENT))
            continue;
        for (int n = 0; n < 2; n++) {
            at_end(next, n, other, back);
            if (hypot(other[0] - place[0], other[1] - place[1]) <= JOINED * r
                && hypot(back[0] + onward[0], back[1] + onward[1]) <= SMOOTH) return m;
        }
    }
    for (int m = 0; m < W.surface_count; m++) {
        const Surface *next = W.surfaces + m;
        if (next->shape != CIRCLE || m == W.pulley) continue;
        double x = place[0] - next->x, y = place[1] - next->y, d = hypot(x, y);
        if (fabs(d - next->radius) <= JOINED * r
            && fabs(x * onward[0] + y * onward[1]) <= SMOOTH * d) return m;
    }
    return -1;
}

/* Ends in one place but for rounding are one point, of the first piece that ends there. */
static void share_ends(int k, double near) {
    Surface *s = W.surfaces + k;
    if (s->shape == CIRCLE) return;
    for (int m = 0; m < k; m++) {
        const Surface *first = W.surfaces + m;
        if (first->shape == CIRCLE) continue;
        for (int n = 0; n < 4; n++) {
            double *end = s->end + (n & 2);
            const double *other = first->end + 2 * (n & 1);
            if (fabs(end[0] - other[0]) > near || fabs(end[1] - other[1]) > near) continue;
            end[0] = other[0];
            end[1] = other[1];
        }
    }
}

/* The host has laid out the arrays and filled in what is marked [in]: fill in what follows. */
__attribute__((visibility("default"))) void prepare(void) {
    double least = INFINITY, most = 0, s = sin(W.ride_incline), c = cos(W.ride_incline);
    int alone = !W.interact;
    for (int i = 0; i < W.disk_count; i++) {
        Disk *d = W.disks + i;
        least = MIN(least, d->radius);
        most = MAX(most, d->radius);
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
        share_ends(k, TOUCHING * least);
        piece->gate = piece->opens > -INFINITY || piece->closes < INFINITY ? W.gate_count++ : -1;
        W.everything[k] = k;
    }
    for (int k = 0; k < W.surface_count; k++)
        for (int end = 0; end < 2; end++)
            W.surfaces[k].mates[end] = W.surfaces[k].shape == CIRCLE ? -1 : mate_of(k, end, least);
    for (int k = 0; k < 2 * W.surface_count; k++) {
        int mate = W.surfaces[k / 2].mates[k % 2], *of = W.surfaces[MAX(mate, 0)].mates;
        if (W.surfaces[k / 2].shape == CIRCLE || mate < 0 || W.surfaces[mate].shape != CIRCLE) continue;
        of[of[0] >= 0] = k / 2;
    }
    W.gx = 0;
    W.gy = -W.g;
    W.sweeps = alone ? SWEEPS_ALONE : SWEEPS;
    W.sleeps = !alone;
    W.smooth_x = alone ? 1e-5 : 1e-4;
    W.pace = W.g > 0 ? sqrt(W.g / EARTH) : 1;
    W.smooth_v = 1e-4 * W.pace;
    W.accurate = (alone ? 1e-15 : 3e-4) * W.pace;
}
