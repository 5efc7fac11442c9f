/* What particles of a family have in common: its members often differ in nothing but materials and speeds of belts, and
   then the same particle of each moves alike until it first meets a surface where they differ. The state there is kept
   and taken over by the next member. */

#include <stddef.h>
#include <string.h>
#include "exact.h"
#include "memory.h"

/* Most knots and events up to there; with more of them it begins anew. */
#define SHARED_KNOTS 24
#define SHARED_EVENTS 12

typedef struct {
    Particle at;            /* `given` is 0 without a state */
    int obstacle, side;     /* what it meets */
    int knots, events, contacts;
    Knot track[SHARED_KNOTS];
    Event told[SHARED_EVENTS];
} Shared;

static Shared *kept;        /* (each) */
static double *books;       /* J; (each, surfaces, 3) */
static int *differs;        /* whether members differ in a column of the table of materials */
static int knots, events, contacts; /* how many there were before the present particle */
static int alone;           /* it has met something where members differ */

static int is_shared_here(void) { return E.brief && E.apart && E.lone_count > E.each; }

void lay_out_shared(void) {
    if (!is_shared_here()) return;
    RESERVE(kept, E.each);
    RESERVE(books, 3.0 * E.each * E.surface_count);
    RESERVE(differs, E.segment_count + E.arc_count + E.wheel_count);
}

/* Find in which columns members differ in the material, or in the speed of a belt. */
static void find_differences(void) {
    int columns = E.segment_count + E.arc_count + E.wheel_count, members = E.lone_count / E.each;
    for (int m = 1; m < members; m++)
        for (int n = 0; n < columns; n++) {
            int s = n < E.segment_count ? n : -1, w = n == E.segment_count + E.arc_count;
            differs[n] |= memcmp(E.materials + n, E.materials + m * columns + n, sizeof(Pair)) != 0
                || (s >= 0 && E.segments[s].speed != E.segments[m * E.segment_count + s].speed)
                || (w && E.wheels[0].speed != E.wheels[m].speed);
        }
}

/* Begin with another machine. */
void forget_shared(void) {
    if (!is_shared_here()) return;
    if (!E.laid) find_differences();
    for (int n = 0; n < E.each; n++) kept[n].at.given = 0;
}

/* Whether two particles are the same, but for the member that they belong to. */
static int is_same(const Lone *one, const Lone *other) {
    const long long *a = (const long long *)one, *b = (const long long *)other;
    for (unsigned n = 0; n < offsetof(Lone, kind) / sizeof *a; n++)
        if (a[n] != b[n]) return 0;
    return one->carried == other->carried;
}

static double *book_of(int lone) { return E.books + 3 * lone * E.surface_count; }

/* Whether a particle comes to where members differ, for the first time. Gates may change what an end belongs to. */
int is_parting(int obstacle) {
    if (alone || !is_shared_here() || !(O.change_count || differs[O.all[obstacle].source])) return 0;
    alone = 1;
    return !O.change_count;
}

/* Keep the state of a particle that is about to meet something where members differ, if the next member has the same. */
void keep_shared(int obstacle, int side) {
    Shared *s = kept + E.lone % E.each;
    int row = 3 * E.surface_count, next = E.lone + E.each;
    if (next >= E.lone_count || !is_same(E.lones + E.lone, E.lones + next)) return;
    s->knots = E.knot_count - knots, s->events = E.event_count - events, s->contacts = E.contacts - contacts;
    if (s->knots > SHARED_KNOTS || s->events > SHARED_EVENTS) return;
    s->at = A, s->obstacle = obstacle, s->side = side;
    memcpy(s->track, E.knots + knots, s->knots * sizeof *s->track);
    memcpy(s->told, E.events + events, s->events * sizeof *s->told);
    memcpy(books + row * (E.lone % E.each), book_of(E.lone), row * sizeof *books);
}

/* Let the present particle begin where that of the member before was kept; return whether there is such a state. */
int take_shared(void) {
    knots = E.knot_count, events = E.event_count, contacts = E.contacts, alone = 0;
    if (!is_shared_here()) return 0;
    Shared *s = kept + E.lone % E.each;
    int row = 3 * E.surface_count;
    if (!s->at.given || !is_same(s->at.given, E.lones + E.lone)) {
        s->at.given = 0;
        return 0;
    }
    alone = 1;
    A = s->at, A.given = E.lones + E.lone;
    fit_obstacles();
    for (int n = 0; n < s->knots; n++) {
        E.knots[E.knot_count] = s->track[n];
        E.knots[E.knot_count++].disk = E.lone;
    }
    for (int n = 0; n < s->events; n++) {
        E.events[E.event_count] = s->told[n];
        E.events[E.event_count++].disk = E.lone;
    }
    E.contacts += s->contacts;
    memcpy(book_of(E.lone), books + row * (E.lone % E.each), row * sizeof *books);
    strike(s->obstacle, s->side);
    return 1;
}
