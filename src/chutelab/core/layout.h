/* What the core shares with its host: every array, every number, in SI units.

   The host fills in the counts marked [in] of a subject, has the core lay its arrays out (`lay_out_...`),
   fills in what of them is marked [in], calls what does the work, and reads what is marked [out].
   `tools/build_core.py` reads this file and writes `layout.json`, from which hosts take sizes, offsets
   and names: so a field is declared once. Only `double`, `int`, arrays of these and pointers stand
   here. */

#ifndef LAYOUT_H
#define LAYOUT_H

#define MAX_HELD 4 /* surfaces that one disk can lie on at a time; a fifth is met as an impact */
#define MOST_IDLE 400 /* rounds in a row that take no time: with more of them a particle is stuck */
#define MOST_CORNERS 32 /* of a particle */
#define WAITS 20 /* states of a track at most that wait to become a knot, or be left out */
#define MAX_NEARBY 12 /* surfaces that are listed for a disk; where there are more, it asks all */

/* What a disk is doing. Free disks move on parabolas; riders and sleepers on a prescribed path. */
enum Mode { WAITING, RIDING, FREE, ASLEEP, GONE };

/* What ends a track, as in `results.REASONS`. */
enum Reason { BY_TIME, BY_LANDING, BY_SETTLING, BY_EXIT };

/* Events, as in `results.Kind`. */
enum Kind { RELEASE, SEPARATION, SLIP, IMPACT, LANDING, COLLISION, STICK, SETTLE, EXIT };

enum Shape { SEGMENT, CIRCLE, ARC };

/* Whether a surface is there. */
enum There { ABSENT, THERE, LEAVING };

/* When a run ends: `run.until`. */
enum Until { UNTIL_LANDED, UNTIL_SETTLED, UNTIL_TIME };

/* Why `run` came back. PAUSED: the budget of steps is used up. FULL: take knots and events, and go on.
   LACKING: the core gets no more memory. */
enum Status { DONE, PAUSED, FULL, STALLED, LACKING };

/* The memory of arrays. Zeros in it, and in all other subjects, free all arrays. */
typedef struct {
    double end;             /* where the next array begins; 0: at the beginning */
    int lacks;              /* whether there was too little */
    int budget;             /* [in] rounds, or steps, after which a run comes back at the latest */
    int packed;             /* [out] bytes of the events of a run that is over and whole, see `pack_events`; else 0 */
    int first;              /* [out] where the first array begins */
} Room;

/* What every step asks of every disk stands first, in few lines of the processor's cache. */
typedef struct {
    double x, y, vx, vy, spin;  /* [in] at time t: centre, velocity, angular velocity */
    double t;
    int mode;                   /* WAITING at first */
    int mark;                   /* of queries */
    double left, bottom, right, top; /* box that it can reach in this step */
    double radius, mass;        /* [in] radius > 0 */
    double due;                 /* s; its next event, INFINITY if none is foreseen in this step */
    int changes;                /* counts changes of path, so that foreseen events can be outdated */
    int impacts;                /* in this step */
    int supports;               /* contacts that pressed in this step or the one before */
    int partner;                /* of the next event: disk j >= 0, surface k as -1 - k, or ALARM */
    int partner_changes;
    int heap_place;
    double ux, uy, uspin;       /* velocity before the step's impulses; of a sleeper, its own */
    double inertia;             /* [in] kg m2; 0: it does not turn */
    double inv_mass, inv_inertia; /* 1/kg, 1/(kg m2); 0 for one that does not turn */
    double aired;               /* s; until when air has slowed it down, see air.c */
    double release;             /* [in] s; it waits from then on until its place is free */
    double ride_x;              /* m along the belt from where that meets the pulley, where a ride by
                                   adhesion begins, <= 0 ... */
    double ride_rho;            /* ... and its distance from the axis on the pulley; 0: no ride */
    double ride_speed;          /* m/s */
    double ride_from, ride_to;  /* s; when the ride began and ends */
    double exit_box[4];         /* [in] m; left, bottom, right, top; its track ends outside */
    double zone[4];             /* the box, and room round it, for which `World.nearby` is right */
    double since;               /* s; latest impact */
    double slept;               /* s; since when it is asleep */
    double calm;                /* s; since when nothing at its contacts slips or moves apart */
    double open;                /* m/s; what the solve leaves open where a belt carries one of those in touch, see `give_in` */
    double rest;                /* s; since when it is at rest: the same to the finer bound of falling asleep,
                                   or it stays where it is, however it rattles there */
    double anchor[3];           /* m; where its rest began: x, y, and how far its rim has turned since */
    int stirred;                /* whether something slips or moves apart at its contacts in this step */
    double entries[3];          /* J; belt work, restitution loss, friction loss so far */
    double gain[3];             /* J; what this step's lasting contacts add to them */
    double ahead[3];            /* J; the second half of it */
    double lacks;               /* J; kinetic energy that the mean velocity of this step's impulses lacks
                                   in a hollow, see `account` */
    double force[2], pushed[2]; /* N; by which it is pushed by hand, in this step and in the one before ... */
    double kick[2];             /* m/s; ... and what that changes of its velocity in this step */
    double turned;              /* [in] rad; from as its corners are written */
    int kind;                   /* [in] row of the table of pairs */
    int rides;                  /* [in] the incoming belt carries it by adhesion */
    int goes_on;                /* [in] it was under way before: released wherever others are */
    int links;                  /* first of its lasting contacts in `World.links`, or -1 */
    int nears;                  /* first of its places in `World.near`, or -1 */
    int before;                 /* first of those of the step before, or -1 */
    int queued, moved, jam;     /* marks of the shock, and of the latest jam */
    int jam_next;               /* the next disk in that jam, or -1 */
    int island;
    int nearby_count;           /* surfaces whose boxes meet its zone; MAX_NEARBY + 1: too many */
    int held_count;
    int held[MAX_HELD];         /* surfaces it lies on ... */
    double bears[8];            /* N; ... and with which forces they bore it in the latest step, x and y of each */
    int ride_met;               /* surface where a ride ends, or -1 */
    int on;                     /* surface it lasts on by itself, or -1 */
    int slips;                  /* whether it slips there */
    int landed;                 /* has met the landing surface */
    int ends;                   /* the reason for which the track ends in this step, or -1 */
    int reason;                 /* [out] why the track ended */
    int waited;                 /* [out] 1 if its place was taken when it was due */
    int wide;                   /* 1 if it is asked by all in this step, see grid.c */
    int far;                    /* 1 if the step's impulses take it further than was foreseen */
    int body;               /* its row of `World.solver_bodies`, if that is of this disk */
    int tie;                /* first of its ends of joints, 2 n and 2 n + 1 of joint n, or -1 */
    int corners;            /* [in] how many it has; 0 of what is round ... */
    int outline;            /* [in] ... and the first of them in `World.outlines` */
    int smooth;             /* step, from 1 on, in which it was brought off its hop, if it was to be */
    double inner, broad;    /* m; radius of the circle inside them, and of one of their area; or its own */
    double tug[3], tugged[3]; /* m/s, m/s, rad/s; what half of a step's pull of its joints changes, and before */
} Disk;

