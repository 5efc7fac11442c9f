/* What the core shares with its host: all arrays and numbers, in SI units.

   The host fills in the counts marked [in] of a subject, lets the core reserve its arrays (`lay_out_...`), fills in what
   of them is marked [in], calls the function that does the work, and reads what is marked [out]. `tools/build_core.py`
   reads this file and writes `layout.json`, from which hosts take sizes, offsets and names: so each field is declared
   once. Only `double`, `int`, arrays of these and pointers are allowed here. */

#ifndef LAYOUT_H
#define LAYOUT_H

#define MAX_HELD 4 /* surfaces that a disk can lie on at a time; contacts with more are resolved as impacts */
#define MANY_TOUCHES 6 /* impacts in a row on one surface of which a family keeps no more */
#define MOST_IDLE 400 /* consecutive rounds that take no time; with more a particle is stuck */
#define MOST_CORNERS 32 /* of a particle */
#define WAITS 20 /* greatest number of states of a track that wait until they become a knot or are left out */
#define MAX_NEARBY 12 /* greatest number of surfaces listed for a disk; if there are more, it checks all */

/* What a disk is doing. Free disks move on parabolas; riders and sleepers on a prescribed path. */
enum Mode { WAITING, RIDING, FREE, ASLEEP, GONE };

/* Why a track ends, as in `results.REASONS`. */
enum Reason { BY_TIME, BY_LANDING, BY_SETTLING, BY_EXIT };

/* Events, as in `results.Kind`. */
enum Kind { RELEASE, SEPARATION, SLIP, IMPACT, LANDING, COLLISION, STICK, SETTLE, EXIT };

enum Shape { SEGMENT, CIRCLE, ARC };

/* Whether a surface exists. LEAVING: it has just vanished. */
enum There { ABSENT, THERE, LEAVING };

/* When a run ends: `run.until`. */
enum Until { UNTIL_LANDED, UNTIL_SETTLED, UNTIL_TIME };

/* Why `run` returned. PAUSED: the budget of steps is used up. FULL: take knots and events, and call again. LACKING: there
   is no more memory. */
enum Status { DONE, PAUSED, FULL, STALLED, LACKING };

/* The memory of arrays. Zeros in it, and in all other subjects, free all arrays. */
typedef struct {
    double end;             /* where the next array begins; 0: at the beginning */
    int lacks;              /* whether there was too little */
    int budget;             /* [in] rounds, or steps, after which a run returns at the latest */
    int packed;             /* [out] bytes of the packed events of a whole run that is over, see `pack_events`; else 0 */
    int first;              /* [out] where the first array begins */
} Room;

/* Fields that every step reads for every disk come first, so that they share few cache lines. */
typedef struct {
    double x, y, vx, vy, spin;  /* [in] at time t: centre, velocity, angular velocity */
    double t;
    int mode;                   /* WAITING at first */
    int mark;                   /* stamp of the latest query that found it */
    double left, bottom, right, top; /* box that it can reach in this step */
    double radius, mass;        /* [in] radius > 0 */
    double due;                 /* s; time of its next event, INFINITY if none is foreseen in this step */
    int changes;                /* number of changes of its path, by which foreseen events become outdated */
    int impacts;                /* in this step */
    int supports;               /* contacts that pressed it in this step or the one before */
    int partner;                /* of the next event: disk j >= 0, surface k as -1 - k, or ALARM */
    int partner_changes;
    int heap_place;
    double ux, uy, uspin;       /* velocity before the step's impulses; of a sleeper its real one */
    double inertia;             /* [in] kg m2; 0: it does not rotate */
    double inv_mass, inv_inertia; /* 1/kg, 1/(kg m2); 0 if it does not rotate */
    double aired;               /* s; time up to which drag has acted, see air.c */
    double release;             /* [in] s; from then on it waits until its place is free */
    double ride_x;              /* m; place along the belt where a ride by adhesion begins, from the start of the
                                   pulley, <= 0 ... */
    double ride_rho;            /* ... and its distance from the axis on the pulley; 0: no ride */
    double ride_speed;          /* m/s */
    double ride_from, ride_to;  /* s; when the ride began and ends */
    double exit_box[4];         /* [in] m; left, bottom, right, top; its track ends outside */
    double zone[4];             /* the box with a margin, for which `World.nearby` is right */
    double since;               /* s; time of the latest impact */
    double slept;               /* s; time at which it fell asleep */
    double balanced;            /* s; time at which the forces on it, as a sleeper, were balanced to its weight */
    double calm;                /* s; for how long its contacts have hardly slipped or opened */
    double open;                /* m/s; approach that a solve leaves open for disks in contact with a rider, see `give_in` */
    double rest;                /* s; for how long it has been at rest: calm by the lower bound for sleep, or staying in
                                   place even if it rattles there */
    double waits;               /* s; for how long it has to be at rest before it falls asleep */
    double anchor[3];           /* m; where its rest began: x, y, and how far its rim has turned since */
    int stirred;                /* whether a contact slips or opens in this step */
    double entries[3];          /* J; belt work, restitution loss, friction loss so far */
    double gain[3];             /* J; what this step's lasting contacts add to them */
    double ahead[3];            /* J; the part of this that belongs to the second half of the step */
    double bends;               /* m/s2; greatest acceleration by which arcs turn the paths of its corners: see `bends_by` */
    double lacks;               /* J; kinetic energy missing in the mean velocity of this step's impulses inside an arc,
                                   see `account` */
    double force[2];            /* N; push by hand */
    double owed[2];             /* N s; impulse that it has still to give, below 0 if it gave more than for the time so far */
    double kick[2];             /* m/s; change of velocity by it in this step */
    double turned;              /* [in] rad; angle from its written position */
    int kind;                   /* [in] row of the table of pairs */
    int rides;                  /* [in] the incoming belt carries it by adhesion */
    int goes_on;                /* [in] it continues an earlier run: released even if it overlaps others */
    int links;                  /* first of its lasting contacts in `World.links`, or -1 */
    int nears;                  /* first of its places in `World.near`, or -1 */
    int before;                 /* first of its contacts of the step before, or -1 */
    int queued, moved, jam;     /* marks: of the shock, twice, and of the latest jam */
    int jam_next;               /* the next disk in that jam, or -1 */
    int bearer;                 /* owner of a surface that supports it, if it sleeps */
    int frozen;                 /* first of its ends of `World.frozen`, or -1 */
    int rouses;                 /* the next of the disks that wake together, or -1 */
    int nearby_count;           /* surfaces whose boxes overlap its zone; MAX_NEARBY + 1: too many */
    int held_count;
    int held[MAX_HELD];         /* surfaces that it lies on */
    int ride_met;               /* surface where a ride ends, or -1 */
    int on;                     /* owner of a surface that it lies on, or -1 */
    int slips;                  /* whether it slips there */
    int landed;                 /* it has met the landing surface */
    int ends;                   /* reason for which its track ends in this step, or -1 */
    int reason;                 /* [out] why its track ended */
    int waited;                 /* [out] 1 if its place was not free when it was due */
    int wide;                   /* 1 if all others check it in this step, see grid.c */
    int far;                    /* 1 if the step's impulses take it further than was foreseen */
    int body;               /* its row of `World.solver_bodies`, if that is of this disk */
    int halved;             /* its contacts are, see `Contact.halved` */
    int tie;                /* first of its ends of joints, 2 n and 2 n + 1 of joint n, or -1 */
    int corners;            /* [in] number of corners; 0 if it is round ... */
    int outline;            /* [in] ... and the first of them in `World.outlines` */
    int smooth;             /* number, from 1 on, of the step in which its hop was ended */
    int lies;               /* whether a lasting contact presses it in this step */
    int hops;               /* whether it is on the hop that its last contacts gave it: no impact has moved it since */
    double whirl;           /* m/s2; if so, greatest centripetal acceleration of its corners at the beginning of the step,
                               and at which gaps to other particles close without impulses, else 0 */
    double inner, broad;    /* m; radius of the inner circle, and of a circle of its area; or its own */
    double tug[3], tugged[3]; /* m/s, m/s, rad/s; change by half of a step's pull of its joints, now and before */
    double drawn[3];        /* m/s2, m/s2, rad/s2; acceleration by its joints in the latest step that was not brief */
} Disk;

