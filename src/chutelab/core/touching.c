/* Find the contacts at the beginning of a step, and what each of them needs: the change of normal velocity such that its
   gap is not negative at the end of the step. */

#include "core.h"

/* Removal of overlaps, in radii. Up to SLOP an overlap stays. Of what is beyond, a step removes as much as opens the contact
   no faster than 2 g dt, at least the share PART, and all of it from DEEP on, but no more than MOST_PARTED: removal does
   work, and where a wedged chain opens the speeds of its contacts add up. (With a smaller bound such a chain takes many
   times the sweeps.) The contact gives way like a spring of stiffness PART / GIVES M / step^2, with M the heaviest mass of the
   island: rigid particles wedged between walls cannot part, and their impulses would grow in each sweep. While a crowd gets
   back energy that it had lost (`eager` < 1, see layout.h), both shares and GIVES are multiplied by `eager`, and no more is
   removed for the sake of 2 g dt. */
#define SLOP 5e-4
#define PART 0.1
#define DEEP 0.03
#define MOST_PARTED 1e-2
#define GIVES 3e-3
/* Gap, in radii, up to which a contact that was pressed still touches: sweeps leave gaps so wide. */
#define LEAVE 1e-4
/* Cosine of the angle within which a contact goes over from a face to the next one in a step. */
#define ALIKE 0.5

/* The gap at the end of the step on the path without impulses; for a surface also the curvature of the path along it, see
   `bending`, if `bends` is not null. */
double gap_later(const Contact *c, double h, double *bends) {
    const Disk *a = W.disks + c->i;
    double x = a->x + (a->vx + 0.5 * W.gx * h) * h, y = a->y + (a->vy + 0.5 * W.gy * h) * h, nx, ny;
    if (c->j < 0) {
        const Surface *s = surface_at(-1 - c->j, a->t + h), *then = face_at(s, x, y);
        /* From a distance a disk can only come to the piece that the normal belongs to. */
        if (then != s && c->gap > TOUCH * a->radius) return INFINITY;
        double gap = gap_to(then, x, y, a->radius, &nx, &ny);
        /* In a hollow hardly wider than the disk what follows may be nearest on the other side. */
        if (then != s && nx * c->nx + ny * c->ny < ALIKE) {
            then = s;
            gap = gap_to(then, x, y, a->radius, &nx, &ny);
        }
        if (bends) *bends = bending(then, x, y, a->radius);
        return gap;
    }
    const Disk *b = W.disks + c->j;
    x -= b->x + (b->vx + 0.5 * W.gx * h) * h;
    y -= b->y + (b->vy + 0.5 * W.gy * h) * h;
    return sqrt(x * x + y * y) - a->radius - b->radius;
}

/* Time until the contact point of a disk passes the end of the face. INFINITY if there is no end, or if the face continues
   smoothly without a bend at which the disk would fly off. */
static double time_on_face(const Contact *c) {
    const Disk *d = W.disks + c->i;
    const Surface *s = surface_at(-1 - c->j, d->t);
    double x = d->x - s->x, y = d->y - s->y, along, run, length = s->length, v[3];
    carried(s, d->x, d->y, v);
    v[0] = d->vx - v[0];
    v[1] = d->vy - v[1];
    if (s->shape == CIRCLE) return INFINITY;
    if (s->shape == SEGMENT) {
        along = x * s->tx + y * s->ty;
        run = v[0] * s->tx + v[1] * s->ty;
    } else {
        /* In angles: the contact point turns with the centre of the disk. */
        double half = acos(s->cos_half), square_away = x * x + y * y;
        if (square_away == 0) return INFINITY;
        along = atan2(s->tx * y - s->ty * x, s->tx * x + s->ty * y) + half;
        run = (x * v[1] - y * v[0]) / square_away;
        length = 2 * half;
    }
    if (along < 0 || along > length || run == 0) return INFINITY;
    if (mate_of(s, run > 0) >= 0) {
        const Surface *next = surface_at(s->mates[run > 0], d->t);
        double load = -(W.gx * c->nx + W.gy * c->ny), fast = v[0] * c->ny - v[1] * c->nx;
        int round = next->shape != SEGMENT
            && square(d->x - next->x) + square(d->y - next->y) >= square(next->radius);
        if (!round || load > fast * fast / (next->radius + d->radius)) return INFINITY;
    }
    return (run > 0 ? length - along : along) / fabs(run);
}

