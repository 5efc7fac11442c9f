/* The ride of the nominal particle with Coulomb friction: along the incoming belt and round its pulley.

   Round the pulley its centre moves on a circle of radius rho. phi is the angle of the normal from the top, clockwise.
   With the speed w along the circle, z = r omega, and the normal and tangential force per mass N and F,

       phi' = w/rho,  w' = g sin phi + F,  z' = (m r^2/I) F,  N = g cos phi - w^2/rho,

   where F = -share g sin phi while it grips, with share = I/(I + m r^2), and -sign mu N while it slips. All of these are
   expanded in a Taylor series in time; a step is so short that its last terms are as small as rounding. */

#include "plan.h"

/* Degree of the series. */
#define ORDER 20
/* Bound on the last terms of a step, as a share of the speeds, and rad of the angle. */
#define LEFT_OUT 1e-16
/* rad of the pulley between two checks for an event: no two changes of one kind are nearer to each other. */
#define LOOK 2.4e-2
#define MOST_LOOKS 32
/* Bisections of a step for the time of an event; they end at the last bit. */
#define HALVINGS 64
/* Steps after which a ride counts as endless: the slowest one, from the very top, takes 2,000. */
#define STEPS 100000
/* rad by which a particle may slide back beyond the place where it came onto the pulley. */
#define BACK 1e-9
/* Phases that can follow each other on a belt: slip, grip or slip in the direction of gravity, slip back. */
#define PHASES 3

/* Events that may end a step, and GOES_ON for none. TURNS ends a step where the particle turns round, so that it is known
   whether that is before the pulley. */
enum { LIFTS, ONSET_BACK, ONSET_FORWARD, GRIPS, RETURNS, TURNS, GAUGES, GOES_ON = GAUGES };

static double sign(double a) { return (a > 0.0) - (a < 0.0); }

/* 0 if friction holds a contact that has no slip now, else the direction in which gravity makes it slip. */
static double slips_to(double pull, double normal, double friction, double share) {
    return share * fabs(pull) <= friction * normal ? 0.0 : sign(pull);
}

/* Slide or roll along the belt until the pulley is reached, `gap` m ahead, with the speeds w and z there (m/s). Return 0
   if it is never reached. `incline` is the belt's angle from the horizontal, rad, clockwise. */
int ride_to_pulley(double *w, double *z, double gap, double length, double gravity, double friction,
                   double share, double belt, double incline) {
    double up, across, lever = 1.0 / share - 1.0;
    sin_cos(incline, &up, &across);
    double load = gravity * across, pull = gravity * up;
    int still = *w + *z == belt;
    for (int n = 0; n < PHASES; n++) {
        double slip = *w + *z - belt, slides = still ? sign(pull) : sign(slip);
        int holds = still && share * fabs(pull) <= friction * load;
        double force = holds ? -share * pull : -slides * friction * load;
        double pace = pull + force, twist = lever * force;
        int fades = !still && slides * (pace + twist) < 0.0;
        double grips = fades ? fabs(slip) / fabs(pace + twist) : INFINITY;
        double ahead = falls_below(gap, -*w, -pace), back = falls_below(length - gap, *w, pace);
        if (!(ahead >= 0.0)) ahead = INFINITY;
        if (!(back >= 0.0)) back = INFINITY;
        double when = MIN(MIN(grips, ahead), back);
        if (isinf(when) || back < MIN(ahead, grips)) return 0;
        gap -= when * (*w + 0.5 * pace * when);
        *w += pace * when;
        *z += twist * when;
        still |= fades;
        if (ahead <= grips) return 1;
    }
    return 0;
}

static double horner(const double *c, int degree, double t) {
    double value = 0.0;
    for (int n = degree; n >= 0; n--) value = value * t + c[n];
    return value;
}

/* Evaluate all gauges at a time; in one loop they take as long as one of them. */
static void read_gauges(double gauges[GAUGES][ORDER + 1], double t, double values[GAUGES]) {
    for (int k = 0; k < GAUGES; k++) values[k] = 0.0;
    for (int n = ORDER; n >= 0; n--)
        for (int k = 0; k < GAUGES; k++) values[k] = values[k] * t + gauges[k][n];
}

typedef struct { double phi[ORDER + 1], w[ORDER + 1], z[ORDER + 1], normal[ORDER + 1]; } Series;
typedef struct {
    double phi, w, z;                            /* state */
    double rho, gravity, friction, share, belt;
    double slip, least;                          /* sign of the slip; angle at which it is back where it began */
} Ride;

