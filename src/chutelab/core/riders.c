/* Particles that the incoming belt carries by adhesion, and the gates that they and others may meet. */

#include "core.h"

/* rad between knots round the pulley: a cubic through them is off by rho angle^4 / 384, 9e-10 rho. */
#define ARC_ANGLE 0.024

/* Position and velocity of a rider: along the belt, then round the pulley, at constant speed. */
void ride_at(const Disk *d, double t, double *place) {
    double along = d->ride_x + d->ride_speed * (t - d->ride_from), rho = d->ride_rho;
    /* Angle from the top of the pulley, clockwise; where the belt meets the pulley it is -incline. */
    double phi = MAX(along, 0) / rho - W.ride_incline;
    double c = phi != 0 ? cos(phi) : 1, s = phi != 0 ? sin(phi) : 0;
    place[0] = rho * s + MIN(along, 0) * c;
    place[1] = rho * c - MIN(along, 0) * s;
    place[2] = d->ride_speed * c;
    place[3] = 0 - d->ride_speed * s;
}

/* Set whether a surface ignores a disk from t on: a gate closes on it, or it is on the side from which a one-sided
   surface lets it pass; or it is clear of such a surface again. In a crowd, a disk in contact may overlap by SUNK without
   being ignored. */
void spare(const Disk *d, const Surface *s, double t) {
    double place[4] = {d->x, d->y, 0, 0}, side = 0, deep = (W.interact ? SUNK : 1e-9) * d->radius;
    int comes = s->opens == t, *spared = spared_by(s, d);
    if (!comes && !s->one_sided && (s->opens > t || !*spared)) return;
    if (d->mode == RIDING) ride_at(d, t, place);
    double gap = chain_gap(s, d, place[0], place[1], t, &side);
    *spared = side < 0 || (comes ? gap < -deep : *spared && gap < 0);
}

/* When the next surface appears or vanishes, or its motion changes, s. */
double next_gate(double t) {
    double next = next_turn(t);
    for (int k = 0; k < W.surface_count; k++) {
        if (W.surfaces[k].opens > t) next = MIN(next, W.surfaces[k].opens);
        if (W.surfaces[k].closes > t) next = MIN(next, W.surfaces[k].closes);
    }
    return next;
}

/* Gap at t between a rider and the nearest surface that exists, is not its own and does not let it pass, and which one
   that is. `way` is how far the rider can go before it reaches any surface, including those that let it pass. */
static double ride_gap(const Disk *d, double t, int *which, double *way) {
    double place[4], nx, ny, least = INFINITY;
    *way = INFINITY;
    ride_at(d, t, place);
    for (int k = 0; k < W.surface_count; k++) {
        const Surface *s = surface_at(k, t);
        if (s->owner == W.ride_owner || t < s->opens || t >= s->closes) continue;
        if (is_spared(s, d) && !s->one_sided) continue;
        double gap = gap_to(s, place[0], place[1], d->radius, &nx, &ny);
        *way = MIN(*way, fabs(gap));
        if (gap < least && !is_spared(s, d)) {
            least = gap;
            *which = k;
        }
    }
    return least;
}

/* Set when a ride ends: where cos phi = v^2 / (g rho); at once where the belt meets the pulley, if that is more than cos
   phi there; or where it meets another surface. Its gap changes by no more than the path, so the search advances by the
   gap, and stops where a gate changes. */
void plan_ride(Disk *d, double from) {
    double v = d->ride_speed, rho = d->ride_rho, c = W.g > 0 ? v * v / (W.g * rho) : 1, t = from;
    double turn = c < cos(W.ride_incline) ? acos(c) + W.ride_incline : 0;
    int which = -1;
    double way;
    d->ride_from = from;
    d->ride_met = -1;
    d->ride_to = INFINITY;
    if (v <= 0) return;
    d->ride_to = from + (MAX(-d->ride_x, 0) + rho * turn) / v;
    for (double safe = from; t < d->ride_to;) {
        for (int k = 0; k < W.surface_count; k++)
            if (W.surfaces[k].gate >= 0) spare(d, W.surfaces + k, t);
        double gap = ride_gap(d, t, &which, &way);
        if (gap <= 0) {
            /* Bisect to the last place that is free. */
            for (double mid = 0.5 * (safe + t); mid > safe && mid < t; mid = 0.5 * (safe + t)) {
                if (ride_gap(d, mid, &which, &way) <= 0) t = mid;
                else safe = mid;
            }
            d->ride_to = safe;
            d->ride_met = which;
            return;
        }
        safe = t;
        t = MIN(t + MAX(way, 1e-3 * d->radius) / (v + W.fastest), next_gate(t));
    }
}

/* Set a rider on the parabola that has its position now and at the end of the step. */
void ride_on(Disk *d, double t, double end) {
    double now[4], then[4], h;
    end = MIN(end, d->ride_to);
    ride_at(d, t, now);
    ride_at(d, end, then);
    h = end - t;
    d->x = now[0];
    d->y = now[1];
    d->t = t;
    d->vx = h > 0 ? (then[0] - now[0]) / h - 0.5 * W.gx * h : now[2];
    d->vy = h > 0 ? (then[1] - now[1]) / h - 0.5 * W.gy * h : now[3];
    d->spin = 0;
}

/* Write a knot of a ride at t. The speed is constant, so the belt does the work against gravity. */
static void ride_knot(int i, double t) {
    Disk *d = W.disks + i;
    double place[4], *knot = W.tracks[i].knot, entries[3] = {0, 0, 0};
    ride_at(d, t, place);
    entries[0] = -d->mass * (W.gx * (place[0] - knot[1]) + W.gy * (place[1] - knot[2]));
    if (entries[0] != 0) book(d->entries, 0, W.ride_owner, entries);
    d->x = place[0];
    d->y = place[1];
    d->vx = place[2];
    d->vy = place[3];
    d->spin = 0;
    d->t = t;
    bear_ride(i);
    knot_now(i);
}

void write_ride(int i, double until) {
    const Disk *d = W.disks + i;
    double top = d->ride_from - d->ride_x / d->ride_speed;
    if (d->ride_speed > 0 && until > top) {
        int pieces = 1 + (int)((until - top) * d->ride_speed / d->ride_rho / ARC_ANGLE);
        if (top > W.tracks[i].knot[0]) ride_knot(i, top);
        for (int n = 1; n < pieces; n++) ride_knot(i, top + (until - top) * n / pieces);
    }
    if (until > W.tracks[i].knot[0]) ride_knot(i, until);
}

/* Greatest number of knots that the rest of a ride may take. */
int ride_knots(const Disk *d) {
    double most = 1.6 + MAX(W.ride_incline, 0);
    return d->mode <= RIDING && d->ride_rho > 0 ? 4 + (int)(most / ARC_ANGLE) : 0;
}
