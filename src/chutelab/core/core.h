/* What the files of the core share: the world, small helpers, and declarations of functions. */

#ifndef CORE_H
#define CORE_H
#include <math.h>
#include <wasm_simd128.h>
#include "layout.h"
#include "loads.h"
#include "memory.h"

#define MIN(a, b) ((a) < (b) ? (a) : (b))
#define MAX(a, b) ((a) > (b) ? (a) : (b))
#define ALARM (-1000000) /* partner of a release or of a ride's end; not the number of any surface */

/* For functions that hardly any scene calls: inlined they would slow down the others. */
#define RARELY __attribute__((noinline))

extern World W;

/* The array that was too small, so that `run` makes more room. */
enum Full { FULL_KNOTS = 100, FULL_EVENTS, FULL_TOTALS, FULL_NEAR, FULL_CONTACTS, FULL_SWINGS };

/* What a run does next. */
enum Phase { PART, STEP, WITHIN };

/* Contacts are searched up to a gap of this share of the radius. Lasting contacts have gaps up to a fifth of it at most,
   and nothing crosses the rest within a step without being foreseen. */
#define TOUCH 5e-3
/* Overlap, in radii, from which on nothing may approach further, not even by a hop. */
#define SUNK 1e-2
/* Share of the usual approach (see SKIP) that is left to the next step in such a contact: else a wedged pile, which
   cannot open, would sink by it in each step. */
#define HARDLY 0.1
/* Overlap, in radii, of disks that just touch, as places are written with some digits: such places count as free. */
#define TOUCHING 1e-9
/* Approach, in radii per step, that is left to the next step instead of an impact at its instant: a tenth of TOUCH, so
   that it becomes a contact before it is an overlap. */
#define SKIP 5e-4
/* The same for a disk with more than MANY impacts in a step: with each it grows by the factor GROW, up to MOST_SKIP. */
#define MOST_SKIP 5e-3
#define MANY 20
#define GROW 1.2
/* Number of a disk's impacts in a step from which on a slow one (below SLOW times what gravity gives in a step) has no
   restitution: this ends an inelastic collapse, which has infinitely many. */
#define FEW 10
#define SLOW 20.0
/* ... from which on a disk that rattles between surfaces is jammed: it is solved together with all that it touches ... */
#define JAM 40
/* ... and from which on the step ends, so that the whole crowd round it is solved together; or, if that was less than
   SHORTEST of a step ago, the jam. In a vast crowd jams come first, see `jams_pay`. */
#define CROWDED 50
#define SHORTEST 0.02
/* ... and from which on more is left to the next step, without bound, as jams do not calm it. */
#define STUCK 500
/* Number of disks that a jam solves, with all that they touch. Beyond them impacts go on singly, so that a pile of
   thousands is not solved at each jam. */
#define JAMMED 30
/* Contacts per disk for which a jam has room; disks in a plane have three pairs each at most. */
#define TOUCHES 8
/* Greatest number of sweeps of a jam: what they leave open rattles on, and causes the next jam after a few impacts. */
#define JAM_SWEEPS 2000
/* Greatest number of knots that an impact writes for a disk. */
#define KNOTS_EACH 6
/* Share of sqrt(g r); at a lower speed particles may fall asleep. 0.5 mm/s for r = 4 mm. */
#define REST 2.5e-3
/* m/s2; gravity for which bounds on speeds and times are written; for another one they are scaled by `W.pace`. */
#define EARTH 9.81
/* m/s on Earth; surfaces, and sleepers on them, whose velocities differ by less move alike. */
#define SAME_SPEED 1e-12
/* s on Earth; a particle has to be at rest for so long before it sleeps. */
#define CALM_DOWN 0.05
/* Share of the speed; a slower approach is a grazing one, and may be rounding. */
#define GRAZE 1e-6
/* Coefficient of friction, 76 degrees, that stops all slip in any impact; where sweeps diverge it is reduced from here
   on. */
#define ROUGH 4.0
/* Number of a disk's impacts in a step that no collapse reaches: something is wrong, and the run stops. */
#define STALL 20000
/* Share of the radius; hops of contacts stay below it, if need be by a shorter step. */
#define HOP 1e-3
/* Greatest path of a disk by itself in a step inside an arc, as a share of the room there: by this angle, rad, the path
   turns. */
#define TURN 0.2
/* Share of a step: events of joints that are nearer to its beginning or end count as there, else rounding would be
   corrected in a step of almost no length. */