/* The track of a disk since its last written knot. */
typedef struct {
    double from[9];       /* that knot */
    double knot[6];       /* latest state that was noted: t, x, y, vx, vy, spin */
    double held[6];       /* latest state in lasting contact, halfway through its impulses */
    double after[3];      /* velocity and spin after these impulses */
    double after_entries[3];
    double past[6];       /* the state before `held` */
    double angles[2];     /* rad; its angle in `from` and in `held` */
    double load[3];       /* N; normal force in the last three steps, newest first */
    double load_t[3];
    int begun, waits;     /* whether it has a first knot; number of waiting states, see `World.waits` */
    int noted, mask;      /* number of states since `from`; of them every (mask + 1)th waits, and the last two */
    int lasted;           /* steps in contact since the last impact, 0 in flight */
    int stays;            /* steps on one surface, with or without impacts */
    int ground;           /* owner of the surface of `stays`; a disk that leaves it may have struck another one last */
} Track;

typedef struct {
    double x, y;            /* [in] segment: first end; circle and arc: centre */
    double tx, ty;          /* segment: unit tangent [in]; arc: unit vector to its middle */
    double length;          /* [in] segment */
    double radius;          /* [in] circle and arc */
    double begin, extent;   /* [in] arc: angle of its first end, and from there on, rad */
    double cos_half;        /* arc: cosine of half its angle */
    double end[4];          /* segment and arc: both ends, x and y */
    double crown[4];        /* ... and unit vectors to the middle of that half of their rim that belongs to its left side */
    double hollows[4];      /* of a segment: cotangents of the angles to the pieces that are next to it at its ends, on its
                               left and right, ... */
    double speed;           /* [in] m/s along the tangent; round a circle or arc clockwise */
    double opens, closes;   /* [in] s; it exists from the one to the other */
    int shape;              /* [in] a full arc becomes a circle */
    int material;           /* column of the table of pairs, behind the kinds of disks */
    int owner;              /* [in] number of the surface that it is a piece of */
    int mates[2];           /* pieces that continue smoothly beyond its ends; of a circle those that lead to it; or -1 */
    double ledges[2];       /* m; distance of both ends there */
    int gate;               /* column of `spared` if it appears, vanishes or is one-sided, else -1 */
    int one_sided;          /* [in] 1: solid on its left (an arc: outside) only; -1: on the other side only; 0: on both */
    int chain;              /* the next of the pieces that share its column: they continue at its ends */
    int there;              /* enum There: whether it exists in this step */
    int ignored;            /* whether it is a gate that has closed on particles, which ignore it */
    int mover;              /* row of `movers` if it moves, else -1 */
    int beside[4];          /* ... and these pieces, or -1 */
    double box[4];          /* m; left, bottom, right, top; of all that it sweeps in this step */
    double swept[4];        /* m; the same for the whole run */
    double posed;           /* s; of a moving surface: time of the position above ... */
    double still[12];       /* ... and its written position: x, y, tx, ty, end, crown */
    double fastest, haste;  /* m/s, m/s2; bounds on speed and acceleration of its points */
    double reach;           /* m; greatest distance from its pivot */
} Surface;

#define TERMS 15 /* of the power series of a hinge's angle */

/* How a surface moves: it shakes, travels and turns about a pivot, as a function of the run's time; or it is a hinge at
   that pivot. */
typedef struct {
    double pivot[2];        /* [in] m; at rest */
    double by[2], frequency, phase; /* [in] m, Hz, rad; it shakes with this amplitude */
    double way[2], from, lasts; /* [in] m, s; it travels this way, from a time on, for so long; 0: it does not */
    double turn;            /* [in] rad/s; of a hinge, that at t */
    double inertia, mass;   /* [in] kg m2, kg; about its hinge; 0 if it is none; 0 without weight */
    double gyration;        /* [in] m; root of the mean square distance from the hinge */
    double moment[2];       /* [in] kg m; mass times the vector from the hinge to the centre of mass, as written */
    double spring, rest, damper; /* [in] N m/rad, rad, N m s/rad */
    double stops[2];        /* [in] rad; least and greatest angle */
    double motor[2];        /* [in] rad/s, N m; speed and greatest torque */
    double worked, stopped, damped; /* [out] J; work of its motor, losses at its stops and in its damper */
    double torque, pushed;  /* N m; torque by hand; [out] J; and its work */
    double t;               /* s; time of the state that follows */
    double place[2], velocity[2], pull[2]; /* m, m/s, m/s2; of the pivot */
    double sine, cosine;    /* of its angle */
    double hastens;         /* rad/s2; angular acceleration */
    double swing;           /* m/s2; greatest acceleration of its pivot */
    /* of a hinge */
    double since, angle, rate; /* s, rad, rad/s; at the beginning of its path ... */
    double path[TERMS];     /* ... and coefficients of the angle from then on, by powers of time */
    double before;          /* rad/s; before the step's impulses */
    double begins;          /* [in] s; it moves from then on: its times count from there */
    double until;           /* s; turned by hand, it turns at `rate` from `angle` up to then */
    double impulse[3];      /* N m s; of its stops and its motor ... */
    double need[2], most;   /* rad/s, N m s; ... least changes that the stops ask for, and the bound of the motor */
    double drift;           /* rad/s; change of its rate by springs and weight up to the middle of the step */
    double acted;           /* s; time up to which its motor has acted */
    int surface;            /* [in] owner of what moves */
    int stirs;              /* whether it moves in this step */
    int solved;             /* its impulses are of a step that begins now */
    int struck;             /* stop that it meets at the end of the step: 1, 2, or 0 */
    int first, last;        /* [in] for the laws: its first and last state in their `swings` */
    int steered;            /* [in] it is turned by hand */
    int lies;               /* stop on which it lies when it is struck: 1, 2, or 0 */
} Mover;

