/* The core's own memory: arrays, one behind the other. */

#ifndef MEMORY_H
#define MEMORY_H

#define EXPORT __attribute__((visibility("default")))

/* Set bytes apart, all zero, for so many rows; NULL if there are none to be had. */
__attribute__((noinline)) void *reserve(double count, unsigned size);

/* The same, of any bytes: for what is written before it is read. */
__attribute__((noinline)) void *set_apart(double count, unsigned size);

/* Have an array of `had` rows, of which `count` are in use, go on elsewhere with twice as many. */
void *stretch(const void *rows, int count, int had, unsigned size);

/* Knots, or events, of a run of particles that do not meet, up to which there is made more room for them
   before the host is to take them. */
#define KEPT 160000

/* Whether all that was reserved is there. */
int has_room(void);

/* Have a field point to so many rows. */
#define RESERVE(field, count) ((field) = reserve(count, sizeof *(field)))

/* Have a field point to twice as many rows, of which so many are in use; `room` is how many there are. */
#define STRETCH(field, count, room) \
    ((field) = stretch(field, count, room, sizeof *(field)), (room) *= 2, (field) != 0)

#endif
