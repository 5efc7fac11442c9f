/* Joints: strings, rods, springs and pins.

   A joint gives the same force all through a step, along the mean of its directions at both ends of the step: half of its
   impulse before the flight, half after it. So its work is exactly the force times the change of its length: 0 for a rod,
   and for a spring what its energy falls by (Gonzalez, J. Nonlinear Sci. 6, 1996). All forces are found together, by
   Newton's method, such that the lengths are right at the end of the step: they do not drift. If a particle is struck, or
   a string becomes tight, the joints give their impulses at the same instant. */

#include <string.h>
#include "core.h"

/* Share of its length; a string that is shorter by less is tight. */
#define BAND 1e-9
/* Greatest number of Newton steps; of times that strings are released; of times that a step is cut where a string becomes
   tight. */
#define NEWTON 40
#define LETS_GO 20
#define CUTS 4
/* Share of a length: error by rounding, and error below which steps that no longer reduce it count as rounding. */
#define ROUNDS 4e-16
#define FINE 1e-13
/* Share of the diagonal: a row with a smaller pivot depends on the others. */
#define DEPENDS 1e-13

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

/* Place and velocity of a particle a span after the step's beginning, and by what it has turned. */
typedef struct { double x, y, turned; } Pose;

static Pose pose_at(const Disk *d, double h) {
    return (Pose){ d->x + (d->vx + 0.5 * W.gx * h) * h, d->y + (d->vy + 0.5 * W.gy * h) * h, d->turned + d->spin * h };
}

/* The arm of a pin from the centre of a particle that has rotated. */
static void turn_arm(const double *arm, double turned, double *out) {
    double c = cos(turned), s = sin(turned);
    out[0] = c * arm[0] - s * arm[1];
    out[1] = s * arm[0] + c * arm[1];
}

/* Whether a joint is a string between two particles over a pulley: a point without mass or friction. */
static int has_pulley(const Joint *j) { return j->kind == STRING && j->other >= 0 && !isnan(j->from[0]); }

/* The two vectors whose lengths add up to that of a joint: from its other end to its particle, and 0; or from a pulley to
   both particles. `h` is the time since the beginning of the step. */
static void between(const Joint *j, double h, double *out) {
    Pose a = pose_at(W.disks + j->particle, h);
    const double *fixed = j->from;
    double arm[2] = {0, 0};
    if (j->kind == PIN) turn_arm(j->arm, a.turned, arm);
    out[0] = a.x + arm[0];
    out[1] = a.y + arm[1];
    out[2] = out[3] = 0;
    if (has_pulley(j)) {
        Pose b = pose_at(W.disks + j->other, h);
        out[0] -= fixed[0];
        out[1] -= fixed[1];
        out[2] = b.x - fixed[0];
        out[3] = b.y - fixed[1];
    } else if (j->other >= 0) {
        Pose b = pose_at(W.disks + j->other, h);
        if (j->kind == PIN) turn_arm(j->arm + 2, b.turned, arm);
        out[0] -= b.x + (j->kind == PIN ? arm[0] : 0);
        out[1] -= b.y + (j->kind == PIN ? arm[1] : 0);
    } else {
        out[0] -= fixed[0];
        out[1] -= fixed[1];
    }
}

static double size(const double *v) { return sqrt(v[0] * v[0] + v[1] * v[1]); }

/* The length of a joint, from the vectors of `between`. */
static double length_of(const double *d) { return size(d) + size(d + 2); }

static double kept_in(const Joint *j, double length) { return 0.5 * j->stiffness * square(length - j->length); }

static int rows_of(const Joint *j) { return 1 + (j->kind == PIN); }

/* Whether a string is as long as it can be. */
static int is_tight(const Joint *j) {
    double d[4];
    between(j, 0, d);
    return length_of(d) >= (1 - BAND) * j->length;
}

/* The particle at an end of a joint, as `Disk.tie` counts ends, or NULL. */
static Disk *at_end(int end) {
    int i = end % 2 ? W.joints[end / 2].other : W.joints[end / 2].particle;
    return i < 0 ? 0 : W.disks + i;
}

/* Change velocity and spin of the particle at one end of a row by an impulse `kick`, N s. */
static void tug(const JointRow *r, int end, double kick, double *v, double *spin) {
    const Disk *d = at_end(2 * r->joint + end);
    v[0] += kick * r->e[2 * end] * d->inv_mass;
    v[1] += kick * r->e[2 * end + 1] * d->inv_mass;
    *spin += kick * r->lever[end] * d->inv_inertia;
}