#define SOON 1e-6
/* Greatest number of contacts, with corners, that are solved to rounding, and where impacts end hops; more are a crowd. */
#define FEW_CONTACTS 32
/* m/s on Earth; approach velocity that the alternating solve of contacts and joints may leave. It ends at a tenth of it. */
#define LEFT_BY_TURNS 1e-9
/* Times `W.soft`: approach up to which two particles of a crowd with corners, of which one is supported, are left to the
   next step. */
#define LATEST 4
/* Number of impacts per lasting contact that an impact may pass on at its instant; others are foreseen. */
#define SHOCKS 4

static inline double square(double a) { return a * a; }

/* A place where a particle with corners is near something: the unit normal towards the particle, the gap now and later,
   the position; which corner of both it is, and what that is on, see shapes.c; and the number of such places of the two. */
typedef struct { double nx, ny, gap, later, x, y; int which, on, many; } Touch;
/* Greatest number of such places of two. */
#define MOST_TOUCHES 8

/* Two doubles at once; each is rounded as if alone. */
typedef v128_t Two;

static inline Two two(const double *from) { return wasm_v128_load(from); }
static inline Two times(double a, Two v) { return wasm_f64x2_mul(wasm_f64x2_splat(a), v); }
static inline Two plus(Two a, Two b) { return wasm_f64x2_add(a, b); }
static inline Two minus(Two a, Two b) { return wasm_f64x2_sub(a, b); }
/* Whether both numbers are within -most and most; NaN is not. */
static inline int are_within(Two v, double most) {
    return wasm_i64x2_all_true(wasm_f64x2_le(wasm_f64x2_abs(v), wasm_f64x2_splat(most)));
}

static inline const Pair *pair_of(int kind, int other) {
    return W.pairs + kind * (W.kind_count + W.material_count) + other;
}
static inline const Pair *surface_pair(const Disk *d, int k) {
    return pair_of(d->kind, W.kind_count + W.surfaces[k].material);
}
/* Cohesion of disk i with disk j, or with surface k as j = -1 - k, N. */
static inline double cohesion_of(int i, int j) {
    const Disk *d = W.disks + i;
    return (j < 0 ? surface_pair(d, -1 - j) : pair_of(d->kind, W.disks[j].kind))->cohesion;
}
/* Whether a surface ignores a disk: a gate has closed on it, or a one-sided surface lets it pass, and it is not clear of
   it yet. CLEARS: it will be in this step. */
#define CLEARS 2
static inline int *spared_by(const Surface *s, const Disk *d) {
    return W.spared + (d - W.disks) * W.gate_count + s->gate;
}
static inline int is_spared(const Surface *s, const Disk *d) {
    return s->gate >= 0 && *spared_by(s, d);
}
/* Whether a particle has corners, or one of two. */
static inline int has_corners(const Disk *d) { return W.outline_count && d->corners; }
static inline int is_cornered(int i, int j) {
    return W.outline_count && (W.disks[i].corners || (j >= 0 && W.disks[j].corners));
}
/* Whether a surface exists and overlaps the box that a disk can reach in this step ... */
static inline int is_beside(const Surface *s, const Disk *d) {
    return s->there && s->box[0] < d->right && s->box[2] > d->left && s->box[1] < d->top
        && s->box[3] > d->bottom;
}
/* ... and does not ignore it. */
static inline int is_near(const Surface *s, const Disk *d) { return is_beside(s, d) && !is_spared(s, d); }
/* The piece that continues smoothly beyond an end of a surface in this step, for all particles, for a circle one that leads
   to it; or -1. */
static inline int mate_of(const Surface *s, int n) {
    int mate = s->mates[n];
    if (mate < 0 || s->ledges[n] > W.ledge) return -1;
    return W.surfaces[mate].there && !W.surfaces[mate].ignored ? mate : -1;
}
/* Whether two surfaces, in the numbers of `Contact.j`, continue each other; whether two partners of a disk are the same
   or do so. */
static inline int is_mate(int j, int other) {
    const Surface *s = W.surfaces + (-1 - j);
    return mate_of(s, 0) == -1 - other || mate_of(s, 1) == -1 - other;
}
static inline int goes_on(int j, int other) {
    return j == other || (j < 0 && other < 0 && (is_mate(j, other) || is_mate(other, j)));
}
/* The same for surfaces that a disk touches at the same place: pieces that lie on each other, or a point that two share. */
int is_one(const Disk *d, int k, int other);
void stall_too(Contact *c);
int is_held(const Disk *d, int k);
/* Whether a disk that is on a piece at the beginning of a step cannot be inside an arc at its end. */
static inline int is_flat(const Surface *s) {
    return s->shape == SEGMENT && mate_of(s, 0) < 0 && mate_of(s, 1) < 0;
}
/* Longest step in which a disk that is pressed on something with this acceleration (m/s2) hops no higher than HOP radii,
   s. */