/* Time at which a load (N, newest first) becomes 0, extrapolated from two values. */
double time_unloaded(const double *load, const double *t) {
    return load[1] > load[0] ? t[0] + load[0] / (load[1] - load[0]) * (t[0] - t[1]) : INFINITY;
}

/* The change of velocity along its normal, m/s, such that the gap of a disk inside an arc is `aim` at the end of the step:
   the wall bends towards the disk on its way. */
static double closes(const Contact *c, double aim, double h) {
    const Disk *d = W.disks + c->i;
    double need = c->need, nx, ny;
    for (int n = 0; n < 2; n++) {
        double x = d->x + (d->vx + need * c->nx + 0.5 * W.gx * h) * h;
        double y = d->y + (d->vy + need * c->ny + 0.5 * W.gy * h) * h;
        double gap = gap_to(face_at(surface_at(-1 - c->j, d->t + h), x, y), x, y, d->radius, &nx, &ny);
        double slope = nx * c->nx + ny * c->ny;
        if (slope < ALIKE) break;
        need += (aim - gap) / (slope * h);
    }
    return need;
}

/* Ask of a contact that its gap is `closed` after the time h, or that a part of a deep overlap is removed by then;
   without impulses its gap would be `later`. Return the gap that it asks for. */
double ask(Contact *c, double closed, double later, double least, double h) {
    double aim = closed;
    if (c->gap < -SLOP * least) {
        /* A shorter step removes less, at the same speed; else it would give more energy. */
        double share = MIN(h / W.usual, 1), beyond = c->gap + SLOP * least;
        double part = W.eager * MAX(PART, -c->gap / (DEEP * least));
        if (W.eager == 1) part = MAX(part, -W.soft * W.step / beyond);
        aim = -SLOP * least + (1 - share * MIN(part, 1)) * beyond;
        if (W.interact) {
            c->most = (c->gap + share * MOST_PARTED * least - later) / h;
            c->gives = W.eager * GIVES;
        }
    }
    c->need = (aim - later) / h;
    c->parts = (aim - closed) / h;
    return aim;
}

/* Correct what a contact asks for as at the end of the step before: where a disk rests in a wedge, corrections that begin
   anew in each step would press it harder in each. */
static void go_on_bending(Contact *c, const Contact *last, double h) {
    c->bend = last->bend;
    c->need -= c->bend / h;
}

/* Add a contact if the two touch and approach slowly, up to `bound`. With corners it is that at `place`, or continues the
   contact `still`, whose gap has changed by `change` since it was looked up. `least` is the smaller radius. Return 0 if
   there is no room. */
