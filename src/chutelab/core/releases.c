/* Where, when and how fast each particle is released. */

#include <string.h>
#include "releases.h"

/* Greatest number of draws of a height; the last one is kept even if it overlaps, and the release waits. */
#define TRIES 1000
/* Distance of neighbours in a packed box, in radii of the largest particle. */
#define PITCH 2.04
/* Random shift of each place in both directions, in the same unit: no real pile is perfectly even. */
#define JITTER 0.01
/* Number of places of a box that are checked together; places above the last particle are never checked. */
#define HANDFUL 1024
/* Places of a box that are checked at most, and TRIES more for each particle. */
#define LOOKS 1e6
/* Factor by which cells are wider than necessary, so that rounding excludes no neighbour. */
#define WIDER 1.001

Drawing D;
static Generator generator;

/* The stream that is being drawn. */
static Tables tables;
static const StreamKeys *stream;
static const ParticleKeys *particle;
static Start *starts;
static int count, rides, carried;
static double belt_x, belt_y; /* direction of the belt, for a stream released on it; else perpendicular to gravity */

static Place handful[HANDFUL];

EXPORT Drawing *drawing(void) { return &D; }

/* Reserve the arrays of the drawing. */
void lay_out_drawing(void) {
    Tables t = tables_of(0);
    double corners = 0.0, beds = 0.0;
    D.count = 0;
    for (int n = 0; n < P.streams; n++) {
        D.count += (int)t.streams[n].count;
        if (t.scene->crowded != 0.0) beds = MAX(beds, t.streams[n].bed_height);
    }
    for (int n = 0; n < P.particles; n++) corners += t.particles[n].corners;
    int near = beds > 0.0 ? D.count : 1, links = P.streams > 1 ? D.count : 1;
    for (D.head_room = 1; D.head_room <= 2 * MAX(near, links);) D.head_room *= 2;
    RESERVE(D.starts, (double)P.members * D.count);
    RESERVE(D.refusals, P.members);
    RESERVE(D.carried, (double)P.members * P.streams);
    RESERVE(D.corners, 2.0 * corners);
    RESERVE(D.near, near);
    RESERVE(D.links, links);
    RESERVE(D.heads, D.head_room);
    RESERVE(D.listed, P.segment_count + P.arc_count + 1 + 2 * P.conveyors);
}

static int is_line(void) { return !isnan(stream->to[0]); }
static int is_fill(void) { return !isnan(stream->fill[0]); }
static int meets_others(void) { return count > 1 && tables.scene->crowded != 0.0; }

/* Seed the generator with the stream's seed, and with its number if it is not the first. */
static void seed_stream(int number) {
    unsigned words[3] = { (unsigned)stream->seed[0], (unsigned)stream->seed[1] };
    int many = words[1] ? 2 : 1;
    if (number) words[many++] = (unsigned)number;
    seed_generator(&generator, words, many);
}

static double draw_share(void) { return draw_uniform(&generator, 0.0, 1.0); }

/* Draw radii from the range of the kind; the first particle has the mean. */
static void draw_radii(void) {
    if (isnan(particle->span[0])) return;
    for (int i = 0; i < count; i++)
        starts[i].radius = draw_uniform(&generator, particle->span[0], particle->span[1]);
    starts[0].radius = particle->radius;
}

/* Draw heights, which are kept in `position[1]` at first, and speeds; the first particle has no spread. */
static void draw_spread(double vx, double vy) {
    double speed = length_of(vx, vy), x = 1.0, y = 0.0;
    if (speed > 0.0) x = vx / speed, y = vy / speed;
    for (int i = 0; i < count; i++) starts[i].position[1] = stream->bed_height * draw_share();
    starts[0].position[1] = 0.0;
    for (int i = 0; i < count; i++) {
        double faster = stream->speed_spread * draw_uniform(&generator, -1.0, 1.0);
        if (i == 0) faster = 0.0;
        starts[i].velocity[0] += faster * x;
        starts[i].velocity[1] += faster * y;
    }
}

