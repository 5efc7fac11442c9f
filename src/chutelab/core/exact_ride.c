/* A ride round a pulley, an arc or the end of a surface, by Taylor series.

   The centre of the particle moves on a circle of radius rho. The angle phi is that of the normal, which points at the
   particle, from the top, clockwise; inside a circle rho is negative. With w the speed along (n_y, -n_x), z = r omega, N
   the normal and F the tangential force per mass,

       phi' = w/rho,   w' = g sin phi + F,   z' = (m r2/I) F,   N = g cos phi - w2/rho,

   and F = stick g sin phi + load N. A grip without rotation has stick = -1, rolling -I/(I + m r2), -1/3 for a disk; slip
   has load = -sigma mu, with sigma the sign of the slip u = w + z - belt. Rolling friction adds a moment q m r, at most
   kappa N, against the spin relative to the surface, z' = (m r2/I) (F + q), and stops the spin if it can. Everything is
   expanded in a Taylor series in time, which holds for any combination of turning back, spinning and slipping. A step is
   so short that its last terms are as small as rounding; knots within it are computed from the series. */

#include "exact.h"

#define ORDER 20
/* Bound on the last terms of a step, as a share of the speeds and of the load, and rad of the angle; and where tracks
   may be less accurate. */
#define LEFT_OUT 1e-16
#define LOOSELY 1e-14
/* Share of its first term by which a series must stay above 0, so that rounding can't make it negative. */
#define SURELY 1e-9
/* Newton steps towards the time of an event, the share of that time by which their result may be wrong, and bisections of
   the remaining interval, beyond the last bit. */
#define STEPS 8
#define SETTLED 1e-8
#define NEAR (8.0 * ULP)
#define HALVINGS 64

/* One term more than is used: the recursion also gives that of the next order. */
typedef double Series[ORDER + 2];

static Series phi, w, z, work, heat, twist, normal, force, couple;

/* Gauges: series that become negative at the events that can happen, and the outcomes that they tell. */
#define GAUGES 9
static Series gauges[GAUGES];
static int tells[GAUGES], gauge_count;

/* The value of a series at a time; even and odd terms are summed at once. */
static double at_time(const double *c, double t) {
    Two sum = { c[ORDER], 0.0 };
    for (int n = ORDER - 2; n >= 0; n -= 2) sum = sum * (t * t) + (Two){ c[n], c[n + 1] };
    return sum[0] + t * sum[1];
}

/* Whether a series stays at or above 0 up to a time, given by its powers: all other terms together are less than the
   first one. */
static int is_never_negative(const double *c, const double *powers) {
    double most = 0.0;
    for (int n = 1; n <= ORDER; n++) most += fabs(c[n]) * powers[n];
    return c[0] - most > SURELY * c[0] || (c[0] >= 0.0 && most == 0.0);
}

static int is_held(const Circle *c) { return c->rolling > 0.0 && c->roll == 0.0; }

/* Set the Taylor coefficients in time: the work is the integral of F, the heat that of -F u less that of the moment, the
   twist that of q. Two products of series are computed at once: w w with F u, and phi' cos phi with phi' sin phi. */
static void expand(const Circle *c) {
    Series slip, spin, rate;
    Two turns[ORDER + 2], forced[ORDER + 1], moved[ORDER + 1];
    int gripping = c->slip == 0.0, rolls = c->rolling > 0.0, held = is_held(c);
    double lever = 1.0 / c->share - 1.0, up, across;
    double stick = !gripping ? 0.0 : held ? -1.0 : -c->share;
    double load = !gripping ? -c->slip * c->friction : rolls ? c->share * lever * c->roll * c->rolling : 0.0;
    double bend = 1.0 / c->rho;
    sin_cos(c->phi, &up, &across);
    turns[0] = (Two){ across, up };
    phi[0] = c->phi, w[0] = c->w, z[0] = c->z;
    work[0] = heat[0] = twist[0] = 0.0;
    slip[0] = gripping ? 0.0 : c->w + c->z - c->belt;
    spin[0] = held ? 0.0 : c->z - c->turn;
    for (int n = 0; n <= ORDER; n++) {
        Two products = { 0.0, 0.0 }, turning = { 0.0, 0.0 };
        double part = 1.0 / (n + 1);
        rate[n] = w[n] * bend;
        phi[n + 1] = rate[n] * part;
        moved[n] = (Two){ w[n], slip[n] };
        /* The factor that was computed last is added last, so that the other terms don't wait for it. */
        for (int i = 1; i < n; i++) products += forced[i] * moved[n - i], turning += rate[i] * turns[n - i];
        if (n) products += forced[0] * moved[n], turning += rate[0] * turns[n];
        turning += rate[n] * turns[0];
        normal[n] = c->gravity * turns[n][0] - (products[0] + w[n] * w[0]) * bend;
        force[n] = stick * c->gravity * turns[n][1] + load * normal[n];
        couple[n] = !rolls ? 0.0 : held ? -force[n] : -c->roll * c->rolling * normal[n];
        forced[n] = (Two){ w[n], force[n] };
        double rubbed = products[1] + force[n] * slip[0];
        for (int i = 0; i <= n && rolls; i++) rubbed += couple[i] * spin[n - i];
        w[n + 1] = (c->gravity * turns[n][1] + force[n]) * part;
        z[n + 1] = lever * (force[n] + couple[n]) * part;
        turns[n + 1] = (Two){ -turning[1], turning[0] } * part;
        work[n + 1] = force[n] * part;
        heat[n + 1] = -rubbed * part;
        twist[n + 1] = couple[n] * part;
        slip[n + 1] = gripping ? 0.0 : w[n + 1] + z[n + 1];
        spin[n + 1] = z[n + 1];
    }
}