static int add(int i, int j, double least, double bound, double h, const Touch *place, const Contact *still,
               double change) {
    if (W.contact_count >= W.contact_room) return 0;
    Contact *c = W.contacts + W.contact_count;
    const Disk *d = W.disks + i;
    double u[3], later, haste = 0;
    if (j < 0 && !place && !still && face_at(surface_at(-1 - j, d->t), d->x, d->y) != W.surfaces + (-1 - j)) return 1;
    /* If the step before was cut short, a disk inside an arc is still on the way up in its hop. */
    if (j < 0) haste = 2 * h * hastes(W.surfaces + (-1 - j), d) + 2 * W.step * pressed_inside(d, -1 - j);
    if (still) go_on_with(c, still, change, h);
    else if (place) describe_touch(c, i, j, place);
    else describe(c, i, j);
    if (place || still) haste += 2 * h * (whirl_of(d) + (j < 0 ? 0 : whirl_of(W.disks + j)));
    /* A face or pulley that a lone disk is about to slide onto may be further away. */
    int far = c->gap > TOUCH * least, cornered = place || still;
    if (far && (W.interact || j >= 0 || !d->supports)) return 1;
    later = c->free_gap = still ? c->free_gap : place ? place->later : gap_later(c, h, 0);
    c->bend = c->stalls = 0;
    if (far && later > 0) return 1;
    relative(c, 0, u);
    /* An impact has just lifted it off: it is in flight. */
    if (!W.interact && !W.tracks[i].lasted && flies_off(d, -1 - j, u[0])) return 1;
    /* A contact with an overlap counts however it moves. Else it would be pressed deeper when other overlaps are removed, or
       be struck in each step. */
    double cohesion = cohesion_of(i, j);
    const Contact *last = place ? place_before(c) : still;
    for (int k = cornered ? -1 : d->before; k >= 0; k = W.earlier[k].next)
        if (goes_on(W.earlier[k].j, j)) last = W.earlier + k;
    /* N s; impulse of cohesion since the step before; for a new contact since the latest impact or release. */
    double parts = MAX(W.soft + haste, soft_approach(d, least)), since = d->since;
    if (j >= 0) since = MAX(since, W.disks[j].since);
    double past = last ? 0.5 * W.length_before : MIN(MAX(W.t - since, 0), W.length_before), held = cohesion * past;
    if (cohesion > 0) parts = last ? INFINITY : MAX(parts, held / c->mass[0]);
    /* A halved contact has no hop to fall back from. */
    if (last && last->halved) parts = MAX(parts, LEFT_BY_TURNS * W.pace);
    if (c->gap > -SUNK * least && (-u[0] > bound || u[0] > parts)) return 1;
    /* Cohesion keeps a gap from opening; it never closes one. */
    double closed = MIN(c->gap, cohesion > 0 ? MAX(later, 0) : 0), aim = ask(c, closed, later, least, h);
    if (place && j < 0) {
        if (last && last->turns > 0) go_on_bending(c, last, h);
        lean_first(c, h);
        relative(c, 0, u);
    }
    c->drift = 0.5 * h * c->pull;
    if (cornered && W.g == 0) {
        /* Without weight no hop is larger than the fall before it, or than an arc makes it: nothing would supply the
           energy. */
        c->need = MIN(c->need, c->parts + MAX(-2 * u[0], c->turns * h));
        c->drift = MIN(MAX(c->drift, -fabs(u[1])), fabs(u[1]));
    }
    c->impulse[0] = c->impulse[1] = c->impulse[2] = 0;
    for (int n = 0; n < 3 && last; n++) c->impulse[n] = W.again * last->impulse[n];
    for (int n = 0; n < 2; n++) c->mean[n] = last ? last->mean[n] : NAN;
    c->frozen = find_frozen(c);
    if (c->frozen && !last) start_from_frozen(c, 0.5 * (W.length_before + h));
    int was_pressed = c->impulse[0] > 0 || is_held(d, -1 - j);
    /* A disk that was pressed comes down from its last hop. It may leave along the surface, not into it, and until it
       reaches the end of the face it hops. Beyond, the end presses it only if it is slow enough. */
    double floor = -u[0], until = j < 0 && !cornered ? time_on_face(c) : INFINITY, least_need = floor;
    if (until < h) {
        const Surface *s = surface_at(-1 - j, d->t);
        double press = press_on(d, s, c->nx, c->ny), v[3];
        carried(s, d->x, d->y, v);
        double along = (d->vx - v[0]) * c->ny - (d->vy - v[1]) * c->nx;
        floor += 0.5 * until * MAX(press, 0);
        least_need = press > along * along / d->radius ? floor : -u[0] + until * MAX(press, 0);
    } else least_need = floor;
    int gone = j < 0 && W.surfaces[-1 - j].there == LEAVING, ends = until < h || gone;
    if (gone && !was_pressed) return 1;
    if (!gone) c->clings = held + 0.5 * cohesion * h;
    if (gone) c->need = -INFINITY;
    /* If the load becomes 0 within the step, there is no approach to stop, and friction acts only until then, not to the
       middle of the step. */
    const Track *track = W.tracks + i;
    double wears = W.interact || ends ? INFINITY : time_unloaded(track->load, track->load_t) - W.t;
    /* In a corner the other surface may press it onto this one. */
    int alone = d->supports <= 1 || gone;
    /* It leaves if the surface moves away faster than it falls. Above an open gap it only falls: it is not stopped there. */
    double opens = c->need + MAX(c->gap, 0) / h;
    c->leaves = was_pressed && !cornered && cohesion == 0 && alone && wears > 3 * h && c->gap <= LEAVE * least && opens < least_need;
    if (c->leaves || gone) {
        c->gives = c->parts = 0;
        c->most = INFINITY;
    }
    if (c->leaves) {
        c->need = floor;
        c->drift = (until < h ? until : 0) * c->pull;
    } else if (gone) c->impulse[0] = c->impulse[1] = c->impulse[2] = 0;
    else if (was_pressed && wears < h) c->drift = MAX(wears, -0.5 * W.length_before) * c->pull;
    if (last && !W.interact && !alone && !c->leaves) go_on_bending(c, last, h);
    if (j < 0 && W.interact && !cornered && !gone && !c->leaves) {
        follow(c, last ? W.length_before : 0, chord(c, aim - closed, h));
        if (c->turns > 0) c->need = closes(c, aim, h);
    }
    W.contact_count++;
    return 1;
}