/* The track of a disk since the last knot that is written. */
typedef struct {
    double from[9];       /* that knot */
    double knot[6];       /* latest state that was noted: t, x, y, vx, vy, spin */
    double held[6];       /* latest state in lasting contact, halfway through its impulses */
    double after[3];      /* velocity and spin after these impulses */
    double after_entries[3];
    double past[6];       /* the state before `held` */
    double angles[2];     /* rad; by which it had turned in `from` and in `held` */
    double load[3];       /* normal impulse per time of the last three steps, newest first */
    double load_t[3];
    int begun, waits;     /* it has a first knot; states that wait, see `World.waits` */
    int lasted;           /* steps of this contact since the last blow, 0 in flight */
    int stays;            /* steps on one surface, blows or not */
    int ground;           /* surface that `stays` are on: a disk that leaves it may have struck another last */
} Track;

typedef struct {
    double x, y;            /* [in] segment: first end; circle and arc: centre */
    double tx, ty;          /* segment: unit tangent [in]; arc: unit vector to its middle */
    double length;          /* [in] segment */
    double radius;          /* [in] circle and arc */
    double begin, extent;   /* [in] arc: angle of its first end, and from there on, rad */
    double cos_half;        /* arc: cosine of half its angle */
    double end[4];          /* segment and arc: both ends, x and y */
    double crown[4];        /* ... and to the middle of the half of its rim that goes on from its left side */
    double speed;           /* [in] m/s along the tangent; round a circle or arc clockwise */
    double opens, closes;   /* [in] s; it is there from the one to the other */
    int shape;              /* [in] an arc all round becomes a circle */
    int material;           /* column of the table of pairs, behind the kinds of disks */
    int owner;              /* [in] number of the surface it is part of */
    int mates[2];           /* pieces that go on smoothly beyond its ends, of a circle that lead to it;
                               or -1 */
    double ledges[2];       /* m; how far their ends are apart there */
    int gate;               /* column of `spared` if it comes and goes, or is solid from one side, else -1 */
    int one_sided;          /* [in] solid on its left, of what is bent outside, if 1, there not if -1; 0: on both */
    int chain;              /* the next of the pieces that share its column: they go on at its ends */
    int there;              /* whether it is there in this step; LEAVING: until just now */
    int mover;              /* row of `movers` if it moves, else -1 */
    int hollows[2];         /* of a segment: sides towards which another goes on from its ends: 1 left, 2 right */
    double box[4];          /* m; left, bottom, right, top; of all that it sweeps in this step */
    double swept[4];        /* m; the same of the whole run */
    double posed;           /* s; of what moves: when its place is as above ... */
    double still[12];       /* ... and as written: x, y, tx, ty, end, crown */
    double fastest, haste;  /* m/s, m/s2; bounds on speed and acceleration of its points */
    double reach;           /* m; how far it is from what it turns about, at most */
} Surface;

#define TERMS 15 /* of the series that the angle of a hinge follows */

/* How a surface moves: it shakes, travels and turns about a pivot, all from the run's time; or it hangs on a
   hinge there. */
typedef struct {
    double pivot[2];        /* [in] m; at rest */
    double by[2], frequency, phase; /* [in] m, Hz, rad; it shakes by so much */
    double way[2], from, lasts; /* [in] m, s; how far it travels, from then on, for so long; 0: nowhere */
    double turn;            /* [in] rad/s; of a hinge, as it is at t */
    double inertia, mass;   /* [in] kg m2, kg; about its hinge, 0 without one; 0 without a weight */
    double gyration;        /* [in] m; root of the mean square distance from there */
    double moment[2];       /* [in] kg m; its mass times its centre's place from the hinge, as written */
    double spring, rest, damper; /* [in] N m/rad, rad, N m s/rad */
    double stops[2];        /* [in] rad; between which it turns */
    double motor[2];        /* [in] rad/s, N m; speed, and the most that it turns with */
    double worked, stopped, damped; /* [out] J; work of its motor, losses at its stops and in its damper */
    double torque, pushed;  /* N m; by which it is pushed by hand; [out] J; and the work of that */
    double t;               /* s; when it is as follows */
    double place[2], velocity[2], pull[2]; /* m, m/s, m/s2; of the pivot */
    double sine, cosine;    /* of the angle that it has turned by */
    double hastens;         /* rad/s2; how its speed changes */
    double swing;           /* m/s2; largest acceleration of its pivot */
    /* of a hinge */
    double since, angle, rate; /* s, rad, rad/s; as its path begins ... */
    double path[TERMS];     /* ... and the angle from then on, a power of time each */
    double before;          /* rad/s; before the step's impulses */
    double begins;          /* [in] s; from when on it moves: its times are counted from there */
    double until;           /* s; up to which it turns, by hand, at `rate` from `angle` on */
    double impulse[3];      /* N m s; of its stops, and of its motor ... */
    double need[2], most;   /* rad/s, N m s; ... the least change that the stops ask for, and a bound */
    double drift;           /* rad/s; what springs and weight make of its speed by the middle of the step */
    double acted;           /* s; up to when its motor has given what it gives */
    int surface;            /* [in] which moves */
    int stirs;              /* whether it moves in this step */
    int solved;             /* its impulses are of a step that begins now */
    int struck;             /* stop that it meets as the step ends: 1, 2, or 0 */
    int first, last;        /* [in] of the laws: its first and last state in their `swings` */
    int steered;            /* [in] it is turned by hand */
    int lies;               /* stop on which it lies when it is struck: 1, 2, or 0 */
} Mover;