/* Draw velocities of a gas: normally distributed in both directions (G. E. P. Box, M. E. Muller, 1958). */
static void draw_gas(void) {
    for (int i = 0; i < count && stream->speed_spread > 0.0; i++) {
        double size = stream->speed_spread * sqrt(-2.0 * log(1.0 - draw_share())), x, y;
        sin_cos(2.0 * PI * draw_share(), &y, &x);
        starts[i].velocity[0] += size * x;
        starts[i].velocity[1] += size * y;
    }
}

/* Draw all that doesn't depend on other particles. */
static void begin_stream(void) {
    double velocity[2];
    stream = tables.streams + D.stream;
    particle = tables.particles + (int)stream->kind;
    count = (int)stream->count;
    release_velocity(&tables, D.stream, velocity);
    rides = is_on_belt(&tables, D.stream);
    carried = rides && tables.incoming->adheres != 0.0;
    sin_cos(tables.scene->gravity_deg * RADIANS, &belt_y, &belt_x);
    if (rides) up_belt(tables.incoming, &belt_x, &belt_y);
    if (carried) {
        double speed = tables.incoming->speed, near = ALONG * fabs(speed);
        int other = fabs(velocity[0] - speed * belt_x) > near || fabs(velocity[1] - speed * belt_y) > near;
        int why = stream->speed_spread > 0.0 ? SPREAD_ADHERES : other ? VELOCITY_ADHERES
                : stream->omega != 0.0 ? SPIN_ADHERES : ACCEPTED;
        D.refusals[D.member] = (Refusal){ .why = why, .stream = D.stream };
    }
    int turns = particle->moment > 0.0 || particle->corners > 0.0;
    for (int i = 0; i < count; i++) {
        double t = stream->at_once != 0.0 ? 0.0 : i / stream->rate;
        starts[i] = (Start){ .t = t + stream->start, .velocity = { velocity[0], velocity[1] },
                             .omega = turns ? stream->omega : 0.0, .radius = particle->radius,
                             .angle = stream->angle_deg * RADIANS };
    }
    D.next = 1;
    D.near_count = 0;
    int spread = stream->bed_height > 0.0 || stream->speed_spread > 0.0 || !isnan(particle->span[0]);
    if (is_fill()) {
        seed_stream(D.stream);
        draw_radii();
        draw_gas();
        D.found = 0;
        D.looked = 0.0;
    } else if (count > 1 && (meets_others() || spread || is_line())) {
        seed_stream(D.stream);
        draw_spread(velocity[0], velocity[1]);
        draw_radii();
    }
}

/* The list of a cell of a grid. */
static int *cell_of(double column, double row) {
    unsigned hash = (unsigned)(long long)column * 73856093u ^ (unsigned)(long long)row * 19349663u;
    return D.heads + ((hash ^ hash >> 15) & (unsigned)(D.head_room - 1));
}

static void empty_cells(void) { memset(D.heads, 0xff, (unsigned long)D.head_room * sizeof(int)); }

/* Whether a particle at a height would overlap none of those nearby. These are listed in rows, whose height is their
   greatest reach. */
static int is_free(double height, double row_height) {
    double row = floor(height / row_height);
    for (int n = -1; n <= 1; n++)
        for (int k = *cell_of(0.0, row + n); k >= 0; k = D.near[k].next) {
            const Near *o = D.near + k;
            double up = o->dy - height;
            if (o->dx * o->dx + up * up < o->reach * o->reach) return 0;
        }
    return 1;
}

/* Draw heights until one is free; after TRIES draws the last one is kept. */
static double free_height(double diameter) {
    double height = 0.0, row_height = WIDER * diameter;
    for (int k = 0; k < D.near_count; k++) {
        int *head = cell_of(0.0, floor(D.near[k].dy / row_height));
        D.near[k].next = *head;
        *head = k;
    }
    for (int left = TRIES; left > 0; left--, D.left--) {
        height = stream->bed_height * draw_share();
        if (left == 1 || is_free(height, row_height)) break;
    }
    for (int k = 0; k < D.near_count; k++) *cell_of(0.0, floor(D.near[k].dy / row_height)) = -1;
    return height;
}

