/* The pull of joints in a step.

   A joint gives the same force all through a step, along the mean of its directions at both ends of the step: half of its
   impulse before the flight, half after it. So its work is exactly the force times the change of its length: 0 for a rod,
   and for a spring what its energy falls by (Gonzalez, J. Nonlinear Sci. 6, 1996). All forces are found together, by
   Newton's method, such that the lengths are right at the end of the step: they do not drift. */

#include <string.h>
#include "joint.h"

/* Greatest number of Newton steps; of times that strings are released; of times that a step is cut where a string becomes
   tight. */
#define NEWTON 40
#define LETS_GO 20
#define CUTS 4
/* Share of a length: error by rounding, and error below which steps that no longer reduce it count as rounding. */
#define ROUNDS 4e-16
#define FINE 1e-13
/* m/s; a pull that would give a particle more is a failure of Newton's method. */
#define WILD 1e6

/* Share of the usual step; in a shorter one velocities are more exact than lengths. */
#define BRIEF 0.1

/* Share of a length by which the latest solve misses a length; 0 if that is rounding. */
static double missed;
/* Whether lengths are as far from what they are to be as steps that ended in rounding are not. */
static int is_rough;
/* End of the step that the pull is found for, and its length, s. */
static double pulled_to, pulled_for;

/* Give the particles half of the pull of the rows, instead of what they had of it. */
static void pull(void) {
    for (int i = W.low; i < W.high; i++) {
        Disk *d = W.disks + i;
        double v[3] = {0, 0, 0};
        for (int end = d->tie; end >= 0; end = W.joints[end / 2].next[end % 2]) {
            const Joint *j = W.joints + end / 2;
            const JointRow *r = W.joint_rows + j->row;
            for (int n = 0; j->tied && n < rows_of(j); n++)
                if (r[n].on) tug(r + n, end % 2, r[n].kick, v, v + 2);
        }
        for (int n = 0; d->tie >= 0 && n < 3; n++) {
            (&d->vx)[n] += v[n] - d->tug[n];
            (&d->ux)[n] += v[n] - d->tug[n];
            d->tug[n] = v[n];
        }
    }
}

/* Add (`way` 1) or subtract (-1) half of the step's pull, for all particles. In halved contacts the pull is part of the
   step's impulses, so there only the velocity before them changes. */
void tug_all(int way) {
    for (int i = W.low; i < W.high; i++) {
        Disk *d = W.disks + i;
        for (int n = 0; d->tie >= 0 && n < 3; n++) {
            if (!d->halved) (&d->vx)[n] += way * d->tug[n];
            (&d->ux)[n] += way * d->tug[n];
        }
    }
}

/* Subtract it, and set it to zero. */
void drop_tugs(void) {
    for (int i = W.low; i < W.high && W.joint_count; i++) {
        Disk *d = W.disks + i;
        for (int n = 0; d->tie >= 0 && n < 3; n++) {
            (&d->vx)[n] -= d->tug[n];
            (&d->ux)[n] -= d->tug[n];
            d->tug[n] = 0;
        }
    }
}

/* The same at the beginning of a step, for a pull that missed and may have any size: velocities are restored. */
void forget_tugs(void) {
    for (int i = W.low; i < W.high; i++) {
        Disk *d = W.disks + i;
        if (d->tie < 0 || d->mode != FREE) continue;
        memcpy(&d->vx, d->tugged, sizeof d->tugged);
        memset(d->tug, 0, sizeof d->tug);
    }
}

/* Whether a pull is too large, or no number; then there is none. */
static int drop_wild_pull(void) {
    int wild = 0;
    for (const Joint *j = W.joints; j < W.joints + W.joint_count; j++) {
        double mass = W.disks[j->particle].inv_mass + (j->other < 0 ? 0 : W.disks[j->other].inv_mass);
        for (int n = 0; n < rows_of(j); n++) wild |= !(fabs(W.joint_rows[j->row + n].kick) * mass < WILD);
    }
    for (JointRow *r = W.joint_rows; r < W.joint_rows + W.joint_row_count && wild; r++) r->kick = 0;
    if (wild) pull();
    return wild;
}