/* Whether two particles are joined by a rod or a pin: then they do not collide. */
int are_joined(int i, int j) {
    for (int end = W.disks[i].tie; end >= 0; end = W.joints[end / 2].next[end % 2]) {
        const Joint *joint = W.joints + end / 2;
        if (joint->kind != ROD && joint->kind != PIN) continue;
        if (joint->particle == j || joint->other == j) return 1;
    }
    return 0;
}

/* ------------------------------------------------------------------------------- systems of rows */

static double *cell(int p, int q) { return W.joint_matrix + (long)p * W.joint_row_count + q; }

/* Change of the rate of one row by an impulse of 1 N s of another, through the particle at one end, 1/kg. */
static double rate_change(const JointRow *p, int end, const JointRow *q, int with) {
    const Disk *d = at_end(2 * p->joint + end);
    const double *e = p->e + 2 * end, *f = q->e + 2 * with;
    return (e[0] * f[0] + e[1] * f[1]) * d->inv_mass + p->lever[end] * q->lever[with] * d->inv_inertia;
}

/* Set the matrix of the rows that act, `scale` times the effect of impulses, and factor it: L D L^T within the envelope
   of its rows, which in a chain has a width of one or two. */
static void factor(double scale, int eases) {
    JointRow *rows = W.joint_rows;
    for (int p = 0; p < W.joint_row_count; p++) {
        JointRow *r = rows + p;
        r->first = p;
        if (!r->on) continue;
        for (int pass = 0; pass < 2; pass++) {
            for (int q = r->first; pass && q <= p; q++) *cell(p, q) = 0;
            for (int end = 0; end < 2; end++) {
                const Disk *d = at_end(2 * r->joint + end);
                for (int other = d ? d->tie : -1; other >= 0; other = W.joints[other / 2].next[other % 2]) {
                    const Joint *j = W.joints + other / 2;
                    for (int q = j->row; j->tied && q < j->row + rows_of(j) && q <= p; q++) {
                        if (!rows[q].on) continue;
                        if (pass) *cell(p, q) += scale * rate_change(r, end, rows + q, other % 2);
                        else r->first = MIN(r->first, q);
                    }
                }
            }
        }
        double whole = *cell(p, p) += eases ? r->eases : 0;
        for (int q = r->first; q <= p; q++) {
            double sum = *cell(p, q);
            if (!rows[q].on) continue;
            for (int k = MAX(r->first, rows[q].first); k < q; k++)
                if (rows[k].on) sum -= *cell(p, k) * *cell(q, k) * rows[k].root;
            *cell(p, q) = q < p && rows[q].root != 0 ? sum / rows[q].root : q < p ? 0 : sum;
        }
        r->root = *cell(p, p) > DEPENDS * whole ? *cell(p, p) : 0;
    }
}

/* Solve for the right side that is in `off` of the rows that act; `off` becomes the solution. */
static void solve(void) {
    JointRow *rows = W.joint_rows;
    for (int p = 0; p < W.joint_row_count; p++)
        for (int q = rows[p].first; q < p && rows[p].on; q++)
            if (rows[q].on) rows[p].off -= *cell(p, q) * rows[q].off;
    for (int p = W.joint_row_count - 1; p >= 0; p--) {
        JointRow *r = rows + p;
        if (!r->on) continue;
        r->off = r->root != 0 ? r->off / r->root : 0;
    }
    for (int p = W.joint_row_count - 1; p >= 0; p--)
        for (int q = rows[p].first; q < p && rows[p].on; q++)
            if (rows[q].on) rows[q].off -= *cell(p, q) * rows[p].off;
}

/* ----------------------------------------------------------------------------------------- a step */

