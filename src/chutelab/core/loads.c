#include <math.h>
#include "loads.h"
#include "memory.h"

/* Bins that there is room for at first. */
#define FIRST 64

Loads B;

EXPORT Loads *loads(void) { return &B; }

EXPORT int lay_out_bins(int owners) {
    B.owner_count = owners;
    B.bin_count = FIRST;
    RESERVE(B.bins, (double)B.bin_count * owners);
    return has_room();
}

#define MIN(a, b) ((a) < (b) ? (a) : (b))
#define MAX(a, b) ((a) > (b) ? (a) : (b))

/* Make room for a bin. Without it all later ones are one, and the host is told. */
static void make_bin(int bin) {
    B.used = MAX(B.used, bin + 1);
    while (bin >= B.bin_count && !B.overflow) {
        int rows = B.bin_count * B.owner_count;
        Load *more = B.bin_count < MOST_BINS ? stretch(B.bins, rows, rows, sizeof *more) : 0;
        B.overflow = !more;
        if (!more) break;
        B.bins = more;
        B.bin_count *= 2;
    }
    B.used = MIN(B.used, B.bin_count);
}

/* Add shares of a push to the bins from one to another: at the first `at` (s) after it began, each `bin` long. */
static void add(const Push *p, int first, int last, double share, double at, double bin) {
    double jx = -share * p->jx, jy = -share * p->jy, normal = -(jx * p->nx + jy * p->ny);
    double along = jx * p->ny - jy * p->nx, couple = share * p->couple;
    make_bin(last);
    for (int n = first; n <= last; n++, at += bin) {
        double middle = at + 0.5 * bin, third = 0.5 * middle * middle + bin * bin / 24.0;
        double x = p->x + p->vx * middle + p->ax * third, y = p->y + p->vy * middle + p->ay * third;
        Load *to = B.bins + (long)MIN(MAX(n, 0), B.bin_count - 1) * B.owner_count + p->owner;
        to->normal += normal;
        to->along += along;
        to->x += jx;
        to->y += jy;
        to->moment += x * jy - y * jx - couple;
        to->at[0] += normal * x;
        to->at[1] += normal * y;
    }
}

static int bin_of(double t) { return (int)MIN(floor(t / B.every), 2.0 * MOST_BINS); }

void bear(const Push *p) {
    double span = p->to - p->from, every = B.every;
    int first = bin_of(p->from), last = span > 0.0 ? bin_of(p->to) : first;
    if (last == first) add(p, first, first, 1.0, 0.0, span > 0.0 ? span : 0.0);
    else {
        double begins = (first + 1) * every - p->from, ends = p->to - last * every;
        add(p, first, first, begins / span, 0.0, begins);
        add(p, first + 1, last - 1, every / span, begins, every);
        add(p, last, last, ends / span, span - ends, ends);
    }
}
