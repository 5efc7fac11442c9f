/* What the files of the exact engine share: the obstacles, the present particle, and declarations of functions.

   Nothing here is shared with the contact engine: each engine is a check of the other, so they have only layout.h,
   memory.h and trig.h in common. */

#ifndef EXACT_H
#define EXACT_H
#include "layout.h"
#include "loads.h"
#include "trig.h"

#define MIN(a, b) ((a) < (b) ? (a) : (b))
#define MAX(a, b) ((a) > (b) ? (a) : (b))
#define NONE (-1)
#define TURN (2.0 * PI)
#define ULP 2.220446049250313e-16

/* Share of a segment's length by which its face extends beyond its ends, so that rounding lets no particle through the
   joint of two segments. */
#define FOOT 1e-12
/* Share of the scene's size; two ends that are nearer form a joint. */
#define JOINT 1e-12
/* Rounding of a coordinate, in units of the last place of the scene's size: a smaller gap is a contact. */
#define TOUCH_ULPS 256.0
/* Sine of the angle at a joint; with a smaller one, one piece continues as the next. */
#define COLLINEAR 1e-12
/* Distance, in `touch`, beyond which a point is no longer in contact. */
#define CLEAR 16.0

/* What a particle can meet. A disk of radius r touches a face if its centre is r away from it, and an end if its centre
   is on a circle of radius r about it. It meets an arc of radius R from outside on a circle of radius R + r, from inside
   on one of radius R - r. The latter radius counts as negative: then one formula holds for both, with normals that point
   at the particle. */
enum Met { FACE, END, OUTSIDE, INSIDE, WHEEL };

typedef struct {
    int met;
    double x, y;            /* m; first end of a face, centre of a circle */
    double tx, ty, nx, ny;  /* of a face: unit tangent, and unit normal to its left */
    double length;          /* m; of a face */
    double bend;            /* m; radius of an arc or the pulley, 0 of an end */
    double rho;             /* m; distance of a particle's centre from that of the circle in contact; negative inside,
                               NAN if the particle doesn't fit in */
    double begin, extent;   /* rad; of an arc: first angle of contacts, and their range */
    double least[2], most[2]; /* x and y of unit vectors in that range */
    double speed;           /* m/s; along a face and its ends, clockwise round an arc */
    double turning;         /* rad/s; of arcs and their ends */
    double came, went;      /* s; it exists from the one to the other */
    double low[2], high[2]; /* m; box of a particle's centre in contact */
    int surface, source;    /* its surface, and the column of the table of materials */
    int tips;               /* first of the ends that lie on it, or -1 */
    int members;            /* first of its entries in sets, or -1 */
    int handovers;          /* first place where a ride round it continues on another piece, or -1 */
} Obstacle;

/* An end of a piece: number 2 piece + end. Pieces are the segments, then the arcs that have ends. */
typedef struct {
    double x, y;            /* m */
    double out[2], left[2]; /* unit vectors out of the piece, and to its left */
    int spot;               /* number of the place; ends within JOINT share it */
    int rests;              /* number of the arc on which it lies, number of arcs for the pulley, or -1 */
    int circle;             /* obstacle round it, or -1 */
    int next;               /* next of the ends on that circle */
    int sets[2];            /* numbers of the sets that are touched at once with the left and the right face there */
} Tip;

/* An obstacle in a set of those that a disk touches at once where pieces end. */
typedef struct {
    int set, obstacle;
    int faces;              /* 1 left, 2 right, 3 both or a circle */
    int edges;              /* of an arc's circle: 1 and 2, its ends at the place */
    int next;               /* next of the set */
    int alike;              /* next entry of the same obstacle */
} Member;

/* A place on a circle where a ride continues on another piece without an impact. */
typedef struct {
    int tip, face;          /* the end, and the face there: 0 left, 1 right */
    int onto;               /* whether the ride goes over onto that piece; else that piece ends */
    int next;
} Handover;

/* The obstacle on which a slide along a face continues at its end, or -1; or, at a concave bend, the one that it meets
   there (before the end, within rounding). */
typedef struct { int obstacle, side, meets; } Onward;

