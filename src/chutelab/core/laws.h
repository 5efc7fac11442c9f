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

/* Knots that break a law, found in the order of particles. */
typedef struct { int particles, particle, latest, knot; } Group;

/* Sums over all particles, and the largest and least values of one. `lightness` sums 1 / mass. `size` is of pieces: the
   largest coordinate and length of segments, coordinate and radius of arcs; `belts` their largest speed. `whirl` is the
   largest speed of a corner by rotation, m/s; `cornered` sums mass times radius, kg m, of what has corners; `reach` the largest coordinate or length of anything, m. For particles that
   do not meet also the energy that is unexplained at their ends, J, its largest change between two knots, and the least
   value of `given_back`. */
struct Sums {
    double mass, lightness, weight, cornered, heaviest, smallest, gravity, size[4], belts;
    double t, knot_t, place, reach, fastest, whirl, lifted, entries[3], residual, change, back;
    Group bad;
    int unreal;
};

extern struct Sums All;

static inline int last_of(int i) { return L.offsets[i + 1] - 1; }

static inline int is_released(int i) { return L.offsets[i + 1] > L.offsets[i]; }

static inline double speed_squared(const double *knot) { return square(knot[3]) + square(knot[4]); }

/* laws.c */
Breach *tell(int law, double amount, double bound);
void add(Group *group, int i, int knot);
void tell_group(int law, const Group *group, double amount, double bound);
int judge(void);
int judge_some(int end);
int judge_rest(void);

/* allowed.c */
double unexplained(int i, const double *knot);
double given_back(const double *now);
void scan_machine(void);
int scan_track(int i);
int are_finite(void);
void find_allowed(double bent);
double longest_step(void);
void find_limits(void);

/* energy.c */
int is_even(double most);
void judge_books(double bound);

/* barriers.c */
void shape_barriers(void);
double beside(const Barrier *b, double x, double y);
int is_within(const Barrier *b, double x, double y, double margin);
double distance(const Barrier *b, double x, double y);
const Barrier *nearest(const Barrier *b, double x, double y, double *gap, double *off);
void to_rest(const Barrier *b, double t, double *x, double *y);
double swiftest(const Barrier *b, double *haste);

/* hits.c */
void place_at(const double *knot, double share, double *x, double *y);
double angle_at(int knot, double share);
int find_hits(int particle);

/* overlaps.c */
double depth_at(int i, int k, int j, int l, double t);
void find_overlaps(double bound, Breach *found);

#endif