/* Put a disk where it is when its contact point reaches the end of the face that it slides along. A straight path would
   lead into the inside of an arc, and far away from its outside. */
static void at_the_end(const Contact *c, Disk *d) {
    const Surface *s = surface_at(-1 - c->j, d->t);
    double nx = c->nx, ny = c->ny, v[3];
    carried(s, d->x, d->y, v);
    double along = (d->vx - v[0]) * ny - (d->vy - v[1]) * nx;
    double way = s->shape == SEGMENT ? ny * s->tx - nx * s->ty : nx * (d->x - s->x) + ny * (d->y - s->y);
    int last = s->shape == SEGMENT ? along * way > 0 : along * way < 0;
    const double *end = s->end + 2 * last;
    if (s->shape == ARC) {
        double side = way > 0 ? 1 / s->radius : -1 / s->radius;
        nx = side * (end[0] - s->x);
        ny = side * (end[1] - s->y);
    }
    d->x = end[0] + d->radius * nx;
    d->y = end[1] + d->radius * ny;
    d->vx = v[0] + along * ny;
    d->vy = v[1] - along * nx;
}

/* A disk that leaves all surfaces in this step over the end of a face is supported up to that end: it gets the impulse of
   its weight until then. */
static void carry_to_end(int i, int first, double h) {
    const Disk *d = W.disks + i;
    Contact *last = 0;
    double until = 0, nx, ny;
    for (int n = first; n < W.contact_count; n++) {
        Contact *c = W.contacts + n;
        double t = c->leaves ? time_on_face(c) : INFINITY;
        if (t < h && t >= until) {
            last = c;
            until = t;
        }
    }
    if (!last) return;
    /* From the end on it falls. If it would fall into another surface within a step, that one supports it. */
    Disk then = *d;
    at_the_end(last, &then);
    advance(&then, then.t + h);
    const int *list;
    int count = surfaces_near(i, &list);
    for (int n = 0; n < count; n++) {
        const Surface *s = surface_at(list[n], d->t + h);
        if (is_near(s, d) && gap_to(s, then.x, then.y, d->radius, &nx, &ny)
                < MIN(0, gap_to(surface_at(list[n], d->t), d->x, d->y, d->radius, &nx, &ny)))
            return;
    }
    double press = press_on(d, surface_at(-1 - last->j, d->t), last->nx, last->ny);
    last->need += 0.5 * MAX(press, 0) * until;
}

/* The places at which a particle with corners touches something: looked up now, or those of the step before. */
typedef struct {
    Touch now[MOST_TOUCHES];
    const Contact *still[MOST_TOUCHES];
    double changes[MOST_TOUCHES];
    int count, are_still;
} Places;

/* Add a contact at each place. */
static RARELY int add_places(int i, int j, double bound, double h, const Places *at) {
    double least = inner_of(i, j);
    for (int n = 0; n < at->count; n++) {
        int added = at->are_still ? add(i, j, least, bound, h, 0, at->still[n], at->changes[n])
                                  : add(i, j, least, bound, h, at->now + n, 0, 0);
        if (!added) return 0;
    }
    return 1;
}

/* List the places for a step of length h; return how many. */
static int list_places(int i, int j, double h, Places *at) {
    at->count = at->are_still = list_still(i, j, h, at->still, at->changes);
    if (!at->count) at->count = list_touches(i, j, W.t, TOUCH * inner_of(i, j), W.t + h, at->now);
    return at->count;
}

/* Whether one of two moves too fast on the other, a sleeper, to rest on it: its velocity, without its last hop, is more than
   gravity gives in a step. */
static int stirs_sleeper(const Disk *a, const Disk *b) {
    const Disk *d = a->mode == ASLEEP ? b : a, *sleeper = d == a ? b : a;
    double x = d->vx - sleeper->ux - 0.5 * W.gx * W.length, y = d->vy - sleeper->uy - 0.5 * W.gy * W.length;
    return d->mode == FREE && square(x) + square(y) > square(0.5 * W.soft);
}