static inline double hop_time(const Disk *d, double press) {
    return press > 0 ? sqrt(8 * HOP * (has_corners(d) ? d->inner : d->radius) / press) : INFINITY;
}
/* A surface at its position at t. */
const Surface *move_to(Surface *s, double t);
static inline const Surface *surface_at(int k, double t) {
    Surface *s = W.surfaces + k;
    return s->mover < 0 || s->posed == t ? s : move_to(s, t);
}
/* Whether a surface is on a hinge. */
static inline int is_hung(int k) { return W.surfaces[k].mover >= 0 && W.movers[W.surfaces[k].mover].inertia > 0; }
/* Whether a surface moves in this step. */
static inline int stirs(const Surface *s) { return s->mover >= 0 && W.movers[s->mover].stirs; }
/* Acceleration, m/s2, at which a gap closes without impulses in a step of length h, at a speed of `opens` at first. */
static inline double closing_rate(const Contact *c, double opens, double h) {
    return 2 * (c->gap + opens * h - c->free_gap) / (h * h);
}
/* Normal impulse of a contact less that of cohesion, N s. */
static inline double pressed(const Contact *c) { return c->impulse[0] - c->clings; }
double swung(const Contact *c, double f);
/* Work that the motion of a surface does by a contact's impulses after the share f of them, J. */
static inline double driven(const Contact *c, double f) {
    double still = (1 - f) * (pressed(c) * c->moved[0] + c->impulse[1] * c->moved[1] + c->impulse[2] * c->moved[2]);
    return c->hung ? still + swung(c, f) : still;
}
/* Time of the step before for which a contact's impulse also acts, s. */
static inline double past_of(const Contact *c) {
    return c->halved || !W.tracks[c->i].lasted ? 0 : 0.5 * W.length_before;
}
/* Share of this step's impulses on a disk that belongs to the step before. */
static inline double share_before(const Disk *d) { return d->halved ? 0 : W.before; }
/* Whether a particle has joints. */
static inline int is_tied(int i) { return i >= 0 && W.disks[i].tie >= 0; }
static inline int is_live(const Disk *d) { return d->mode >= RIDING && d->mode <= ASLEEP; }
/* Head of a loop over all disks that are live as a step begins or were released in it. */
#define EACH_LIVE(i) int at_##i = 0, i; at_##i < W.live_count && (i = W.live[at_##i], 1); at_##i++
/* Velocity of the partner of a contact; of a sleeper that without the hop. */
static inline const double *motion_of(const Disk *d) { return d->mode == ASLEEP ? &d->ux : &d->vx; }
/* Whether so many contacts, together with those of sleepers, are too few for a crowd. */
static inline int are_few(int contacts) { return contacts + W.frozen_count <= FEW_CONTACTS; }
static inline int sleeps(int i) { return i >= 0 && W.disks[i].mode == ASLEEP; }
/* Kinetic and potential energy of a disk for a velocity, a spin and a position, J. */
static inline double kinetic_of(const Disk *d, const double *v, double spin) {
    return 0.5 * (d->mass * (square(v[0]) + square(v[1])) + d->inertia * square(spin));
}
static inline double lifted(const Disk *d, const double *place) {
    return d->mass * W.g * (W.up[0] * place[0] + W.up[1] * place[1]);
}

/* Change of normal velocity that a contact asks for at a normal impulse, m/s. */
static inline double asks(const Contact *c, double impulse) {
    return MAX(MIN(c->need - c->gives * impulse, c->most), c->need - c->parts);
}

/* Move a disk along its parabola up to t. */
static inline void advance(Disk *d, double t) {
    double h = t - d->t;
    d->x += (d->vx + 0.5 * W.gx * h) * h;
    d->y += (d->vy + 0.5 * W.gy * h) * h;
    d->vx += W.gx * h;
    d->vy += W.gy * h;
    d->turned += d->spin * h;
    d->t = t;
}

/* Whether a disk by itself moves off a surface that is so rough that even a soft contact is an impact: it is not pressed
   again before it comes back. */
static inline int flies_off(const Disk *d, int k, double rate) {
    return surface_pair(d, k)->friction > ROUGH
        && rate > GRAZE * (sqrt(d->vx * d->vx + d->vy * d->vy) + W.soft);
}