/* The nearest angle in one direction where a ride ends, and what is there. */
typedef struct {
    double angle;           /* rad; infinite if the path is free */
    int obstacle, side;
    int handover;           /* the ride continues there without an impact */
    int joint;              /* set of all that is touched at once there, or -1 */
} Bound;

/* A place where a ride round a circle may end, and how fast the gap falls there with the angle. */
typedef struct { double closing; Bound what; } Stop;

typedef struct {
    Obstacle *all;
    int count, faces;       /* faces come first, then ends, arcs from outside, arcs from inside, the pulley */
    int first_arc, arcs, bent, pulley; /* bent: number of arcs with ends */
    Tip *tips;
    int tip_count;
    Member *members;
    int *sets;              /* first member of each set */
    int set_count, member_count;
    Handover *handovers;
    int handover_count;
    double *changes;        /* s; when gates appear or vanish, ascending */
    int change_count;
    int owned_in;           /* epoch for which ends have the belts and materials of their pieces: see `own_ends` */
    Onward *onward;         /* (changes + 1, tips, 2) before the first change, and after each */
    double *crowns;         /* (epochs, tips, 2) by the number of a place: see `find_crowns` */
    Onward *opposite;       /* the same: what bounds, together with a face, the sector beside its end */
    Stop *stops;            /* those of rides round one circle, on one side, in one epoch */
    int stop_count, stops_on, stops_side, stops_epoch;
    double stops_rho;       /* m; at this distance from its centre */
    double size;            /* m; the largest coordinate */
    double touch;           /* m; smaller gaps are rounding */
    double fitted;          /* m; radius that they fit, NAN at first */
} Obstacles;

extern Exact E;
extern Obstacles O;

/* How a particle moves. From ON_FACE on it is in contact. */
enum Way { OVER, FLIES, RIDES_BELT, ON_FACE, ON_ARC };

/* A motion of the present particle with constant acceleration until the next event. */
typedef struct { double x, y, vx, vy, ax, ay; } Motion;

/* The present particle. Ages count from its release. */
typedef struct {
    const Lone *given;
    double age, x, y, vx, vy, z; /* z: r ω, m/s */
    double entries[3];      /* J */
    double share, lever;    /* effective mass at the rim over m; m r2/I, or 0 */
    int turns, way;
    int on, side;           /* what it slides or rides on, or -1, and its face; for a circle see `rim_side` */
    double slip;            /* sign of the slip there, 0 without; 1 in flight */
    double roll;            /* sign of the spin that rolling friction opposes, 0 while it is held */
    int left, left_side;    /* obstacle (and its face) in contact now that is being left, or -1 ... */
    int order;              /* ... and how many of the leading coefficients of the gap to it are zero: 1 after a
                               rebound, 2 when leaving tangentially, 3 when lifting off a circle */
    int joint;              /* set that it leaves as a whole, tangentially, or -1 */
    double free;            /* m; length of path on which it can meet only what it left, see `hop` */
    int hopped;             /* its latest round that was a hop */
    int hit, hits;          /* surface of the latest event, and how many impacts on it were the latest ones */
    int idle, crawls;       /* consecutive events that took no time; that were slow, between two obstacles */
    double angle;           /* rad; of a ride round a circle ... */
    Bound bounds[2];        /* ... and its ends, backwards and forwards */
    int point;              /* it is a point: in contact with a face it could be on either side */
    int landed, rounds;
    double then;            /* s; its age some rounds ago */
    double told[6];         /* age, position, velocity and z up to which loads have been reported */
} Particle;

extern Particle A;

/* A contact as seen by the particle: normal towards it, tangent (ny, -nx). */
typedef struct {
    double nx, ny, tx, ty;
    double belt;            /* m/s; speed of the surface along the tangent */
    double friction, restitution, falls;
    int surface, obstacle;
} Touch;

static inline double square(double a) { return a * a; }
static inline double sign_of(double a) { return a > 0.0 ? 1.0 : a < 0.0 ? -1.0 : 0.0; }