/* Redraw heights so that no particle overlaps one released before it.

   If no height is free, the last draw is kept, and the release is delayed. Earlier particles are assumed to have moved at
   their release velocity relative to the belt, and to have fallen freely, but riders not below the lowest layer. A
   particle stays in the list as long as it may be in the way: one that has moved on by a diameter, or has fallen below
   the bed by one, will not come back. */
static int spread_apart(void) {
    double diameter = 0.0, fall = carried ? 0.0 : 0.5 * tables.scene->gravity;
    double lowest = rides ? 0.0 : -INFINITY;
    for (int i = 0; i < count; i++) diameter = MAX(diameter, 2.0 * starts[i].radius);
    if (D.next == 1) empty_cells();
    for (; D.next < count; D.next++) {
        if (D.left <= 0) return 0;
        Start *own = starts + D.next;
        int kept = 0, is_taken = 0;
        D.near[D.near_count++].particle = D.next - 1;
        for (int k = 0; k < D.near_count; k++) {
            const Start *o = starts + D.near[k].particle;
            double u = o->velocity[0] * belt_x + o->velocity[1] * belt_y, age = own->t - o->t;
            double v = o->velocity[1] * belt_x - o->velocity[0] * belt_y, dx = u * age;
            double dy = MAX(o->position[1] + v * age - fall * (age * age), lowest);
            int sinks = v <= 2.0 * fall * age;
            if (!(fabs(dx) < diameter) || (sinks && dy <= -diameter)) continue;
            double reach = o->radius + own->radius, up = dy - own->position[1];
            if (dx * dx + up * up < reach * reach) is_taken = 1;
            D.near[kept++] = (Near){ dx, dy, reach, D.near[k].particle, -1 };
        }
        D.left -= D.near_count;
        D.near_count = kept;
        if (is_taken) own->position[1] = free_height(diameter);
    }
    return 1;
}

static void place_stream(void) {
    const double *at = stream->at, *to = stream->to;
    double place[2], step = 1.0 / MAX(count - 1, 1);
    if (!is_line()) release_point(&tables, D.stream, place);
    for (int i = 0; i < count; i++) {
        double *position = starts[i].position, height = position[1];
        if (is_line()) {
            double share = i == 0 ? 0.0 : i == count - 1 ? 1.0 : i * step;
            if (i > 0 && stream->at_once == 0.0) share = draw_share();
            for (int n = 0; n < 2; n++) position[n] = at[n] + share * (to[n] - at[n]);
            continue;
        }
        if (rides) height += starts[i].radius - particle->radius;
        position[0] = place[0] - belt_y * height;
        position[1] = place[1] + belt_x * height;
    }
}

/* Sort the particles of earlier streams into cells of a grid; return the size of a cell. */
static double sort_earlier(double largest) {
    Start *first = D.starts + (long)D.member * D.count;
    double size = 0.0;
    for (const Start *o = first; o < starts; o++) size = MAX(size, o->radius);
    size = WIDER * (size + largest);
    empty_cells();
    for (int k = 0; k < starts - first; k++) {
        int *head = cell_of(floor(first[k].position[0] / size), floor(first[k].position[1] / size));
        D.links[k] = *head;
        *head = k;
    }
    return size;
}

/* Mark the places of a handful that overlap particles of earlier streams. */
static void take_what_is_in_others(int many, double largest) {
    const Start *first = D.starts + (long)D.member * D.count;
    for (Place *p = handful; p < handful + many; p++) {
        double column = floor(p->x / D.cell), row = floor(p->y / D.cell);
        for (int n = 0; n < 9 && !p->taken; n++)
            for (int k = *cell_of(column + n % 3 - 1, row + n / 3 - 1); k >= 0; k = D.links[k]) {
                const double *o = first[k].position;
                if (length_of(p->x - o[0], p->y - o[1]) < largest + first[k].radius) p->taken = 1;
            }
    }
}