/* By how much of its length a string that is let go though it is tight gets longer within h. */
static double longer(const Joint *j, double h) {
    double d[4];
    if (j->kind != STRING || !j->tied || W.joint_rows[j->row].on || !is_tight(j)) return 0;
    vectors_of(j, h, d);
    return length_of_joint(d) / j->length - 1;
}

/* Find the forces of all joints in a step of length h, from the velocities as they are without them. A string
   that would push is let go. They begin with what was found last, unless that missed. */
void pull_joints(double h) {
    int strings = 1, anew = missed > 0;
    /* A shorter step pulls less: lengths tell nothing of what is brief. */
    double share = pulled_for > h ? h / pulled_for : 1;
    missed = 0;
    pulled_to = W.step_end;
    pulled_for = h;
    for (Joint *j = W.joints; j < W.joints + W.joint_count; j++) {
        JointRow *r = W.joint_rows + j->row;
        for (int n = 0; n < rows_of(j); n++) {
            r[n].on = j->tied && h > 0 && (j->kind != STRING || j->taut || is_tight(j));
            r[n].kick *= r[n].on && !anew ? share : 0;
        }
    }
    for (int again = 0; strings && again < LETS_GO; again++) {
        double worst = INFINITY, last;
        for (int n = 0; n < NEWTON; n++) {
            double most = 0;
            pull();
            for (const Joint *j = W.joints; j < W.joints + W.joint_count; j++) {
                double d0[4], d1[4];
                if (!W.joint_rows[j->row].on) continue;
                /* Where it is now, without the flight. */
                vectors_of(j, 0, d0);
                vectors_of(j, h, d1);
                aim_rows(j, d0, d1, h);
                for (int k = 0; k < rows_of(j); k++) {
                    const Disk *d = W.disks + j->particle;
                    double reach = length_of_joint(d0) + (j->kind == PIN ? fabs(d->x) + fabs(d->y) : 0) + d->radius;
                    most = MAX(most, fabs(W.joint_rows[j->row + k].off) / reach);
                }
            }
            last = worst;
            worst = most;
            if (worst <= ROUNDS || (n > 2 && worst >= 0.5 * last && worst < FINE)) break;
            factor_rows(h, 1);
            for (JointRow *r = W.joint_rows; r < W.joint_rows + W.joint_row_count; r++) r->off = -r->off;
            solve_rows();
            for (JointRow *r = W.joint_rows; r < W.joint_rows + W.joint_row_count; r++)
                if (r->on) r->kick += r->off;
            if (!drop_wild_pull()) continue;
            worst = 1;
            break;
        }
        missed = worst > BAND ? worst : 0;
        is_rough = worst > FINE;
        strings = 0;
        for (const Joint *j = W.joints; j < W.joints + W.joint_count; j++) {
            JointRow *r = W.joint_rows + j->row;
            if (j->kind != STRING || !r->on || r->kick <= 0) continue;
            r->on = 0;
            r->kick = 0;
            strings = 1;
        }
        /* Where one does not push any more, since another has been let go, it pulls after all. */
        int goes_on = !strings && again < LETS_GO - 1;
        for (const Joint *j = W.joints; j < W.joints + W.joint_count && goes_on; j++) {
            if (!(longer(j, h) > BAND)) continue;
            W.joint_rows[j->row].on = 1;
            strings = 1;
        }
    }
    pull();
    /* One that is let go since it would push, and yet gets longer, asks for a shorter step. */
    for (const Joint *j = W.joints; j < W.joints + W.joint_count; j++) missed = MAX(missed, longer(j, h) - BAND);
}

