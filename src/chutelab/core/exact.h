/* What the files of the exact engine share: the obstacles, the particle under way, a line a function.

   Nothing of this is the contact engine's, and nothing of that is used here: each is a check of the
   other, so they share layout.h, memory.h and trig.h alone. */

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

/* Share of a segment's length by which its face reaches past its ends, so that no particle slips
   through the joint of two segments by rounding. */
#define FOOT 1e-12
/* Share of the scene's size within which two ends are one joint. */
#define JOINT 1e-12
/* Rounding of a coordinate, in units of the last place of the scene's size: closer is touching. */
#define TOUCH_ULPS 256.0
/* Sine of the angle at a joint below which one piece simply goes on as the next. */
#define COLLINEAR 1e-12
/* Way, in `touch`, after which a point has been away from what it touches. */
#define CLEAR 16.0

/* What a particle can meet. A disk of radius r touches a face when its centre is r away, and an end
   when the centre is on a circle of radius r about it. An arc of radius R is met from outside on a
   circle of radius R + r, from inside on one of radius R - r, which counts as negative: then one
   formula serves both, with normals that point at the particle. */
enum Met { FACE, END, OUTSIDE, INSIDE, WHEEL };

typedef struct {
    int met;
    double x, y;            /* m; first end of a face, centre of a circle */
    double tx, ty, nx, ny;  /* of a face: unit tangent, and unit normal to its left */
    double length;          /* m; of a face */
    double bend;            /* m; radius of an arc or the pulley, 0 of an end */
    double rho;             /* m; distance of a particle's centre from the circle's; negative inside,
                               NAN where it is too large for that */
    double begin, extent;   /* rad; contacts of an arc: the first angle and how far they reach */
    double crown[2];        /* to the middle of the half of an end that joins the left face of a piece */
    double speed;           /* m/s; along a face and its ends, clockwise round an arc */
    double turning;         /* rad/s; of arcs and their ends */
    double came, went;      /* s; it is there from the one to the other */
    double low[2], high[2]; /* m; box of a particle's centre when it touches */
    int surface, source;    /* whose it is, and the column of the table of materials */
    int tips;               /* first of the ends that lie on it, or -1 */
    int members;            /* first of its places in sets, or -1 */
    int handovers;          /* first place where a ride round it goes over into another piece, or -1 */
} Obstacle;

/* An end of a piece: number 2 piece + end. Pieces are the segments, then the arcs that have ends. */
typedef struct {
    double x, y;            /* m */
    double out[2], left[2]; /* directions out of the piece, and to the left of the piece */
    int spot;               /* number of the place; ends within JOINT share it */
    int rests;              /* number of the arc on which it lies, of arcs for the pulley, or -1 */
    int circle;             /* obstacle round it, or -1 */
    int next;               /* of the ends on that circle */
    int sets[2];            /* number of what is touched at once with the left and right face there */
} Tip;

/* An obstacle in a set of what a disk touches at once where pieces end. */
typedef struct {
    int set, obstacle;
    int faces;              /* 1 left, 2 right, 3 of a circle */
    int edges;              /* of an arc's circle: 1 and 2, its ends that are there */
    int next;               /* of the set */
    int alike;              /* the next with this obstacle */
} Member;

/* A place on a circle where a ride goes over into another piece, without a blow. */
typedef struct {
    int tip, face;          /* at which end, and the face there: 0 left, 1 right */
    int onto;               /* whether that piece is gone over to; else it is the one that ends */
    int next;
} Handover;

/* What a face goes over into at its end, or -1; or, in a hollow bend, what is met there: before its end, but
   for rounding. */
typedef struct { int obstacle, side, meets; } Onward;

typedef struct {
    Obstacle *all;
    int count, faces;       /* faces come first, then ends, arcs from outside, from inside, pulley */
    int first_arc, arcs, bent, pulley; /* bent: arcs with ends */
    Tip *tips;
    int tip_count;
    Member *members;
    int *sets;              /* first member of each set */
    int set_count, member_count;
    Handover *handovers;
    int handover_count;
    double *changes;        /* s; when gates open or shut, ascending */
    int change_count;
    Onward *onward;         /* (changes + 1, tips, 2) before the first change, and after each */
    Onward *opposite;       /* likewise: what bounds, with a face, the sector beside its end */
    double size;            /* m; the largest coordinate */
    double touch;           /* m; gaps smaller than this are rounding */
} Obstacles;

