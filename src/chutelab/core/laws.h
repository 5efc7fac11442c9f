/* What the files of the laws share. */

#ifndef LAWS_H
#define LAWS_H
#include <math.h>
#include "layout.h"
#include "memory.h"
#include "trig.h"

#define MIN(a, b) ((a) < (b) ? (a) : (b))
#define MAX(a, b) ((a) > (b) ? (a) : (b))

static inline double square(double a) { return a * a; }

/* Two numbers side by side, such as x and y: one instruction works on both. */
#define PAIRED __attribute__((target("simd128")))
typedef double Two __attribute__((vector_size(16), aligned(8)));
typedef long long Truth __attribute__((vector_size(16)));

PAIRED static inline Two two_at(const double *place) { return *(const Two *)place; }
PAIRED static inline Two both(double a) { return (Two){ a, a }; }
PAIRED static inline Two lesser(Two a, Two b) { return __builtin_wasm_pmin_f64x2(a, b); }
PAIRED static inline Two larger(Two a, Two b) { return __builtin_wasm_pmax_f64x2(a, b); }
PAIRED static inline Two size_of(Two a) { return __builtin_wasm_abs_f64x2(a); }
PAIRED static inline int is_any(Truth a) { return __builtin_wasm_any_true_v128(a); }
PAIRED static inline int is_all(Truth a) { return __builtin_wasm_all_true_i64x2(a); }

extern Laws L;

/* Number of members of a family, and the member that a particle belongs to. */
static inline int members(void) { return L.each ? L.particle_count / L.each : 1; }
static inline long member_of(int i) { return L.each ? i / L.each : 0; }

/* Number of consecutive intervals, or knots, that are first checked by a common box: they are near each other. */
#define WIDTH 32

/* A knot by its number. */
#define KNOT(k) (L.knots + (long)(k) * L.row)

/* laws.c */
int judge(void);
int judge_some(int end);
int judge_rest(void);

/* barriers.c */
void shape_barriers(void);
double beside(const Barrier *b, double x, double y);
int is_within(const Barrier *b, double x, double y, double margin);
double distance(const Barrier *b, double x, double y);
void to_rest(const Barrier *b, double t, double *x, double *y);
double swiftest(const Barrier *b, double *haste);
void place_at(const double *knot, double share, double *x, double *y);
double angle_at(int knot, double share);
int find_hits(int particle);

/* overlaps.c */
void find_overlaps(double bound, Breach *found);

#endif
