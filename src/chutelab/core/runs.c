/* Run a plan in the core's memory: build its machine, draw its releases, and hand both to an engine. This is between the
   builder and the engines; of engines it uses only what layout.h describes. */

#include <string.h>
#include "plan.h"

/* Particles and places that may be checked while releases are drawn, some 10 ms. A drawing that takes longer is left to
   the host, which watches the time. */
#define LOOKS 1000000
/* Distance from the world's origin, in machine sizes, beyond which the host may use a local origin: it does beyond twice
   as much (REMOTE), measured by a box that may be larger than the one here. */
#define FAR_OFF 4.0
/* Replaces infinite friction, which cannot be multiplied by zero. */
#define GREATEST 1e300
/* m/s2; gravity for which bounds on speeds are written. */
#define EARTH 9.81
/* Numbers of a row of `results.KNOT`. */
#define KNOT_ROW 9

Exact *exact(void);
int lay_out_exact(void);
int follow_and_judge(void);
World *world(void);
int lay_out_world(void);
int prepare_to_judge(void);
int run_and_judge(void);
Drawing *drawing(void);
Laws *laws(void);
int lay_out_laws(void);
int judge(void);
int build(void);
int draw(void);

/* The terms of a run beside its tables: see layout.h. */
static const RunKeys *run_keys;
static const BodyKeys *bodies;
static const Pair *pairs;
static int own_pairs; /* number of pairs of a kind: with each kind, then with each surface */

static void find_terms(void) {
    run_keys = (const RunKeys *)P.terms;
    bodies = (const BodyKeys *)(run_keys + 1);
    pairs = (const Pair *)(bodies + P.particles);
    own_pairs = P.particles + P.owners;
}

static const Pair *pair_with(int kind, int surface) { return pairs + kind * own_pairs + P.particles + surface; }

/* Whether the whole machine is far from the world's origin. */
static int is_far_off(void) {
    double low[2] = { INFINITY, INFINITY }, high[2] = { -INFINITY, -INFINITY }, size = 0.0;
    if (P.incoming) return 0;
    for (int n = 0; n < 2; n++) {
        for (const Segment *s = P.segments; s < P.segments + P.segment_count; s++) {
            low[n] = MIN(low[n], MIN(s->start[n], s->end[n]));
            high[n] = MAX(high[n], MAX(s->start[n], s->end[n]));
        }
        for (const Arc *a = P.arcs; a < P.arcs + P.arc_count; a++) {
            double way[2];
            sin_cos(a->begin, way + 1, way);
            low[n] = MIN(low[n], a->center[n] + a->radius * way[n]);
            high[n] = MAX(high[n], a->center[n] + a->radius * way[n]);
        }
        size = MAX(size, high[n] - low[n]);
    }
    return fabs(low[0] + high[0]) > 2.0 * FAR_OFF * size || fabs(low[1] + high[1]) > 2.0 * FAR_OFF * size;
}

/* Build the machine and draw its releases. Return 1, ASIDE if the host has to do it, 0 if there is no memory. */
static int make_machine(void) {
    Drawing *d = drawing();
    if (!build()) return 0;
    d->looks = LOOKS;
    find_terms();
    int is_sound = P.nominal->contradiction == SOUND && !is_far_off();
    return is_sound && draw() == DONE && d->refusals->why == ACCEPTED ? 1 : ASIDE;
}

/* What `Start` and the tables say about a particle. */
typedef struct { const Start *start; const BodyKeys *body; double mass, inertia; int kind, carried; } Released;

/* The next particle; streams follow each other. Mass and inertia grow with the third and fifth power of its radius. */
static Released released(const Tables *t, int i, int *stream, int *first) {
    const Start *start = drawing()->starts + i;
    while (i >= *first + (int)t->streams[*stream].count) *first += (int)t->streams[(*stream)++].count;
    int kind = (int)t->streams[*stream].kind;
    const BodyKeys *body = bodies + kind;
    double size = start->radius / t->particles[kind].radius, square = size * size, cube = square * size;
    if (t->particles[kind].radius == 0.0) square = cube = 1.0;
    return (Released){ start, body, body->mass * cube, body->inertia * (cube * square), kind,
                       drawing()->carried[*stream] };
}