/* The state of a hinge: halfway through the impulses of a step, and before a blow. */
typedef struct { double t, angle, rate; int surface, pad; } Swing; /* s, rad, rad/s */ /* [out] */

/* What comes, goes or begins to move when a surface is touched for the first time. */
enum Doing { GOES, COMES, STARTS };

typedef struct {
    double t;               /* [out] s; when that was, INFINITY before */
    int surface, doing;     /* [in] owner, and what it does ... */
    int by, pad;            /* [in] ... when this owner is touched */
} Trigger;

/* What joins a particle with a fixed point or with another particle: a string pulls only, a rod keeps its
   length, a spring changes it, a pin keeps a point of both together. */
enum Tie { STRING, ROD, SPRING, PIN };

typedef struct {
    double from[2];         /* [in] m; fixed end of what has no other particle; of a pin its place; of a string between
                               two the pulley that it runs over, or NaN */
    double length;          /* [in] m; of a spring at rest; NaN: as it is when it is tied */
    double stiffness, damper; /* [in] N/m, N s/m */
    double kept[2], damped, given; /* [out] J; in a spring when it was tied and now, what its damper took,
                               and what it gave to particles */
    double arm[4];          /* m; of a pin, from both centres in particles that have not turned */
    int kind, particle, other; /* [in] enum Tie; two particles, or one and -1 */
    double now[4];          /* m; from its other end to its particle; over a pulley from there to both */
    int tied, struck;       /* whether both ends move freely; a blow is passed on to it */
    int taut;               /* a string that pulled in the step before */
    int row;                /* first of its rows */
    int next[2];            /* ends of joints of the same particles, as `Disk.tie` */
} Joint;

/* One equation of a joint: a pin has two. */
typedef struct {
    double e[4], lever[2];  /* how its impulse acts, on the particle and on the other; m */
    double kick;            /* N s; half of what it gives in a step; apart if above 0 */
    double struck[2], answer[2]; /* 1/kg, N s; what a blow of 1 N s draws it apart, and how it answers */
    double off, eases;      /* m, m/(N s); by how much it is missed, and how a spring gives way */
    double root;            /* of the diagonal matrix of the factors */
    int joint, on;          /* whether it acts */
    int first, pad;         /* first column of its row of the matrix that is not 0 */
} JointRow;

typedef struct { double restitution, friction, rolling, falls, cohesion; } Pair; /* [in] rolling: arm over radius;
                                        falls: 1 over the speed up to which restitution
                                        is that, s/m; 0 for all; cohesion: N */

/* A contact of disk i with disk j, or with surface k as j = -1 - k. Its tangent is (ny, -nx). */
typedef struct {
    double nx, ny;          /* unit normal towards i */
    double gap;             /* m */
    double need;            /* m/s; least change of normal velocity that keeps the gap closed ... */
    double gives;           /* ... and by how much less for each N s of its normal impulse, 1/kg ... */
    double most;            /* ... but by no more than that, m/s */
    double parts;           /* the part of it that opens an overlap, m/s: all that it may do without if driven */
    double pull;            /* m/s2; by which gravity makes it slip on a surface */
    double drift;           /* m/s; the slip that it makes by the middle of the step */
    double impulse[3];      /* on i: normal, tangential (N s), rolling (N m s) */
    double clings;          /* N s; of cohesion, which pulls: the normal impulse is so much less */
    double mass[3];         /* what the contact feels of masses and inertias, in the same order */
    double friction, arm;   /* coefficient; rolling friction as an arm, m */
    double other[3];        /* velocity of a surface or rider there: normal, tangential, spin */
    double moved[3];        /* the part of it that the motion of a surface gives */
    double lever[3];        /* m, m, 1; its share in the speed of a hinge, which was ... */
    double turning;         /* ... so much then, rad/s */
    double rest, falls;     /* coefficient of restitution, and how it falls with speed, s/m: see `Pair` */
    double share;           /* of its friction that acts; below 1 where surfaces wedge a disk */
    double entries[3], later[3]; /* J; what its impulses do to the ledger, and what the part of them
                                    does that belongs to this step; see `account` */
    double given[2];        /* J; the same for the belt that carries the partner */
    double turns;           /* m/s2; by which a hollow turns the way of a disk in a crowd, else 0 */
    double free_gap, bend;     /* m; its gap at the step's end without impulses, and what they change of it
                               but for the straight way: see `bends` */
    int i, j;
    int two;                /* whether j is a free disk, which feels the impulse too */
    int owner;              /* of the ledger entries */
    int island;             /* a disk by which it is known */
    int next;               /* of the contacts of disk i in the step before */
    int leaves;             /* it parts in this step */
    int hung;               /* number of the hinge that feels the impulse from 1 on, or 0 */
    int cornered;           /* i has corners, and perhaps j */
    double own[2], others[2]; /* m; of what has corners: levers of a normal and of a tangential impulse, on i and on j */
    double spot[2];         /* m; ... and the place from the centre of i, as that is turned */
    double looked[7];       /* m, rad; as the place was looked up: the gap, and x, y and `turned` of i and of j */
    int places, pad;        /* at which the two touched then */
} Contact;

