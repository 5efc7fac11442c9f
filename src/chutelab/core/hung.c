/* Contacts that last, with what hangs on hinges: projected Gauss-Seidel over contacts, stops and motors, as the
   solver's, but one by one on the bodies themselves. */

#include "core.h"

/* m/s on Earth; changes at which sweeps end. */
#define ENDS 1e-9
/* Times that friction is lowered where sweeps diverge, to a quarter and at last to nothing. */
#define TRIES 4
/* Times the first change: sweeps whose changes grow so far never end. */
#define DIVERGES 1e3
/* Of momentum: what presses less is rounding. */
#define NOISE 1e-11

/* Give a contact the normal impulse that keeps its gap closed; return by how much it changed, m/s. */
static double press(Contact *c) {
    double u[3], v[3], change[3] = {0, 0, 0};
    relative(c, 1, u);
    relative(c, 0, v);
    double opens = v[0] - u[0], given = (c->need - c->gives * c->impulse[0] - opens) / (1 / c->mass[0] + c->gives);
    given = MAX(MIN(given, (c->most - opens) * c->mass[0]), (c->need - c->parts - opens) * c->mass[0]);
    change[0] = MAX(c->impulse[0] + given, 0) - c->impulse[0];
    if (change[0] != 0) push(c, change);
    c->impulse[0] += change[0];
    return fabs(change[0]) / c->mass[0];
}

/* The most that a contact allows of friction, N s, or of rolling friction, N m s, as it is pressed. */
static double bound(const Contact *c, int rolling) {
    double rough = c->share < 1 ? c->share * MIN(c->friction, ROUGH) : c->friction;
    return (rolling ? c->share * c->arm : rough) * c->impulse[0];
}

/* Give a contact the friction that stops its slip and its rolling, as far as it is pressed. */
static double rub(Contact *c) {
    double *J = c->impulse, v[3], change[3] = {0, 0, 0};
    double most = bound(c, 0), arm = bound(c, 1);
    relative(c, 0, v);
    change[1] = MIN(MAX(J[1] - c->mass[1] * (v[1] + c->drift), -most), most) - J[1];
    change[2] = MIN(MAX(J[2] - c->mass[2] * v[2], -arm), arm) - J[2];
    if (change[1] == 0 && change[2] == 0) return 0;
    push(c, change);
    J[1] += change[1];
    J[2] += change[2];
    double turned = c->mass[2] > 0 ? fabs(change[2]) / c->mass[2] * W.disks[c->i].radius : 0;
    return MAX(fabs(change[1]) / c->mass[1], turned);
}

/* Take the share of all impulses at which the cost is least, see `lessen` of the solver. */
static void lessen_all(Contact *list, int count) {
    double none = 0, all = 0, u[3], v[3], more[3];
    for (int n = 0; n < count; n++) {
        const Contact *c = list + n;
        const double *J = c->impulse;
        if (J[0] == 0 && J[1] == 0 && J[2] == 0) continue;
        relative(c, 1, u);
        relative(c, 0, v);
        double pushed[2] = {0, 0};
        for (int side = 0; side <= c->two; side++) {
            const double *kick = W.disks[side ? c->j : c->i].kick;
            pushed[0] += (side ? -1 : 1) * (kick[0] * c->nx + kick[1] * c->ny);
            pushed[1] += (side ? -1 : 1) * (kick[0] * c->ny - kick[1] * c->nx);
        }
        none += J[1] * (u[1] + pushed[1] + c->drift) + J[2] * u[2] + J[0] * (pushed[0] - asks(c, 0));
        all += J[1] * (v[1] + c->drift) + J[2] * v[2] + J[0] * (v[0] - u[0] - asks(c, J[0]));
    }
    lean_on_hinges(&none, &all);
    if (!(all > 0)) return;
    double less = none < 0 ? all / (all - none) : 1;
    lessen_hinges(less);
    for (int n = 0; n < count; n++) {
        for (int k = 0; k < 3; k++) list[n].impulse[k] += more[k] = -less * list[n].impulse[k];
        push(list + n, more);
    }
}

/* Sweep to and fro; return by how much a velocity changed in the last sweep, m/s, or INFINITY if they diverge. */
static double sweep(Contact *list, int count, int sweeps) {
    double first = 0, worst = 0;
    for (int n = 0; n < sweeps; n++) {
        worst = 0;
        for (int m = 0; m < count; m++) {
            Contact *c = list + ((sweeps - n) % 2 ? m : count - 1 - m);
            double change = press(c), rubbed = rub(c);
            worst = MAX(worst, MAX(change, rubbed));
        }
        double turned = turn_hinges();
        worst = MAX(worst, turned);
        W.sweep_count++;
        if (n == 0) first = worst;
        if (worst <= ENDS * W.pace) return worst;
        if (!(worst <= DIVERGES * (first + W.soft + W.skip * W.disks[list->i].radius))) return INFINITY;
    }
    return worst;
}

/* Take an impulse back as far as it goes beyond what is allowed. */
static void take_beyond(Contact *c, int n, double most) {
    double more[3] = {0, 0, 0};
    more[n] = MIN(MAX(c->impulse[n], -most), most) - c->impulse[n];
    if (more[n] == 0) return;
    push(c, more);
    c->impulse[n] += more[n];
}

/* Give what touches the velocities that all impulses make of those before: sums of thousands of changes would drift by
   what these were rounded to. */
static void add_up(const Contact *list, int count) {
    for (const Contact *c = list; c < list + count; c++)
        for (int side = 0; side <= c->two; side++) {
            Disk *d = W.disks + (side ? c->j : c->i);
            d->vx = d->ux + d->kick[0];
            d->vy = d->uy + d->kick[1];
            d->spin = d->uspin;
        }
    start_hinges(0);
    for (const Contact *c = list; c < list + count; c++) push(c, c->impulse);
}

/* Solve contacts of which some act on hinges, from the impulses of the step before; see `sweep_contacts`. */
void sweep_hung(Contact *list, int count, int sweeps, double enough) {
    add_up(list, count);
    lessen_all(list, count);
    for (int left = TRIES;; left--) {
        double change = sweep(list, count, sweeps);
        for (int n = 0; n < count; n++)
            for (int k = 1; k < 3; k++) take_beyond(list + n, k, bound(list + n, k == 2));
        if (change <= enough || left == 0) break;
        for (int n = 0; n < count; n++) {
            Contact *c = list + n;
            double back[3] = {-c->impulse[0], -c->impulse[1], -c->impulse[2]};
            push(c, back);
            c->impulse[0] = c->impulse[1] = c->impulse[2] = 0;
            c->share = left > 1 ? 0.25 * c->share : 0;
        }
        start_hinges(1);
    }
    for (int n = 0; n < count; n++) {
        /* Rounding does not press. */
        Contact *c = list + n;
        const Disk *d = W.disks + c->i;
        if (c->impulse[0] < NOISE * c->mass[0] * (fabs(d->vx) + fabs(d->vy)))
            for (int k = 0; k < 3; k++) take_beyond(c, k, 0);
    }
    lessen_all(list, count);
    add_up(list, count);
}
