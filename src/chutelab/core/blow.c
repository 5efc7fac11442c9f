/* The impulses of an impact of two particles of which one has corners, or of one and a surface, at all places at which they
   touch; and those of a disk at a hinge. */

#include <string.h>
#include "core.h"

/* Greatest number of sweeps over the places of an impact, and the share of its size at which they end. */
#define SWEEPS 2000
#define ENDS 1e-15
/* Share of a diagonal element of the matrix; a smaller pivot is rounding, where two impulses have the same effect. */
#define SAME 1e-6
/* Share of the velocity that an impulse would change without joints; if it changes less, the joints hold the place. */
#define HELD 1e-13
/* Share of an impact's energy that it may gain by rounding. */
#define GAINS 1e-12
/* Greatest number of rounds for friction and rolling friction of a disk at a hinge, where each changes the other. */
#define COUPLED 100
/* Greatest number of impulses. */
#define MOST (3 * MOST_TOUCHES)

/* Whether a struck particle has joints, which respond to each impulse of the impact. */
static int answers;

static void give_all(const Contact *c, const double *impulse) {
    push(c, impulse);
    if (answers) answer_with_joints();
}

/* The matrix of an impact: how impulses and moments at its places change normal velocity, slip and spin at all places,
   1/kg. */
static double matrix[MOST][MOST];

/* Scalar product of two directions, normal (0) or tangent (1), at two places; 0 for a moment (2), which has none. */
static double along_both(const Contact *c, int n, const Contact *o, int k) {
    if (n == 2 || k == 2) return 0;
    if (n == k) return c->nx * o->nx + c->ny * o->ny;
    double cross = c->nx * o->ny - c->ny * o->nx;
    return n ? -cross : cross;
}

/* Set the matrix of an impact. If joints respond, it is measured by impulses that change velocities by about `size`, m/s,
   and are taken back; joints may hold a place entirely. */
static void find_matrix(Contact *list, int count, double size, int joined) {
    answers = joined;
    for (int m = 0; m < 3 * count; m++) {
        const Contact *c = list + m / 3;
        const Disk *a = W.disks + c->i, *b = W.disks + MAX(c->j, 0);
        double one[3] = {0, 0, 0}, back[3] = {0, 0, 0}, u[MOST_TOUCHES][3], v[3];
        double mass = a->inv_mass + (c->two ? b->inv_mass : 0);
        if (m % 3 == 2 && c->arm == 0) continue;
        for (int n = 0; n < count && answers; n++) relative(list + n, 0, u[n]);
        one[m % 3] = size * a->mass;
        back[m % 3] = -one[m % 3];
        if (answers) give_all(c, one);
        for (int n = 0; n < count; n++) {
            const Contact *o = list + n;
            if (answers) relative(o, 0, v);
            for (int k = 0; k < 3; k++) {
                double *to = &matrix[3 * n + k][m];
                if (answers) {
                    double gives = (v[k] - u[n][k]) / one[m % 3];
                    *to = 3 * n + k == m && !(gives > HELD / a->mass) ? 0 : gives;
                    continue;
                }
                double own = k < 2 ? o->own[k] : 1, others = k < 2 ? o->others[k] : -1;
                *to = mass * along_both(o, k, c, m % 3) + own * (m % 3 < 2 ? c->own[m % 3] : 1) * a->inv_inertia;
                if (c->two) *to += others * (m % 3 < 2 ? c->others[m % 3] : -1) * b->inv_inertia;
                if (c->hung) *to += o->lever[k] * c->lever[m % 3] / W.movers[c->hung - 1].inertia;
            }
        }
        if (answers) give_all(c, back);
    }
    if (answers) forget_answers();
}

/* Bound on a tangential impulse or a moment per normal impulse. */
static double bound_of(const Contact *c, int n, double share) {
    if (n == 1) return share * MIN(c->friction, share < 1 ? ROUGH : INFINITY);
    return share * c->arm;
}

/* Change one impulse of an impact, and with it the velocities at all places. */
static void change_one(Contact *list, int count, int m, double change, double *v) {
    list[m / 3].impulse[m % 3] += change;
    for (int k = 0; k < 3 * count && change != 0; k++) v[k] += matrix[k][m] * change;
}