/* Add a gauge: a number and two series, each with a factor. */
static void add_gauge(int outcome, double first, double a, const double *x, double b, const double *y) {
    double *gauge = gauges[gauge_count];
    tells[gauge_count++] = outcome;
    for (int n = 0; n <= ORDER; n++) gauge[n] = a * x[n] + b * y[n];
    gauge[0] += first;
}

/* Set the gauges of the events that can happen. */
static void find_gauges(const Circle *c) {
    gauge_count = 0;
    add_gauge(LIFT, 0.0, 1.0, normal, 0.0, normal);
    for (int side = -1; side <= 1 && c->slip == 0.0 && isfinite(c->friction); side += 2)
        add_gauge(ONSET, 0.0, c->friction, normal, side, force);
    if (c->slip != 0.0) add_gauge(GRIP, -c->slip * c->belt, c->slip, w, c->slip, z);
    /* A ride round a full circle has no ends. */
    if (isfinite(c->low)) add_gauge(LOW, -c->low, 1.0, phi, 0.0, phi);
    if (isfinite(c->high)) add_gauge(HIGH, c->high, -1.0, phi, 0.0, phi);
    if (c->roll != 0.0) add_gauge(HALT, -c->roll * c->turn, c->roll, z, 0.0, z);
    /* With slip the spin stays held if friction is less than rolling friction can hold. */
    for (int side = -1; side <= 1 && is_held(c) && c->slip == 0.0; side += 2)
        add_gauge(ROLL, 0.0, c->rolling, normal, side, couple);
}

/* The length of a step, s, and the number of knots, evenly in time, by which it is recorded.

   The cubic between two knots, h apart, is off by h^4/384 times the fourth derivative of the place rho exp(i phi): rho
   |phi1^4 - 3 phi2^2 - 4 phi1 phi3 + i (phi4 - 6 phi1^2 phi2)|. */
static double step_of(const Circle *c, double longest, int *parts) {
    double pace = fabs(c->w) + fabs(c->z) + fabs(c->belt) + sqrt(c->gravity * fabs(c->rho));
    double load = c->gravity + c->w * c->w / fabs(c->rho), dt = longest, bend = 0.0;
    double least = E.loose > 0.0 ? LOOSELY : LEFT_OUT;
    for (int n = ORDER - 1; n <= ORDER; n++) {
        double share = fabs(phi[n]);
        if (pace > 0.0) share = MAX(share, MAX(fabs(w[n]), fabs(z[n])) / pace);
        if (load > 0.0) share = MAX(share, fabs(normal[n]) / load);
        dt = MIN(dt, pow(least / share, 1.0 / n));
    }
    /* A particle at rest has no bound on its step. */
    double finite = isfinite(dt) ? dt : 0.0, rates[4][ORDER];
    for (int k = 0; k < 4; k++)
        for (int n = 1; n <= ORDER - k; n++) rates[k][n - 1] = (k ? rates[k - 1][n] : phi[n]) * n;
    /* In the middle of the step and at its end, at once. */
    Two later[4], t = { 0.5 * finite, finite };
    for (int k = 0; k < 4; k++) {
        later[k] = (Two){ 0.0, 0.0 };
        for (int n = ORDER - k; n--;) later[k] = later[k] * t + rates[k][n];
    }
    for (int n = 0; n < 3; n++) {
        double of[4];
        for (int k = 0; k < 4; k++) of[k] = n ? later[k][n - 1] : rates[k][0];
        double one = of[0] * of[0];
        bend = MAX(bend, length_of(one * one - 3.0 * of[1] * of[1] - 4.0 * of[0] * of[2],
                                   of[3] - 6.0 * one * of[1]));
    }
    double count = MAX(ceil(finite * sqrt(sqrt(bend / (384.0 * curve())))), 1.0);
    *parts = (int)MIN(count, MOST_KNOTS);
    return dt * MIN(MOST_KNOTS / count, 1.0);
}

