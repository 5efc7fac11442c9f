/* Runs that are judged at their end, where their records are in memory, so that no array is copied out and in. This is
   between the engines and the laws, and uses only what layout.h says of either: what the host told an engine, and what
   that engine wrote. */

#include <math.h>
#include <stddef.h>
#include <string.h>
#include "laws.h"
#include "loads.h"

/* Functions that a host may also call itself. */
Exact *exact(void);
int follow_some(int end, int *rounds);
World *world(void);
int prepare(void);
int run(int steps);
Room *room(void);

/* Have the laws read the knots in place. */
static void take_knots(const Knot *knots, int count) {
    L.knots = (double *)knots;
    L.knot_count = count;
    L.row = sizeof(Knot) / sizeof(double);
    L.owned = 1;
}

/* Count the numbers of events that are not finite. Numbers times zero are zero only if all are finite: ten of them are
   checked in pairs, then the last two. */
PAIRED static void take_events(const Event *events, int count) {
    for (const Event *e = events; e < events + count; e++) {
        const double *all = &e->t, *last = &e->tangent;
        Two sum = (two_at(all) + two_at(all + 2)) + (two_at(all + 4) + two_at(all + 6)) + (two_at(all + 8) + two_at(last - 1));
        if (is_all(0 * sum == 0)) continue;
        for (const double *number = all; number <= last; number++) L.unreal += !isfinite(*number);
    }
}

static char *put(char *to, const void *from, int size) {
    memcpy(to, from, size);
    return to + size;
}

/* Convert events to rows of `results.EVENT`, which have no padding, in place; return the number of bytes. */
EXPORT int pack_events(Event *events, int count) {
    char *to = (char *)events;
    for (int n = 0; n < count; n++) {
        const Event e = events[n];
        const signed char kind = e.kind;
        const short surface = e.surface;
        to = put(to, &e.t, 8);
        to = put(to, &e.disk, 8);
        to = put(to, &kind, 1);
        to = put(to, &surface, 2);
        to = put(to, &e.x, 16);
        to = put(to, e.before, 16);
        to = put(to, e.after, 16);
        to = put(to, e.before + 2, 8);
        to = put(to, e.after + 2, 8);
        to = put(to, &e.normal, 16);
    }
    return (int)(to - (char *)events);
}

static void end_events(Event *events, int count) { room()->packed = pack_events(events, count); }

static int lay_out_pieces(void) {
    RESERVE(L.bodies, L.particle_count);
    RESERVE(L.barriers, (double)L.piece_count * members());
    return has_room();
}

static int end_up(void) {
    RESERVE(L.offsets, L.particle_count + 1);
    RESERVE(L.breaches, BREACHES);
    RESERVE(L.order, 1);
    RESERVE(L.places, 1);
    return has_room() && judge();
}

/* The exact engine. */

static void take_pieces(const Exact *e, int member) {
    Barrier *b = L.barriers + (long)member * L.piece_count;
    const Segment *straight = e->segments + (long)member * e->segment_count;
    const Arc *bent = e->arcs + (long)member * e->arc_count;
    for (const Segment *s = straight; s < straight + e->segment_count; s++)
        *b++ = (Barrier){ .x = s->start[0], .y = s->start[1], .tx = s->tangent[0], .ty = s->tangent[1],
                          .length = s->length, .speed = s->speed, .appears = s->appears,
                          .vanishes = s->vanishes, .surface = s->surface };
    for (const Arc *a = bent; a < bent + e->arc_count; a++)
        *b++ = (Barrier){ .x = a->center[0], .y = a->center[1], .radius = a->radius, .begin = a->begin,
                          .extent = a->extent, .speed = a->speed, .appears = a->appears,
                          .vanishes = a->vanishes, .surface = a->surface };
    if (!e->wheel_count) return;
    const Wheel *w = e->wheels + member;
    *b = (Barrier){ .radius = w->radius, .extent = 2 * PI, .speed = w->speed, .appears = -INFINITY,
                    .vanishes = INFINITY, .surface = w->surface };
}