/* Set the rows of a joint whose vectors change from d0 to d1 within h: how they act, and by how much they are missed. */
static void aim(const Joint *j, const double *d0, const double *d1, double h) {
    JointRow *r = W.joint_rows + j->row;
    /* A short step corrects only as small a share of an initial error; else it would do so at any speed. */
    double share = MIN(h / W.usual, 1);
    if (j->kind == PIN) {
        for (int n = 0; n < 2; n++, r++) {
            memset(r->e, 0, sizeof r->e);
            r->e[n] = 1;
            r->e[2 + n] = -1;
            r->off = d1[n] - (1 - share) * d0[n];
            for (int end = 0; end < 2; end++) {
                const Disk *d = at_end(2 * (int)(j - W.joints) + end);
                double arm[2], half = d ? 0.5 * h * d->spin : 0;
                if (!d) continue;
                turn_arm(j->arm + 2 * end, d->turned + half, arm);
                r->lever[end] = (n ? arm[0] : -arm[1]) * (half != 0 ? sin(half) / half : 1) * (end ? -1 : 1);
            }
        }
        return;
    }
    double before = length_of(d0), after = length_of(d1);
    for (int n = 0; n < 4; n += 2) {
        double sum = size(d0 + n) + size(d1 + n);
        for (int k = n; k < n + 2; k++) r->e[k] = sum > 0 ? (d0[k] + d1[k]) / sum : 0;
    }
    if (!has_pulley(j)) r->e[2] = -r->e[0], r->e[3] = -r->e[1];
    r->off = after - before - share * (j->length - before);
    if (j->kind != SPRING) return;
    double stiff = 0.5 * j->stiffness + j->damper / h;
    r->eases = 2 / (h * stiff);
    r->off = after - (j->stiffness * j->length + (j->damper / h - 0.5 * j->stiffness) * before) / stiff;
    r->off += r->eases * r->kick;
}

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
    between(j, h, d);
    return length_of(d) / j->length - 1;
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
                between(j, 0, d0);
                between(j, h, d1);
                aim(j, d0, d1, h);
                for (int k = 0; k < rows_of(j); k++) {
                    const Disk *d = W.disks + j->particle;
                    double reach = length_of(d0) + (j->kind == PIN ? fabs(d->x) + fabs(d->y) : 0) + d->radius;
                    most = MAX(most, fabs(W.joint_rows[j->row + k].off) / reach);
                }
            }
            last = worst;
            worst = most;
            if (worst <= ROUNDS || (n > 2 && worst >= 0.5 * last && worst < FINE)) break;
            factor(h, 1);
            for (JointRow *r = W.joint_rows; r < W.joint_rows + W.joint_row_count; r++) r->off = -r->off;
            solve();
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

/* Acceleration by which joints press a particle on what it touches at a contact, m/s2. */
double pressed_by_joints(const Contact *c) {
    const Disk *a = W.disks + c->i, *b = W.disks + MAX(c->j, 0);
    double press = 0;
    if (is_tied(c->i)) press -= a->drawn[0] * c->nx + a->drawn[1] * c->ny + (c->cornered ? c->own[0] * a->drawn[2] : 0);
    if (c->two && is_tied(c->j))
        press += b->drawn[0] * c->nx + b->drawn[1] * c->ny - (c->cornered ? c->others[0] * b->drawn[2] : 0);
    return press;
}

