/* What the exact engine records: knots, events, loads and the ledger's entries. */

#include "exact.h"

void write_knot_of(int inner) {
    const double *b = A.entries;
    double spin = A.turns ? A.z / A.given->radius : 0.0;
    E.knots[E.knot_count++] = (Knot){ A.given->release + A.age, A.x, A.y, A.vx, A.vy, spin,
                                      { b[0], b[1], b[2] }, E.lone, inner, 0.0 };
}

void write_knot(void) { write_knot_of(0); }

void record_event(int kind, int surface) {
    A.hits = kind != IMPACT ? 0 : surface == A.hit ? A.hits + 1 : 1, A.hit = surface;
    double spin = A.turns ? A.z / A.given->radius : 0.0;
    E.events[E.event_count++] = (Event){ A.given->release + A.age, A.x, A.y, { A.vx, A.vy, spin },
                                         { A.vx, A.vy, spin }, 0.0, 0.0, E.lone, NONE, kind, surface };
}

/* Loads, if they are asked for, have been reported up to here; in flight there are none. */
void tell_here(void) {
    if (!(B.every > 0.0)) return;
    double now[] = { A.age, A.x, A.y, A.vx, A.vy, A.z };
    for (int n = 0; n < 6; n++) A.told[n] = now[n];
}

/* Report the load by the particle on a surface since the last report: the surface gave the change of the velocity, and
   what gravity took. It is `depth` (m) below the centre. */
void bear_since(int surface, double nx, double ny, double depth) {
    if (!(B.every > 0.0)) return;
    double span = A.age - A.told[0], mass = A.given->mass, from = A.given->release + A.told[0];
    Push p = { .owner = surface, .from = from, .to = from + span, .x = A.told[1] - depth * nx,
               .y = A.told[2] - depth * ny, .nx = nx, .ny = ny, .jx = mass * (A.vx - A.told[3]),
               .jy = mass * (A.vy - A.told[4] + A.given->gravity * span) };
    if (span > 0.0) {
        /* The parabola from there to the present place with the present velocity at its end. */
        double rate = 1.0 / span;
        p.ax = 2.0 * rate * (A.vx - rate * (A.x - A.told[1]));
        p.ay = 2.0 * rate * (A.vy - rate * (A.y - A.told[2]));
        p.vx = A.vx - p.ax * span, p.vy = A.vy - p.ay * span;
    }
    if (A.turns && A.given->rolling > 0.0)
        p.couple = A.given->inertia * (A.z - A.told[5]) / A.given->radius
            - A.given->radius * (p.jx * ny - p.jy * nx);
    bear(&p);
    tell_here();
}

/* The same of a particle that has gone round a circle: the normal is that in the middle. */
void bear_round(int surface, double x, double y, double rho, double depth) {
    if (!(B.every > 0.0)) return;
    double mx = A.x + A.told[1] - 2.0 * x, my = A.y + A.told[2] - 2.0 * y, away = copysign(length_of(mx, my), rho);
    bear_since(surface, mx / away, my / away, depth);
}

void bear_at(const Touch *c) { bear_since(c->surface, c->nx, c->ny, A.given->radius); }

void record_entries(int surface, double work, double restitution, double friction) {
    double *row = E.books + 3 * (surface + (E.apart ? E.lone * E.surface_count : 0));
    double entries[] = { work, restitution, friction };
    for (int k = 0; k < 3; k++) A.entries[k] += entries[k], row[k] += entries[k];
}

void end_track(int reason) {
    A.way = OVER;
    E.lones[E.lone].reason = reason;
}

void part_from(int surface) { record_event(SEPARATION, surface); }

/* Let the particle leave the obstacle it touched, or all those of a joint. */
void let_go(int left, int side, int order, int joint) {
    A.way = FLIES;
    A.on = NONE, A.side = 0, A.slip = 1.0;
    A.left = left, A.left_side = side, A.order = order, A.joint = joint;
}