/* A state of a hinge: halfway through the impulses of a step, and before an impact. */
typedef struct { double t, angle, rate; int surface, pad; } Swing; /* s, rad, rad/s */ /* [out] */

/* What happens to a surface when another one is touched for the first time: it vanishes, appears or begins to move. */
enum Doing { GOES, COMES, STARTS };

typedef struct {
    double t;               /* [out] s; when that was, INFINITY before */
    int surface, doing;     /* [in] owner, and what it does ... */
    int by, pad;            /* [in] ... when this owner is touched */
} Trigger;

/* What connects a particle with a fixed point or another particle: a string only pulls, a rod keeps its length, a spring
   changes its length, a pin keeps a point of both together. */
enum Tie { STRING, ROD, SPRING, PIN };

typedef struct {
    double from[2];         /* [in] m; fixed end if there is no other particle; of a pin its place; of a string between
                               two particles its pulley, or NaN */
    double length;          /* [in] m; of a spring at rest; NaN: the distance when it is tied */
    double stiffness, damper; /* [in] N/m, N s/m */
    double kept[2], damped, given; /* [out] J; energy in a spring when it was tied and now, loss in its damper, and work
                                      on its particles */
    double arm[4];          /* m; of a pin, from both centres, for particles at an angle of 0 */
    int kind, particle, other; /* [in] enum Tie; two particles, or one and -1 */
    double now[4];          /* m; from its other end to its particle; from a pulley to both particles */
    int tied, struck;       /* whether both ends move freely; an impact is passed on to it */
    int taut;               /* a string that pulled in the step before */
    int row;                /* first of its rows */
    int next[2];            /* next ends of joints of the same particles, as `Disk.tie` */
} Joint;

/* One equation of a joint; a pin has two. */
typedef struct {
    double e[4], lever[2];  /* directions and levers with which its impulse acts on the particle and on the other one; m */
    double kick;            /* N s; half of its impulse in a step; above 0 it pushes them apart */
    double answer;          /* N s; its response to an impact */
    double off, eases;      /* m, m/(N s); by how much it is missed, and compliance of a spring */
    double root;            /* pivot: its element of the diagonal matrix of the factors */
    int joint, on;          /* whether it acts */
    int first, pad;         /* first column of its row of the matrix that is not 0 */
} JointRow;

typedef struct { double restitution, friction, rolling, falls, cohesion; } Pair; /* [in] rolling: arm over radius;
                                                                                    falls: 1 over the speed up to which
                                                                                    the restitution is constant, s/m; 0
                                                                                    for all; cohesion: N */

/* A contact of disk i with disk j, or with surface k as j = -1 - k. Its tangent is (ny, -nx). */
typedef struct {
    double nx, ny;          /* unit normal towards i */
    double gap;             /* m */
    double need;            /* m/s; least change of normal velocity such that the gap doesn't become negative ... */
    double gives;           /* ... how much less it asks for per N s of its normal impulse, 1/kg ... */
    double most;            /* ... and the most that it then asks for, m/s */
    double parts;           /* m/s; the part of `need` that removes an overlap; only this part may be given up */
    double pull;            /* m/s2; tangential acceleration by gravity on a surface */
    double drift;           /* m/s; slip that this gives up to the middle of the step */
    double impulse[3];      /* on i: normal, tangential (N s), rolling (N m s) */
    double clings;          /* N s; impulse of cohesion, by which the normal impulse is reduced */
    double mass[3];         /* effective masses and inertia, in the same order */
    double friction, arm;   /* coefficient; rolling friction as an arm, m */
    double other[3];        /* velocity of a surface or rider there: normal, tangential, spin */
    double moved[3];        /* the part of it by the motion of a surface */
    double lever[3];        /* m, m, 1; levers about a hinge, whose angular velocity was ... */
    double turning;         /* ... so large then, rad/s */
    double rest, falls;     /* coefficient of restitution, and s/m for its fall with speed: see `Pair` */
    double share;           /* share of its friction that acts; below 1 where surfaces wedge a disk */
    double entries[3], later[3]; /* J; ledger entries of its impulses, and of the part of them that belongs to this
                                    step, see `account`; of a halved contact those of its first half */
    double given[2];        /* J; the same for the belt that carries the partner */
    double turns;           /* m/s2; acceleration by which an arc turns the path of a disk in a crowd or of a corner, or 0 */
    double leans, steep;    /* ... and tangent of the angle by which the normal of a corner is turned for it, at most `steep` */
    double free_gap, bend;     /* m; gap at the end of the step without impulses, and change of it by impulses beyond
                                  the linear one: see `bends`, `bends_off` */
    int i, j;
    int two;                /* whether j is a free disk, which also gets the impulse */
    int owner;              /* of the ledger entries */
    int island;             /* disk at the root of its island */
    int next;               /* next of the contacts of disk i in the step before */
    int frozen;             /* number, from 1 on, of the row of `World.frozen` for this pair and place, or 0 */
    int leaves;             /* it opens in this step */
    int halved;             /* half of its impulse is given before the flight and half after it, see tied.c */
    int hung;               /* number, from 1 on, of the hinge that also gets the impulse, or 0 */
    int cornered;           /* i has corners, and perhaps j */
    double own[2], others[2]; /* m; with corners: levers of a normal and of a tangential impulse, on i and on j */
    double spot[2];         /* m; ... and the place from the centre of i, in the frame of i */
    double looked[7];       /* m, rad; when the place was looked up: the gap, and x, y and `turned` of i and of j */
    int places;             /* number of places at which the two touched then */
    int stalls;             /* its surface has stalled in this step, see solver.c */
    int is_corner;          /* the place is a corner of i on a surface, from the inside if that is an arc */
    double mean[2];         /* N; running mean of its force on i, see sleep.c; NaN before the first step */
} Contact;