/* What the impulses of a solve change of a disk, and what one of 1 N s does to it. The first of all is of
   what does not give way. */
typedef struct {
    double x, y, rim;       /* m/s; change of velocity, and of spin times radius */
    double mass;            /* 1/kg */
    double turn, twist;     /* 1/kg, 1/(kg m); of the rim by an impulse on it, and by a couple */
    double bend;            /* 1/m; 1 / radius */
    int disk, used;         /* whose; which colours its rows have */
} SolverBody;

/* A contact as sweeps see it: what they change, and what they ask for. */
typedef struct {
    double normal[2], tangent[2]; /* unit vectors towards the first body, in m/s of normal and slip for x and y */
    double free[2];         /* m/s; normal velocity less what the gap needs, and slip, without impulses */
    double mass[2], light[2]; /* kg; what the contact feels, and 1 / that */
    double impulse[2];      /* N s; normal, tangential */
    double swept[2], course[2]; /* N s; the impulse two sweeps ago, and the step from there: see `hasten` */
    double gives, eases, more, parts; /* as those of the contact; kg for a change where it gives, `most` less `need` */
    double rough;           /* coefficient of friction that acts */
    double arm, spin;       /* m, rad/s; of rolling friction, and how fast it rolls without impulses */
    double roll_mass, roll_light; /* kg m2, and what makes m/s of a moment */
    double moment, roll_swept, roll_course; /* N m s; as impulse, swept and course */
    double change;          /* m/s; by which the last sweep changed its slip */
    int a, b;               /* bodies */
    int from;               /* which contact of the list it is */
    int colour, four;       /* see `SolverFour`; its place among their numbers */
    int pad;
} SolverRow;

/* What a row of what has corners has besides: how its impulse turns both bodies, of their radii; and what of its normal
   impulse slips, 1/kg. */
typedef struct { double own[2], others[2], slips, pad; } RowLever;

/* Four rows as sweeps in single precision see them, of the same names but for those of x and y, and of normal and slip. */
typedef struct {
    float nx[4], ny[4], opens[4], slips[4], mass[4], slide_mass[4], light[4], slide_light[4];
    float gives[4], eases[4], more[4], parts[4], rough[4], arm[4], spin[4], roll_mass[4], roll_light[4];
    float mass_a[4], mass_b[4], turn_a[4], turn_b[4], twist_a[4], twist_b[4], bend_a[4], bend_b[4];
    float impulse[4], swept[4], course[4], along[4], slide_swept[4], slide_course[4];
    float moment[4], roll_swept[4], roll_course[4];
    int a[4], b[4];
} SolverFour;

/* The levers of four rows. */
typedef struct { float own[4], own_slide[4], others[4], others_slide[4], slips[4]; } LeverFour;

/* ... and what they change of a body. */
typedef struct { float x, y, rim, pad, swept[4], course[4]; } LightBody;

typedef struct { double t, x, y, vx, vy, spin, entries[3]; int disk, pad; double angle; } Knot; /* [out] */

typedef struct {                                                                         /* [out] */
    double t, x, y, before[3], after[3]; /* velocity and spin */
    double normal, tangent;              /* N s, on `disk` */
    int disk, other, kind, surface;
} Event;

/* What all disks of a crowd that were released have together as a step begins: that of those that ended at
   their ends, and of what lasts in contact halfway through its impulses, as their tracks are. */
typedef struct {                                                                         /* [out] */
    double t, kinetic, potential, entries[3], unsolved; /* s, J, radii */
    double released;        /* J; what they had at their releases */
    double springs[4];      /* J; of all springs: what they kept when they were tied, keep, lost and gave */
} Total;

typedef struct { int disk, next, ix, iy; } Cell; /* one disk in one cell of the grid */