/* Tell the laws about the machine. */
static int take_machine(const Exact *e) {
    L = (Laws){ .particle_count = e->lone_count, .engine = ENGINE_EXACT, .each = e->each,
                .piece_count = e->segment_count + e->arc_count + e->wheel_count,
                .pulley = e->wheel_count, .books = e->books, .surface_count = e->surface_count,
                .book_rows = e->surface_count * (e->apart ? e->lone_count : 1), .loose = e->loose };
    if (!lay_out_pieces()) return 0;
    for (int i = 0; i < e->lone_count; i++) {
        const Lone *p = e->lones + i;
        L.bodies[i] = (Body){ .radius = p->radius, .mass = p->mass, .inertia = p->inertia, .gravity = p->gravity };
        L.largest = MAX(L.largest, p->radius);
    }
    for (int member = 0; member < members(); member++) take_pieces(e, member);
    return 1;
}

static void take_counts(const Exact *e) {
    L.contacts = e->contacts, L.steps = e->rounds;
}

static int judge_exact(const Exact *e) {
    if (!take_machine(e)) return 0;
    take_counts(e);
    take_events(e->events, e->event_count);
    take_knots(e->knots, e->knot_count);
    return end_up();
}

/* What is kept of a family that is judged as it runs: rows of `results.KNOT`, and labels of events. */
static struct { char *knots, *labels; int knot_count, label_count, knot_room, label_room; } Kept;

/* Number of particles of a family that are followed, then judged. */
#define SOME 8
/* Number of bytes of a row of `results.KNOT`, which is the beginning of a `Knot`, and of labels. */
#define KNOT_SIZE ((int)offsetof(Knot, disk))
#define LABEL_SIZE ((int)(3 * sizeof(int)))

/* Double the room of rows until there is some for `more` of them; return whether there is. */
static int make_room(char **rows, int *room, int count, int more, int size) {
    while (*room - count < more) {
        char *wider = set_apart(2.0 * *room, size);
        if (!wider) return 0;
        memcpy(wider, *rows, (unsigned long)count * size);
        *rows = wider, *room *= 2;
    }
    return 1;
}

static int begin_briefly(const Exact *e) {
    int knots = 4 * e->lone_count, labels = 15 * e->lone_count;
    Kept.knot_count = Kept.label_count = 0, Kept.knot_room = knots, Kept.label_room = labels;
    Kept.knots = set_apart(knots, KNOT_SIZE), Kept.labels = set_apart(labels, LABEL_SIZE);
    return take_machine(e) && RESERVE(L.offsets, L.particle_count + 1) && has_room();
}

/* Begin again, and keep all knots. */
static void begin_again(Exact *e) {
    e->brief = e->lone = e->begun = e->laid = e->knot_count = e->event_count = e->contacts = e->rounds = 0;
    memset(e->books, 0, 3 * L.book_rows * sizeof *e->books);
    L = (Laws){ .offsets = 0 };
}

/* Keep the ends of the tracks of particles that have come where they should; of others also the knots between, but those
   inside rides. */
static void keep_knots(const Exact *e, int first) {
    char *to = Kept.knots + (long)Kept.knot_count * KNOT_SIZE;
    for (int i = first, k = 0; i < L.judged; i++) {
        int begin = k, end = L.offsets[i + 1], reason = e->lones[i].reason;
        int has_come = reason == HAS_LANDED || reason == HAS_SETTLED;
        L.offsets[i] = Kept.knot_count;
        for (; k < end; k++) {
            if (k > begin && k < end - 1 && (has_come || e->knots[k].inner % 2)) continue;
            to = put(to, e->knots + k, KNOT_SIZE);
            Kept.knot_count++;
        }
    }
    L.offsets[L.judged] = Kept.knot_count;
}

/* Keep the labels of new events, which are read more often than the events. */
static void keep_labels(const Exact *e) {
    int *to = (int *)Kept.labels + 3 * Kept.label_count;
    for (const Event *now = e->events + Kept.label_count; now < e->events + e->event_count; now++)
        *to++ = now->disk, *to++ = now->kind, *to++ = now->surface;
    Kept.label_count = e->event_count;
}

/* Judge the particles that have ended, and keep what is needed of them; return whether nothing stands out. */
static int judge_and_keep(Exact *e) {
    int first = L.judged;
    take_knots(e->knots, e->knot_count);
    take_events(e->events + Kept.label_count, e->event_count - Kept.label_count);
    L.offsets[first] = 0;
    if (!judge_some(e->lone)) return 0;
    keep_knots(e, first);
    keep_labels(e);
    e->knot_count = 0;
    return 1;
}

/* Run a family, of which a few particles are judged at a time, while what they wrote is in the cache. If its laws cannot
   be judged without inner knots, or there is too much to keep, it runs again and keeps them. */
