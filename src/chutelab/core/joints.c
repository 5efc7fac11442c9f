/* Joints: strings, rods, springs and pins. Where they act, and the linear system of their rows.

   A row is one number that impulses along a joint change: its length, or a coordinate of a pin. */

#include <string.h>
#include "joint.h"

/* Share of the diagonal: a row with a smaller pivot depends on the others. */
#define DEPENDS 1e-13


/* Place and velocity of a particle a span after the step's beginning, and by what it has turned. */
typedef struct { double x, y, turned; } Pose;

static Pose pose_at(const Disk *d, double h) {
    return (Pose){ d->x + (d->vx + 0.5 * W.gx * h) * h, d->y + (d->vy + 0.5 * W.gy * h) * h, d->turned + d->spin * h };
}

/* The arm of a pin from the centre of a particle that has rotated. */
void turn_arm(const double *arm, double turned, double *out) {
    double c = cos(turned), s = sin(turned);
    out[0] = c * arm[0] - s * arm[1];
    out[1] = s * arm[0] + c * arm[1];
}

/* Whether a joint is a string between two particles over a pulley: a point without mass or friction. */
static int has_pulley(const Joint *j) { return j->kind == STRING && j->other >= 0 && !isnan(j->from[0]); }

/* The two vectors whose lengths add up to that of a joint: from its other end to its particle, and 0; or from a pulley to
   both particles. `h` is the time since the beginning of the step. */
void vectors_of(const Joint *j, double h, double *out) {
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

/* The length of a joint, from the vectors of `vectors_of`. */
double length_of_joint(const double *d) { return size(d) + size(d + 2); }

/* Whether a string is as long as it can be. */
int is_tight(const Joint *j) {
    double d[4];
    vectors_of(j, 0, d);
    return length_of_joint(d) >= (1 - BAND) * j->length;
}

/* Change velocity and spin of the particle at one end of a row by an impulse `kick`, N s. */
void tug(const JointRow *r, int end, double kick, double *v, double *spin) {
    const Disk *d = disk_at(2 * r->joint + end);
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

/* Acceleration by which joints press a particle on what it touches at a contact, m/s2. */
double pressed_by_joints(const Contact *c) {
    const Disk *a = W.disks + c->i, *b = W.disks + MAX(c->j, 0);
    double press = 0;
    if (is_tied(c->i)) press -= a->drawn[0] * c->nx + a->drawn[1] * c->ny + (c->cornered ? c->own[0] * a->drawn[2] : 0);
    if (c->two && is_tied(c->j))
        press += b->drawn[0] * c->nx + b->drawn[1] * c->ny - (c->cornered ? c->others[0] * b->drawn[2] : 0);
    return press;
}

/* Set the rows of a joint whose vectors change from d0 to d1 within h: how they act, and by how much they are missed. */
void aim_rows(const Joint *j, const double *d0, const double *d1, double h) {
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
                const Disk *d = disk_at(2 * (int)(j - W.joints) + end);
                double arm[2], half = d ? 0.5 * h * d->spin : 0;
                if (!d) continue;
                turn_arm(j->arm + 2 * end, d->turned + half, arm);
                r->lever[end] = (n ? arm[0] : -arm[1]) * (half != 0 ? sin(half) / half : 1) * (end ? -1 : 1);
            }
        }
        return;
    }
    double before = length_of_joint(d0), after = length_of_joint(d1);
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

/* Rate at which a joint becomes longer, m/s. */
double rate_of_row(const JointRow *r) {
    double sum = 0;
    for (int end = 0; end < 2; end++) {
        const Disk *d = disk_at(2 * r->joint + end);
        if (!d) continue;
        sum += d->vx * r->e[2 * end] + d->vy * r->e[2 * end + 1] + r->lever[end] * d->spin;
    }
    return sum;
}

/* Add up all springs, as in `Total`. */
void add_springs(double *sums) {
    for (const Joint *j = W.joints; j < W.joints + W.joint_count; j++) {
        const double own[4] = {j->kept[0], j->kept[1], j->damped, j->given};
        for (int n = 0; n < 4; n++) sums[n] += own[n];
    }
}

/* ------------------------------------------------------------------------------- systems of rows */

static double *cell(int p, int q) { return W.joint_matrix + (long)p * W.joint_row_count + q; }

/* Change of the rate of one row by an impulse of 1 N s of another, through the particle at one end, 1/kg. */
static double rate_change(const JointRow *p, int end, const JointRow *q, int with) {
    const Disk *d = disk_at(2 * p->joint + end);
    const double *e = p->e + 2 * end, *f = q->e + 2 * with;
    return (e[0] * f[0] + e[1] * f[1]) * d->inv_mass + p->lever[end] * q->lever[with] * d->inv_inertia;
}

/* Set the matrix of the rows that act, `scale` times the effect of impulses, and factor it: L D L^T within the envelope
   of its rows, which in a chain has a width of one or two. */
void factor_rows(double scale, int eases) {
    JointRow *rows = W.joint_rows;
    for (int p = 0; p < W.joint_row_count; p++) {
        JointRow *r = rows + p;
        r->first = p;
        if (!r->on) continue;
        for (int pass = 0; pass < 2; pass++) {
            for (int q = r->first; pass && q <= p; q++) *cell(p, q) = 0;
            for (int end = 0; end < 2; end++) {
                const Disk *d = disk_at(2 * r->joint + end);
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
void solve_rows(void) {
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