/* Expand a ride in time, and with it the gauges: functions that become negative at an event. */
static void expand(const Ride *r, Series *s, double gauges[GAUGES][ORDER + 1]) {
    double sine[ORDER + 1], cosine[ORDER + 1], rates[ORDER + 1], lever = 1.0 / r->share - 1.0;
    int grips = r->slip == 0.0;
    double stick = grips ? -r->share : 0.0, load = grips ? 0.0 : -r->slip * r->friction;
    s->phi[0] = r->phi, s->w[0] = r->w, s->z[0] = r->z;
    sin_cos(r->phi, sine, cosine);
    double square = s->w[0] * s->w[0] + 0.0; /* Cauchy products give its terms, one degree after the other. */
    for (int n = 0; n <= ORDER; n++) {
        s->normal[n] = r->gravity * cosine[n] - square / r->rho;
        double force = stick * r->gravity * sine[n] + load * s->normal[n];
        double limit = grips ? r->friction * s->normal[n] : 0.0;
        gauges[LIFTS][n] = s->normal[n];
        gauges[ONSET_BACK][n] = grips ? limit - force : 0.0;
        gauges[ONSET_FORWARD][n] = grips ? limit + force : 0.0;
        gauges[GRIPS][n] = r->slip * (s->w[n] + s->z[n]) - (n ? 0.0 : r->slip * r->belt);
        gauges[RETURNS][n] = s->phi[n] - (n ? 0.0 : r->least);
        gauges[TURNS][n] = sign(r->w) * s->w[n];
        if (n == ORDER) break;
        s->w[n + 1] = (r->gravity * sine[n] + force) / (n + 1);
        s->z[n + 1] = lever * force / (n + 1);
        s->phi[n + 1] = s->w[n] / r->rho / (n + 1);
        rates[n] = (n + 1) * s->phi[n + 1];
        double up = 0.0, across = 0.0;
        square = 0.0;
        for (int i = 0; i <= n; i++) {
            up += rates[i] * cosine[n - i];
            across += rates[i] * sine[n - i];
            square += s->w[i] * s->w[n + 1 - i];
        }
        square += s->w[n + 1] * s->w[0];
        sine[n + 1] = up / (n + 1);
        cosine[n + 1] = -across / (n + 1);
    }
}

/* Length of a step, s; INFINITY for a particle at rest. */
static double step_of(const Ride *r, const Series *s) {
    double pace = fabs(r->w) + fabs(r->z) + fabs(r->belt) + sqrt(r->gravity * r->rho);
    double weight = r->gravity + r->w * r->w / r->rho, dt = INFINITY;
    for (int n = ORDER - 1; n <= ORDER; n++) {
        double share = MAX(MAX(fabs(s->phi[n]), fabs(s->w[n]) / pace),
                           MAX(fabs(s->z[n]) / pace, fabs(s->normal[n]) / weight));
        if (share > 0.0) dt = MIN(dt, pow(LEFT_OUT / share, 1.0 / n));
    }
    return dt;
}

/* Time at which a gauge that is negative at `high` became negative. */
static double turns_negative(const double *gauge, double low, double high) {
    for (int n = 0; n < HALVINGS; n++) {
        double middle = 0.5 * (low + high);
        if (middle == low || middle == high) break;
        if (horner(gauge, ORDER, middle) >= 0.0) low = middle;
        else high = middle;
    }
    return high;
}

/* Ride round the pulley until it lifts off; set the angle (rad) and the speed (m/s) there. Return 0 if it never does. */
int ride_round(double *phi, double *w, double z, double rho, double gravity, double friction,
               double share, double belt) {
    Ride r = { *phi, *w, z, rho, gravity, friction, share, belt, 0.0, *phi - BACK };
    r.slip = sign(r.w + r.z - belt);
    for (int step = 0; step < STEPS; step++) {
        double sine, cosine, gauges[GAUGES][ORDER + 1];
        sin_cos(r.phi, &sine, &cosine);
        double normal = gravity * cosine - r.w * r.w / rho;
        if (step == 0 && r.slip == 0.0) r.slip = slips_to(gravity * sine, normal, friction, share);
        *phi = r.phi, *w = r.w;
        if (normal <= 0.0) return 1;
        Series s;
        expand(&r, &s, gauges);
        double dt = step_of(&r, &s);
        if (isinf(dt)) return 0;
        double turn = fabs(horner(s.phi, ORDER, dt) - r.phi) / LOOK;
        int looks = turn < MOST_LOOKS ? (int)ceil(turn) : MOST_LOOKS, event = GOES_ON;
        double before = 0.0, at = dt;
        looks = MAX(looks, 4);
        for (int look = 1; look <= looks && event == GOES_ON; look++) {
            double now = dt * look / looks, values[GAUGES];
            read_gauges(gauges, now, values);
            for (int gauge = 0; gauge < GAUGES; gauge++) {
                if (values[gauge] >= 0.0) continue;
                double when = turns_negative(gauges[gauge], before, now);
                if (event == GOES_ON || when < at) at = when, event = gauge;
            }
            before = now;
        }
        r.phi = horner(s.phi, ORDER, at);
        r.w = horner(s.w, ORDER, at);
        r.z = horner(s.z, ORDER, at);
        if (event == RETURNS) return 0;
        *phi = r.phi, *w = r.w;
        if (event == LIFTS) return 1;
        sin_cos(r.phi, &sine, &cosine);
        normal = gravity * cosine - r.w * r.w / rho;
        if (event == GRIPS) r.slip = slips_to(gravity * sine, normal, friction, share);
        if (event == ONSET_BACK || event == ONSET_FORWARD) r.slip = sign(sine);
    }
    return 0;
}