/* A contact of a sleeper with a surface or with another particle, which may be awake. Forces act on i, N. */
typedef struct {
    double pressed[3];      /* N, N, N m; the impulses of the contact per time, when the later of both fell asleep */
    double bore[2], now[2]; /* running mean of its force: when the first of both fell asleep, and now */
    double felt[2];         /* its force in the latest step */
    double force[2];        /* its force in the balance of loads of the disk that fell asleep first ... */
    double more[2];         /* ... and what is added to that in the balance of the other one */
    double branch[2];       /* m; vector to the centre of i from that of j, or from its foot on a surface */
    double spot[2];         /* m; the place from the centre of i */
    double from;            /* s; since when both sleep, or INFINITY */
    double told;            /* s; time up to which the loads of a single sleeper are reported */
    double rise;            /* component of the normal against gravity: positive if i lies on j, 0 if they lean on each other */
    int i, j;               /* as of `Contact` */
    int first, pad;         /* the one that fell asleep first */
} Frozen;

/* What the impulses of a solve change of a disk, and how it responds to 1 N s. The first body stands for everything that
   does not move. */
typedef struct {
    double x, y, rim;       /* m/s; change of velocity, and of spin times radius */
    double mass;            /* 1/kg */
    double turn, twist;     /* 1/kg, 1/(kg m); response of the rim to an impulse at it, and to a moment */
    double bend;            /* 1/m; 1 / radius */
    int disk, used;         /* whose; which colours its rows have, see fours.c */
} SolverBody;

/* A contact for the sweeps: what they change, and what it asks for. */
typedef struct {
    double normal[2], tangent[2]; /* unit vectors; times a velocity of the first body they give normal velocity and slip */
    double free[2];         /* m/s; normal velocity less what the gap needs, and slip, without impulses */
    double mass[2], light[2]; /* kg; effective masses, and 1 / them */
    double impulse[2];      /* N s; normal, tangential */
    double swept[2], course[2]; /* N s; the impulse two sweeps ago, and the last momentum step: see `hasten` */
    double gives, eases, more, parts; /* `gives` and `parts` of the contact; effective mass where it gives, kg; `most`
                                         less `need` */
    double rough;           /* coefficient of friction that acts */
    double arm, spin;       /* m, rad/s; of rolling friction, and rate of rolling without impulses */
    double roll_mass, roll_light; /* kg m2, and m/s per moment */
    double moment, roll_swept, roll_course; /* N m s; as impulse, swept and course */
    double change;          /* m/s; change of its slip by the last sweep */
    int a, b;               /* bodies */
    int from;               /* number of its contact in the list */
    int four;               /* its place among the numbers of `SolverFour` */
} SolverRow;

/* Levers of a row with corners or a hinge: change of the rim of both bodies by its impulses, in their radii; and change
   of the slip by its normal impulse, 1/kg. */
typedef struct { double own[2], others[2], slips, pad; } RowLever;

/* A body of the sweeps in single precision, with 1/kg of x, y and rim. */
typedef struct { float x, y, rim, pad, swept[4], course[4], response[4]; } LightBody;

/* Four rows for these sweeps. Fields have the names of `SolverRow`, except those of x and y, and of normal and slip;
   `eases` and `parts` have the opposite sign. */
typedef struct {
    LightBody *a[4], *b[4];
    float nx[4], ny[4], opens[4], slips[4], mass[4], slide_mass[4], light[4], slide_light[4];
    float gives[4], eases[4], more[4], parts[4], rough[4];
    float impulse[4], along[4], swept[4], course[4], slide_swept[4], slide_course[4];
} SolverFour;

/* The rolling friction of four rows. */
typedef struct {
    float arm[4], spin[4], roll_mass[4], roll_light[4], bend_a[4], bend_b[4];
    float moment[4], roll_swept[4], roll_course[4];
} RollFour;

/* The levers of four rows. */
typedef struct { float own[4], own_slide[4], others[4], others_slide[4], slips[4]; } LeverFour;

/* inner: in the exact engine, whether it lies within a ride round a circle; plus 2 if a track of a family comes there round
   a circle from the knot before. */
typedef struct { double t, x, y, vx, vy, spin, entries[3]; int disk, inner; double angle; } Knot; /* [out] */

typedef struct {                                                                         /* [out] */
    double t, x, y, before[3], after[3]; /* velocity and spin */
    double normal, tangent;              /* N s, on `disk` */
    int disk, other, kind, surface;
} Event;

/* What all released disks of a crowd have together at the beginning of a step. Ended disks count with their state at
   their ends, disks in lasting contact with that halfway through their impulses, as in their tracks. */
typedef struct {                                                                         /* [out] */
    double t, kinetic, potential, entries[3], unsolved; /* s, J, radii */
    double released;        /* J; what they had at their releases */
    double springs[4];      /* J; of all springs: energy when they were tied, energy now, losses, work */
} Total;

typedef struct { int disk, next, ix, iy; } Cell; /* one disk in one cell of the grid */

