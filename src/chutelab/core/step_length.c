/* How long a step may be: what hops, turns, shakes or overlaps in it is followed closely enough. */

#include "core.h"

/* A crowd of which more than the share MANY_DEEP of the contacts are deeper than DEEP radii as a step begins takes shorter
   steps, down to LEAST_EASE of what hops allow: after each such step by SHORTEN, after others longer by LENGTHEN. Steps
   that no scene asks for are at most CHOSEN of what hops allow, or the usual one: with longer ones walls bear more of what
   fills a silo. The hops of corners that rotate have no such limit, as they are those of a few. */
#define DEEP 4.5e-3
#define MANY_DEEP 0.01
#define LEAST_EASE 0.5
#define CHOSEN 0.7
#define SHORTEN 0.98
#define LENGTHEN 1.01
/* Least number of steps per period of a surface that shakes: with at most FEW_CONTACTS particles so many that it throws
   what lies on it at its own speed to 1e-4, unless they are shorter than BRIEFEST, s; always so many that no impact is
   missed. */
#define FOLLOWED 200
#define BRIEFEST 5e-6
#define SEEN 8

/* Step of a disk by itself, s, at most `h`, in which it moves by no more than TURN of the room that an arc leaves it.
   That holds if the arc supports it, or did, or if it is at the opening and touches both ends. If it lies on another
   piece, a step may take it up to the arc. */
static double hollow_step(const Disk *d, double h) {
    double speed = sqrt(d->vx * d->vx + d->vy * d->vy) + W.g * h, nx, ny;
    if (speed * h <= TURN * W.room) return h;
    for (int k = 0; k < W.surface_count; k++) {
        const Surface *s = surface_at(k, d->t);
        double room = s->radius - d->radius;
        if (s->shape == SEGMENT || !(room > 0) || speed * h <= TURN * room) continue;
        if (square(d->x - s->x) + square(d->y - s->y) >= square(s->radius)) continue;
        double off = gap_to(s, d->x, d->y, d->radius, &nx, &ny) - TOUCH * d->radius;
        if (off < 0 || d->supports) h = MIN(h, MAX(TURN * room, off) / speed);
    }
    return h;
}

/* Height of a ledge up to which a joint counts as smooth for a disk by itself in a step, m. To close the gap at a ledge
   in one step gives the speed ledge / h. An impact at the edge of a ledge turns the path by sqrt(2 ledge / r), the angle
   at which the disk meets the edge: where the speed ledge / h is larger than such an impact gives, the step is short
   enough to resolve the impact. */
static double ledge_in(const Disk *d, double h) {
    double way = (sqrt(d->vx * d->vx + d->vy * d->vy) + W.g * h) * h;
    return MAX(2 * way * way / d->radius, TOUCHING * d->radius);
}

/* Longest step, s, in which shaking surfaces are followed. */
static double shaken_step(void) {
    double most = 1 / (SEEN * W.shakes);
    return W.high - W.low > FEW_CONTACTS ? most : MIN(most, MAX(1 / (FOLLOWED * W.shakes), BRIEFEST));
}

void set_step(double h) {
    W.step = h;
    W.soft = 2 * W.g * h;
    W.skip = SKIP / h;
}

/* Longest step, s, for two limits: disks inside arcs in a crowd hop no higher than HOP; and a corner, whose gap changes
   at an accelerated rate while its particle rotates, is not moved faster by that than by its weight (without gravity, by
   its weight on Earth). `h` is the length of the present step. */
double bent_step(double h) {
    double most = INFINITY, press = (W.g > 0 ? W.g : EARTH) + W.haste, u[3];
    for (const Contact *c = W.contacts; c < W.contacts + W.contact_count; c++) {
        const Disk *d = W.disks + c->i;
        if (c->turns > 0) most = MIN(most, hop_time(d, W.g + c->turns));
        if (!c->cornered) continue;
        relative(c, 1, u);
        double bends = closing_rate(c, u[0], h) - c->turns;
        /* The step is short enough for its weight already. */
        if (W.g > 0 && bends <= press) continue;
        most = MIN(most, MAX(hop_time(d, press) * press / MAX(bends, press), SHORTEST * W.usual));
    }
    return most;
}

/* Set which share of the longest step the next one of a crowd takes, by the overlaps that the last one has left: of pairs
   and of contacts with surfaces. */
void rate_overlaps(void) {
    int deep[2] = {0, 0}, all[2] = {0, 0};
    for (const Contact *c = W.contacts; c < W.contacts + W.contact_count; c++) {
        deep[c->j < 0] += c->gap < -DEEP * inner_of(c->i, c->j);
        all[c->j < 0]++;
    }
    W.ease *= deep[0] > MANY_DEEP * all[0] || deep[1] > MANY_DEEP * all[1] ? SHORTEN : LENGTHEN;
    W.ease = MIN(MAX(W.ease, LEAST_EASE), W.easiest);
}

/* Choose and set the length of a step, s, at most `W.dt`. */
double choose_step(void) {
    double press = W.g + W.haste + hastened();
    double h = hop_time(W.disks + W.smallest, press);
    for (int i = W.low; i < W.high && W.outline_count; i++) {
        const Disk *d = W.disks + i;
        /* In a crowd most that rotate fast are in flight. There only contacts shorten a step for that, see `bent_step`. */
        int turns = W.chosen == 0 && has_corners(d) && d->mode == FREE;
        h = MIN(h, hop_time(d, turns ? press + whirl_of(d) : press));
    }
    W.easiest = W.chosen > 0 ? MIN(MAX(CHOSEN, W.chosen / h), 1) : 1;
    h = MIN(MIN(W.ease, W.easiest) * h, W.dt);
    if (!W.interact && W.disks[W.low].mode == FREE) h = hollow_step(W.disks + W.low, h);
    if (W.hinges) h = hinge_step(h);
    if (W.shakes > 0) h = MIN(h, shaken_step());
    if (W.air > 0) h = MIN(h, air_step());
    W.usual = h;
    set_step(h);
    if (!W.interact) W.ledge = ledge_in(W.disks + W.low, h);
    return h;
}