/* Impulses that are solved for at once: those in `free`. The others are 0 or at their bound, a multiple of the normal
   impulse at their place. `more` are the changes. If others have the same effect as a friction, that friction is `loose`:
   together with the others, which change by `turns` times as much, it changes no velocity. */
typedef struct {
    double bound[MOST], more[MOST], turns[MOST];
    int free[MOST], many, loose;
} Direct;

/* Solve the equations of all that is free, up to `rounding` of a velocity. */
static void eliminate(Direct *d, const double *back, const double *v, double rounding) {
    double rows[MOST][MOST + 1];
    int many = d->many, *free = d->free;
    for (int n = 0; n < many; n++) {
        rows[n][many] = (free[n] % 3 ? 0 : back[free[n] / 3]) - v[free[n]];
        for (int k = 0; k < many; k++) {
            int o = free[k];
            rows[n][k] = matrix[free[n]][o];
            for (int with = o + 1; o % 3 == 0 && with < o + 3; with++)
                if (d->bound[with] != 0) rows[n][k] += matrix[free[n]][with] * d->bound[with];
        }
    }
    d->loose = -1;
    for (int n = 0; n < many; n++) {
        d->more[free[n]] = d->turns[free[n]] = 0;
        if (!(fabs(rows[n][n]) > SAME * matrix[free[n]][free[n]])) {
            if (free[n] % 3) d->loose = n;
            continue;
        }
        for (int k = 0; k < many; k++) {
            double by = k == n ? 0 : rows[k][n] / rows[n][n];
            for (int o = n; o <= many && by != 0; o++) rows[k][o] -= by * rows[n][o];
        }
    }
    /* If slip is left at the loose one, it has to change until some friction is at its bound. */
    int loose = d->loose;
    double left = loose < 0 ? 0 : rows[loose][many];
    if (fabs(left) <= rounding) d->loose = loose = -1;
    for (int n = 0; n < many; n++) {
        if (n == loose) d->turns[free[n]] = copysign(1, left);
        if (!(fabs(rows[n][n]) > SAME * matrix[free[n]][free[n]])) continue;
        d->more[free[n]] = rows[n][many] / rows[n][n];
        if (loose >= 0) d->turns[free[n]] = -copysign(rows[n][loose] / rows[n][n], left);
    }
}

/* Which of the free impulses, all friction, has to be at a bound, and which one; -1 if none has. It is the one that is
   furthest beyond, or the first one that gets there as the loose one changes. */
static int beyond(const Contact *list, const Direct *d, double share, double *bound) {
    int found = -1;
    double worst = 0, least = INFINITY;
    for (int n = 0; n < d->many; n++) {
        int m = d->free[n], first = m - m % 3;
        const double *J = list[m / 3].impulse;
        double most = bound_of(list + m / 3, m % 3, share), normal = J[0] + d->more[first], along = J[m % 3] + d->more[m];
        for (int side = -1; side < 2 && m % 3; side += 2) {
            double excess = side * along - most * normal, rate = side * d->turns[m] - most * d->turns[first];
            if (excess > worst + ENDS * most * normal) {
                worst = excess;
                least = 0;
            } else if (d->loose >= 0 && rate > 0 && -excess / rate < least) least = -excess / rate;
            else continue;
            found = n;
            *bound = side * most;
        }
    }
    return found;
}

/* Solve for all impulses at once, under the assumption that those that are free after the sweeps stay free and the others
   stay at their bounds; the sweeps that follow check that. Friction that would be beyond its bound is set to it, and the
   rest is solved again. Where an edge lies on an edge, both places slip alike, and sweeps would shift friction from one to
   the other in tiny steps. Not with joints, as their response is not known exactly enough. */
