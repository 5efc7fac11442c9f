/* What the files of the core share: the world, small helpers, and one line a function. */

#ifndef CORE_H
#define CORE_H
#include <math.h>
#include <wasm_simd128.h>
#include "layout.h"
#include "loads.h"
#include "memory.h"

#define MIN(a, b) ((a) < (b) ? (a) : (b))
#define MAX(a, b) ((a) > (b) ? (a) : (b))
#define ALARM (-1000000) /* partner of a release or of a ride's end; no surface has that number */

/* Of what hardly any scene asks for: inline it would slow all that asks. */
#define RARELY __attribute__((noinline))

extern World W;

/* What was too small, so that `run` makes more room. */
enum Full { FULL_KNOTS = 100, FULL_EVENTS, FULL_TOTALS, FULL_NEAR, FULL_CONTACTS, FULL_SWINGS };

/* Contacts are looked for where a gap is below this share of the radius: what lasts stays a
   thousandth of it apart at most, and nothing crosses the rest within a step unseen. */
#define TOUCH 5e-3
/* Overlap, in radii, from which on nothing may sink further, not even by a hop. */
#define SUNK 1e-2
/* Share of what is left to the next step otherwise (see SKIP) that is left of an approach there: else it
   would sink by so much in each step wherever a pile is wedged, and cannot part. */
#define HARDLY 0.1
/* Overlap, in radii, of disks that just touch, written with some digits: their places count as free. */
#define TOUCHING 1e-9
/* Approach, in radii per step, that is left to the next step instead of an impact at its instant:
   a tenth of TOUCH, so that what is left is in reach of the contacts before it overlaps. */
#define SKIP 5e-4
/* The same once a disk had MANY impacts in a step; it grows by GROW with each, up to MOST_SKIP. */
#define MOST_SKIP 5e-3
#define MANY 20
#define GROW 1.2
/* Impacts of a disk in a step from which on a slow one (below SLOW times what gravity does in a
   step) has no restitution: the infinitely many of an inelastic collapse end. */
#define FEW 10
#define SLOW 20.0
/* ... from which on what rattles between surfaces is jammed: it is solved with all it touches ... */
#define JAM 40
/* ... and from which on the step ends, so that the whole crowd round it is solved at once; or, where
   that has just been done, less than SHORTEST of a step ago, the jam. */
#define CROWDED 50
#define SHORTEST 0.02
/* ... and from which on more is left to the next step, without a bound, since jams do not calm it. */
#define STUCK 500
/* Disks that a jam is solved for, with all they touch: what goes on beyond are impacts of their own,
   and a pile of thousands is not solved at each of them. */
#define JAMMED 30
/* Contacts per disk that a jam may have: disks in a plane have three pairs each at most. */
#define TOUCHES 8
/* Sweeps that a jam may take: what they leave open rattles on, and is the next jam after a few impacts. */
#define JAM_SWEEPS 2000
/* Of sqrt(g r): below it an island may fall asleep; 0.5 mm/s for r = 4 mm. */
#define REST 2.5e-3
/* m/s2; gravity for which bounds on speeds and times are written: others have `W.pace` of them. */
#define EARTH 9.81
/* s on Earth; so long an island has to be at rest. */
#define CALM_DOWN 0.05
/* Of the speed; a slower approach grazes, and rounding may well have made it. */
#define GRAZE 1e-6
/* Friction, 76 degrees, that takes all slip in any blow; where sweeps diverge it is lowered from here. */
#define ROUGH 4.0
/* Impacts of a disk in a step that no collapse needs: something is wrong, the run stops. */
#define STALL 20000
/* Of the radius: hops of what lies stay below it, else the step is shorter than asked for. */
#define HOP 1e-3
/* rad; steps of a disk by itself turn it by no more inside an arc. */
#define TURN 0.2
/* Of a step: what befalls joints nearer to its beginning or end counts as there, else rounding would be taken
   back in next to no time. */
#define SOON 1e-6
/* Contacts of what has corners up to which they are solved to rounding, and blows on them are no hops: more are
   a crowd. */
#define FEW_CONTACTS 32
/* Times `W.soft`: approach up to which two of a crowd with corners that rest on something are left to the next step. */
#define LATEST 4
/* Blows that one impact may pass on at its instant, per lasting contact; the rest are foreseen. */
#define SHOCKS 4

static inline double square(double a) { return a * a; }

/* A place at which a particle with corners is near something: the normal towards it, how near, where; and which corner
   of both that is, on what, see corners.c; of how many. */
typedef struct { double nx, ny, gap, later, x, y; int which, on, many; } Touch;
/* Such places of two, at most. */
#define MOST_TOUCHES 8

/* Two doubles at once: each rounds as by itself. */
typedef v128_t Two;