typedef struct {
    Disk *disks;
    Surface *surfaces;   /* room for twice as many: narrow arcs are split in two */
    Pair *pairs;         /* (kinds, kinds + materials) */
    Mover *movers;
    Trigger *triggers;
    Joint *joints;
    double *outlines;    /* [in] (outline_count, 2) corners round the centroid, counterclockwise, kind by kind, m */
    double *edges;       /* (outline_count, 3) unit vector out of the edge that begins at a corner, and its length, m */
    double *poses;       /* (disks, 3) angle, cosine and sine of each */
    JointRow *joint_rows;
    double *joint_matrix; /* (joint rows, joint rows) */
    /* arrays that `prepare` reserves */
    Track *tracks;
    Knot *waits;         /* (disks, WAITS) states of each since its last knot; (1, WAITS) if disks don't meet */
    double *books;       /* (owners + 1, 3), J; the last row is for impulses between disks */
    double *drives;      /* (owners), J; the part of the work in `books` that is done by the motion of a surface */
    Knot *knots;
    Event *events;
    Total *totals;       /* one per step of a crowd */
    Swing *swings;
    double *swing_work;  /* (swings, 3), J; `stopped`, `damped` and `pushed` of its mover then */
    Contact *contacts;   /* of this step */
    Contact *earlier;    /* of the step before */
    SolverRow *rows;     /* (contacts + 3 movers) rows that are solved together */
    RowLever *levers;    /* (contacts + 3 movers) ... levers of those of particles with corners, and of hinges */
    SolverBody *solver_bodies; /* (disks + 1 + movers) ... and their disks and hinges */
    SolverFour *fours;   /* (four_room) the same in single precision */
    RollFour *roll_fours;   /* (four_room) ... their rolling friction */
    LeverFour *lever_fours; /* (four_room) ... and their levers */
    LightBody *light_bodies; /* (disks + 1 + movers) */
    Frozen *frozen;      /* (2 contacts) contacts of sleepers */
    int *frozen_links;   /* (4 contacts) row n has the ends 2 n and 2 n + 1: the next end of the same disk, or -1 */
    int *borders;        /* (2 contacts) rows of `frozen` of which one is a sleeper and the other one is not */
    double *balance;     /* (disks, 5, 2) room for conjugate gradients */
    int *links;          /* (2 contacts) */
    int *near;           /* (2 near) pairs that may meet in this step */
    int *near_links;     /* (2 near) the next place in `near` of the same disk, or -1 */
    Cell *cells;
    int *heads;          /* first entry of each bucket of the grid */
    int *heap;           /* disks, sorted by their next events */
    int *queue;          /* (disks + 1) */
    int *moved;          /* (disks) */
    int *found;          /* (2 disks) */
    int *live;           /* (disks) those that ride, fly, lie or sleep in this step, ascending */
    int *nearby;         /* (disks, MAX_NEARBY) surfaces near each, ascending */
    int *everything;     /* (surfaces) 0, 1, ... */
    int *ends;           /* (2 surfaces) ends of segments and arcs, sorted by place ... */
    int *circles;        /* ... and behind them, in the same array, the circles */
    int *spared;         /* (disks, gates) 1: the gate closed on this disk, or lets it pass, and the disk isn't clear of
                            it yet */
    /* sizes */
    int disk_count, surface_count, kind_count, owner_count; /* [in] */
    int mover_count;     /* [in] */
    int trigger_count;   /* [in] */
    int joint_count;     /* [in] */
    int outline_count;   /* [in] */
    int joint_row_count;
    int material_count;
    int knot_room, event_room, total_room, contact_room, four_room, near_room, cell_room, swing_room;
    int full;            /* the array for which `run` has to make room: see `Full` */
    int bucket_count;    /* a power of two */
    int gate_count, end_count, circle_count;
    int smallest;        /* disk of the smallest radius in this part of the run */
    /* the run */
    int interact;        /* disks collide with each other */
    int is_whole;        /* [in] all knots and events are still here: the host has taken none */
    int until;
    int landing;         /* owner on which a disk lands, or -1 */
    int ride_owner;      /* owner that rides are on */
    int pulley;          /* row of the drive pulley among the surfaces, or -1 */
    double ride_incline; /* rad; angle at which the belt rises to the pulley */
    int sweeps;          /* greatest number of sweeps of the contact solver */
    int sleeps;          /* whether particles may fall asleep */
    double gx, gy;       /* m/s2 */
    double up[2];        /* unit vector against gravity */
    double air;          /* [in] kg/m3; density of still air, 0 without */
    double dt;           /* s; longest step */
    double end_time;     /* s */
    double pause;        /* [in] s; `run` returns after the first step that ends then or later; 0: it does not */
    double smooth_x, smooth_v; /* radii, m/s; tolerance of a track between two knots ... */
    double hops;         /* ... but no less than so many hops of a contact */
    double accurate;     /* m/s; changes at which sweeps end */
    /* [out] */
    int knot_count, event_count, total_count, contact_count, near_count, earlier_count, swing_count;
    int frozen_count;
    int border_count;    /* ... or -1 if they have to be listed again */
    int roused;          /* whether rows of `frozen` may have become obsolete */
    int later_count;     /* pairs in `near` beyond `near_count`, added when a path changed within the step; -1: there is
                            no room for them */
    int woken;           /* whether the latest impact has woken any disk */
    int impact_count, step_count, solve_count, sweep_count;
    int done;            /* number of disks that have ended, as a measure of progress */
    int stalled;         /* the disk that stalled */
    double air_loss;     /* J; loss by drag */
    double released;     /* J; energy of disks at their releases */
    double latest[3];    /* s, J; time of the latest release, kinetic and potential energy of all disks released then */
    double ended[5];     /* J; of disks of a crowd at their ends: kinetic, potential, entries */
    double push_work;    /* J; work of pushes by hand */
    double hastened;     /* m/s2; greatest acceleration of a disk by such a push */
    double gained;       /* J; by which solves broke their law of energy, see `check_solve` */
    double unsolved;     /* radii; greatest overlap that the solve of this step leaves beyond what it asks for */
    double unsolved_most; /* ... and that of all steps so far */
    /* within the step */
    int low, high;       /* range of disks of this part of the run */
    int live_count;
    int phase, cell_count, heap_count, moved_count, wide_count;
    int stirs;           /* whether a surface moves in this step */
    int passes;          /* some kinds pass through each other (their restitution is below 0), or some particles are
                            joined */
    int hinges;          /* number of hinges */
    int swings_too;      /* some contacts that are solved act on hinges */
    int stamp, shocks, jams; /* numbers of the latest query, shock and jam, for marks */
    int step_jams;       /* number of jams in this step */
    double t, now, step, step_end, cell;
    double looked;       /* s; time for which it is set which surfaces exist */
    double chosen;       /* [in] s; the usual step if `dt` is not the scene's: longer ones stay further below what hops allow */
    double easiest;      /* greatest `ease` in this step */
    double ease;         /* share of the step that hops allow which a crowd takes, less while overlaps are deep */
    double taken[2];     /* J; the most that restitution and friction losses of a crowd have been */
    double borne;        /* J; sum of weights times radii */
    double regained;     /* J; greatest fall of both together below these */
    double risen;        /* J; the most that all have had at a step beyond what they brought and the ledger explains */
    double eager;        /* 1; less while a crowd gets back energy that it had lost, see `note_totals`: then slow approaches
                            may make less overlap, and overlaps are removed more slowly */
    double usual;        /* s; the step unless something cuts it short; what a step corrects is for this length */
    double length, length_before; /* s; of this step and of the one before */
    double hopped; /* s; latest time at which a step was to end when it was solved, and with it the hops of what rests */
    double again;        /* factor by which the impulses of the step before are the first guess for those of this one */
    double before;       /* share of this step's impulses that belongs to the one before */
    double g;            /* m/s2; size of gravity */
    double tilt;         /* rad; angle of gravity from straight down, counterclockwise */
    double haste;        /* m/s2; bound on the acceleration of surfaces in this step */
    double shakes;       /* Hz; highest frequency of surfaces that shake in this step, or 0 */
    double fastest;      /* m/s; bound on the speed of all surfaces */
    double pace;         /* sqrt(g / EARTH), 1 without gravity: bounds on speeds are proportional to it, bounds on times
                            inversely. So a film of a run that is played faster is a run, too */
    double soft;         /* m/s; twice the speed that gravity gives in a step: supported disks have soft impacts below it */
    double ledge;        /* m; ledge up to which a joint is smooth in this step, see `ledge_in` */
    double room;         /* m; least room that an arc leaves a disk by itself, INFINITY without one */
    double skip;         /* 1/s; SKIP per step */
} World;

/* A scene as a row of numbers: the keys of its tables, with their own names, NaN for those that are not given. Tables
   follow each other in the order of `Plan`'s counts, those of one kind in the order of the file. A family of scenes is a
   set of such rows. All of these structs are of doubles only. */

