/* The random numbers of NumPy's `default_rng`, see random.c. */

#ifndef RANDOM_H
#define RANDOM_H

typedef struct { unsigned __int128 state, step; } Generator;

void seed_generator(Generator *g, const unsigned *words, int count);
double draw_uniform(Generator *g, double low, double high);

#endif
