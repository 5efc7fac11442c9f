/* What surfaces bear in bins of time: sums of impulses, where engines tell of each. No mechanics. */

#ifndef LOADS_H
#define LOADS_H
#include "layout.h"

/* What a surface bears in a time. Without acceleration and velocity the place stays; an impulse is spread
   evenly, at an instant it is all in one bin. */
typedef struct {
    int owner;
    double from, to;        /* s */
    double x, y, vx, vy, ax, ay; /* of the place on the surface, as the time begins */
    double nx, ny;          /* unit normal of the surface, towards the particle */
    double jx, jy, couple;  /* on the particle, N s and N m s */
} Push;

extern Loads B;

/* Set the first bins apart; 0 if there is no memory. */
int lay_out_bins(int owners, int disks);

void bear(const Push *p);

/* Keep what a lasting contact gave a disk between two times: the impulse J, and b, see `Lasting`. */
void keep_contact(int disk, int other, double from, double to, const double *J, const double *b);

/* Keep what holds a sleeper from then on, each second, until it wakes. */
void keep_asleep(int disk, int other, double from, const double *force, const double *b);

/* A disk woke: what held it, did so for some time. */
void keep_awake(int disk, double to, double time);

#endif
