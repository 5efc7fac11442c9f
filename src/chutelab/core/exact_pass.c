/* The part of a ride round a circle in which the particle goes on in one direction, without spin of its own, and nothing
   changes: the square of its speed has a closed form, and the time is an integral.

   With phi and w as in exact_ride.c, the friction load N + (stick - 1) g sin phi, and y = w2,

       dy/dphi = 2 rho g (stick sin phi + load cos phi) - 2 load y,
       y = P cos phi + Q sin phi + R exp(-2 load phi),

   which is the chute of Roberts (1969) where stick = 1. The time, the integral of rho/w, is summed by Gauss-Legendre
   quadrature from knot to knot. All knots are one angle h apart, so what the quadrature needs of cos, sin and exp is
   computed once. A stretch ends before anything that could happen in it: zeros of the speed, of the load and of the slip
   are kept away by bounds on slopes. */

#include "exact.h"

/* Pairs of places, and weights, of the quadrature with eight places in [0, 1]. It is off by less than rounding if y has
   no zero within CLEAR_OF times the interval, at any complex angle: 1/w is smooth up to there. */
#define PAIRS 4
#define CLEAR_OF 2.5
/* Largest h and 2 |load| h, for which the series of cos, sin and exp have enough terms. */
#define WIDEST 0.15
#define SINES 6
#define EXPONENTS 10
/* Share of |P + i Q| below which y is a difference of larger numbers, with their rounding. */
#define SLOW 0.05
/* Knots from one whose sine and cosine are computed to the next: those between are turned on from the one before, each of
   which rounds once more. */
#define FRESH 4
/* Share of the longest h that is allowed at the beginning: it may be less later on. */
#define FIRST 0.85

static const Two PLACE[PAIRS] = {
    { 0.01985507175123188416, 0.98014492824876811584 }, { 0.10166676129318663020, 0.89833323870681336980 },
    { 0.23723379504183550709, 0.76276620495816449291 }, { 0.40828267875217509753, 0.59171732124782490247 },
};
static const double WEIGHT[PAIRS] = {
    0.05061426814518812958, 0.11119051722668723527, 0.15685332293894364367, 0.18134189168918099148,
};
static const double COS[SINES] = { 1.0, -1.0 / 2.0, 1.0 / 24.0, -1.0 / 720.0, 1.0 / 40320.0, -1.0 / 3628800.0 };
static const double SIN[SINES] = { 1.0, -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0, 1.0 / 362880.0, -1.0 / 39916800.0 };
static const double EXP[EXPONENTS] = { 1.0, 1.0, 1.0 / 2.0, 1.0 / 6.0, 1.0 / 24.0, 1.0 / 120.0, 1.0 / 720.0,
    1.0 / 5040.0, 1.0 / 40320.0, 1.0 / 362880.0 };

/* Along the ride: cos and sin of phi, the exponential term, and y with its first three derivatives by phi. */
typedef struct { double phi, across, up, rest, y[4]; } Place;

static double P, Q, wave, twice; /* wave: |P + i Q|, twice: 2 load */

/* The state at an angle, by its sine and cosine and the exponential term there. */
static Place place_at(double phi, double up, double across, double rest) {
    Place p = { .phi = phi, .across = across, .up = up, .rest = rest };
    double even = P * p.across + Q * p.up, odd = Q * p.across - P * p.up, fade = twice * rest;
    p.y[0] = even + rest, p.y[1] = odd - fade;
    p.y[2] = twice * fade - even, p.y[3] = -odd - twice * (twice * fade);
    return p;
}

/* Greatest second derivative of y near a place. */
static double bend_at(const Place *p) { return wave + twice * twice * fabs(p->rest); }

/* The angle within which y has no zero, at any complex angle. */
static double clear_of_zero(const Place *p) {
    double slope = fabs(p->y[1]);
    return 2.0 * p->y[0] / (slope + sqrt(slope * slope + 2.0 * bend_at(p) * p->y[0]));
}

/* Whether that is more than an angle. */
static int is_clear_of_zero(const Place *p, double angle) {
    return p->y[0] > angle * (fabs(p->y[1]) + 0.5 * bend_at(p) * angle);
}

/* The square of the fourth derivative by time of the place on a circle, divided by rho2 and the eighth power of the
   angular velocity, by which cubics leave the circle; times y^4. */
static double bulge_at(const Place *p) {
    double a = p->y[0], b = p->y[1], c = p->y[2], d = p->y[3];
    return square(a * a - 0.75 * b * b - 2.0 * a * c) + square(0.5 * a * d + 0.25 * b * c - 3.0 * a * b);
}

static Two series(const double *c, int count, Two x) {
    Two sum = { c[count - 1], c[count - 1] };
    for (int n = count - 2; n >= 0; n--) sum = sum * x + c[n];
    return sum;
}

/* Follow a ride from knot to knot as long as nothing can change; return the number of knots, the last of which is its end,
   or 0 if it has to go on otherwise. */
