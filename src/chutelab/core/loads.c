#include <math.h>
#include <string.h>
#include "loads.h"
#include "memory.h"

/* Number of bins at first. */
#define FIRST 64

Loads B;

EXPORT Loads *loads(void) { return &B; }

EXPORT int lay_out_bins(int owners) {
    if (B.every > 0.0) {
        B.owner_count = owners;
        B.bin_count = FIRST;
        RESERVE(B.bins, (double)B.bin_count * owners);
    }
    if (B.each > 0.0) {
        B.lasting_room = FIRST;
        B.seat_count = 2 * FIRST;
        RESERVE(B.lasting, FIRST);
        RESERVE(B.seats, B.seat_count);
    }
    return has_room();
}

#define MIN(a, b) ((a) < (b) ? (a) : (b))
#define MAX(a, b) ((a) > (b) ? (a) : (b))

/* Make room for a bin. If there is none, all later loads are added to the last bin, and the host is told. */
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

/* Add shares of a push to the bins from `first` to `last`: `at` (s) is the time from its beginning to that of the first
   bin, `bin` the length of each. */
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

/* The entry of `seats`, a hash table, that holds or is to hold the row of a pair in this bin. */
static int *seat_of(int disk, int other) {
    unsigned at = (unsigned)disk * 2654435761u + (unsigned)other * 40503u;
    for (;; at++) {
        int *seat = B.seats + (at & (unsigned)(B.seat_count - 1));
        const Lasting *row = B.lasting + *seat - 1;
        if (!*seat || (row->disk == disk && row->other == other)) return seat;
    }
}

/* Begin a bin, or enter its rows again after the table has grown. */
static void seat_all(void) {
    memset(B.seats, 0, B.seat_count * sizeof *B.seats);
    for (int n = B.first; n < B.lasting_count; n++)
        if (B.lasting[n].from == B.bin * B.each) *seat_of(B.lasting[n].disk, B.lasting[n].other) = n + 1;
}

/* Another row, all zero; 0 if there is no room. */
static Lasting *next_row(void) {
    if (B.overflow || (B.lasting_count == B.lasting_room && !STRETCH(B.lasting, B.lasting_count, B.lasting_room))) {
        B.overflow = 1;
        return 0;
    }
    B.lasting[B.lasting_count] = (Lasting){0};
    return B.lasting + B.lasting_count++;
}

static void add_to(Lasting *row, double share, double x, double y, const double *stress) {
    row->x += share * x;
    row->y += share * y;
    for (int n = 0; n < 4; n++) row->stress[n] += share * stress[n];
}

/* Record a row of its own. */
static void keep_row(int disk, int other, double from, double to, double share, double x, double y, const double *stress) {
    Lasting *row = next_row();
    if (!row) return;
    row->disk = disk;
    row->other = other;
    row->from = from;
    row->to = to;
    add_to(row, share, x, y, stress);
}

void keep_contact(int disk, int other, double from, double to, const double *J, const double *b) {
    double bin = floor(0.5 * (from + to) / B.each);
    double stress[4] = {J[0] * b[0], J[0] * b[1], J[1] * b[0], J[1] * b[1]};
    if (to - from > B.each) {
        keep_row(disk, other, from, to, 1.0, J[0], J[1], stress);
        return;
    }
    if (bin != B.bin || !B.lasting_count) {
        B.bin = bin;
        B.first = B.lasting_count;
        seat_all();
    }
    if (4 * (B.lasting_count - B.first) > B.seat_count) {
        RESERVE(B.seats, 2.0 * B.seat_count);
        B.overflow |= !B.seats;
        if (B.overflow) return;
        B.seat_count *= 2;
        seat_all();
    }
    int *seat = seat_of(disk, other);
    if (*seat) add_to(B.lasting + *seat - 1, 1.0, J[0], J[1], stress);
    else {
        keep_row(disk, other, bin * B.each, (bin + 1.0) * B.each, 1.0, J[0], J[1], stress);
        *seat = B.overflow ? 0 : B.lasting_count;
    }
}
