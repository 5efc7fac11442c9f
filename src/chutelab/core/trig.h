/* Sine, cosine and their inverses by + - * / and square roots alone: the same bits everywhere, see trig.c. */

#ifndef TRIG_H
#define TRIG_H
#include <math.h>

#define PI 3.14159265358979311600
#define RADIANS (PI / 180.0) /* in a degree */

double sine(double angle);
double cosine(double angle);
void sin_cos(double angle, double *sine, double *cosine);
double angle_of(double y, double x);
double angle_of_cosine(double cosine);

/* Length of a vector whose squares neither overflow nor underflow. */
static inline double length_of(double x, double y) { return sqrt(x * x + y * y); }

/* Remainder with the sign of a positive divisor, like Python's `%`. */
static inline double modulo(double value, double by) {
    double rest = fmod(value, by);
    return rest < 0.0 ? rest + by : rest + 0.0;
}

#endif
