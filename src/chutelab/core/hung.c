/* Hinges among the rows of the solver: a hinge is a body that only rotates, its two stops and its motor are rows. */

#include "core.h"

/* rad/s; change of rate that a hinge is allowed that asks for nothing. Finite, since infinity cannot be multiplied by 0. */
#define ANY 1e100

/* The solver body of a mover: `rim` is the change of a hinge's angular velocity, rad/s. Other movers have no mobility. */
SolverBody hinge_body(int k) {
    double turn = W.movers[k].inertia > 0 ? 1 / W.movers[k].inertia : 0;
    return (SolverBody){.turn = turn, .twist = turn, .bend = 1, .disk = -1};
}

/* Make the rows of stops and motors; `body` is the body of the first mover. Return how many rows. A stop acts like the
   normal direction of a contact. A motor acts like friction: its normal impulse is the greatest angular impulse that it
   can give, and no sweep changes it. */
int set_hinge_rows(SolverRow *rows, int body) {
    SolverRow *r = rows;
    for (int k = 0; k < W.mover_count; k++) {
        const Mover *m = W.movers + k;
        for (int n = 0; n < 3 && m->inertia > 0; n++) {
            int runs = n == 2;
            double side = n == 1 ? -1 : 1, heavy = runs ? 0 : m->inertia;
            if (runs ? !(m->most > 0) : fabs(m->need[n]) == INFINITY) continue;
            *r = (SolverRow){.a = body + k, .from = 3 * k + n, .rough = runs, .mass = {heavy, m->inertia}, .eases = heavy,
                             .light = {1 / m->inertia, 1 / m->inertia}, .more = ANY, .parts = runs ? 0 : ANY};
            r->free[0] = runs ? 0 : -side * m->need[n];
            r->free[1] = runs ? m->before + m->drift - m->motor[0] : 0;
            r->impulse[0] = runs ? m->most : side * m->impulse[n];
            r->impulse[1] = runs ? m->impulse[2] : 0;
            W.levers[r++ - W.rows] = (RowLever){.own = {runs ? 0 : side, runs}};
        }
    }
    return (int)(r - rows);
}

/* Copy the impulses of these rows to the hinges, and set the angular velocities that all rows together give. */
void take_hinge_rows(const SolverRow *rows, int count, int body) {
    for (const SolverRow *r = rows; r < rows + count; r++) {
        int n = r->from % 3;
        W.movers[r->from / 3].impulse[n] = n == 2 ? r->impulse[1] : n ? -r->impulse[0] : r->impulse[0];
    }
    for (int k = 0; k < W.mover_count; k++)
        if (W.movers[k].inertia > 0) W.movers[k].rate = W.movers[k].before + W.solver_bodies[body + k].rim;
}