typedef struct {
    Disk *disks;
    Surface *surfaces;   /* with room for twice as many: narrow arcs become two */
    Pair *pairs;         /* (kinds, kinds + materials) */
    Mover *movers;
    Trigger *triggers;
    Joint *joints;
    double *outlines;    /* [in] (outline_count, 2) corners round the centroid, counterclockwise, kind by kind, m */
    double *edges;       /* (outline_count, 3) unit vectors out of their edges, each from its corner on, and m */
    double *poses;       /* (disks, 2, 3) an angle of each, with its cosine and sine, now and later in a step */
    JointRow *joint_rows;
    double *joint_matrix; /* (joint rows, joint rows) */
    /* arrays that `prepare` lays out */
    Track *tracks;
    Knot *waits;         /* (disks, WAITS) states of each since its last knot; of one by itself (1, WAITS) */
    double *books;       /* (owners + 1, 3), J; the last row is the disks' among themselves */
    double *drives;      /* (owners), J; what of the work in `books` the motion of a surface did */
    Knot *knots;
    Event *events;
    Total *totals;       /* one a step in a crowd */
    Swing *swings;
    double *swing_work;  /* (swings, 3), J; `stopped`, `damped` and `pushed` of its mover then */
    Contact *contacts;   /* of this step */
    Contact *earlier;    /* of the step before */
    SolverRow *rows;     /* (contacts + 3 movers) of those that are solved together */
    RowLever *levers;    /* (contacts + 3 movers) ... of particles with corners, and hinges */
    SolverBody *solver_bodies; /* (disks + 1 + movers) ... and their disks, and hinges */
    SolverFour *fours;   /* (four_room) the same in single precision */
    LeverFour *lever_fours; /* (four_room) ... and their levers */
    LightBody *light_bodies; /* (disks + 1 + movers) */
    int *links;          /* (2 contacts) */
    int *near;           /* (2 near) pairs that may meet in this step */
    int *near_links;     /* (2 near) the next place in `near` of the same disk, or -1 */
    Cell *cells;
    int *heads;          /* first entry of each bucket of the grid */
    int *heap;           /* disks by their next events */
    int *queue;          /* (disks + 1) */
    int *moved;          /* (disks) */
    int *found;          /* (2 disks) */
    int *live;           /* (disks) those that ride, fly, lie or sleep in this step, ascending */
    int *nearby;         /* (disks, MAX_NEARBY) surfaces near each, ascending */
    int *everything;     /* (surfaces) 0, 1, ... */
    int *ends;           /* (2 surfaces) ends of segments and arcs, sorted by place ... */
    int *circles;        /* ... and within, behind them, the circles */
    int *spared;         /* (disks, gates) 1: it shut on this disk, or lets it through, and that is not clear of
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
    int full;            /* what `run` makes room for as it goes on: see `Full` */
    int bucket_count;    /* a power of two */
    int gate_count, end_count, circle_count;
    int smallest;        /* disk of the least radius in this part of the run */
    /* the run */
    int interact;        /* disks meet each other */
    int is_whole;        /* [in] all knots and events are still there: the host took none */
    int pushes;          /* something has been pushed by hand */
    int until;
    int landing;         /* owner that a disk lands on, or -1 */
    int ride_owner;      /* owner that rides are on */
    int pulley;          /* row of the drive pulley among the surfaces, or -1 */
    double ride_incline; /* rad; at which the belt rises to the pulley */
    int sweeps;          /* of the contact solver, at most */
    int sleeps;          /* whether islands may fall asleep */
    double gx, gy;       /* m/s2 */
    double up[2];        /* against gravity */
    double air;          /* [in] kg/m3; density of still air, 0 without */
    double dt;           /* s; longest step */
    double end_time;     /* s */
    double pause;        /* [in] s; `run` comes back with the first step that ends then; 0: it goes on */
    double smooth_x, smooth_v; /* radii, m/s; by how much a track may be off between two knots ... */
    double hops;         /* ... if that is not less than so many hops of what lasts */
    double accurate;     /* m/s; changes at which sweeps end */
    /* [out] */
    int knot_count, event_count, total_count, contact_count, near_count, earlier_count, swing_count;
    int later_count;     /* pairs in `near` beyond `near_count`, of what may meet since its path changed within the step; -1:
                            there is no room for them */
    int woken;           /* whether the latest blow has woken any */
    int impact_count, step_count, solve_count, sweep_count;
    int done;            /* disks ended, a measure of progress */
    int stalled;         /* which disk */
    double air_loss;     /* J; what air has taken */
    double released;     /* J; what disks had at their releases */
    double ended[5];     /* J; what those of a crowd that ended had then: kinetic, potential, entries */
    double push_work;    /* J; what pushes by hand have given */
    double gained;       /* J; by which solves broke their law of energy, see `check_solve` */
    double unsolved;     /* radii; the most overlap that the solve of this step leaves beyond what it asks for */
    double unsolved_most; /* ... and of all steps so far */
    /* within the step */
    int low, high;       /* disks that this part of the run is about */
    int live_count;
    int phase, cell_count, heap_count, moved_count, wide_count;
    int stirs;           /* whether something moves in this step */
    int passes;          /* some kinds pass through each other: their restitution is below 0 */
    int hinges;          /* how many there are */
    int swings_too;      /* contacts that are solved act on hinges */
    int stamp, shocks, jams; /* numbers of the latest query, shock and jam, for marks */
    double t, now, step, step_end, cell;
    double looked;       /* s; for when it is told which surfaces are there */
    double usual;        /* s; the step if nothing slid in a hollow: so long a part of an overlap takes */
    double length, length_before; /* s; of this step and of the one before */
    double again;        /* what lasts needs so many times the impulses of the step before */
    double before;       /* share of this step's impulses that belongs to the one before */
    double g;            /* m/s2; size of gravity */
    double tilt;         /* rad; by which it is turned from straight down, counterclockwise */
    double haste;        /* m/s2; bound on the acceleration of what moves in this step */
    double fastest;      /* m/s; bound on the speed of all that moves */
    double pace;         /* sqrt(g / EARTH), 1 without gravity: bounds on speeds grow with it, bounds
                            on times shrink: a film of the run shown faster is a run */
    double soft;         /* m/s; twice what gravity does in a step: supported disks meet softly */
    double ledge;        /* m; up to which a joint is smooth in this step, see `ledge_in` */
    double room;         /* m; least that a hollow leaves a disk by itself, INFINITY without one */
    double skip;         /* 1/s; SKIP in a step: radii that it may go */
} World;

/* A scene as one row of numbers: keys of its tables, by their own names, NaN where nothing is given.
   Tables follow each other in the order of `Plan`'s counts, those of one kind in that of the file. A
   family of scenes are several such rows. All of these structs are of doubles alone. */

enum DropFrom { FROM_IMPACT, FROM_TOP };

typedef struct {
    double gravity;
    double gravity_deg;     /* 0 is down */
    double air_density;     /* kg/m3; of still air */
    double crowded;         /* whether particles meet each other */
} SceneKeys;

/* Of a kind of particles. */
typedef struct {
    double radius;          /* m; the mean */
    double span[2];         /* m; of radii that differ */
    double moment;          /* I/(m r2); 0 if it never turns */
    double corners;         /* of a box or polygon, see `Drawing.corners`; 0 of what is round */
} ParticleKeys;

