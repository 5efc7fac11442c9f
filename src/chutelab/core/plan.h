/* What the files that build machines share: the plan, the tables of a scene, and their functions. */

#ifndef PLAN_H
#define PLAN_H
#include "layout.h"
#include "memory.h"
#include "trig.h"

#define MIN(a, b) ((a) < (b) ? (a) : (b))
#define MAX(a, b) ((a) > (b) ? (a) : (b))

/* m; a release this near to the height R + r above the belt counts as lying on it. */
#define ON_BELT 1e-9
/* Share of a speed on the belt; less is rounding. */
#define ALONG 1e-12

extern Plan P;

/* The tables of a scene, and the points of its polylines. */
typedef struct {
    const SceneKeys *scene;
    const ParticleKeys *particles, *particle; /* all kinds; that of the nominal particle */
    const StreamKeys *streams;
    const IncomingKeys *incoming; /* or NULL */
    const PlateKeys *plates, *plate; /* all; the damping plate or NULL */
    const OutgoingKeys *outgoing; /* or NULL */
    const ConveyorKeys *conveyors;
    const SurfaceKeys *surfaces;
    const JointKeys *joints;
    const MoverKeys *movers;
    const double *points;
} Tables;

Tables tables_of(int member);

/* nominal.c */
double falls_below(double gap, double rate, double acceleration);
void up_belt(const IncomingKeys *belt, double *dx, double *dy);
int is_on_belt(const Tables *t, int stream);
void release_point(const Tables *t, int stream, double *place);
void release_velocity(const Tables *t, int stream, double *velocity);
void fly_nominal(const Tables *t, Nominal *out);

/* plan.c */
int is_moved(const Tables *t, int surface);

/* releases.c */
void lay_out_drawing(void);
void draw_if_told(void);

/* ride.c */
int ride_to_pulley(double *w, double *z, double gap, double length, double gravity, double friction,
                   double share, double belt, double incline);
int ride_round(double *phi, double *w, double z, double rho, double gravity, double friction,
               double share, double belt);

#endif
