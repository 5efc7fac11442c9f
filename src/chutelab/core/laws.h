/* What the files of the laws share. */

#ifndef LAWS_H
#define LAWS_H
#include <math.h>
#include "layout.h"
#include "memory.h"

#define MIN(a, b) ((a) < (b) ? (a) : (b))
#define MAX(a, b) ((a) > (b) ? (a) : (b))

extern Laws L;

/* A knot by its number. */
#define KNOT(k) (L.knots + (long)(k) * L.row)

/* laws.c */
int judge(void);

/* barriers.c */
void shape_barriers(void);
double beside(const Barrier *b, double x, double y);
int is_within(const Barrier *b, double x, double y, double margin);
double distance(const Barrier *b, double x, double y);
void place_at(const double *knot, double share, double *x, double *y);
int find_hits(int particle);

#endif