/* Pack a box from below, in rows of which every other one is shifted by half a pitch. */
static int pour(void) {
    const double *box = stream->fill;
    double largest = isnan(particle->span[1]) ? particle->radius : particle->span[1];
    double pitch = PITCH * largest, room = largest * (1.0 + JITTER), rise = pitch * sqrt(0.75);
    double rows = floor((box[3] - box[1] - 2.0 * room) / rise) + 1.0;
    double across = floor((box[2] - box[0] - 2.0 * room) / pitch) + 1.0;
    double most = rows > 0.0 && across > 0.0 ? MIN(rows * across, LOOKS + TRIES * (double)count) : 0.0;
    int is_first = starts == D.starts + (long)D.member * D.count;
    if (D.looked == 0.0 && !is_first) D.cell = sort_earlier(largest);
    while (D.looked < most && D.found < count) {
        if (D.left <= 0) return 0;
        int many = 0;
        double row = floor(D.looked / across), column = D.looked - row * across;
        for (int n = 0; n < HANDFUL && D.looked < most; n++, D.looked += 1.0, column += 1.0) {
            if (column >= across) column = 0.0, row += 1.0;
            double x = box[0] + room + (column * pitch + 0.5 * pitch * fmod(row, 2.0));
            if (!(x <= box[2] - room)) continue;
            Place *p = handful + many++;
            p->x = x + JITTER * largest * draw_uniform(&generator, -1.0, 1.0);
            p->y = box[1] + room + row * rise;
            p->y += JITTER * largest * draw_uniform(&generator, -1.0, 1.0);
            p->taken = 0;
        }
        D.left -= take_what_is_in_surfaces(handful, many, largest) + HANDFUL;
        if (!is_first) take_what_is_in_others(many, largest);
        for (const Place *p = handful; p < handful + many && D.found < count; p++) {
            if (p->taken) continue;
            starts[D.found].position[0] = p->x;
            starts[D.found++].position[1] = p->y;
        }
    }
    if (D.found < count)
        D.refusals[D.member] = (Refusal){ 0.0, largest, BOX_FULL, D.stream, D.found, 0 };
    return 1;
}

/* Continue to draw a stream; return 1 when it is done. */
static int draw_stream(void) {
    starts = D.starts + (long)D.member * D.count + D.first;
    if (!D.is_begun) begin_stream();
    D.is_begun = 1;
    if (D.refusals[D.member].why) return 1;
    int is_bed = !is_fill() && !is_line() && meets_others() && stream->bed_height > 0.0;
    if (is_fill() ? !pour() : is_bed && !spread_apart()) return 0;
    if (!is_fill()) place_stream();
    D.carried[D.member * P.streams + D.stream] = carried;
    D.first += count;
    return 1;
}

/* Continue to draw for about `looks` checks; return DONE or PAUSED. */
EXPORT int draw(void) {
    D.left = D.looks;
    for (; D.member < P.members; D.member++, D.stream = D.first = 0) {
        tables = tables_of(D.member);
        enter_room(&tables);
        for (; D.stream <= P.streams && !D.refusals[D.member].why; D.stream++, D.is_begun = 0)
            if (!(D.stream < P.streams ? draw_stream() : clear_releases())) return PAUSED;
        box_in();
    }
    return DONE;
}

/* Draw right after the machines are built, if the host has said how many places may be checked, no machine contradicts
   itself, and no corners have to be told before. */
void draw_if_told(void) {
    Tables t = tables_of(0);
    double corners = 0.0;
    for (int n = 0; n < P.particles; n++) corners += t.particles[n].corners;
    int is_sound = D.looks > 0 && corners == 0.0;
    for (int n = 0; n < P.members && is_sound; n++) is_sound = P.nominal[n].contradiction == SOUND;
    if (is_sound) draw();
}