static double end_of_run(void) {
    double latest = -INFINITY, end;
    for (const Start *s = drawing()->starts; s < drawing()->starts + drawing()->count; s++) latest = MAX(latest, s->t);
    end = latest + run_keys->max_time;
    return run_keys->until < end ? run_keys->until : end;
}

static int take_up_exact(void) {
    Exact *e = exact();
    int stream = 0, first = 0;
    Tables t = tables_of(0);
    double end = end_of_run(), g = t.scene->gravity, pace = sqrt((g > 0.0 ? g : EARTH) / EARTH);
    e->segment_count = P.segment_count;
    e->arc_count = P.arc_count;
    e->wheel_count = P.incoming;
    e->lone_count = drawing()->count;
    e->kind_count = P.particles;
    e->surface_count = P.owners + 1;
    if (!lay_out_exact()) return 0;
    memcpy(e->segments, P.segments, P.segment_count * sizeof(Segment));
    memcpy(e->arcs, P.arcs, P.arc_count * sizeof(Arc));
    if (P.incoming)
        *e->wheels = (Wheel){ t.incoming->pulley_radius, t.incoming->speed, t.incoming->incline_deg * RADIANS, 0, 0 };
    Pair *pair = e->materials;
    for (int kind = 0; kind < P.particles; kind++) {
        for (int n = 0; n < P.segment_count; n++) *pair++ = *pair_with(kind, P.segments[n].surface);
        for (int n = 0; n < P.arc_count; n++) *pair++ = *pair_with(kind, P.arcs[n].surface);
        if (P.incoming) *pair++ = *pair_with(kind, 0);
    }
    for (int i = 0; i < e->lone_count; i++) {
        Released one = released(&t, i, &stream, &first);
        const Start *s = one.start;
        Lone *p = e->lones + i;
        *p = (Lone){ .release = s->t, .stop = end - s->t, .position = { s->position[0], s->position[1] },
                     .velocity = { s->velocity[0], s->velocity[1] }, .omega = s->omega, .radius = s->radius, .mass = one.mass,
                     .inertia = one.inertia, .rolling = one.body->rolling, .gravity = g, .pace = pace,
                     .kind = one.kind, .carried = one.carried };
        memcpy(p->exit_box, s->exit_box, sizeof p->exit_box);
        p->up[1] = 1.0;
    }
    return 1;
}

/* Build the plan and run it with the exact engine, see `follow_and_judge`. Return ASIDE if the host has to do it. */
EXPORT int run_exact(void) {
    int made = make_machine();
    if (made == ASIDE) return ASIDE;
    return made && take_up_exact() ? follow_and_judge() : NO_MEMORY;
}

static Surface *take_segments(Surface *to) {
    for (const Segment *s = P.segments; s < P.segments + P.segment_count; s++)
        *to++ = (Surface){ .x = s->start[0], .y = s->start[1], .tx = s->tangent[0], .ty = s->tangent[1],
                           .length = s->length, .speed = s->speed, .opens = s->appears, .closes = s->vanishes,
                           .shape = SEGMENT, .owner = s->surface, .one_sided = s->one_sided };
    return to;
}