typedef struct {
    double kind;            /* which of the particles it consists of */
    double at[2], to[2], fill[4], velocity[2], omega, angle_deg; /* spin at the release, rad/s, and turn */
    double count, rate, start, bed_height, speed_spread;
    double seed[2];         /* its lower 32 bits and the others */
    double at_once;         /* whether all are released at once */
} StreamKeys;

typedef struct {
    double speed, pulley_radius, length, incline_deg;
    double friction;        /* with the nominal particle; INFINITY is adhesion */
    double adheres;         /* whether adhesion is what the belt's own table says */
} IncomingKeys;

/* Which way a surface lets through. */
enum Passes { NEITHER_WAY, PASSES_UP, PASSES_RIGHT, PASSES_OUT };

/* With a pivot it is a further plate, else the damping plate. */
typedef struct { double distance, pivot_height, pivot[2], angle_deg, above, below; } PlateKeys;

typedef struct { double speed, drop, drop_from, start, length; } OutgoingKeys;

typedef struct { double from[2], to[2], pulley_radius, speed; } ConveyorKeys;

typedef struct {
    double corners;         /* of `points`, which stand behind all tables, surface by surface; 0: an arc */
    double center[2], radius, from_deg, to_deg, speed, opens_at, closes_at;
    double passes;          /* enum Passes, below 0 the other way; NaN: solid from both sides */
    double repeat[6];       /* up to two of count, dx, dy */
} SurfaceKeys;

/* A joint, see `Joint`; without a length as long as it has to be at the release, without a point between two
   particles. */
typedef struct { double kind, from[2], length, particle, other, stiffness, damper; } JointKeys;

/* How a surface moves; without a pivot about its first point, the centre of an arc, the pivot of a plate. */
typedef struct {
    double surface, pivot[2], by[2], frequency, phase_deg, to[2], at, in, turn;
    double hangs, mass, inertia, spring, rest_deg, damper, stops_deg[2], speed_deg, torque;
} MoverKeys;

/* What a run needs beside these tables, for a plan that is run as it is: of the run, of each kind of
   particles, and then restitution and friction of each kind, as `Pair`: with each kind, with each surface. */
typedef struct { double max_time, until; } RunKeys; /* s; `until` is NaN where it is a word */

typedef struct { double mass, inertia, rolling; } BodyKeys; /* kg, kg m2; of the mean radius */

/* Pieces of surfaces. Speeds are along the tangent, and clockwise round an arc. */
typedef struct {                                                                         /* [out] */
    double start[2], end[2], tangent[2], length, speed;
    double appears, vanishes; /* s; it is there from the one to the other */
    int surface;              /* which it belongs to */
    int one_sided;            /* as that of `Surface` */
} Segment;

typedef struct {                                                                         /* [out] */
    double center[2], radius, begin, extent, speed; /* `Surface` says more */
    double appears, vanishes;
    int surface, one_sided;
} Arc;

/* What contradicts itself: no impact to place the outgoing belt by, a plate without a length, or
   one that the impact lies above or below of. */
enum Contradiction { SOUND, NO_IMPACT, NO_LENGTH, HIT_ABOVE, HIT_BELOW };

/* The flight that places plate and belt: that of particle 0, without spread. */
typedef struct {                                                                         /* [out] */
    double position[2], velocity[2]; /* where it begins; NaN if it never leaves forwards */
    double hit[2];          /* m; its centre as it meets the plate's unbounded line; NaN if never */
    double along;           /* m; how far above the pivot that is, along the plate */
    double below;           /* m; how far the damping plate reaches below its pivot */
    int contradiction;
    int off;                /* the hit is above or below the plate: HIT_ABOVE, HIT_BELOW, or SOUND */
} Nominal;

/* What a run comes back with that the host has to prepare: it has words for what is wrong with the plan, time
   for releases that take long to draw, and another origin for what is far off. */
#define ASIDE -1

/* Machines: rows of numbers in, surfaces out; of each member of a family as many. */
typedef struct {
    double *rows;           /* [in] (members, width) */
    double *terms;          /* (term_width) of a plan that is run, behind its row: `RunKeys` and what follows */
    int members, width, term_width; /* [in] */
    int owners;             /* [in] of a plan that is run: how many names its surfaces have */
    int particles, streams, incoming, plates, outgoing, conveyors, surfaces, joints, moving; /* [in] counts */
    Segment *segments;      /* [out] (members, segment_count) */
    Arc *arcs;
    Mover *movers;          /* [out] (moving) of a scene by itself */
    Nominal *nominal;       /* [out] (members) */
    int segment_count, arc_count; /* [out] of each */
    int pad;
} Plan;

/* A particle that meets no other, for the exact engine. */
typedef struct {
    double release, stop;       /* [in] s; when it starts, and how long after that its run is over */
    double position[2], velocity[2], omega; /* [in] at its release */
    double radius, mass;        /* [in] a radius of 0 is a mass point */
    double inertia;             /* [in] kg m2; 0: it does not turn */
    double rolling;             /* [in] rolling friction: its arm over the radius */
    double gravity, pace;       /* [in] m/s2; what bounds on speeds are multiplied by */
    double exit_box[4], up[2];  /* [in] m; as of `Start`, in the world's frame, where up is: here it is (0, 1) */
    int kind;                   /* [in] row of the table of pairs */
    int carried;                /* [in] it rides the incoming belt by adhesion */
    int reason;                 /* [out] why its track ended: enum Ending */
    int pad;
} Lone;

/* Why a track of the exact engine ended, as in `results.REASONS`. */
enum Ending { TIME_IS_OVER, HAS_LANDED, HAS_SETTLED, HAS_LEFT };

