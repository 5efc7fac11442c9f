/* What the files about joints share: where joints act, and how their rows are solved. */

#ifndef JOINT_H
#define JOINT_H
#include "core.h"

/* Share of its length; a string that is shorter by less is tight. */
#define BAND 1e-9

/* Energy kept in a spring of a length, J. */
static inline double kept_in(const Joint *j, double length) { return 0.5 * j->stiffness * square(length - j->length); }
static inline int rows_of(const Joint *j) { return 1 + (j->kind == PIN); }
/* The particle at an end of a joint, as `Disk.tie` counts ends, or NULL. */
static inline Disk *disk_at(int end) {
    int i = end % 2 ? W.joints[end / 2].other : W.joints[end / 2].particle;
    return i < 0 ? 0 : W.disks + i;
}

/* joints.c */
void turn_arm(const double *arm, double turned, double *out);
void vectors_of(const Joint *j, double h, double *out);
double length_of_joint(const double *d);
int is_tight(const Joint *j);
void tug(const JointRow *r, int end, double kick, double *v, double *spin);
void aim_rows(const Joint *j, const double *d0, const double *d1, double h);
double rate_of_row(const JointRow *r);
void factor_rows(double scale, int eases);
void solve_rows(void);

#endif