/* Two numbers at once, such as x and y; each is rounded as if alone. */
typedef double Two __attribute__((vector_size(16), aligned(8)));
static inline Two two_at(const double *place) { return *(const Two *)place; }
static inline Two lesser(Two a, Two b) { return __builtin_wasm_pmin_f64x2(a, b); }
static inline Two larger(Two a, Two b) { return __builtin_wasm_pmax_f64x2(a, b); }

/* exact.c */
extern int course; /* result of a round, see `enum Course` */

/* exact_record.c */
void write_knot_of(int inner);
void write_knot(void);
void record_event(int kind, int surface);
void tell_here(void);
void bear_since(int surface, double nx, double ny, double depth);
void bear_round(int surface, double x, double y, double rho, double depth);
void bear_at(const Touch *c);
void record_entries(int surface, double work, double restitution, double friction);
void end_track(int reason);
void part_from(int surface);
void let_go(int left, int side, int order, int joint);

/* exact_contact.c */
int epoch_now(void);
double next_change(void);
double vanishes(int obstacle);
Touch touch_now(void);
double along(const Touch *c);
double surface_spin(int obstacle);
void snap(int obstacle, int side);
int is_pressed(const Touch *c);
void end_roll(void);
void end_slip(void);
double face_force(const Touch *c, double *force, double *couple);
void look_round(void);
void strike(int obstacle, int side);
void pass_on(int obstacle, int side, int joint);

/* exact_shared.c */
void lay_out_shared(void);
void forget_shared(void);
int is_parting(int obstacle);
void keep_shared(int obstacle, int side);
int take_shared(void);

/* exact_pieces.c */
int lay_obstacles(int member);
void fit_obstacles(void);
void own_ends(int epoch);
/* The crown of an end in an epoch. */
static inline const double *crown_of(const Obstacle *end, int epoch) {
    return O.crowns + 2 * (epoch * O.tip_count + O.tips[end->tips].spot);
}

/* exact_there.c */
int face_of(int piece, int face);
int epoch_at(double t);
int is_there(int obstacle, int epoch);
int is_shared(int set, int obstacle, int face);
int has_edge(int set, int obstacle, int edge);
int back_of(int circle);
int is_beside(int circle, int obstacle, int face);
int corner_at(int obstacle, int side, double x, double y);
int bounds(int corner, int obstacle, int side, int epoch);

/* exact_meet.c */
double descent(double gap, double rate, double acceleration);
double polynomial(const double *c, int count, double t);
int spans(const Obstacle *o, double x, double y);
int is_reached(int circle, double x, double y, int epoch);
int first_contact(const Motion *m, double *until, int *obstacle, int *side);
int is_free(double way);
double hop(const Motion *m, double until);
void find_bounds(int circle, int side, double phi, int epoch, Bound *found);

/* exact_ride.c */
/* Share of the radius by which the cubic Hermite curve between two knots may leave a circle: what the recording allows,
   less what the check at three times of a step may miss. */
static inline double curve(void) { return 0.9 * (ON_ARCS + E.loose); }

/* rad between knots at constant speed, where the cubic is off by the fourth power of the angle over 384. */
static inline double step_angle(void) { return sqrt(sqrt(384.0 * curve())); }

enum Outcome { NOTHING, LIFT, ONSET, GRIP, LOW, HIGH, HALT, ROLL };

/* A particle that rides round a circle. */
typedef struct {
    double phi;             /* rad; from the top, clockwise, of the normal */
    double w, z;            /* m/s; along the circle, and r ω */
    double rho, gravity, friction, belt, slip, share;
    double low, high;       /* rad; where the circle ends or something is met */
    double rolling, roll, turn; /* rolling friction; its sign; r ω of the surface */
} Circle;

/* The state at the end of a step, or at a knot within it, with time, work and heat since its beginning, and sin and cos
   of the angle; and whether a track of a family comes there round the circle in one direction. */
typedef struct { double dt, phi, up, across, w, z, work, heat, twist; int outcome, round; } Ridden;

#define MOST_KNOTS 32

int advance_ride(const Circle *c, double longest, Ridden *end, Ridden *knots);

/* exact_pass.c */
int pass_round(const Circle *c, double longest, Ridden *end, Ridden *knots);

#endif
