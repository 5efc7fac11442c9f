/* Loads on surfaces in bins of time: sums of the impulses that engines report. No mechanics. */

#ifndef LOADS_H
#define LOADS_H
#include "layout.h"

/* A load on a surface from one time to another. Its place moves with a velocity and an acceleration, if there are any.
   The impulse is spread evenly over the time; at an instant it is in one bin. */
typedef struct {
    int owner;
    double from, to;        /* s */
    double x, y, vx, vy, ax, ay; /* of the place on the surface, at the beginning */
    double nx, ny;          /* unit normal of the surface, towards the particle */
    double jx, jy, couple;  /* on the particle, N s and N m s */
} Push;

extern Loads B;

/* Reserve the first bins; return 0 if there is no memory. */
int lay_out_bins(int owners);

void bear(const Push *p);

/* Record what a lasting contact gave a disk between two times: the impulse J, and b, see `Lasting`. */
void keep_contact(int disk, int other, double from, double to, const double *J, const double *b);

#endif