/* The time at which a series that is not negative at `low` and is at `high` becomes negative. Newton's method finds about
   where; if the sign changes there, little is left for bisection. */
static double first_negative(const double *c, double low, double high) {
    double first = at_time(c, low), t = low + (high - low) * first / (first - at_time(c, high));
    for (int n = 0; n < STEPS && t > low && t < high; n++) {
        double value = 0.0, slope = 0.0;
        for (int k = ORDER; k >= 0; k--) slope = slope * t + value, value = value * t + c[k];
        double old = t;
        t -= value / slope;
        if (fabs(t - old) <= SETTLED * t) break;
    }
    double ends[] = { t - NEAR * t, t + NEAR * t };
    for (int n = 0; n < 2; n++) {
        if (!(ends[n] > low && ends[n] < high)) continue;
        if (at_time(c, ends[n]) >= 0.0) low = ends[n];
        else high = ends[n];
    }
    for (int n = 0; n < HALVINGS; n++) {
        double middle = 0.5 * (low + high);
        if (middle == low || middle == high) break;
        if (at_time(c, middle) >= 0.0) low = middle;
        else high = middle;
    }
    return high;
}

/* The state at a time; two series at once, each by Horner's rule. */
static Ridden state_at(double t) {
    Two place = { phi[ORDER], w[ORDER] }, spent = { work[ORDER], heat[ORDER] }, turned = { z[ORDER], twist[ORDER] };
    for (int n = ORDER - 1; n >= 0; n--) {
        place = place * t + (Two){ phi[n], w[n] };
        spent = spent * t + (Two){ work[n], heat[n] };
        turned = turned * t + (Two){ z[n], twist[n] };
    }
    Ridden found = { .dt = t, .phi = place[0], .w = place[1], .z = turned[0], .work = spent[0], .heat = spent[1],
                     .twist = turned[1], .outcome = NOTHING };
    sin_cos(found.phi, &found.up, &found.across);
    return found;
}

/* Move on by one step, or to the first event within it; return the number of knots before its end. N must be positive. */
int advance_ride(const Circle *c, double longest, Ridden *end, Ridden *knots) {
    int parts, outcome = NOTHING, count = pass_round(c, longest, end, knots);
    if (count) return count - 1;
    expand(c);
    find_gauges(c);
    double dt = step_of(c, longest, &parts);
    /* If it turns round beyond an end of the circle, it would be back at the end of the whole step. */
    Series back;
    for (int n = 0; n <= ORDER; n++) back[n] = sign_of(c->w) * w[n];
    if (at_time(back, dt) < 0.0) {
        double turn = first_negative(back, 0.0, dt);
        double there = at_time(phi, turn);
        if (there < c->low || there > c->high) dt = turn;
    }
    double whole = dt, low = 0.0;
    int open[GAUGES], many = 0;
    Series powers = { 1.0 };
    for (int n = 1; n <= ORDER; n++) powers[n] = powers[n - 1] * whole;
    for (int k = 0; k < gauge_count; k++)
        if (!is_never_negative(gauges[k], powers)) open[many++] = k;
    for (int n = 1; n <= parts && outcome == NOTHING; n++) {
        double high = whole * MIN(n / (double)parts, 1.0), first = INFINITY;
        for (int g = 0; g < many; g++) {
            int k = open[g];
            if (!(at_time(gauges[k], high) < 0.0)) continue;
            double at = first_negative(gauges[k], low, high);
            if (at < first) first = dt = at, outcome = tells[k];
        }
        low = high;
    }
    for (int n = 1; n < parts; n++) {
        double t = whole * (n / (double)parts);
        if (t < dt) knots[count++] = state_at(t);
    }
    *end = state_at(dt);
    end->outcome = outcome;
    if (outcome == LOW || outcome == HIGH) {
        end->phi = outcome == LOW ? c->low : c->high;
        sin_cos(end->phi, &end->up, &end->across);
    }
    return count;
}