static inline Two two(const double *from) { return wasm_v128_load(from); }
static inline Two times(double a, Two v) { return wasm_f64x2_mul(wasm_f64x2_splat(a), v); }
static inline Two plus(Two a, Two b) { return wasm_f64x2_add(a, b); }
static inline Two minus(Two a, Two b) { return wasm_f64x2_sub(a, b); }
/* Whether both are at most so far from 0; what is no number is not. */
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
/* Whether a disk is spared: a gate shut on it, or what is solid from one side lets it through, and it is not clear
   of that yet; or CLEARS: it will be in this step. */
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
/* Whether a surface is there and near the box that a disk can reach in this step ... */
static inline int is_beside(const Surface *s, const Disk *d) {
    return s->there && s->box[0] < d->right && s->box[2] > d->left && s->box[1] < d->top
        && s->box[3] > d->bottom;
}
/* ... and does not spare it. */
static inline int is_near(const Surface *s, const Disk *d) { return is_beside(s, d) && !is_spared(s, d); }
/* The piece that goes on smoothly beyond an end of a surface, of a circle one that leads to it, or -1. */
static inline int mate_of(const Surface *s, int n) { return s->ledges[n] <= W.ledge ? s->mates[n] : -1; }
/* Whether two partners of a disk, in the numbers of `Contact.j`, are one or go on smoothly. */
static inline int is_mate(int j, int other) {
    const Surface *s = W.surfaces + (-1 - j);
    return mate_of(s, 0) == -1 - other || mate_of(s, 1) == -1 - other;
}
static inline int goes_on(int j, int other) {
    return j == other || (j < 0 && other < 0 && (is_mate(j, other) || is_mate(other, j)));
}
/* The same for surfaces of which a disk touches the same place: pieces in one place, or the point that
   two share. */
int is_one(const Disk *d, int k, int other);
int is_held(const Disk *d, int k);
/* Whether a disk that is on a piece at the beginning of a step is on no hollow at its end. */
static inline int is_flat(const Surface *s) {
    return s->shape == SEGMENT && mate_of(s, 0) < 0 && mate_of(s, 1) < 0;
}
/* Longest step in which what is pressed on something, by so much (m/s2), hops by no more than HOP radii, s. */
static inline double hop_time(const Disk *d, double press) {
    return press > 0 ? sqrt(8 * HOP * (has_corners(d) ? d->inner : d->radius) / press) : INFINITY;
}
/* A surface where it is at t. */
const Surface *move_to(Surface *s, double t);
static inline const Surface *surface_at(int k, double t) {
    Surface *s = W.surfaces + k;
    return s->mover < 0 || s->posed == t ? s : move_to(s, t);
}
/* Whether a surface hangs on a hinge. */
static inline int is_hung(int k) { return W.surfaces[k].mover >= 0 && W.movers[W.surfaces[k].mover].inertia > 0; }
/* Whether a surface moves in this step. */
static inline int stirs(const Surface *s) { return s->mover >= 0 && W.movers[s->mover].stirs; }
/* Normal impulse of a contact, with what cohesion pulls, N s. */
static inline double pressed(const Contact *c) { return c->impulse[0] - c->clings; }
double swung(const Contact *c, double f);
/* Work that the motion of a surface does by a contact's impulses, of which the share f has been given, J. */
static inline double driven(const Contact *c, double f) {
    double still = (1 - f) * (pressed(c) * c->moved[0] + c->impulse[1] * c->moved[1] + c->impulse[2] * c->moved[2]);
    return c->hung ? still + swung(c, f) : still;
}
/* Whether a particle has joints. */
static inline int is_tied(int i) { return i >= 0 && W.disks[i].tie >= 0; }
static inline int is_live(const Disk *d) { return d->mode >= RIDING && d->mode <= ASLEEP; }
/* Of a loop over all that are live as a step begins, or were released in it. */
#define EACH_LIVE(i) int at_##i = 0, i; at_##i < W.live_count && (i = W.live[at_##i], 1); at_##i++
/* Kinetic and potential energy of a disk with a velocity, a spin and a place, J. */
static inline double kinetic_of(const Disk *d, const double *v, double spin) {
    return 0.5 * (d->mass * (square(v[0]) + square(v[1])) + d->inertia * square(spin));
}
static inline double lifted(const Disk *d, const double *place) {
    return d->mass * W.g * (W.up[0] * place[0] + W.up[1] * place[1]);
}

/* Change of normal velocity that a contact asks for under a normal impulse, m/s. */
static inline double asks(const Contact *c, double impulse) {
    return MAX(MIN(c->need - c->gives * impulse, c->most), c->need - c->parts);
}

/* Move a disk along its parabola. */
static inline void advance(Disk *d, double t) {
    double h = t - d->t;
    d->x += (d->vx + 0.5 * W.gx * h) * h;
    d->y += (d->vy + 0.5 * W.gy * h) * h;
    d->vx += W.gx * h;
    d->vy += W.gy * h;
    d->turned += d->spin * h;
    d->t = t;
}