enum DropFrom { FROM_IMPACT, FROM_TOP };

typedef struct {
    double gravity;
    double gravity_deg;     /* 0 is down */
    double air_density;     /* kg/m3; of still air */
    double crowded;         /* whether particles collide with each other */
} SceneKeys;

/* A kind of particles. */
typedef struct {
    double radius;          /* m; the mean */
    double span[2];         /* m; range of radii, if they differ */
    double moment;          /* I/(m r2); 0 if it never rotates */
    double corners;         /* number of corners of a box or polygon, see `Drawing.corners`; 0 if it is round */
} ParticleKeys;

typedef struct {
    double kind;            /* number of its kind of particles */
    double at[2], to[2], fill[4], velocity[2], omega, angle_deg; /* rad/s at the release; and the angle then */
    double count, rate, start, bed_height, speed_spread;
    double seed[2];         /* its lower 32 bits and the others */
    double at_once;         /* whether all are released at once */
} StreamKeys;

typedef struct {
    double speed, pulley_radius, length, incline_deg;
    double friction;        /* with the nominal particle; INFINITY is adhesion */
    double adheres;         /* whether the belt's own table says that it adheres */
} IncomingKeys;

/* The direction in which particles may pass a surface. */
enum Passes { NEITHER_WAY, PASSES_UP, PASSES_RIGHT, PASSES_OUT };

/* The damping plate; or a further plate, if it has a pivot. */
typedef struct { double distance, pivot_height, pivot[2], angle_deg, above, below; } PlateKeys;

typedef struct { double speed, drop, drop_from, start, length; } OutgoingKeys;

typedef struct { double from[2], to[2], pulley_radius, speed; } ConveyorKeys;

typedef struct {
    double corners;         /* number of corners in `points`, which follow all tables, surface by surface; 0: an arc */
    double center[2], radius, from_deg, to_deg, speed, opens_at, closes_at;
    double passes;          /* enum Passes, negative for the opposite direction; NaN: solid from both sides */
    double repeat[6];       /* up to two of count, dx, dy */
} SurfaceKeys;

/* A joint, see `Joint`. Without a length it is as long as at the release; without a point it is between two particles. */
typedef struct { double kind, from[2], length, particle, other, stiffness, damper; } JointKeys;

/* How a surface moves. Without a pivot it is its first point, the centre of an arc, or the pivot of a plate. */
typedef struct {
    double surface, pivot[2], by[2], frequency, phase_deg, to[2], at, in, turn;
    double hangs, mass, inertia, spring, rest_deg, damper, stops_deg[2], speed_deg, torque;
} MoverKeys;

/* The terms that a plan needs to be run as it is, beside these tables: of the run, of each kind of particles, and then
   restitution and friction of each kind, as `Pair`, with each kind and with each surface. */
typedef struct { double max_time, until; } RunKeys; /* s; `until` is NaN if it is a word */

typedef struct { double mass, inertia, rolling; } BodyKeys; /* kg, kg m2; for the mean radius */

/* Pieces of surfaces. Speeds are along the tangent, and clockwise round an arc. */
typedef struct {                                                                         /* [out] */
    double start[2], end[2], tangent[2], length, speed;
    double appears, vanishes; /* s; it exists from the one to the other */
    int surface;              /* which it belongs to */
    int one_sided;            /* as in `Surface` */
} Segment;

typedef struct {                                                                         /* [out] */
    double center[2], radius, begin, extent, speed; /* see `Surface` */
    double appears, vanishes;
    int surface, one_sided;
} Arc;

/* What is contradictory: there is no impact from which to measure the outgoing belt, the plate has no length, or the
   impact is above or below the plate. */
enum Contradiction { SOUND, NO_IMPACT, NO_LENGTH, HIT_ABOVE, HIT_BELOW };

/* The flight that determines plate and belt: that of particle 0, without spread. */
typedef struct {                                                                         /* [out] */
    double position[2], velocity[2]; /* at its beginning; NaN if it never leaves forwards */
    double hit[2];          /* m; its centre when it meets the plate's unbounded line; NaN if never */
    double along;           /* m; how far above the pivot that is, along the plate */
    double below;           /* m; how far the damping plate reaches below its pivot */
    int contradiction;
    int off;                /* enum Contradiction: whether the hit is above or below the plate */
} Nominal;

/* Returned by a run that the host has to prepare: it reports what is wrong with the plan, gives time to releases that
   take long to draw, and a local origin to a machine that is far away. */
#define ASIDE -1

/* Machines: rows of numbers in, surfaces out; as many for each member of a family. */
typedef struct {
    double *rows;           /* [in] (members, width) */
    double *terms;          /* (term_width) of a plan that is run, behind its rows: `RunKeys` and what follows */
    int members, width, term_width; /* [in] */
    int owners;             /* [in] of a plan that is run: number of names of its surfaces */
    int particles, streams, incoming, plates, outgoing, conveyors, surfaces, joints, moving; /* [in] counts */
    Segment *segments;      /* [out] (members, segment_count) */
    Arc *arcs;
    Mover *movers;          /* [out] (moving) of a single scene */
    Nominal *nominal;       /* [out] (members) */
    int segment_count, arc_count; /* [out] of each */
    int pad;
} Plan;

/* A particle of the exact engine, which meets no other. */
typedef struct {
    double release, stop;       /* [in] s; its release, and the time from then to the end of its run */
    double position[2], velocity[2], omega; /* [in] at its release */
    double radius, mass;        /* [in] a radius of 0 is a mass point */
    double inertia;             /* [in] kg m2; 0: it does not rotate */
    double rolling;             /* [in] rolling friction: its arm over the radius */
    double gravity, pace;       /* [in] m/s2; factor of bounds on speeds */
    double exit_box[4], up[2];  /* [in] m; as in `Start`, in the world's frame, and the upward direction there: here it
                                   is (0, 1) */
    int kind;                   /* [in] row of the table of pairs */
    int carried;                /* [in] the incoming belt carries it by adhesion */
    int reason;                 /* [out] why its track ended: enum Ending */
    int pad;
} Lone;

/* Why a track of the exact engine ended, as in `results.REASONS`. */
enum Ending { TIME_IS_OVER, HAS_LANDED, HAS_SETTLED, HAS_LEFT };

/* Why the exact engine returned. PAUSING: the budget of rounds is used up. FILLED: take knots and events, and call again.
   NO_MEMORY: there is no more memory. NO_PROGRESS, DRIVEN, TOO_LONG: a particle is stuck, and its track is over; call
   again for the others. HELD: a spinning disk is held between surfaces of which one moves. */
enum Course { FINISHED, PAUSING, FILLED, NO_MEMORY, NO_PROGRESS, DRIVEN, TOO_LONG, HELD };