/* The instant within (0, h] at which a slack string becomes tight, INFINITY if it does not. */
static double snaps(const Joint *j, double h) {
    double d[4], low = 0, high = h;
    if (j->kind != STRING || !j->tied || W.joint_rows[j->row].on || is_tight(j)) return INFINITY;
    vectors_of(j, h, d);
    if (length_of_joint(d) <= j->length) return INFINITY;
    while (high - low > 1e-15 * h) {
        double middle = 0.5 * (low + high);
        if (middle == low || middle == high) break;
        vectors_of(j, middle, d);
        if (length_of_joint(d) <= j->length) low = middle;
        else high = middle;
    }
    return high;
}

/* End the step at t instead, and find the forces anew. */
void cut_step(double t) {
    W.step_end = t;
    drop_tugs();
    pull_joints(t - W.t);
    for (int i = W.low; i < W.high; i++) {
        if (W.disks[i].tie < 0 || W.disks[i].mode != FREE) continue;
        W.disks[i].changes++;
        enter_again(i, t);
    }
}

/* Whether the step has been cut by something else: then the forces are found anew. */
int is_cut(void) {
    if (pulled_to == W.step_end) return 0;
    cut_step(W.step_end);
    return 1;
}

/* End the step where a string becomes tight. */
void cut_at_snaps(void) {
    for (int n = 0; n < CUTS; n++) {
        double h = W.step_end - W.t, first = INFINITY;
        for (const Joint *j = W.joints; j < W.joints + W.joint_count; j++) first = MIN(first, snaps(j, h));
        if (!(first < h * (1 - BAND))) return;
        cut_step(W.t + first);
    }
}

/* Work of a row on its particles in a step of length h that ends now, J: half of its impulse before the flight, half
   after it, each times the mean of the velocities before and after it. It is computed from the present velocities, before
   the second half. */
static double worked(const JointRow *r, double h) {
    double falls = 0;
    for (int end = 0; end < 2; end++)
        if (disk_at(2 * r->joint + end)) falls += h * (W.gx * r->e[2 * end] + W.gy * r->e[2 * end + 1]);
    return r->kick * (2 * rate_of_row(r) - falls);
}

/* Give the other half of the step's pull, at its end, and book the energy that springs gave and lost. */
void end_pull(void) {
    double h = W.step_end - W.t, d[4];
    for (Joint *j = W.joints; j < W.joints + W.joint_count; j++) {
        JointRow *r = W.joint_rows + j->row;
        Disk *a = W.disks + j->particle, *b = j->other < 0 ? 0 : W.disks + j->other;
        if (!j->tied || h <= 0 || a->mode != FREE || (b && b->mode != FREE)) continue;
        j->taut = r->on;
        vectors_of(j, 0, d);
        double length = length_of_joint(d), grows = length - length_of_joint(j->now), entries[3] = {0, 0, 0};
        double moves[2] = {d[0] - j->now[0], d[1] - j->now[1]};
        memcpy(j->now, d, sizeof j->now);
        if (j->kind == SPRING) {
            double kept = kept_in(j, length), lost = j->damper * grows * grows / h;
            entries[0] = j->kept[1] - kept - lost;
            j->kept[1] = kept;
            j->damped += lost;
            j->given += entries[0];
        } else
            for (int n = 0; n < rows_of(j) && r->on; n++)
                entries[1] -= h < BRIEF * W.usual || is_rough ? worked(r + n, h)
                    : 2 / h * r[n].kick * (j->kind == PIN ? moves[n] : grows);
        if (entries[0] != 0 || entries[1] != 0) book(a->entries, b ? b->entries : 0, W.owner_count, entries);
    }
    double hastens = h >= BRIEF * W.usual ? 2 / h : 0;
    for (int i = W.low; i < W.high; i++) {
        Disk *disk = W.disks + i;
        for (int n = 0; disk->tie >= 0 && n < 3; n++) {
            if (disk->mode == FREE) (&disk->vx)[n] += disk->tug[n];
            if (hastens > 0) disk->drawn[n] = hastens * disk->tug[n];
            disk->tug[n] = 0;
        }
    }
}

/* What of the lengths of joints the step misses, as a share of them. */
double missed_by_joints(void) { return missed; }
