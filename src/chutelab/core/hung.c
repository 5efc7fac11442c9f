/* Hinges among the rows of the solver: a body that only turns, and rows of its stops and its motor. */

#include "core.h"

/* rad/s; what a hinge is free to turn by that asks for nothing: finite, so that it can be multiplied by 0. */
#define ANY 1e100

/* The body of a mover: its rim is the change of a hinge's rate, rad/s; others give no way. */
SolverBody hinge_body(int k) {
    double turn = W.movers[k].inertia > 0 ? 1 / W.movers[k].inertia : 0;
    return (SolverBody){.turn = turn, .twist = turn, .bend = 1, .disk = -1};
}

/* Make rows of stops and motors, whose bodies begin with that; return how many. A stop gives an impulse that it asks for
   as a contact does, a motor one as friction does: its normal impulse, which nothing changes, is the most that it gives. */
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

/* Give hinges what these rows, and all others, make of their rates. */
void take_hinge_rows(const SolverRow *rows, int count, int body) {
    for (const SolverRow *r = rows; r < rows + count; r++) {
        int n = r->from % 3;
        W.movers[r->from / 3].impulse[n] = n == 2 ? r->impulse[1] : n ? -r->impulse[0] : r->impulse[0];
    }
    for (int k = 0; k < W.mover_count; k++)
        if (W.movers[k].inertia > 0) W.movers[k].rate = W.movers[k].before + W.solver_bodies[body + k].rim;
}
