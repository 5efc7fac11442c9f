/* Drag of still air on disks, which count as spheres, and on boxes and polygons, which count as spheres whose disk has
   their area: with Schiller's and Naumann's coefficient, as in `theory.drag`. What rides or sleeps is held against it.

   A step is split (Strang): half of what air does in it comes before the flight, half after it. So paths are
   parabolas between two steps, and of second order in the step. A blow comes with
   what air has done by then. */

#include "core.h"

#define PI 3.14159265358979323846
#define VISCOSITY 1.8e-5 /* Pa s; of air at 20 degrees */

/* Deceleration over speed, 1/s. */
static double relief(const Disk *d, double speed) {
    double r = d->broad, reynolds = 2 * r * speed * W.air / VISCOSITY, area = PI * r * r;
    if (reynolds >= 1000) return 0.22 * W.air * area * speed * d->inv_mass;
    return 6 * PI * VISCOSITY * r * (1 + 0.15 * pow(reynolds, 0.687)) * d->inv_mass;
}

/* Have air slow a disk down for the time up to t since it did last; before that, take it back. */
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

/* Begin a step of which this is the middle, once; what flies has its state noted as of its beginning. */
void begin_in_air(int i, double middle) {
    const Disk *d = W.disks + i;
    if (d->aired == d->t && !W.tracks[i].lasted) track_flying(i);
    slow_down(i, middle);
}
