/* What the files share that make the obstacles of the exact engine from the pieces of a machine. */

#ifndef EXACT_PIECES_H
#define EXACT_PIECES_H
#include "exact.h"

/* A segment, or a part of one, with its ends. */
typedef struct { double x, y, ex, ey, length; const Segment *of; int source; } Part;

extern Part *parts;
extern int part_count, are_points; /* whether particles are mass points */
extern const Arc **bends; /* those with ends first */
extern int *bend_source;
extern double *xs;        /* of the ends, for sorting */
extern int *order;        /* ends sorted by x */
extern int *at_spot;      /* first end at each spot, or -1 ... */
extern int *next_there;   /* ... and the next of each */

static inline double extent_of(const Arc *a) { return MIN(a->extent, TURN); }

/* Times at which a piece appears and vanishes, s. Segments, or parts of them, come before arcs. */
static inline double came_of(int piece) {
    return piece < part_count ? parts[piece].of->appears : bends[piece - part_count]->appears;
}
static inline double went_of(int piece) {
    return piece < part_count ? parts[piece].of->vanishes : bends[piece - part_count]->vanishes;
}
static inline int stays(int piece) { return isinf(came_of(piece)) && isinf(went_of(piece)); }

/* Whether an obstacle, or one of its pieces, exists after a change of gates. */
static inline int is_open(const Obstacle *o, int piece, double since) {
    return piece < 0 ? o->came <= since && o->went > since : came_of(piece) <= since && went_of(piece) > since;
}

static inline int compared(double a, double b) { return a < b ? -1 : a > b; }
static inline int ascending(const void *a, const void *b) {
    return compared(*(const double *)a, *(const double *)b);
}

/* exact_pieces.c */
extern int arena_full;
void *take_room(double count, int size);
int before(double x);

/* exact_cuts.c */
int cut_parts(double near);
int cut_bends(double near);

/* exact_joints.c */
int find_joints(void);

#endif