/* Why the exact engine came back. PAUSING: the budget of rounds is used up. FILLED: take knots and events,
   and go on. NO_MEMORY: the core gets no more of it. NO_PROGRESS, DRIVEN, TOO_LONG: a
   particle is stuck, its track is over; go on with the others.
   HELD: a spinning disk is held between surfaces of which one moves. */
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
    double *room;           /* (room_size) for the obstacles that surfaces are */
    int segment_count, arc_count, wheel_count, lone_count, surface_count, kind_count; /* [in] */
    int knot_room, event_room, room_size;
    int each, apart;        /* [in] particles of a member, 0 without a family; each has books of its own */
    int is_whole;           /* [in] all knots and events are still there: the host took none */
    int until, landing;     /* [in] enum Until; surface that a particle lands on, or -1 */
    int most, window;       /* [in] rounds of a particle; progress check interval, in rounds */
    double tick;            /* [in] s over its pace; mean time between events below which it does not */
    double far;             /* [in] m; how far off the coordinates were rounded */
    double loose;           /* [in] what ON_ARCS is more for this run */
    int laid, begun;        /* number after the member whose obstacles are laid; whether `lone` is */
    /* [out] */
    int knot_count, event_count, contacts, rounds; /* rounds: of the particle that took most */
    int lone;               /* the particle that is under way; all before it have ended */
    int other[2];           /* surfaces that hold it */
    double t, x, y;         /* where it is stuck, s and m */
    double passed;          /* s; that its latest rounds took */
} Exact;

/* m below the lowest surface and release, or outside the box of all without gravity, where a track
   ends. */
#define EXIT_MARGIN 1.0

/* Where and how a particle starts, and where its track ends if nothing holds it. */
typedef struct {                                                                         /* [out] */
    double t, position[2], velocity[2], radius;
    double exit_box[4];     /* m; left, bottom, right, top */
    double omega, angle;    /* rad/s, rad */
} Start;

/* An earlier particle as one that is drawn sees it: how far it has come (m), and how far apart they
   have to be. */
typedef struct { double dx, dy, reach; int particle, next; } Near;

/* Why releases of a scene cannot be drawn: a box has room for so many of this radius only; one would
   start inside a surface, at this distance from it instead of `reach` (m); or a belt that grips by
   adhesion lets none be faster than others, start with another velocity than its own, or spin. */
enum Refused { ACCEPTED, BOX_FULL, RELEASE_INSIDE, SPREAD_ADHERES, VELOCITY_ADHERES, SPIN_ADHERES };

typedef struct {                                                                         /* [out] */
    double distance, reach;
    int why, stream;
    int particle;           /* which of the scene's, or how many */
    int surface;
} Refusal;

/* The releases of the machines of a `Plan`, of each member as many, stream by stream. */
typedef struct {
    Start *starts;          /* [out] (members, count) */
    Refusal *refusals;      /* [out] (members) */
    int *carried;           /* [out] (members, streams) whether the incoming belt carries them by
                               adhesion */
    double *corners;        /* [in] of boxes and polygons round their centroid, m; kind by kind */
    Near *near;             /* (count) */
    int *links;             /* (count) */
    int *heads;             /* (head_room) lists of a grid */
    int *listed;            /* (pieces) */
    int count;              /* [out] particles of each member */
    int head_room;          /* a power of two */
    int looks;              /* [in] particles and places that a call looks at before it comes back */
    /* how far it has come */
    int left;               /* of the looks of this call */
    int member, stream, first, is_begun, next, near_count, found, listed_count;
    double looked, cell;
} Drawing;

/* What a surface bears in a bin of time: what presses it, what drags it along (n_y, -n_x), n the normal
   towards a particle, and the whole of both; its moment about the origin; and places by what presses there. */
typedef struct { double normal, along, x, y, moment, at[2]; } Load; /* N s, N m s; at: N s m */ /* [out] */

#define MOST_BINS 1048576

/* Share of its size by which an impulse may differ from the change of momentum that it alone made. */
#define SAME_IMPULSE 1e-6

/* What a lasting contact gave a disk, in a bin of time or while it slept. */
typedef struct {
    int disk, other;        /* the other: a disk, or -1 - a surface's owner */
    double from, to;        /* s */
    double x, y;            /* on the disk, N s */
    double stress[4];       /* (J b) in rows, N m s: b to the disk's centre from the other's, or from its foot */
} Lasting; /* [out] */

/* Loads of surfaces, if they are asked for. */
typedef struct {
    double every;           /* [in] s; how long a bin is; 0: nothing is counted */
    Load *bins;             /* [out] (bin_count, owner_count) */
    int owner_count, bin_count;
    int used;               /* [out] bins up to the last in which anything is borne */
    int overflow;           /* [out] there were to be more of them than MOST_BINS, or than memory has room for */
    double each;            /* [in] s; how long a bin of lasting contacts is; 0: they are not kept */
    Lasting *lasting;       /* [out] bin by bin */
    Lasting *asleep;        /* what holds sleepers, each second; in no order */
    int *seats;             /* rows of this bin by their pairs, + 1 */
    double *balance;        /* (disks, 4, 2) room for conjugate gradients */
    int lasting_count;      /* [out] */
    int lasting_room, asleep_count, asleep_room, seat_count, first;
    double bin;             /* which one `first` begins */
} Loads;

/* ---- What a run is judged by: a subject of its own, which shares nothing with the engine's. ---- */

/* The laws, in the order in which they are told. */
enum Law { LAW_FINITE, LAW_THROUGH, LAW_INSIDE, LAW_ENERGY, LAW_LOSSES, LAW_LEDGER, LAW_SOLVED, LAW_STEP };

enum Engine { ENGINE_EXACT, ENGINE_CONTACT, ENGINE_PYMUNK };

#define EPS 2.220446049250313e-16
/* Roundings that one number may have gone through between two contacts: some ten operations, each on
   numbers up to some ten times as large as what comes out. */
