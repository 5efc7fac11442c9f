/* Drag of still air on particles: the coefficient of Schiller and Naumann for spheres, as in `theory.drag`. Disks count
   as spheres of their radius, boxes and polygons as spheres whose disk has their area. Riders and sleepers feel no drag.

   A step is split (Strang): drag acts for half of the step before the flight and for the other half after it. So paths
   are parabolas between two steps, and of second order in the step. At an impact, drag is applied up to its instant
   first. */

#include "core.h"

#define PI 3.14159265358979323846
#define VISCOSITY 1.8e-5 /* Pa s; of air at 20 degrees */
/* Greatest share of its speed that drag takes from a particle in a step: where it falls as fast as air lets it, halves of
   a step are off by a twelfth of the square of that. */
#define TAKES 0.05

/* Deceleration divided by speed, 1/s. Newton's constant coefficient 0.44 holds from a Reynolds number of 1000 on. */
static double relief(const Disk *d, double speed) {
    double r = d->broad, reynolds = 2 * r * speed * W.air / VISCOSITY, area = PI * r * r;
    if (reynolds >= 1000) return 0.22 * W.air * area * speed * d->inv_mass;
    return 6 * PI * VISCOSITY * r * (1 + 0.15 * pow(reynolds, 0.687)) * d->inv_mass;
}

/* Longest step, s, in which drag takes no more than that from any particle in flight. */
double air_step(void) {
    double most = INFINITY;
    for (EACH_LIVE(i)) {
        const Disk *d = W.disks + i;
        if (d->mode == FREE) most = MIN(most, TAKES / relief(d, sqrt(square(d->vx) + square(d->vy))));
    }
    return most;
}

/* Apply the drag of the time since it last acted on a disk up to t; if t is earlier, undo it. */
void slow_down(int i, double t) {
    Disk *d = W.disks + i;
    double h = t - d->aired, speed = sqrt(square(d->vx) + square(d->vy));
    if (W.air == 0 || h == 0) return;
    d->aired = t;
    double left = exp(-relief(d, speed * exp(-0.5 * relief(d, speed) * h)) * h);
    double x = left * d->vx, y = left * d->vy;
    double lost = 0.5 * d->mass * ((d->vx - x) * (d->vx + x) + (d->vy - y) * (d->vy + y));
    d->vx = x;
    d->vy = y;
    d->entries[2] += lost;
    W.air_loss += lost;
}

/* Apply drag at the beginning of a step up to its middle, once; for a particle in flight, its state is noted first. */
void begin_in_air(int i, double middle) {
    const Disk *d = W.disks + i;
    if (d->aired == d->t && !W.tracks[i].lasted) track_flying(i);
    slow_down(i, middle);
}