extern Exact E;
extern Obstacles O;

/* How a particle moves. From ON_FACE on it touches something. */
enum Way { OVER, FLIES, RIDES_BELT, ON_FACE, ON_ARC };

/* Nearest angle in one direction where a ride ends, and what is there. */
typedef struct {
    double angle;           /* rad; infinite where the way is free */
    int obstacle, side;
    int handover;           /* something takes over there without a blow */
    int joint;              /* set that is touched all at once there, or -1 */
} Bound;

/* A motion with constant acceleration, until something happens. */
typedef struct {
    double x, y, vx, vy, ax, ay;
    int left, left_side;    /* obstacle (and face of it) in contact now that is being left, or -1 ... */
    int order;              /* ... and how many of the leading coefficients of the gap to it are zero: 1
                               after a rebound, 2 when leaving tangentially, 3 when lifting off a circle */
    int joint;              /* set that it leaves all of, tangentially, or -1 */
    int on, on_side;        /* face it slides on, or -1 */
    int carried;            /* it rides the incoming belt */
} Motion;

/* The particle under way. Ages count from its release. */
typedef struct {
    const Lone *given;
    double age, x, y, vx, vy, z; /* z: r ω, m/s */
    double entries[3];      /* J */
    double share, lever;    /* effective mass at the rim over m; m r2/I, or 0 */
    int turns, way;
    int on, side;           /* what it touches, and the face of it; of a circle see `rim_side` */
    double slip;            /* sign of the slip there, 0 without; 1 in flight */
    double roll;            /* sign of the spin that rolling friction opposes, 0 while it is held */
    int left, left_side, order, joint; /* see `Motion` */
    int idle, crawls;       /* events in a row that took no time; that went slowly to and fro */
    double angle;           /* rad; of a ride round a circle ... */
    Bound bounds[2];        /* ... and where it ends, backwards and forwards */
    int point;              /* a disk that touches a face cannot be on its other side, a point could: */
    int landed, rounds;
    double then;            /* s; its age some rounds ago */
    double told[6];         /* age, place, velocity and z up to which loads are told */
} Particle;

extern Particle A;

/* A contact seen from the particle: normal towards it, tangent (ny, -nx). */
typedef struct {
    double nx, ny, tx, ty;
    double belt;            /* m/s; speed of the surface along the tangent */
    double friction, restitution, falls;
    int surface, obstacle;
} Touch;

static inline double square(double a) { return a * a; }
static inline double sign_of(double a) { return a > 0.0 ? 1.0 : a < 0.0 ? -1.0 : 0.0; }

/* exact_pieces.c */
int lay_obstacles(int member);
void fit_obstacles(void);
int is_there(int obstacle, int epoch);
int epoch_at(double t);
int is_shared(int set, int obstacle, int face);
int has_edge(int set, int obstacle, int edge);
int is_beside(int circle, int obstacle, int face);
int corner_at(int obstacle, int side, double x, double y);
int bounds(int corner, int obstacle, int side, int epoch);
int face_of(int piece, int face);

/* exact_meet.c */
double descent(double gap, double rate, double acceleration);
double polynomial(const double *c, int count, double t);
int spans(const Obstacle *o, double x, double y);
int is_reached(int circle, double x, double y, int epoch);
int first_contact(const Motion *m, double *until, int *obstacle, int *side);

/* exact_ride.c */
/* Share of the radius by which the cubic Hermite curve between two knots may leave a way round a circle: what
   the recording is allowed, less what is missed by looking at three times of a step. */
static inline double curve(void) { return 0.9 * (ON_ARCS + E.loose); }

/* rad between knots at constant speed, where the cubic is off by the fourth power of it over 384. */
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

/* What a step did; `at` has the numbers of a knot within it. */
typedef struct { double dt, phi, w, z, work, heat, twist; int outcome; } Ridden;

#define MOST_KNOTS 32

int advance_ride(const Circle *c, double longest, Ridden *end, Ridden *knots);
void find_bounds(int circle, int side, double phi, int epoch, Bound *found);

#endif