/* Whether a disk, whose contacts begin at `first`, would leave a surface on which another one presses it in this step. */
static int is_wedged(int first) {
    for (const Contact *c = W.contacts + first; c < W.contacts + W.contact_count; c++)
        for (const Contact *o = W.contacts + first; o < W.contacts + W.contact_count && c->leaves; o++)
            if (c->nx * o->nx + c->ny * o->ny < 0) return 1;
    return 0;
}

/* List the contacts of the step and wake the sleepers among them. Return 0 if there is no room. */
int find_contacts(double h, int *woke) {
    Places places;
    int few = are_few(W.earlier_count);
    W.contact_count = 0;
    *woke = 0;
    for (int n = 0; n < W.near_count; n++) {
        int i = W.near[2 * n], j = W.near[2 * n + 1];
        if (sleeps(i) && sleeps(j)) {
            /* A belt carries one of them to the other. */
            wake(i, W.t);
            if (sleeps(j)) wake(j, W.t);
            *woke = 1;
            continue;
        }
        int cornered = is_cornered(i, j);
        int both = cornered && W.disks[i].corners && W.disks[j].corners;
        if (cornered && (both ? W.disks[i].mode != FREE : !W.disks[i].corners)) { int k = i; i = j; j = k; }
        Disk *a = W.disks + i, *b = W.disks + j;
        double least = MIN(a->radius, b->radius), reach = a->radius + b->radius + TOUCH * least;
        if (square(a->x - b->x) + square(a->y - b->y) > reach * reach) continue;
        if (cornered && !list_places(i, j, h, &places)) continue;
        /* Slow approaches that the step before has left become contacts here. */
        int impacts = MAX(a->impacts, b->impacts);
        double bound = impacts > CROWDED ? INFINITY : left_over(a, impacts, -1, least, 0, W.t);
        if (cornered) bound = MAX(bound, left_over(b, impacts, -1, least, 0, W.t));
        if (a->supports || b->supports || a->mode != FREE || b->mode != FREE)
            bound = MAX(bound, cornered ? (few ? 1 : LATEST) * W.soft : MAX(W.soft, W.skip * least));
        int together = (cornered && (!both || few)) || is_tied(i) || is_tied(j);
        if ((a->mode == ASLEEP || b->mode == ASLEEP) && (together || stirs_sleeper(a, b))) {
            wake(a->mode == ASLEEP ? i : j, W.t);
            *woke = 1;
        }
        if (a->mode != FREE && !cornered) { int k = i; i = j; j = k; }
        if (cornered ? !add_places(i, j, bound, h, &places) : !add(i, j, least, bound, h, 0, 0, 0)) return 0;
    }
    if (*woke) return 1;
    for (EACH_LIVE(i)) {
        Disk *d = W.disks + i;
        if (d->mode != FREE) continue;
        int first = W.contact_count;
        double bound = d->impacts > CROWDED ? INFINITY : left_over(d, d->impacts, -1, d->radius, 0, W.t);
        if (d->supports) bound = MAX(bound, W.interact && !has_corners(d) ? MAX(W.soft, W.skip * d->radius) : W.soft);
        const int *list;
        int count = surfaces_near(i, &list);
        for (int n = 0; n < count; n++) {
            int k = list[n];
            if (!is_near(W.surfaces + k, d)) continue;
            double inside = pressed_inside(d, k), most = MAX(bound, inside ? W.soft + 2 * h * inside : 0);
            if (d->supports && W.stirs) most += 2 * h * hastes(surface_at(k, d->t), d);
            if (has_corners(d)) most = MAX(most, left_over(d, d->impacts, k, d->radius, 0, W.t));
            if (has_corners(d)) list_places(i, -1 - k, h, &places);
            if (has_corners(d) ? !add_places(i, -1 - k, most, h, &places) : !add(i, -1 - k, d->radius, most, h, 0, 0, 0)) return 0;
        }
        if (d->supports == 1 && is_wedged(first)) {
            /* Its contacts are listed again, as those of a disk that lies on two. */
            d->supports = 2;
            W.contact_count = first;
            at_i--;
            continue;
        }
        if (W.contact_count > first && !has_corners(d)) carry_to_end(i, first, h);
        for (Contact *c = W.contacts + first; W.interact && c < W.contacts + W.contact_count; c++) {
            if (!c->leaves) continue;
            double speed = sqrt(d->vx * d->vx + d->vy * d->vy), rate = d->vx * c->nx + d->vy * c->ny;
            c->need /= follow(c, W.length_before, speed > 0 ? (rate + c->need) / speed : 0);
        }
    }
    return 1;
}
