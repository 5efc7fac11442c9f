/* What the files about particles with corners share: a particle or a surface at an instant. */

#ifndef SHAPE_H
#define SHAPE_H
#include "core.h"

/* A particle or a surface at a time. A segment has two points, an arc its ends and its centre, something round its
   centre. */
typedef struct {
    double p[MOST_CORNERS][2];
    double n[MOST_CORNERS][2]; /* of a polygon: unit vectors out of its edges */
    double x, y, radius;    /* x, y: centre of a particle */
    const double *edges;    /* of a polygon: see `World.edges` */
    const Surface *s;
    int count, round;       /* number of points; the one with a radius, or -1 */
    int facing;             /* of two polygons: the edge that faces the other one, see `are_apart`, */
    double clear;           /* and how far its best edge separates the other, m */
} Shape;

/* The smaller and the larger of two numbers, without a branch. */
static inline double smaller(double a, double b) {
    return wasm_f64x2_extract_lane(wasm_f64x2_pmin(wasm_f64x2_splat(b), wasm_f64x2_splat(a)), 0);
}
static inline double larger(double a, double b) {
    return wasm_f64x2_extract_lane(wasm_f64x2_pmax(wasm_f64x2_splat(b), wasm_f64x2_splat(a)), 0);
}

/* Unit vector out of an edge of a polygon, and the length of the edge. */
static inline double out_of(const Shape *a, int edge, double *n) {
    n[0] = a->n[edge][0];
    n[1] = a->n[edge][1];
    return a->edges[3 * edge + 2];
}

static inline double off_edge(const Shape *a, int edge, const double *q) {
    return (q[0] - a->p[edge][0]) * a->n[edge][0] + (q[1] - a->p[edge][1]) * a->n[edge][1];
}

/* The edge that a point is furthest outside of, and its distance from that edge, m. */
static inline int furthest(const Shape *a, const double *q, double *off) {
    int found = 0;
    for (int n = 0; n < a->count; n++) {
        double one = off_edge(a, n, q);
        if (n && one <= *off) continue;
        *off = one;
        found = n;
    }
    return found;
}

/* The distance of a point from the edge that it is furthest outside of, m. */
static inline double outside(const Shape *a, const double *q) {
    double off = off_edge(a, 0, q);
    for (int n = 1; n < a->count; n++) off = larger(off, off_edge(a, n, q));
    return off;
}

/* shapes.c */
const double *pose_of(int j);
void turn_pose(int j, double by, double *pose);
Shape shape_of(int j, double t);
int are_apart(Shape *a, Shape *b, double by);
void fill_in(const Shape *a, const Shape *b, Touch *t);
int side_of(const Shape *a, const Surface *s, int corner, double near);
int find_place(const Shape *a, const Shape *b, double near, Touch *t);
int overlap(const Shape *a, const Shape *b);
int list_places_of(Shape *a, Shape *b, double near, double within, Touch *list);

#endif