/* geometry.c */
double gap_to(const Surface *s, double x, double y, double r, double *nx, double *ny);
const Surface *face_at(const Surface *s, double x, double y);
double surface_speed(const Surface *s, double nx, double ny, double x, double y, double r);
double bending(const Surface *s, double x, double y, double r);
double chain_gap(const Surface *s, const Disk *d, double x, double y, double t, double *side);
double clear_after(const Surface *s, const Disk *d, double span);
double meet_surface(const Surface *s, const Disk *d, double span, double *approach);
double meet_disk(double x, double y, double u, double v, double reach, double span, double *approach);
double free_span(const Disk *d, double least);

/* motion.c */
void carried(const Surface *s, double x, double y, double *v);
void along_with(const Surface *s, const Disk *d, double *v);
double pulled(const Surface *s, const Disk *d, double nx, double ny, double *pull);
double hastes(const Surface *s, const Disk *d);
double closing(const Surface *s, const Disk *d, double span);
double meet_moving(int k, const Disk *d, double span, double *approach);
double box_span(const Surface *s, const Disk *d);
double next_turn(double t);
int stir(double t);
void box_around(Surface *s, double more);
void box_movers(double t, double h);
int find_mover(const Surface *s);
void prepare_mover(Surface *s);

/* riders.c */
void ride_at(const Disk *d, double t, double *place);
void spare(const Disk *d, const Surface *s, double t);
double next_gate(double t);
void plan_ride(Disk *d, double from);
void ride_on(Disk *d, double t, double end);
void write_ride(int i, double until);
int ride_knots(const Disk *d);

/* step_length.c */
void set_step(double h);
double bent_step(double h);
void rate_overlaps(void);
double choose_step(void);

/* hinge.c */
void set_hinge(Mover *m, double t);
void prepare_hinge(Mover *m);
double hinge_step(double h);
void bound_hinges(double t, double h);
void begin_hinges(double t, double h);
double gained_by_hinges(void);
void leave_hinges(double t);
double meet_stops(double t, double end);
void end_hinges(double t);
void finish_hinges(double t);
void hang_on(Contact *c, const Mover *m, const Disk *d);
void swing_away(const Contact *c, int earlier, double *out);
double swung_open(const Contact *c);
void push_hinge(const Contact *c, const double *J);
double hinge_share(const Contact *c);
void strike_hinge(int mover, double t);
void leave_struck(int mover);
int hold_hinge(Contact *list, int count);
void stop_hinges(double t);
void go_on(void);

/* hung.c */
SolverBody hinge_body(int k);
int set_hinge_rows(SolverRow *rows, int body);
void take_hinge_rows(const SolverRow *rows, int count, int body);

/* hand.c */
double hastened(void);
void kick(Disk *d, double time);
double pushed(const Disk *d, double f);
void book_push(double *entries, double work);
double steered_to(const Mover *m, double t);

/* joints.c */
int are_joined(int i, int j);
double pressed_by_joints(const Contact *c);
void add_springs(double *sums);

/* joint_pull.c */
void pull_joints(double h);
double missed_by_joints(void);
void tug_all(int way);
void drop_tugs(void);
void forget_tugs(void);
void cut_step(double t);
int is_cut(void);
void cut_at_snaps(void);
void end_pull(void);

/* joint_blows.c */
void tie_joints(void);
void strike_joints(int i, int j);
void end_blow(void);
void begin_answers(void);
void forget_answers(void);
void answer_with_joints(void);
int let_go_again(void);

/* tied.c */
void agree_with_contacts(double h);
void mark_halved(void);
void leave_first_halves(Contact *list, int count);
void take_halves_back(void);
int has_halves(void);
void press_again(double h);

/* shapes.c */
double inner_of(int i, int j);
int list_touches(int i, int j, double t, double within, double later, Touch *list);
double clear_of_corners(const Disk *d, double x, double y, int k, double t);
int would_overlap(int i, double x, double y, int j, double t, double deep);

/* meeting.c */
double fastest_of(int i, int j, double t, double span);
double meet_corners(int i, int j, double from, double until, double most, double soft);

/* corners.c */
double whirl_of(const Disk *d);
void describe_touch(Contact *c, int i, int j, const Touch *t);
const Contact *place_before(const Contact *c);
int list_still(int i, int j, double h, const Contact **list, double *changes);
void go_on_with(Contact *c, const Contact *last, double change, double h);
double opens_by(const Contact *c);
double bends_by(const Contact *c);
void lean_first(Contact *c, double h);
double lean_again(Contact *c, double h);
void straighten(Contact *c);
double bent_gap(const Contact *c, double h);
int lies_flat(int i, int k);
void forget_places(void);
int list_struck(int i, int j, double t, Contact *list);
void strike_corners(int i, int j, double t);

/* blow.c */
double find_blow(Contact *list, int count, double size, int joined, double (*u)[3], double *back);
void couple(const Contact *c, double wanted, const double *u, double *J);

