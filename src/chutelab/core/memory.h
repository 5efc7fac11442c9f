/* The core's own memory: arrays, one behind the other. */

#ifndef MEMORY_H
#define MEMORY_H

#define EXPORT __attribute__((visibility("default")))

/* Reserve memory for so many rows, all zero; NULL if there is not enough. */
__attribute__((noinline)) void *reserve(double count, unsigned size);

/* The same without clearing it: for arrays that are written before they are read. */
__attribute__((noinline)) void *set_apart(double count, unsigned size);

/* Copy an array of `had` rows, of which `count` are in use, to a place with twice as many rows. */
void *stretch(const void *rows, int count, int had, unsigned size);

/* Greatest number of knots, or of events, of a run of particles that do not meet for which room is made before the host
   has to take them. */
#define KEPT 160000
/* The same where most knots are dropped as a family runs. */
#define BRIEF_KEPT (4 * KEPT)

/* Whether all that was asked for could be reserved. */
int has_room(void);

/* Point a field to so many new rows. */
#define RESERVE(field, count) ((field) = reserve(count, sizeof *(field)))

/* Point a field to twice as many rows, of which `count` are in use; `room` is their number. */
#define STRETCH(field, count, room) \
    ((field) = stretch(field, count, room, sizeof *(field)), (room) *= 2, (field) != 0)

#endif
