/* The random numbers of NumPy's `default_rng`, to the last bit: PCG64 (M. O'Neill, 2014, XSL-RR), seeded by what NumPy
   calls a SeedSequence. */

#include "releases.h"

#define POOL 4 /* words; a seed has no more */

typedef unsigned long long Word;

static unsigned folded(unsigned value) { return value ^ value >> 16; }

/* Hash a word; the constant changes each time. */
static unsigned hashed(unsigned word, unsigned *constant, unsigned factor) {
    unsigned mixed = word ^ *constant;
    return folded(mixed * (*constant *= factor));
}

static void advance_generator(Generator *g) {
    const unsigned __int128 factor = (unsigned __int128)0x2360ed051fc65da4 << 64 | 0x4385df649fccf645;
    g->state = g->state * factor + g->step;
}

/* Seed a generator with one or several whole numbers, as words of 32 bits, the lowest first. */
void seed_generator(Generator *g, const unsigned *words, int count) {
    unsigned pool[POOL], constant = 0x43b0d7e5;
    for (int n = 0; n < POOL; n++) pool[n] = hashed(n < count ? words[n] : 0, &constant, 0x931e8875);
    for (int from = 0; from < POOL; from++)
        for (int to = 0; to < POOL; to++) {
            if (from == to) continue;
            unsigned other = hashed(pool[from], &constant, 0x931e8875);
            pool[to] = folded(pool[to] * 0xca01f9dd - other * 0x4973f715);
        }
    Word seeds[4];
    constant = 0x8b51f9dd;
    for (int n = 0; n < 4; n++) {
        seeds[n] = hashed(pool[2 * n % POOL], &constant, 0x58f38ded);
        seeds[n] |= (Word)hashed(pool[(2 * n + 1) % POOL], &constant, 0x58f38ded) << 32;
    }
    g->step = ((unsigned __int128)seeds[2] << 64 | seeds[3]) << 1 | 1;
    g->state = 0;
    advance_generator(g);
    g->state += (unsigned __int128)seeds[0] << 64 | seeds[1];
    advance_generator(g);
}

/* A number from `low` to `high`, uniformly distributed. */
double draw_uniform(Generator *g, double low, double high) {
    advance_generator(g);
    Word word = (Word)(g->state >> 64) ^ (Word)g->state;
    unsigned turn = (unsigned)(g->state >> 122);
    word = word >> turn | word << (-turn & 63);
    return low + (high - low) * ((double)(word >> 11) * 0x1p-53);
}
