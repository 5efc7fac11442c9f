/* What the files share that draw releases: the drawing, a line a function. */

#ifndef RELEASES_H
#define RELEASES_H
#include "plan.h"
#include "random.h"

extern Drawing D;

/* A place that a disk may be put to. */
typedef struct { double x, y; int taken; } Place;

/* room.c */
void enter_room(const Tables *t);
int take_what_is_in_surfaces(Place *places, int count, double radius);
void list_near_releases(void);
void clear_piece(int k, Refusal *refusal);

#endif