static void solve_directly(Contact *list, int count, const double *back, double share, double rounding, double *v) {
    Direct d = {.many = 0};
    for (int m = 0; m < 3 * count; m++) {
        const double *J = list[m / 3].impulse;
        double most = m % 3 ? bound_of(list + m / 3, m % 3, share) : 0;
        int is_free = m % 3 ? fabs(J[m % 3]) < most * J[0] : J[0] > 0;
        if (is_free) d.free[d.many++] = m;
        d.bound[m] = is_free ? 0 : J[m % 3] > 0 ? most : -most;
        d.more[m] = d.turns[m] = 0;
    }
    for (;;) {
        double bound;
        eliminate(&d, back, v, rounding);
        int n = beyond(list, &d, share, &bound), m = d.free[MAX(n, 0)];
        if (n < 0) break;
        d.bound[m] = bound;
        d.more[m] = d.turns[m] = 0;
        change_one(list, count, m, bound * list[m / 3].impulse[0] - list[m / 3].impulse[m % 3], v);
        for (d.many--; n < d.many; n++) d.free[n] = d.free[n + 1];
    }
    for (int n = 0; n < d.many; n++) {
        int m = d.free[n];
        for (int o = m; o < (m % 3 ? m + 1 : m + 3); o++)
            change_one(list, count, o, o == m ? d.more[m] : d.bound[o] * d.more[m], v);
    }
}

/* Find impulses at all places such that no gap closes, or that it opens as fast as restitution asks for; friction, scaled
   by `share`, stops slip within its bound, and rolling friction the rolling of a disk. */
static void solve_impact(Contact *list, int count, const double *back, double share) {
    double size = 0, v[MOST];
    for (int n = 0; n < count; n++) {
        size = MAX(size, back[n]);
        relative(list + n, 0, v + 3 * n);
    }
    for (int sweep = 0, direct = 1; sweep < SWEEPS; sweep++) {
        double worst = 0;
        if (sweep == direct && !answers) {
            solve_directly(list, count, back, share, ENDS * size, v);
            direct *= 2;
        }
        for (int m = 0; m < 3 * count; m++) {
            const Contact *c = list + m / 3;
            if (m % 3 == 2 && c->arm == 0) continue;
            double *J = list[m / 3].impulse, gives = matrix[m][m], most = INFINITY, least = 0;
            if (m % 3) {
                most = bound_of(c, m % 3, share) * J[0];
                least = -most;
            } else size = MAX(size, fabs(v[m]) + fabs(v[m + 1]));
            double wanted = J[m % 3] + (gives > 0 ? ((m % 3 ? 0 : back[m / 3]) - v[m]) / gives : 0);
            double change = MIN(MAX(wanted, least), most) - J[m % 3];
            if (change == 0) continue;
            J[m % 3] += change;
            if (m % 3 < 2) size = MAX(size, fabs(J[m % 3]) * gives);
            for (int k = 0; k < 3 * count; k++) v[k] += matrix[k][m] * change;
            worst = MAX(worst, fabs(change) * gives * (m % 3 < 2 ? 1 : W.disks[MAX(c->j, 0)].radius));
        }
        if (worst <= ENDS * size) break;
    }
    for (int n = 0; n < count; n++) give_all(list + n, list[n].impulse);
}

/* Find the impulses of an impact. Newton's restitution with friction, or at several places, may seem to create energy if
   one impulse changes the velocity at another place (T. R. Kane, J. Appl. Mech. 51, 1984). Then friction is reduced, and
   finally restitution is 0, which never creates energy. `u` are the velocities before. Return the loss, J. */
static double solve_with_energy(Contact *list, int count, double *back, const double (*u)[3]) {
    for (double share = 1;;) {
        double lost = 0, size = 0, v[3];
        solve_impact(list, count, back, share);
        for (int n = 0; n < count; n++) {
            const double *J = list[n].impulse;
            relative(list + n, 0, v);
            lost -= 0.5 * (J[0] * (u[n][0] + v[0]) + J[1] * (u[n][1] + v[1]) + J[2] * (u[n][2] + v[2]));
            size += fabs(J[0] * u[n][0]) + fabs(J[1] * u[n][1]);
        }
        int is_plastic = 1;
        for (int n = 0; n < count; n++) is_plastic &= back[n] == 0;
        if (lost >= -GAINS * size || is_plastic) return lost;
        for (int n = 0; n < count; n++) {
            Contact *c = list + n;
            double none[3] = {-c->impulse[0], -c->impulse[1], -c->impulse[2]};
            give_all(c, none);
            c->impulse[0] = c->impulse[1] = c->impulse[2] = 0;
            if (share == 0) back[n] = 0;
        }
        share = share > 0.1 ? 0.5 * share : share > 0 ? 0 : 1;
    }
}