/* trigger.c */
int is_triggered(int owner, int doing);
void touch(int owner, double t);

/* grid.c */
int list_near(double end);
void list_again(int i);
int enter_again(int i, double end);
int reachable(int i);
int surfaces_near(int i, const int **list);
int place_is_free(int i, double x, double y, double t);

/* record.c */
void knot_now(int i);
void knot_after(int i);
void knot_before(int i, double t, double vx, double vy, double spin);
void flush_track(int i);
void track_lasting(int i);
void last_on(int i);
void track_flying(int i);
void track_ended(int i);
void knot_held(int i);
void finish(int i, int reason);
void write_event(int kind, int i, int other, int owner, double t, const double *place,
                 const double *before, const double *after, double normal, double tangent);
void event_here(int kind, int i, int owner);
void book(double *first, double *second, int owner, const double *entries);
void spread(double loss, int k);
void give_back(const Contact *list, int count);

/* air.c */
double air_step(void);
void slow_down(int i, double t);
void begin_in_air(int i, double middle);

/* bearing.c */
void bear_contact(const Contact *c, double share, double from, double to);
void bear_disk(const Disk *d, int owner, double jx, double jy, double from, double to);
void bear_ride(int i);
void balance_sleepers(void);
void keep_impulse(const Contact *c, double share, double from, double to);
void keep_carried(const Contact *c, double share, double from, double to);
void melt(Frozen *f, double t);
void tell_frozen(Frozen *f, int sleeper, const double *J, double to);
void branch_of(const Contact *c, double *b);

/* contact.c */
void describe(Contact *c, int i, int j);
void relative(const Contact *c, int earlier, double *out);
void push(const Contact *c, const double *impulse);
int island_of(int i);
int giver_of(const Contact *c);
void share_out(const Contact *c, const double *u, const double *v, double f, double *entries,
               double *given);
void pool(Contact *list, int count, int later);
void account(Contact *list, int count);
double pressed_inside(const Disk *d, int surface);
double turning_time(const Disk *d, const Surface *s);
double press_on(const Disk *d, const Surface *s, double nx, double ny);
double chord(const Contact *c, double parted, double h);
double follow(Contact *c, double past, double out);

/* foresee.c */
void foresee(int i);
void foresee_all(void);
void expect(int i, double due, int partner);
int next_disk(void);
double soft_approach(const Disk *d, double radius);
double left_over(const Disk *d, int impacts, int surface, double radius, int sunk, double t);
double left_between(const Disk *a, const Disk *b, double radius, double gap, double t);
double left_by_corners(int i, int j, double gap, double t);

/* impacts.c */
void shock(int i, int j, double t);
int is_alone(const Contact *c, const double *before);
void hold(Disk *d, int k);
void lie_down(int i);
void was_moved(int i);

/* jam.c */
int jams_pay(void);
void jam(Contact *struck, double t);

/* touching.c */
double ask(Contact *c, double closed, double later, double least, double h);
double gap_later(const Contact *c, double h, double *bends);
double time_unloaded(const double *load, const double *t);
int find_contacts(double h, int *woke);

/* rows.c */
void set_rows(Contact *list, int count);
void take_rows(Contact *list, int count);
void begin_anew(void);
double sweep_rows(int sweeps, int plain, double accurate);
double sweep_lightly(int sweeps, int plain, double accurate);
int lessen(void);
void keep_bounds(void);
int drop_noise(void);
double left_open(void);
double slip_of(const SolverRow *row);

/* fours.c */
double sweep_fours(int rows, int all_bodies, int cornered, int sweeps, int plain, double accurate, double most);

/* solver.c */
int sweep_contacts(Contact *list, int count, int rounds, int sweeps, int plain, double accurate,
                   double enough);
void solve_contacts(int again);

/* closing.c */
void give_in(const Contact *list, int count);
void close_step(double h);
void unload(int i, const int *up);
void take_back(int i);
void end_in_contact(int i, int reason);

/* sleep.c */
void wake(int i, double t);
void fall_asleep(void);
int find_frozen(const Contact *c);
void start_from_frozen(Contact *c, double span);
void note_frozen(void);
void untell_frozen(const Contact *c, double share);
void rouse(void);

/* tracks.c */
int release(int i, double t);
void separate(int i);
void leave(int i, double end);
void stop_all(int reason);

/* step.c */
double set_gates(double t);
void note_totals(void);
int begin_step(void);
int go_through(void);
void end_step(void);

/* prepare.c */
int stretch_swings(void);
int make_room(int full);
void join_surfaces(void);
void find_crowns(void);

#endif