#define ROUNDINGS 500
/* EPS that one contact may move an energy by: half an ulp for each of two velocity components, a
   height and a sum. */
#define A_CONTACT 2
/* Share of the radius by which disks of a crowd may be pressed into each other or into a surface: what
   the contact engine promises. A solver that iterates leaves some. */
#define PRESSED 0.05
/* Share of its radius by which a cubic between two knots may leave a circle: the recording's
   contract. */
#define ON_ARCS 1e-9
/* Breaches that are told at most: of losses there may be two. */
#define BREACHES 9

/* A piece of a surface as it is told to the laws. */
typedef struct {
    double x, y;            /* [in] first end of a straight piece; centre of a bent one */
    double tx, ty, length;  /* [in] of a straight piece: unit tangent, and m */
    double radius;          /* [in] of a bent piece, m; 0 of a straight one */
    double begin, extent;   /* [in] of a bent piece: angle of its first end, and from there on, rad */
    double speed;           /* [in] m/s */
    double appears, vanishes; /* [in] s; it is there from the one to the other */
    double end[4];          /* both ends, x and y */
    double box[4];          /* m; left, bottom, right, top */
    double clear;           /* s; when a particle got clear of a gate, see `forgiven`; NAN: not known */
    int surface;            /* [in] which surface it is part of */
    int whole;              /* whether it is bent all round */
    int near;               /* of a list of pieces that may be met */
    int mover;              /* [in] number of its mover from 1 on, 0 if it stays where it is */
    int one_sided;          /* [in] as that of `Surface` */
    int chain;              /* of the first of such pieces that follow each other: how many they are */
} Barrier;

/* A particle as it is told to the laws. */
typedef struct {                                                                          /* [in] */
    double radius;          /* m; of one with corners that of the circle inside */
    double mass, inertia;   /* kg, kg m2 */
    double gravity;         /* m/s2 */
    int corners, outline;   /* how many it has, 0 of what is round, and the first in `Laws.outlines` */
} Body;

/* A place where a particle is deeper in a piece than it may be, or passes it. */
typedef struct {                                                                         /* [out] */
    double t, x, y, depth;  /* s, m */
    int particle, piece;
    int passes;             /* its centre gets to the other side, between the piece's ends */
    int pad;
} Hit;

/* A law that is broken, where it was first. */
typedef struct {                                                                         /* [out] */
    double t, x, y;         /* s, m; NAN of what is about the whole run */
    double amount, bound;   /* what was found, and what it must not exceed */
    int law;
    int particles;          /* how many broke it; 0 if it is about all together */
    int particle;           /* the first of them, or -1 */
    int surface, piece;     /* which it is about, or -1 */
    int pad;
} Breach;

typedef struct {
    double *knots;          /* [in] rows of t, x, y, vx, vy, spin, three entries of the ledger */
    double *angles;         /* [in] (knots), rad, if some have corners */
    double *outlines;       /* [in] (outline_count, 2) corners round the centroid, counterclockwise, m */
    int *offsets;           /* (particles + 1) first knot of each, and behind the last: [in], or `owned` */
    Body *bodies;           /* [in] (particles) */
    Barrier *barriers;      /* [in] (pieces), of a family (members, pieces) */
    Mover *movers;          /* [in] (mover_count), as far as they are told */
    Swing *swings;          /* [in] of all hinges, each one's in the order of time */
    double *books;          /* [in] (book_rows, 3) entries of each surface, J */
    Breach *breaches;       /* (BREACHES) */
    Hit *hits;              /* in the order of particles and knots */
    int *order;             /* (knots) in crowds of the contact engine */
    double *places;         /* (particles, 2) there, too */
    /* sizes */
    int particle_count, piece_count, knot_count, row; /* [in] row: doubles from knot to knot */
    int mover_count, swing_count, outline_count; /* [in] */
    int book_rows, surface_count; /* [in] with the particles' own, which is the last */
    int hit_room;
    /* the run */
    int engine;             /* [in] */
    int interact;           /* [in] particles meet each other */
    int joined;             /* [in] some hang on joints */
    int alike;              /* [in] all is left to steps that are all alike, and to Chipmunk */
    int each;               /* [in] particles that share pieces, of a family; else 0: all */
    int pulley;             /* [in] piece 0 ends on a drive pulley */
    int contacts, steps;    /* [in] that were made */
    int owned;              /* [in] behind its numbers a knot says whose it is: rows are those of `Knot` */
    int unreal;             /* [in] numbers that are not finite, beside knots and books */
    double tilt;            /* [in] rad; by which gravity is turned from straight down */
    double dt;              /* [in] s; step, 0 of the exact engine */
    double gained;          /* [in] J; by which solves broke their law of energy */
    double unsolved;        /* [in] radii; the most overlap that the solve of a step left beyond what it asked for */
    double largest;         /* [in] m; radius of the largest particle, with its corners */
    double loose;           /* [in] what ON_ARCS is more for this run */
    /* [out] */
    int breach_count, hit_count;
    double speed;           /* m/s; the largest of anything that moves, belts included */
    double length;          /* m; the largest in play */
    double rounding;        /* m; what rounding may do to a length */
    double arcs;            /* m; by which a curve between two knots may leave an arc */
    double bent;            /* m/s2; largest acceleration along the inside of an arc */
    double haste;           /* m/s2; largest acceleration of what moves */
    double late;            /* m; by which a step may take a disk beyond a surface */
    double allowed;         /* m; how deep a disk may be in a surface */
    double energy;          /* J; in play, see `energy_share` */
    double energy_bound;    /* what numbers may do to it, as a share of it */
    double parted;          /* J; what parting overlaps may give */
    double untold;          /* J; what a crowd's tracks may leave out between two knots */
} Laws;

#endif