/* Whether a disk by itself flies off a surface that is so rough that a touch, however soft, is a blow:
   it is not pressed again before it comes back. */
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

/* loop.c */
void spare(const Disk *d, const Surface *s, double t);

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
double coupled(const Contact *c);
double couple(const Contact *c, double wanted, double slip, double *tangent);
void strike_hinge(int mover, double t);
void leave_struck(int mover);
int hold_hinge(Contact *list, int count, double (*u)[3], double *back);
void stop_hinges(double t);
void go_on(void);

/* hung.c */
SolverBody hinge_body(int k);
int set_hinge_rows(SolverRow *rows, int body);
void take_hinge_rows(const SolverRow *rows, int count, int body);

/* hand.c */
void kick_disks(double h);
double pushed(const Disk *d, double f);
double steered_to(const Mover *m, double t);

/* joints.c */
int are_joined(int i, int j);
void tie_joints(void);
void pull_joints(double h);
void agree_with_contacts(double h);
double missed_by_joints(void);
void tug_all(int way);
void drop_tugs(void);
void forget_tugs(void);
void cut_step(double t);
int is_cut(void);
void cut_at_snaps(void);
void end_pull(void);
void add_springs(double *sums);
void strike_joints(int i, int j);
void end_blow(void);
void begin_answers(void);
void forget_answers(void);
void answer_with_joints(void);
int let_go_again(void);
void share_with_joints(const Contact *c, double wanted, const double *u, double *J);

/* corners.c */
double inner_of(int i, int j);
double whirl_of(const Disk *d);
int list_touches(int i, int j, double t, double within, double later, Touch *list);
double clear_of_corners(const Disk *d, double x, double y, int k, double t);
int would_overlap(int i, double x, double y, int j, double t, double deep);
double fastest_of(int i, int j, double t, double span);
double meet_corners(int i, int j, double from, double until, double most, double soft);
void describe_touch(Contact *c, int i, int j, const Touch *t);
const Contact *place_before(const Contact *c);
int list_still(int i, int j, double h, const Contact **list);
void go_on_with(Contact *c, const Contact *last, double h);
double opens_by(const Contact *c);
int lies_flat(int i, int k);
int list_struck(int i, int j, double t, Contact *list);
void strike_corners(int i, int j, double t);

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
void track_flying(int i);
void knot_held(int i);
void finish(int i, int reason);
void write_event(int kind, int i, int other, int owner, double t, const double *place,
                 const double *before, const double *after, double normal, double tangent);
void event_here(int kind, int i, int owner);
void book(double *first, double *second, int owner, const double *entries);
void spread(double loss, int k);
void give_back(const Contact *list, int count);

/* air.c */
void slow_down(int i, double t);
void begin_in_air(int i, double middle);

/* bearing.c */
void bear_contact(const Contact *c, double share, double from, double to);
void bear_disk(const Disk *d, int owner, double jx, double jy, double from, double to);
void bear_ride(int i);
void note_force(Disk *d, const Contact *c, double span);
void bear_asleep(const Disk *d, double until, double more);
void balance_sleepers(void);
void keep_impulse(const Contact *c, double share, double from, double to);
void keep_carried(const Contact *c, double share, double from, double to);
void keep_sleepers(void);

/* contact.c */
void describe(Contact *c, int i, int j);
void relative(const Contact *c, int earlier, double *out);
void push(const Contact *c, const double *impulse);
int island_of(int i);
void share_out(const Contact *c, const double *u, const double *v, double f, double *entries,
               double *given);
void pool(Contact *list, int count, int later);
void account(Contact *list, int count);
double pressed_inside(const Disk *d, int surface);
double turning_time(const Disk *d, const Surface *s);
double press_on(const Disk *d, const Surface *s, double nx, double ny);
double chord(const Contact *c, double parted, double h);
double follow(Contact *c, double past, double out);

/* impacts.c */
void foresee(int i);
void foresee_all(void);
void expect(int i, double due, int partner);
int next_disk(void);
void shock(int i, int j, double t);
int is_alone(const Contact *c, const double *before);
void hold(Disk *d, int k);
double soft_approach(const Disk *d, double radius);
double left_over(const Disk *d, int impacts, int surface, double radius, int sunk);
void lie_down(int i);
void was_moved(int i);

/* touching.c */
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
void sweep_contacts(Contact *list, int count, int rounds, int sweeps, int plain, double accurate,
                    double enough);
void solve_contacts(int again);

/* closing.c */
void give_in(const Contact *list, int count);
void close_step(double h);
void take_back(int i);
void end_in_contact(int i, int reason);

/* sleep.c */
void wake(int i, double t);
void fall_asleep(void);

/* prepare.c */
int stretch_swings(void);
int make_room(int full);
void join_surfaces(void);

#endif