typedef struct { double radius, speed, incline; int surface, pad; } Wheel; /* [in] the drive pulley */

typedef struct {
    /* arrays; of a family each scene is a member */
    Segment *segments;      /* [in] (members, segment_count) */
    Arc *arcs;              /* [in] (members, arc_count) */
    Wheel *wheels;          /* [in] (members) or none */
    Pair *materials;        /* [in] (kinds or members, segments + arcs + pulley) */
    Lone *lones;            /* [in] (lone_count) in the order of releases */
    double *books;          /* (1 or lone_count, surface_count, 3) entries of each surface, J */
    Knot *knots;            /* [out] */
    Event *events;          /* [out] */
    int *labels;            /* [out] (event_count, 3) particle, kind and surface of each, if `brief` */
    double *room;           /* (room_size) for the obstacles that surfaces are */
    int segment_count, arc_count, wheel_count, lone_count, surface_count, kind_count; /* [in] */
    int knot_room, event_room, room_size;
    int each, apart;        /* [in] particles of a member, 0 without a family; each has books of its own */
    int is_whole;           /* [in] all knots and events are still here: the host has taken none */
    int brief;              /* [in] a family is judged as it runs, and most of its knots are dropped then */
    int until, landing;     /* [in] enum Until; surface that a particle lands on, or -1 */
    int most, window;       /* [in] greatest number of rounds of a particle; progress check interval, in rounds */
    double tick;            /* [in] s, divided by the pace; mean time between events below which there is no progress */
    double far;             /* [in] m; distance from the origin for which coordinates were rounded */
    double loose;           /* [in] how much larger ON_ARCS is for this run */
    int laid, begun;        /* number, from 1 on, of the member whose obstacles are set; whether `lone` has begun */
    /* [out] */
    int knot_count, event_count, contacts, rounds; /* rounds: greatest number of a particle */
    int lone;               /* the particle that is being followed; all before it have ended */
    int other[2];           /* surfaces between which it is held */
    double t, x, y;         /* where it is stuck, s and m */
    double passed;          /* s; time covered by its latest rounds */
} Exact;

/* m below the lowest surface and release, or outside the box of all without gravity, where a track ends. */
#define EXIT_MARGIN 1.0

/* Where and how a particle starts, and the box outside which its track ends. */
typedef struct {                                                                         /* [out] */
    double t, position[2], velocity[2], radius;
    double exit_box[4];     /* m; left, bottom, right, top */
    double omega, angle;    /* rad/s, rad */
} Start;

/* An earlier particle for the one that is being drawn: how far it has moved along the belt, its height (both m), and the
   least distance of the two (m). */
typedef struct { double dx, dy, reach; int particle, next; } Near;

/* Why releases of a scene cannot be drawn: a box has room for fewer particles of this radius; one would start inside a
   surface, at this distance from it instead of `reach` (m); or a belt with adhesion doesn't allow a spread of speeds,
   another velocity than its own, or a spin. */
enum Refused { ACCEPTED, BOX_FULL, RELEASE_INSIDE, SPREAD_ADHERES, VELOCITY_ADHERES, SPIN_ADHERES };

typedef struct {                                                                         /* [out] */
    double distance, reach;
    int why, stream;
    int particle;           /* which of the scene's, or how many */
    int surface;
} Refusal;

/* The releases of the machines of a `Plan`, as many for each member, stream by stream. */
typedef struct {
    Start *starts;          /* [out] (members, count) */
    Refusal *refusals;      /* [out] (members) */
    int *carried;           /* [out] (members, streams) whether the incoming belt carries them by adhesion */
    double *corners;        /* [in] of boxes and polygons round their centroid, m; kind by kind */
    Near *near;             /* (count) */
    int *links;             /* (count) */
    int *heads;             /* (head_room) lists of a grid */
    int *listed;            /* (pieces) */
    int count;              /* [out] particles of each member */
    int head_room;          /* a power of two */
    int looks;              /* [in] particles and places that a call checks before it returns */
    /* state of the drawing */
    int left;               /* checks left in this call */
    int member, stream, first, is_begun, next, near_count, found, listed_count;
    double looked, cell;
} Drawing;

/* Load on a surface in a bin of time: normal impulse, tangential impulse along (n_y, -n_x), where n is the normal towards
   a particle, and the vector of both; its moment about the origin; and the normal impulse times its place. */
typedef struct { double normal, along, x, y, moment, at[2]; } Load; /* N s, N m s; at: N s m */ /* [out] */

#define MOST_BINS 1048576

/* Share of its size by which an impulse may differ from the change of momentum that it alone caused. */
#define SAME_IMPULSE 1e-6

/* The impulse of a lasting contact on a disk, in a bin of time or while the disk slept. */
typedef struct {
    int disk, other;        /* the other: a disk, or -1 - a surface's owner */
    double from, to;        /* s */
    double x, y;            /* on the disk, N s */
    double stress[4];       /* (J b) in rows, N m s; b: vector to the disk's centre from that of the other disk, or from
                               the foot */
} Lasting; /* [out] */

/* Loads on surfaces, if they are asked for. */
typedef struct {
    double every;           /* [in] s; length of a bin; 0: no loads are recorded */
    Load *bins;             /* [out] (bin_count, owner_count) */
    int owner_count, bin_count;
    int used;               /* [out] bins up to the last one with a load */
    int overflow;           /* [out] there were to be more bins than MOST_BINS, or than memory has room for */
    double each;            /* [in] s; length of a bin of lasting contacts; 0: they are not recorded */
    Lasting *lasting;       /* [out] bin by bin */
    int *seats;             /* hash table of this bin: rows of pairs, + 1 */
    int lasting_count;      /* [out] */
    int lasting_room, seat_count, first, pad;
    double bin;             /* the bin that begins with row `first` */
} Loads;

/* ---- What a run is judged by: a subject of its own, which shares nothing with the engines'. ---- */

/* The laws, in the order in which they are reported. */
enum Law {
    LAW_FINITE, LAW_THROUGH, LAW_INSIDE, LAW_APART, LAW_ENERGY, LAW_LOSSES, LAW_LEDGER, LAW_SOLVED, LAW_STEP
};

enum Engine { ENGINE_EXACT, ENGINE_CONTACT, ENGINE_PYMUNK };

#define EPS 2.220446049250313e-16
/* Roundings that a number may have gone through between two contacts: some ten operations, each on numbers up to some ten
   times as large as the result. */
#define ROUNDINGS 500
/* EPS by which a contact may change an energy: half an ulp for each of two velocity components, a height and a sum. */
#define A_CONTACT 2
/* Share of the radius by which disks of a crowd may be pressed into each other or into a surface, as the contact engine
   promises: an iterative solver leaves some overlap. */