/* The instant within (0, h] at which a slack string becomes tight, INFINITY if it does not. */
static double snaps(const Joint *j, double h) {
    double d[4], low = 0, high = h;
    if (j->kind != STRING || !j->tied || W.joint_rows[j->row].on || is_tight(j)) return INFINITY;
    between(j, h, d);
    if (length_of(d) <= j->length) return INFINITY;
    while (high - low > 1e-15 * h) {
        double middle = 0.5 * (low + high);
        if (middle == low || middle == high) break;
        between(j, middle, d);
        if (length_of(d) <= j->length) low = middle;
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

/* Rate at which a joint becomes longer, m/s. */
static double rate_of(const JointRow *r) {
    double sum = 0;
    for (int end = 0; end < 2; end++) {
        const Disk *d = at_end(2 * r->joint + end);
        if (!d) continue;
        sum += d->vx * r->e[2 * end] + d->vy * r->e[2 * end + 1] + r->lever[end] * d->spin;
    }
    return sum;
}

/* Work of a row on its particles in a step of length h that ends now, J: half of its impulse before the flight, half
   after it, each times the mean of the velocities before and after it. It is computed from the present velocities, before
   the second half. */
static double worked(const JointRow *r, double h) {
    double falls = 0;
    for (int end = 0; end < 2; end++)
        if (at_end(2 * r->joint + end)) falls += h * (W.gx * r->e[2 * end] + W.gy * r->e[2 * end + 1]);
    return r->kick * (2 * rate_of(r) - falls);
}

/* Give the other half of the step's pull, at its end, and book the energy that springs gave and lost. */
void end_pull(void) {
    double h = W.step_end - W.t, d[4];
    for (Joint *j = W.joints; j < W.joints + W.joint_count; j++) {
        JointRow *r = W.joint_rows + j->row;
        Disk *a = W.disks + j->particle, *b = j->other < 0 ? 0 : W.disks + j->other;
        if (!j->tied || h <= 0 || a->mode != FREE || (b && b->mode != FREE)) continue;
        j->taut = r->on;
        between(j, 0, d);
        double length = length_of(d), grows = length - length_of(j->now), entries[3] = {0, 0, 0};
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

/* Add up all springs, as in `Total`. */
void add_springs(double *sums) {
    for (const Joint *j = W.joints; j < W.joints + W.joint_count; j++) {
        const double own[4] = {j->kept[0], j->kept[1], j->damped, j->given};
        for (int n = 0; n < 4; n++) sums[n] += own[n];
    }
}

/* ------------------------------------------------------------------------------------------ impacts */

/* Let the rows of struck joints act at this instant; of strings those that are tight, or only those that are `taut`. */
static void aim_now(int taut) {
    for (Joint *j = W.joints; j < W.joints + W.joint_count; j++) {
        JointRow *r = W.joint_rows + j->row;
        int tight = j->taut || (!taut && is_tight(j));
        int acts = j->struck && (j->kind == STRING ? tight : j->kind != SPRING);
        double d[4];
        for (int n = 0; n < rows_of(j); n++) r[n].on = acts;
        if (!acts) continue;
        between(j, 0, d);
        aim(j, d, d, 0);
    }
}

/* Release strings that would push; return whether there are any. */
static int let_go(void) {
    int found = 0;
    for (JointRow *r = W.joint_rows; r < W.joint_rows + W.joint_row_count; r++) {
        const Disk *d = at_end(2 * r->joint);
        /* What goes along its circle has no speed along the string but what rounding makes. */
        double rounds = BAND * d->mass * (fabs(d->vx) + fabs(d->vy));
        if (!r->on || W.joints[r->joint].kind != STRING || r->off <= rounds) continue;
        r->on = 0;
        found = 1;
    }
    return found;
}

/* Give the particles the impulses that are in `off` of the rows. */
static void give_impulses(void) {
    for (JointRow *r = W.joint_rows; r < W.joint_rows + W.joint_row_count; r++)
        for (int end = 0; end < 2 && r->on; end++) {
            Disk *d = at_end(2 * r->joint + end);
            if (!d || r->off == 0) continue;
            was_moved((int)(d - W.disks));
            tug(r, end, r->off, &d->vx, &d->spin);
        }
}

/* Mark all joints that are connected to struck ones as struck. */
static void spread_struck(void) {
    for (int more = 1; more;) {
        more = 0;
        for (int n = 0; n < 2 * W.joint_count; n++) {
            const Disk *d = at_end(n);
            if (!d || !W.joints[n / 2].struck) continue;
            for (int end = d->tie; end >= 0; end = W.joints[end / 2].next[end % 2]) {
                Joint *j = W.joints + end / 2;
                if (!j->tied || j->struck) continue;
                j->struck = more = 1;
            }
        }
    }
}

/* Stop the rates of struck joints, without restitution. */
static void stop(void) {
    spread_struck();
    aim_now(0);
    do {
        for (JointRow *r = W.joint_rows; r < W.joint_rows + W.joint_row_count; r++) r->off = -rate_of(r);
        factor(1, 0);
        solve();
    } while (let_go());
    /* For rows that are solved together only the sum of the losses has a meaning: a gain becomes 0. */
    double all = 0, losses = 0;
    for (const JointRow *r = W.joint_rows; r < W.joint_rows + W.joint_row_count; r++) {
        double loss = r->on ? -0.5 * r->off * rate_of(r) : 0;
        all += loss;
        losses += MAX(loss, 0);
    }
    for (JointRow *r = W.joint_rows; r < W.joint_rows + W.joint_row_count; r++) {
        Joint *j = W.joints + r->joint;
        double loss[3] = {0, losses > 0 ? -0.5 * r->off * rate_of(r) * all / losses : 0, 0};
        if (j->struck && j->kind == STRING) j->taut = r->on;
        if (!r->on || !(loss[1] > 0)) continue;
        book(W.disks[j->particle].entries, j->other < 0 ? 0 : W.disks[j->other].entries, W.owner_count, loss);
    }
    give_impulses();
}

/* Begin a step: tie joints whose particles have been released, and stop strings that have become tight. Particles in
   contact keep a rate of second order along their joints. */
void tie_joints(void) {
    int fresh = 0;
    W.moved_count = 0;
    W.shocks++;
    for (Joint *j = W.joints; j < W.joints + W.joint_count; j++) {
        const Disk *a = W.disks + j->particle, *b = j->other < 0 ? 0 : W.disks + j->other;
        int was = j->tied;
        double d[4];
        j->struck = 0;
        j->tied = a->mode == FREE && (!b || b->mode == FREE);
        if (!j->tied) continue;
        if (!was && j->kind == PIN) {
            for (int end = 0; end < 2 && at_end(2 * (int)(j - W.joints) + end); end++) {
                const Disk *disk = at_end(2 * (int)(j - W.joints) + end);
                double away[2] = {j->from[0] - disk->x, j->from[1] - disk->y};
                turn_arm(away, -disk->turned, j->arm + 2 * end);
            }
        }
        if (!was) {
            between(j, 0, j->now);
            if (isnan(j->length)) j->length = length_of(j->now);
            j->kept[0] = j->kept[1] = j->kind == SPRING ? kept_in(j, length_of(j->now)) : 0;
        }
        j->struck = !was && j->kind != STRING;
        if (j->kind == STRING && !j->taut) {
            between(j, 0, d);
            aim(j, d, d, 0);
            double rate = rate_of(W.joint_rows + j->row);
            j->struck = rate > 0 && length_of(d) + SOON * W.dt * rate >= (1 - BAND) * j->length;
            j->taut = j->struck;
        }
        fresh |= j->struck;
    }
    if (fresh) stop();
    for (int k = 0; k < W.moved_count; k++) {
        Disk *d = W.disks + W.moved[k];
        d->changes++;
        d->moved = 0;
        knot_after(W.moved[k]);
    }
    for (int i = W.low; i < W.high; i++)
        if (W.disks[i].tie >= 0 && W.disks[i].mode == FREE && !W.tracks[i].lasted) track_flying(i);
}

/* Begin an impact of one or two particles, of which at least one has joints. */
void strike_joints(int i, int j) {
    for (Joint *one = W.joints; one < W.joints + W.joint_count; one++)
        one->struck = one->tied && (one->particle == i || one->other == i
                                    || (j >= 0 && (one->particle == j || one->other == j)));
    stop();
}

/* End such an impact: it may have made strings tight. */
void end_blow(void) {
    for (const Joint *j = W.joints; j < W.joints + W.joint_count; j++) {
        if (!j->struck || j->kind != STRING || j->taut || !is_tight(j)) continue;
        double d[4];
        between(j, 0, d);
        aim(j, d, d, 0);
        if (!(rate_of(W.joint_rows + j->row) > 0)) continue;
        stop();
        return;
    }
}

/* Let joints respond to an impact, whose impulses are found one by one, at this instant; see
   `answer_with_joints`. */
void begin_answers(void) {
    aim_now(1);
    factor(1, 0);
    for (JointRow *r = W.joint_rows; r < W.joint_rows + W.joint_row_count; r++)
        for (int end = 0; end < 2 && r->on; end++) {
            const Disk *d = at_end(2 * r->joint + end);
            if (d) was_moved((int)(d - W.disks));
        }
}

void forget_answers(void) {
    for (JointRow *r = W.joint_rows; r < W.joint_rows + W.joint_row_count; r++) r->answer = 0;
}

/* Give the joints' impulses that stop the rates caused by the impulses given to particles so far. */
void answer_with_joints(void) {
    for (JointRow *r = W.joint_rows; r < W.joint_rows + W.joint_row_count; r++) r->off = -rate_of(r);
    solve();
    for (JointRow *r = W.joint_rows; r < W.joint_rows + W.joint_row_count; r++) {
        if (r->on) r->answer += r->off;
        for (int end = 0; end < 2 && r->on; end++) {
            Disk *d = at_end(2 * r->joint + end);
            if (d) tug(r, end, r->off, &d->vx, &d->spin);
        }
    }
}

/* Release strings that would push by their responses, and take all responses back; return whether there are any. */
int let_go_again(void) {
    JointRow *rows = W.joint_rows, *last = rows + W.joint_row_count;
    for (JointRow *r = rows; r < last; r++) r->off = r->answer;
    if (!let_go()) return 0;
    for (JointRow *r = rows; r < last; r++) {
        for (int end = 0; end < 2 && r->answer != 0; end++) {
            Disk *d = at_end(2 * r->joint + end);
            if (d) tug(r, end, -r->answer, &d->vx, &d->spin);
        }
        r->answer = 0;
    }
    factor(1, 0);
    return 1;
}

/* What of the lengths of joints the step misses, as a share of them. */
double missed_by_joints(void) { return missed; }
