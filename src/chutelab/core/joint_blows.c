/* Impulses of joints: if a particle is struck, a string becomes tight, or joints are tied, they act at that instant. */

#include "joint.h"

/* Let the rows of struck joints act at this instant; of strings those that are tight, or only those that are `taut`. */
static void aim_now(int taut) {
    for (Joint *j = W.joints; j < W.joints + W.joint_count; j++) {
        JointRow *r = W.joint_rows + j->row;
        int tight = j->taut || (!taut && is_tight(j));
        int acts = j->struck && (j->kind == STRING ? tight : j->kind != SPRING);
        double d[4];
        for (int n = 0; n < rows_of(j); n++) r[n].on = acts;
        if (!acts) continue;
        vectors_of(j, 0, d);
        aim_rows(j, d, d, 0);
    }
}

/* Release strings that would push; return whether there are any. */
static int let_go(void) {
    int found = 0;
    for (JointRow *r = W.joint_rows; r < W.joint_rows + W.joint_row_count; r++) {
        const Disk *d = disk_at(2 * r->joint);
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
            Disk *d = disk_at(2 * r->joint + end);
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
            const Disk *d = disk_at(n);
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
        for (JointRow *r = W.joint_rows; r < W.joint_rows + W.joint_row_count; r++) r->off = -rate_of_row(r);
        factor_rows(1, 0);
        solve_rows();
    } while (let_go());
    /* For rows that are solved together only the sum of the losses has a meaning: a gain becomes 0. */
    double all = 0, losses = 0;
    for (const JointRow *r = W.joint_rows; r < W.joint_rows + W.joint_row_count; r++) {
        double loss = r->on ? -0.5 * r->off * rate_of_row(r) : 0;
        all += loss;
        losses += MAX(loss, 0);
    }
    for (JointRow *r = W.joint_rows; r < W.joint_rows + W.joint_row_count; r++) {
        Joint *j = W.joints + r->joint;
        double loss[3] = {0, losses > 0 ? -0.5 * r->off * rate_of_row(r) * all / losses : 0, 0};
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
            for (int end = 0; end < 2 && disk_at(2 * (int)(j - W.joints) + end); end++) {
                const Disk *disk = disk_at(2 * (int)(j - W.joints) + end);
                double away[2] = {j->from[0] - disk->x, j->from[1] - disk->y};
                turn_arm(away, -disk->turned, j->arm + 2 * end);
            }
        }
        if (!was) {
            vectors_of(j, 0, j->now);
            if (isnan(j->length)) j->length = length_of_joint(j->now);
            j->kept[0] = j->kept[1] = j->kind == SPRING ? kept_in(j, length_of_joint(j->now)) : 0;
        }
        j->struck = !was && j->kind != STRING;
        if (j->kind == STRING && !j->taut) {
            vectors_of(j, 0, d);
            aim_rows(j, d, d, 0);
            double rate = rate_of_row(W.joint_rows + j->row);
            j->struck = rate > 0 && length_of_joint(d) + SOON * W.dt * rate >= (1 - BAND) * j->length;
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
        vectors_of(j, 0, d);
        aim_rows(j, d, d, 0);
        if (!(rate_of_row(W.joint_rows + j->row) > 0)) continue;
        stop();
        return;
    }
}

/* Let joints respond to an impact, whose impulses are found one by one, at this instant; see
   `answer_with_joints`. */
void begin_answers(void) {
    aim_now(1);
    factor_rows(1, 0);
    for (JointRow *r = W.joint_rows; r < W.joint_rows + W.joint_row_count; r++)
        for (int end = 0; end < 2 && r->on; end++) {
            const Disk *d = disk_at(2 * r->joint + end);
            if (d) was_moved((int)(d - W.disks));
        }
}

void forget_answers(void) {
    for (JointRow *r = W.joint_rows; r < W.joint_rows + W.joint_row_count; r++) r->answer = 0;
}

/* Give the joints' impulses that stop the rates caused by the impulses given to particles so far. */
void answer_with_joints(void) {
    for (JointRow *r = W.joint_rows; r < W.joint_rows + W.joint_row_count; r++) r->off = -rate_of_row(r);
    solve_rows();
    for (JointRow *r = W.joint_rows; r < W.joint_rows + W.joint_row_count; r++) {
        if (r->on) r->answer += r->off;
        for (int end = 0; end < 2 && r->on; end++) {
            Disk *d = disk_at(2 * r->joint + end);
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
            Disk *d = disk_at(2 * r->joint + end);
            if (d) tug(r, end, -r->answer, &d->vx, &d->spin);
        }
        r->answer = 0;
    }
    factor_rows(1, 0);
    return 1;
}
