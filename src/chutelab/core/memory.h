/* The core's own memory: arrays, one behind the other. */

#ifndef MEMORY_H
#define MEMORY_H

#define EXPORT __attribute__((visibility("default")))

/* Set bytes apart, all zero, for so many rows; NULL if there are none to be had. */
__attribute__((noinline)) void *reserve(double count, unsigned size);

/* Whether all that was reserved is there. */
int has_room(void);

/* Have a field point to so many rows. */
#define RESERVE(field, count) ((field) = reserve(count, sizeof *(field)))

#endif
