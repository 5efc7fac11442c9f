/* Sine, cosine and their inverses by + - * / and square roots alone: the same bits everywhere.

   Those of libraries differ in the last bit from one to another, and JavaScript's are not NumPy's. The polynomials are
   those of fdlibm (Sun Microsystems, 1993), which are free to use. */

#include "trig.h"

#define EXPORT __attribute__((visibility("default")))

/* rad; for larger angles, subtracting pi/2 in three parts of 33 bits is no longer exact. */
#define LARGEST_ANGLE 1e6
/* Adding and subtracting this rounds to a whole number. */
#define ROUND 6755399441055744.0 /* 1.5 * 2^52 */

#define QUARTERS 6.36619772367581382433e-01 /* 2/pi */

/* Angles, each with what its double lacks: the arc tangent of 1/2, pi/4, pi/2 and pi. */
static const double HALF[] = { 4.63647609000806093515e-01, 2.26987774529616870924e-17 };
static const double EIGHTH[] = { 7.85398163397448278999e-01, 3.06161699786838301793e-17 };
static const double QUARTER[] = { 1.57079632679489655800e+00, 6.12323399573676603587e-17 };
static const double STRAIGHT[] = { 3.14159265358979311600e+00, 1.22464679914735317723e-16 };
static const double NOTHING[] = { 0.0, 0.0 };

static const double PART[] = { 1.57079632673412561417e+00, 6.07710050630396597660e-11,
    2.02226624871116645580e-21, 8.47842766036889956997e-32 };
static const double S[] = { -1.66666666666666324348e-01, 8.33333333332248946124e-03,
    -1.98412698298579493134e-04, 2.75573137070700676789e-06, -2.50507602534068634195e-08,
    1.58969099521155010221e-10 };
static const double C[] = { 4.16666666666666019037e-02, -1.38888888888741095749e-03,
    2.48015872894767294178e-05, -2.75573143513906633035e-07, 2.08757232129817482790e-09,
    -1.13596475577881948265e-11 };
static const double A[] = { 3.33333333333329318027e-01, -1.99999999998764832476e-01,
    1.42857142725034663711e-01, -1.11111104054623557880e-01, 9.09088713343650656196e-02,
    -7.69187620504482999495e-02, 6.66107313738753120669e-02, -5.83357013379057348645e-02,
    4.97687799461593236017e-02, -3.65315727442169155270e-02, 1.62858201153657823623e-02 };

/* Sine and cosine of an angle (rad), each to less than 1 unit in the last place; NaN beyond LARGEST_ANGLE. */
void sin_cos(double angle, double *sine, double *cosine) {
    if (!(fabs(angle) <= LARGEST_ANGLE)) {
        *sine = *cosine = NAN;
        return;
    }
    double turns = (angle * QUARTERS + ROUND) - ROUND;
    /* The remainder as the sum of x and a tail, so that cancellation loses no digits. */
    double first = angle - turns * PART[0];
    double second = first - turns * PART[1];
    double lost = (first - second) - turns * PART[1];
    double third = second - turns * PART[2];
    double tail = lost + ((second - third) - turns * PART[2]) - turns * PART[3];
    double x = third + tail;
    tail = (third - x) + tail;
    double z = x * x, w = z * z, v = z * x;
    double r = S[1] + z * (S[2] + z * S[3]) + z * w * (S[4] + z * S[5]);
    double up = x - ((z * (0.5 * tail - v * r) - tail) - v * S[0]);
    r = z * (C[0] + z * (C[1] + z * C[2])) + w * w * (C[3] + z * (C[4] + z * C[5]));
    double half = 0.5 * z, one = 1.0 - half;
    double across = one + (((1.0 - one) - half) + (z * r - x * tail));
    switch ((int)turns & 3) {
    case 0: *sine = up, *cosine = across; break;
    case 1: *sine = across, *cosine = -up; break;
    case 2: *sine = -up, *cosine = -across; break;
    default: *sine = -across, *cosine = up;
    }
}

EXPORT double sine(double angle) {
    double up, across;
    sin_cos(angle, &up, &across);
    return up;
}

EXPORT double cosine(double angle) {
    double up, across;
    sin_cos(angle, &up, &across);
    return across;
}

/* The angle of a finite vector from the x axis, rad, above -pi and up to pi, to 1.5 units in the last place. The sign of
   a zero doesn't matter, and the vector (0, 0) has the angle 0. */
EXPORT double angle_of(double y, double x) {
    double up = fabs(y), across = fabs(x);
    int steep = up > across, back = x < 0.0;
    double low = steep ? across : up, high = steep ? up : across, at = 0.0;
    const double *angle = NOTHING, *base = steep ? QUARTER : back ? STRAIGHT : NOTHING;
    if (low > 0.6875 * high)
        at = 1.0, angle = EIGHTH;
    else if (low > 0.4375 * high)
        at = 0.5, angle = HALF;
    double t = (low - at * high) / (high == 0.0 ? 1.0 : high + at * low);
    /* base + sign (angle + the arc tangent of t), rounded once */
    double sign = steep != back ? -1.0 : 1.0, z = t * t, w = z * z;
    double odd = z * (A[0] + w * (A[2] + w * (A[4] + w * (A[6] + w * (A[8] + w * A[10])))));
    double even = w * (A[1] + w * (A[3] + w * (A[5] + w * (A[7] + w * A[9]))));
    double part = sign * angle[0], most = base[0] + part, lost = part - (most - base[0]);
    double turned = most + (((lost + base[1]) + sign * angle[1]) + sign * (t - t * (odd + even)));
    return y < 0.0 ? -turned : turned;
}

/* The angle from 0 to pi (rad) that has a cosine, to 2.5 units in the last place, or NaN. */
EXPORT double angle_of_cosine(double cosine) {
    return angle_of(sqrt((1.0 - cosine) * (1.0 + cosine)), cosine);
}