int pass_round(const Circle *c, double longest, Ridden *end, Ridden *knots) {
    int slips = c->slip != 0.0, count = 0;
    double lever = 1.0 / c->share - 1.0, g = c->gravity, rho = c->rho, stick = slips ? 1.0 : 1.0 - c->share;
    if (c->w == 0.0 || c->rolling > 0.0 || (slips && !(lever == 0.0 && isfinite(c->friction)))) return 0;
    double load = slips ? -c->slip * c->friction : 0.0, bend = 1.0 / fabs(rho);
    twice = 2.0 * load;
    Q = 2.0 * rho * g * load * (1.0 + 2.0 * stick) / (1.0 + twice * twice);
    P = twice * Q - 2.0 * rho * g * stick;
    wave = length_of(P, Q);
    double up, across, sense = sign_of(c->w), way = sense * sign_of(rho), last = way > 0.0 ? c->high : c->low;
    sin_cos(c->phi, &up, &across);
    Place now = place_at(c->phi, up, across, c->w * c->w - P * across - Q * up);
    double whole = fabs(last - c->phi), most = 384.0 * curve(), from = now.rest;
    /* The tracks of a family are not kept, so its cubics need not be functions of time: see curve_after in hits.c. */
    double h = E.brief ? clear_of_zero(&now) / CLEAR_OF : sqrt(sqrt(most * now.y[0] * now.y[0] / sqrt(bulge_at(&now))));
    h = MIN(MIN(FIRST * h, WIDEST), WIDEST / fabs(twice));
    double steps = isfinite(whole) ? ceil(whole / h) : INFINITY;
    if (isfinite(whole)) h = whole / steps;
    double slope = wave + fabs(twice * from), before = g * now.across - sign_of(rho) * bend * now.y[0];
    /* The slip changes its sign where w is the speed of the surface. */
    double belt = slips && c->belt * sense > 0.0 ? c->belt * c->belt : -INFINITY;
    if (!(h > 0.0 && before > 0.0 && fabs(now.y[0] - belt) > slope * h)) return 0;
    if (!is_clear_of_zero(&now, CLEAR_OF * h)) return 0;
    Two cosines[PAIRS], sines[PAIRS], fades[PAIRS];
    for (int n = 0; n < PAIRS; n++) {
        Two x = h * PLACE[n], x2 = x * x;
        cosines[n] = series(COS, SINES, x2), sines[n] = way * x * series(SIN, SINES, x2);
        fades[n] = series(EXP, EXPONENTS, -way * twice * x);
    }
    double turned_up, turned_across;
    sin_cos(way * h, &turned_up, &turned_across);
    double t = 0.0, fallen = 0.0, fade = fades[0][0] * fades[0][1], width = h * fabs(rho);
    most *= most / square(square(square(h)));
    while (count < MOST_KNOTS && count < steps) {
        double phi = count + 1.0 < steps ? c->phi + way * h * (count + 1.0) : last;
        double sine = now.up * turned_across + now.across * turned_up;
        double cosine = now.across * turned_across - now.up * turned_up;
        if (count % FRESH == 0 || phi == last) sin_cos(phi, &sine, &cosine);
        Place then = place_at(phi, sine, cosine, now.rest * fade);
        double after = g * then.across - sign_of(rho) * bend * then.y[0];
        slope = MAX(slope, wave + fabs(twice * then.rest));
        double least = before + after - (g + slope * bend) * h;
        if (!(least > 0.0 && then.y[0] > SLOW * wave && is_clear_of_zero(&then, CLEAR_OF * h))) break;
        if (!E.brief && bulge_at(&then) > most * square(square(then.y[0]))) break;
        if (!slips && isfinite(c->friction) && !(0.5 * c->friction * least > c->share * g)) break;
        if (!(MIN(fabs(now.y[0] - belt), fabs(then.y[0] - belt)) > slope * h)) break;
        double even = P * now.across + Q * now.up, odd = Q * now.across - P * now.up;
        Two spent = { 0.0, 0.0 }, fell = { 0.0, 0.0 };
        for (int n = 0; n < PAIRS; n++) {
            Two y = even * cosines[n] + odd * sines[n] + now.rest * fades[n];
            Two pace = WEIGHT[n] / __builtin_elementwise_sqrt(y);
            spent += pace;
            if (c->belt != 0.0) fell += pace * (now.up * cosines[n] + now.across * sines[n]);
        }
        double later = t + width * (spent[0] + spent[1]);
        if (later > longest) break;
        t = later, fallen += width * g * (fell[0] + fell[1]);
        now = then, before = after;
        double w = sense * sqrt(now.y[0]), gain = w - c->w, work = gain - fallen, heat = 0.0;
        /* The work of friction in the frame of the circle is the integral of load N rho. */
        if (slips)
            heat = c->belt * work - load * ((rho * g - P) * (now.up - up) + Q * (now.across - across))
                + 0.5 * (from - now.rest);
        knots[count++] = (Ridden){ t, now.phi, now.up, now.across, w, lever == 0.0 ? c->z : c->z - gain, work, heat,
                                   0.0, NOTHING, E.brief };
    }
    if (!count) return 0;
    *end = knots[count - 1];
    if (count == steps) end->outcome = way > 0.0 ? HIGH : LOW;
    return count;
}