static int follow_briefly(Exact *e, int *rounds) {
    if (!L.bodies && !begin_briefly(e)) return NO_MEMORY;
    while (L.judged < e->lone_count) {
        int course = follow_some(MIN(L.judged + SOME, e->lone_count), rounds);
        if (course != FINISHED && course != FILLED) return course;
        if (course == FILLED || Kept.knot_count + e->knot_count > BRIEF_KEPT) {
            begin_again(e);
            return FINISHED;
        }
        if (!make_room(&Kept.knots, &Kept.knot_room, Kept.knot_count, e->knot_count, KNOT_SIZE)
            || !make_room(&Kept.labels, &Kept.label_room, Kept.label_count, e->event_count - Kept.label_count, LABEL_SIZE))
            return NO_MEMORY;
        if (!judge_and_keep(e)) {
            begin_again(e);
            return FINISHED;
        }
    }
    take_counts(e);
    if (!RESERVE(L.breaches, BREACHES)) return NO_MEMORY;
    if (!judge_rest()) {
        begin_again(e);
        return FINISHED;
    }
    e->knots = (Knot *)Kept.knots, e->knot_count = Kept.knot_count, e->labels = (int *)Kept.labels;
    return FINISHED;
}

/* Run at most as many rounds as the budget; a run that has finished, and of which nothing has been taken out, is
   judged. */
EXPORT int follow_and_judge(void) {
    Exact *e = exact();
    int rounds = room()->budget, course = FINISHED;
    if (e->brief) course = follow_briefly(e, &rounds);
    if (course == FINISHED && !e->brief) {
        course = follow_some(e->lone_count, &rounds);
        if (course == FINISHED && e->is_whole && !judge_exact(e)) course = NO_MEMORY;
    }
    if (course == FINISHED && e->is_whole && !e->brief) end_events(e->events, e->event_count);
    return course;
}

/* The contact engine. It changes the surfaces that it is given, so they are copied before. */

EXPORT int prepare_to_judge(void) {
    const World *w = world();
    const Surface *pulley = w->pulley < 0 ? 0 : w->surfaces + w->pulley;
    L = (Laws){ .particle_count = w->disk_count, .piece_count = w->surface_count, .pulley = pulley != 0,
                .engine = ENGINE_CONTACT, .tilt = w->tilt, .dt = w->dt, .surface_count = w->owner_count + 1,
                .book_rows = w->owner_count + 1, .interact = w->interact, .movers = w->movers,
                .mover_count = w->mover_count, .joined = w->joint_count > 0 };
    if (!lay_out_pieces()) return 0;
    Barrier *b = L.barriers;
    for (int k = 0; k < w->surface_count; k++) {
        const Surface *s = w->surfaces + k;
        Barrier *own = s == pulley ? L.barriers + w->surface_count - 1 : b++;
        *own = (Barrier){ .x = s->x, .y = s->y, .tx = s->tx, .ty = s->ty, .length = s->length,
                          .radius = s->radius, .begin = s->begin, .extent = s->extent,
                          .speed = s->speed, .appears = s->opens, .vanishes = s->closes,
                          .surface = s->owner, .one_sided = s->one_sided };
        for (int n = 0; n < w->mover_count; n++)
            if (w->movers[n].surface == s->owner) own->mover = n + 1;
    }
    for (int i = 0; i < w->disk_count; i++) {
        const Disk *d = w->disks + i;
        L.bodies[i] = (Body){ .radius = d->radius, .mass = d->mass, .inertia = d->inertia, .gravity = w->g };
        L.largest = MAX(L.largest, d->radius);
    }
    return prepare() && lay_out_bins(w->owner_count);
}

static int judge_world(void) {
    const World *w = world();
    L.books = w->books;
    L.contacts = w->impact_count;
    L.steps = w->step_count;
    L.gained = w->gained;
    L.unsolved = w->unsolved_most;
    take_events(w->events, w->event_count);
    take_knots(w->knots, w->knot_count);
    return end_up();
}

/* `run`; a run of particles that do not meet is judged when it has finished, if nothing has been taken out. */
EXPORT int run_and_judge(void) {
    int status = run(room()->budget);
    const World *w = world();
    if (status != DONE || !w->is_whole) return status;
    if (!w->interact && !judge_world()) return LACKING;
    end_events(w->events, w->event_count);
    return status;
}