#define PRESSED 0.05
/* Share of its radius by which a cubic between two knots may leave a circle, as the recording promises. */
#define ON_ARCS 1e-9
/* Greatest number of breaches that are reported; there may be two of the law of losses. */
#define BREACHES 10

/* A piece of a surface for the laws. */
typedef struct {
    double x, y;            /* [in] first end of a segment; centre of an arc */
    double tx, ty, length;  /* [in] of a segment: unit tangent, and m */
    double radius;          /* [in] of an arc, m; 0 of a segment */
    double begin, extent;   /* [in] of an arc: angle of its first end, and from there on, rad */
    double speed;           /* [in] m/s */
    double appears, vanishes; /* [in] s; it exists from the one to the other */
    double end[4];          /* both ends, x and y */
    double box[4];          /* m; left, bottom, right, top */
    double clear;           /* s; time at which a particle got clear of a gate, see `forgiven`; NAN: not known */
    int surface;            /* [in] which surface it is part of */
    int whole;              /* whether it is a full circle */
    int mover;              /* [in] number, from 1 on, of its mover; 0 if it does not move */
    int one_sided;          /* [in] as in `Surface` */
    int chain;              /* number of pieces of a chain of such, at its first piece */
} Barrier;

/* A particle for the laws. */
typedef struct {                                                                          /* [in] */
    double radius;          /* m; with corners that of the inner circle */
    double mass, inertia;   /* kg, kg m2 */
    double gravity;         /* m/s2 */
    double reach;           /* m; radius, with its corners, see overlaps.c */
    int corners, outline;   /* number of corners, 0 if it is round, and the first one in `Laws.outlines` */
    int kind;
    int group;              /* from 1 on, of particles that nothing holds apart; else 0 */
    int overlaps;           /* whether it is deeper in another one than it may be */
    int pad;
} Body;

/* The path of a particle in a span of time, and its corners. */
typedef struct {
    double box[4];          /* m; left, bottom, right, top, with its corners; empty if it is not there */
    double from[4], to[4];  /* m, m/s; place and velocity at both ends */
    double strays;          /* m; from an even motion from the one place to the other, at most; INFINITY if it is there for
                               a part of the span */
    double turns;           /* m; way of its corners by rotation, at most */
    int knot;               /* the one before the span */
    int pad;
} Path;

/* A place where a particle is deeper in a piece than is allowed, or passes through it. */
typedef struct {                                                                         /* [out] */
    double t, x, y, depth;  /* s, m */
    int particle, piece;
    int passes;             /* its centre gets to the other side, between the ends of the piece */
    int pad;
} Hit;

/* A broken law, at its first breach. */
typedef struct {                                                                         /* [out] */
    double t, x, y;         /* s, m; NAN if it is about the whole run */
    double amount, bound;   /* what was found, and the bound that it must not exceed */
    int law;
    int particles;          /* number of particles that broke it; 0 if it is about all together */
    int particle;           /* the first of them, or -1 */
    int surface, piece;     /* those that it is about, or -1 */
    int pad;
} Breach;

typedef struct {
    double *knots;          /* [in] rows of t, x, y, vx, vy, spin, three entries of the ledger */
    double *angles;         /* [in] (knots), rad, if some have corners */
    double *outlines;       /* [in] (outline_count, 2) corners round the centroid, counterclockwise, m */
    int *offsets;           /* (particles + 1) first knot of each, and behind the last one: [in], or found if `owned` */
    Body *bodies;           /* [in] (particles) */
    Barrier *barriers;      /* [in] (pieces), of a family (members, pieces) */
    Mover *movers;          /* [in] (mover_count), as far as the laws need them */
    Swing *swings;          /* [in] of all hinges, those of each in the order of time */
    double *books;          /* [in] (book_rows, 3) entries of each surface, J */
    Breach *breaches;       /* (BREACHES) */
    Hit *hits;              /* in the order of particles and knots */
    int *order;             /* (knots) for crowds of the contact engine, (particles) for all crowds */
    double *places;         /* (particles, 2) for the same */
    Path *paths;            /* (particles) for crowds */
    int *passing;           /* [in] (kind_count, kind_count) whether two kinds do not meet */
    /* sizes */
    int particle_count, piece_count, knot_count, row; /* [in] row: doubles from knot to knot */
    int mover_count, swing_count, outline_count, kind_count; /* [in] */
    int book_rows, surface_count; /* [in] with the particles' own, which is the last */
    int hit_room;
    /* the run */
    int engine;             /* [in] */
    int interact;           /* [in] particles meet each other */
    int joined;             /* [in] some have joints */
    int alike;              /* [in] all steps are alike, and Chipmunk does all */
    int each;               /* [in] particles that share pieces, of a family; else 0: all */
    int pulley;             /* [in] piece 0 ends on a drive pulley */
    int contacts, steps;    /* [in] numbers of contacts and steps */
    int owned;              /* [in] rows are those of `Knot`, which also say whose knot it is */
    int unreal;             /* [in] number of values that are not finite, beside knots and books */
    double tilt;            /* [in] rad; angle of gravity from straight down */
    double dt;              /* [in] s; step, 0 for the exact engine */
    double gained;          /* [in] J; by which solves broke their law of energy */
    double hastened;        /* [in] m/s2; greatest acceleration of a particle by a push by hand */
    double regained;        /* [in] J; greatest fall of the losses of all below their maxima before, both together */
    double risen;           /* [in] J; the most that all have had at a step beyond what the ledger explains */
    double unsolved;        /* [in] radii; greatest overlap that the solve of a step left beyond what it asked for */
    double unit;            /* [in] J; unit of the entries of a crowd from a file, 0: they have all bits */
    double largest;         /* [in] m; radius of the largest particle, with its corners */
    double cohesion;        /* [in] N; greatest force that holds two together */
    double loose;           /* [in] how much larger ON_ARCS is for this run */
    int judged;             /* particles that have been judged while others still run */
    /* [out] */
    int breach_count, hit_count;
    double speed;           /* m/s; greatest speed of anything, belts included */
    double length;          /* m; greatest length in play */
    double rounding;        /* m; greatest rounding of a length */
    double arcs;            /* m; by which a curve between two knots may leave an arc */
    double bent;            /* m/s2; greatest acceleration along the inside of an arc */
    double haste;           /* m/s2; greatest acceleration by a push or of a moving surface */
    double late;            /* m; by which a step may take a disk beyond a surface */
    double allowed;         /* m; how deep a disk may be in a surface */
    double energy;          /* J; in play, see `energy_share` */
    double energy_bound;    /* rounding of the energy, as a share of it */
    double parted;          /* J; that the removal of overlaps may give */
    double held;            /* J; by which all losses of a crowd may be below their maxima before */
    double untold;          /* J; that a crowd's tracks may leave out between two knots */
} Laws;

#endif
