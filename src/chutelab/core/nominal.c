/* The nominal particle up to the line of the plate: the geometry of the machine is measured from its impact. */

#include "plan.h"

/* Time at which gap + rate t + acceleration t^2/2 crosses zero downwards; NaN or an infinity if it never does.

   A parabola crosses any level downwards at most once, with the slope -S, S^2 = rate^2 - 2 acceleration gap. Of both
   forms of the root, the one without cancellation is used. */
double falls_below(double gap, double rate, double acceleration) {
    double span = fabs(rate) + sqrt(rate * rate - (acceleration + acceleration) * gap);
    if (span == 0.0 && gap == 0.0 && acceleration < 0.0) return 0.0;
    return rate > 0.0 ? span / -acceleration : (gap + gap) / span;
}

/* The unit vector in which the incoming belt runs. */
void up_belt(const IncomingKeys *belt, double *dx, double *dy) {
    sin_cos(belt->incline_deg * RADIANS, dy, dx);
}

/* Whether a stream is released on the incoming belt. */
int is_on_belt(const Tables *t, int stream) {
    const StreamKeys *its = t->streams + stream;
    const IncomingKeys *belt = t->incoming;
    double dx, dy;
    if (!belt || !isnan(its->fill[0]) || !isnan(its->to[0])) return 0;
    if (isnan(its->at[0])) return 1;
    up_belt(belt, &dx, &dy);
    double along = its->at[0] * dx + its->at[1] * dy, above = its->at[1] * dx - its->at[0] * dy;
    double riding = belt->pulley_radius + t->particles[(int)its->kind].radius;
    return -belt->length <= along && along <= 0.0 && fabs(above - riding) <= ON_BELT;
}

/* The nominal release point of a stream, m; on the belt at exactly the riding height. */
void release_point(const Tables *t, int stream, double *place) {
    const StreamKeys *its = t->streams + stream;
    const IncomingKeys *belt = t->incoming;
    double dx, dy;
    place[0] = its->at[0];
    place[1] = its->at[1];
    if (!belt || (!isnan(its->at[0]) && !is_on_belt(t, stream))) return;
    up_belt(belt, &dx, &dy);
    double riding = belt->pulley_radius + t->particles[(int)its->kind].radius;
    double along = isnan(its->at[0]) ? -belt->length : its->at[0] * dx + its->at[1] * dy;
    place[0] = along * dx - riding * dy;
    place[1] = along * dy + riding * dx;
}

/* The nominal release velocity of a stream, m/s. */
void release_velocity(const Tables *t, int stream, double *velocity) {
    const StreamKeys *its = t->streams + stream;
    velocity[0] = its->velocity[0];
    velocity[1] = its->velocity[1];
    if (!isnan(velocity[0])) return;
    velocity[0] = velocity[1] = 0.0;
    if (!isnan(its->fill[0]) || !t->incoming) return;
    up_belt(t->incoming, velocity, velocity + 1);
    velocity[0] *= t->incoming->speed;
    velocity[1] *= t->incoming->speed;
}

/* Follow particle 0 along belt and pulley to the beginning of its flight. */
static void discharge(const Tables *t, Nominal *out) {
    const IncomingKeys *belt = t->incoming;
    double *place = out->position, *velocity = out->velocity, dx, dy;
    release_point(t, 0, place);
    release_velocity(t, 0, velocity);
    if (!belt || !is_on_belt(t, 0)) return;
    up_belt(belt, &dx, &dy);
    if (!isnan(t->streams->velocity[0])) {
        double across = fabs(velocity[1] * dx - velocity[0] * dy);
        if (across > ALONG * length_of(velocity[0], velocity[1])) return;
    }
    double rho = belt->pulley_radius + t->particle->radius, gravity = t->scene->gravity;
    if (isfinite(belt->friction)) {
        double phi = 0.0 - belt->incline_deg * RADIANS, up, across;
        double z = t->streams->omega * t->particle->radius;
        double w = velocity[0] * dx + velocity[1] * dy;
        double gap = 0.0 - (place[0] * dx + place[1] * dy);
        double share = t->particle->moment > 0.0
            ? t->particle->moment / (t->particle->moment + 1.0) : 1.0;
        if (!ride_to_pulley(&w, &z, gap, belt->length, gravity, belt->friction, share, belt->speed,
                            phi)
            || !ride_round(&phi, &w, z, rho, gravity, belt->friction, share, belt->speed))
            phi = w = NAN;
        sin_cos(phi, &up, &across);
        place[0] = rho * up;
        place[1] = rho * across;
        velocity[0] = w * across;
        velocity[1] = -w * up;
        return;
    }
    /* Adhesion ends where cos phi1 = v^2/(g rho), Eq. (2), or where the belt meets the pulley, if that value is above cos
       phi there. */
    double ratio = belt->speed * belt->speed / (gravity * rho);
    double grip = belt->speed > 0.0 ? MIN(ratio, dx) : NAN;
    double side = sqrt((1.0 - grip) * (1.0 + grip));
    if (grip >= dx) side = 0.0 - dy;
    place[0] = rho * side;
    place[1] = rho * grip;
    velocity[0] = belt->speed * grip;
    velocity[1] = 0.0 - belt->speed * side;
}

/* Follow particle 0 to the unbounded line of the plate, whose struck face has the normal (-cos a, -sin a): they touch
   when its centre is r in front of the face. */
void fly_nominal(const Tables *t, Nominal *out) {
    const PlateKeys *plate = t->plate;
    out->hit[0] = out->hit[1] = NAN;
    discharge(t, out);
    if (!plate || !t->incoming) return;
    double nx, ny, g = t->scene->gravity;
    double *place = out->position, *velocity = out->velocity;
    sin_cos(plate->angle_deg * RADIANS, &ny, &nx);
    nx = -nx;
    ny = -ny;
    double pivot_x = t->incoming->pulley_radius + plate->distance;
    double gap = (place[0] - pivot_x) * nx + (place[1] - plate->pivot_height) * ny
        - t->particle->radius;
    double when = falls_below(gap, velocity[0] * nx + velocity[1] * ny, -g * ny);
    int moves = velocity[0] != 0.0 || velocity[1] != 0.0 || g != 0.0;
    if (!(gap >= 0.0 && when >= 0.0 && when < INFINITY && moves)) return;
    out->hit[0] = place[0] + velocity[0] * when;
    out->hit[1] = place[1] + velocity[1] * when - 0.5 * g * when * when;
}