static int take_up_world(void) {
    World *w = world();
    int stream = 0, first = 0;
    Tables t = tables_of(0);
    w->disk_count = drawing()->count;
    w->surface_count = P.segment_count + P.arc_count + P.incoming;
    w->kind_count = P.particles;
    w->owner_count = P.owners;
    w->mover_count = P.moving;
    w->joint_count = P.joints;
    w->pulley = P.incoming ? P.segment_count : -1;
    w->ride_incline = P.incoming ? t.incoming->incline_deg * RADIANS : 0.0;
    w->g = t.scene->gravity;
    w->tilt = t.scene->gravity_deg * RADIANS;
    w->air = t.scene->air_density;
    w->end_time = end_of_run();
    if (!lay_out_world()) return 0;
    memcpy(w->movers, P.movers, P.moving * sizeof(Mover));
    for (int n = 0; n < P.joints; n++) {
        const JointKeys *keys = t.joints + n;
        w->joints[n] = (Joint){ .from = { keys->from[0], keys->from[1] }, .length = keys->length,
                                .stiffness = keys->stiffness, .damper = keys->damper, .kind = (int)keys->kind,
                                .particle = (int)keys->particle, .other = isnan(keys->other) ? -1 : (int)keys->other };
    }
    Surface *to = take_segments(w->surfaces);
    if (P.incoming)
        *to++ = (Surface){ .radius = t.incoming->pulley_radius, .extent = 2.0 * PI, .speed = t.incoming->speed,
                           .opens = -INFINITY, .closes = INFINITY, .shape = CIRCLE };
    for (const Arc *a = P.arcs; a < P.arcs + P.arc_count; a++)
        *to++ = (Surface){ .x = a->center[0], .y = a->center[1], .radius = a->radius, .begin = a->begin,
                           .extent = a->extent, .speed = a->speed, .opens = a->appears, .closes = a->vanishes,
                           .shape = ARC, .owner = a->surface, .one_sided = a->one_sided };
    Pair *pair = w->pairs;
    for (int kind = 0; kind < P.particles; kind++) {
        for (int n = 0; n < own_pairs - P.owners + w->surface_count; n++) {
            int with = n - P.particles;
            *pair = with < 0 ? pairs[kind * own_pairs + n] : *pair_with(kind, w->surfaces[with].owner);
            pair->friction = MIN(pair->friction, GREATEST);
            pair++;
        }
    }
    for (int i = 0; i < w->disk_count; i++) {
        Released one = released(&t, i, &stream, &first);
        const Start *s = one.start;
        Disk *d = w->disks + i;
        *d = (Disk){ .x = s->position[0], .y = s->position[1], .vx = s->velocity[0], .vy = s->velocity[1],
                     .spin = s->omega, .radius = s->radius, .mass = one.mass, .inertia = one.inertia, .release = s->t,
                     .kind = one.kind, .rides = one.carried };
        memcpy(d->exit_box, s->exit_box, sizeof d->exit_box);
    }
    return prepare_to_judge();
}

/* The same with the contact engine, see `run_and_judge`. */
EXPORT int run_world(void) {
    int made = make_machine();
    if (made == ASIDE) return ASIDE;
    return made && take_up_world() ? run_and_judge() : LACKING;
}

/* Tell the laws the pieces of the plan's surfaces, the pulley last. */
static void take_up_pieces(Barrier *to, const IncomingKeys *belt) {
    for (const Segment *s = P.segments; s < P.segments + P.segment_count; s++)
        *to++ = (Barrier){ .x = s->start[0], .y = s->start[1], .tx = s->tangent[0], .ty = s->tangent[1],
                           .length = s->length, .speed = s->speed, .appears = s->appears,
                           .vanishes = s->vanishes, .surface = s->surface, .one_sided = s->one_sided };
    for (const Arc *a = P.arcs; a < P.arcs + P.arc_count; a++)
        *to++ = (Barrier){ .x = a->center[0], .y = a->center[1], .radius = a->radius, .begin = a->begin,
                           .extent = a->extent, .speed = a->speed, .appears = a->appears,
                           .vanishes = a->vanishes, .surface = a->surface, .one_sided = a->one_sided };
    if (P.incoming)
        *to = (Barrier){ .radius = belt->pulley_radius, .extent = 2.0 * PI, .speed = belt->speed,
                         .appears = -INFINITY, .vanishes = INFINITY };
}

/* Judge a run of a plan by an engine that is not here. It has one particle, whose knots and then the entries of all
   surfaces end the plan's terms. Return 1, ASIDE if the host has to tell the machine, 0 if there is no memory. */
EXPORT int judge_plan(void) {
    Laws *l = laws();
    int made = make_machine(), stream = 0, first = 0;
    if (made != 1) return made;
    Tables t = tables_of(0);
    Released one = released(&t, 0, &stream, &first);
    l->particle_count = 1, l->row = KNOT_ROW;
    l->piece_count = P.segment_count + P.arc_count + P.incoming, l->pulley = P.incoming;
    l->book_rows = l->surface_count = P.owners + 1;
    l->tilt = t.scene->gravity_deg * RADIANS, l->largest = one.start->radius;
    if (!lay_out_laws()) return 0;
    l->books = P.rows + P.width + P.term_width - 3 * l->book_rows;
    l->knots = l->books - KNOT_ROW * l->knot_count;
    l->offsets[1] = l->knot_count;
    *l->bodies = (Body){ .radius = one.start->radius, .mass = one.mass, .inertia = one.inertia,
                         .gravity = t.scene->gravity };
    take_up_pieces(l->barriers, t.incoming);
    return judge();
}