/* Find the impulses of an impact at some places, and of the joints that respond, and give them. `size` is the fastest
   approach, `u` are the velocities before. `back`, the velocities after, is changed where a hinge stands. Return the
   loss, J. */
double find_blow(Contact *list, int count, double size, int joined, double (*u)[3], double *back) {
    double lost = 0;
    if (joined) begin_answers();
    for (int again = 1; again;) {
        double wanted[MOST_TOUCHES];
        memcpy(wanted, back, count * sizeof *back);
        find_matrix(list, count, size, joined);
        lost = solve_with_energy(list, count, wanted, u);
        int lets_go = joined && let_go_again();
        again = lets_go || hold_hinge(list, count);
        for (int n = 0; n < count && again; n++) {
            double *J = list[n].impulse, none[3] = {-J[0], -J[1], -J[2]};
            if (lets_go) push(list + n, none);
            else give_all(list + n, none);
            J[0] = J[1] = J[2] = 0;
        }
    }
    return lost;
}

/* Friction (1) or rolling friction (2) that stops a slip or a relative rotation, as far as its bound allows, with the
   normal impulse that changes the normal velocity by `wanted`. `free` is what there is to stop without both impulses, and
   `both` how much each of them changes the other's velocity, 1/kg. */
static double holds(const Contact *c, int n, double wanted, double free, double both) {
    double gives = 1 / c->mass[n] - both * both * c->mass[0], bound = n == 1 ? c->friction : c->arm;
    double low = 1 / (c->mass[0] * bound) - both, high = low + 2 * both;
    if (!(gives > 0)) return 0;
    low = low > 0 ? -MAX(wanted, 0) / low : -INFINITY;
    high = high > 0 ? MAX(wanted, 0) / high : INFINITY;
    return MIN(MAX(-(free + both * wanted * c->mass[0]) / gives, low), high);
}

/* Set the impulses with which a contact with a hinge changes its normal velocity by `wanted`. Each of them changes all
   velocities there, so friction and rolling friction are solved together, with the normal impulse that belongs to them;
   `u` are the velocities before. Together they must not create energy, as they might with Newton's restitution if the
   impact itself reverses the slip (T. R. Kane and D. A. Levinson, Dynamics, 1985, sec. 5.7): then both are smaller, such
   that they do no work. Of friction alone that brings the slip to the opposite of what it was. */
void couple(const Contact *c, double wanted, const double *u, double *J) {
    const Disk *d = W.disks + c->i;
    double turn = 1 / W.movers[c->hung - 1].inertia, by[3], work = 0, change = 0;
    double across = d->radius * d->inv_inertia + c->lever[1] * c->lever[2] * turn;
    for (int n = 1; n < 3; n++) by[n] = c->lever[0] * c->lever[n] * turn;
    J[1] = J[2] = 0;
    for (int round = 0; round < COUPLED; round++) {
        double last[3] = {0, J[1], J[2]};
        for (int n = 1; n < 3; n++)
            J[n] = holds(c, n, wanted - by[3 - n] * J[3 - n], u[n] + across * J[3 - n], by[n]);
        if (J[1] == last[1] && J[2] == last[2]) break;
    }
    double less = by[1] * J[1] + by[2] * J[2];
    for (int n = 1; n < 3; n++) {
        work += J[n] * (2 * u[n] + by[n] * wanted * c->mass[0]);
        change += J[n] * (J[n] / c->mass[n] + across * J[3 - n] - by[n] * less * c->mass[0]);
    }
    double share = work + change > 0 ? MAX(-work, 0) / change : 1;
    J[1] *= share;
    J[2] *= share;
    J[0] = MAX((wanted - share * less) * c->mass[0], 0);
}
