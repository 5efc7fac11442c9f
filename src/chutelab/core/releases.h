/* What the files that draw releases share: the drawing, and their functions. */

#ifndef RELEASES_H
#define RELEASES_H
#include "plan.h"

extern Drawing D;

/* A place where a disk may be put. */
typedef struct { double x, y; int taken; } Place;

/* random.c */
typedef struct { unsigned __int128 state, step; } Generator;
void seed_generator(Generator *g, const unsigned *words, int count);
double draw_uniform(Generator *g, double low, double high);

/* room.c */
void enter_room(const Tables *t);
int take_what_is_in_surfaces(Place *places, int count, double radius);
int clear_releases(void);
void box_in(void);

/* within.c */
/* How deep a piece is in a polygon, m, negative if it is outside, and the shift that clears the polygon of it. */
typedef struct { double depth, x, y; } Clearance;
/* For a segment, an arc round a centre, or, without both, a solid disk. */
Clearance clear_polygon(const Start *o, const double *outline, int count, const Segment *segment, const Arc *arc,
                        const double *center, double radius);

#endif
