/* The exact engine: particles that meet no other, one after the other, from event to event.

   Flight, sliding on a face and riding on the belt have constant acceleration. A ride round the pulley by adhesion has a
   closed form; one with friction is computed in steps along the circle. */

#include "exact.h"
#include "memory.h"

/* Share of a particle's age that an event must take to count as progress. */
#define ROUNDING (4.0 * ULP)
/* Effective mass over m at the rim of a free disk, with I = m r2/2: an impulse changes the velocity of the contact point
   3 times as much as for a particle that does not rotate. */
#define DISK_SHARE (1.0 / 3.0)
/* Greatest number of knots and events that a round writes. */
#define ROUND_KNOTS 400
#define ROUND_EVENTS 32
/* Each way to move has a stack frame of its own: within one function that has all of them, the compiler keeps fewer numbers
   in registers. */
#define APART __attribute__((noinline))
/* Number of knots for which room is made at first in a family, of which a few particles run at a time. */
#define BRIEFLY 2000

Exact E;
Particle A;
int course;

static int member_of(int lone) { return E.each ? lone / E.each : 0; }

EXPORT Exact *exact(void) { return &E; }

/* Count consecutive events that take no time. */
static void count_idle(double dt) {
    A.idle = dt > ROUNDING * A.age ? 0 : A.idle + 1;
    if (A.idle > MOST_IDLE) course = NO_PROGRESS;
}

static Motion motion_of(double ax, double ay) {
    return (Motion){ A.x, A.y, A.vx, A.vy, ax, ay };
}

/* Move the particle for a time dt. */
static void move(const Motion *m, double dt) {
    double half = 0.5 * dt;
    A.age += dt;
    A.x = m->x + dt * (m->vx + half * m->ax), A.y = m->y + dt * (m->vy + half * m->ay);
    A.vx = m->vx + dt * m->ax, A.vy = m->vy + dt * m->ay;
}

/* Time until a gap closes, 0 if it is closed; infinite if that never happens. */
static double when(double gap, double rate, double acceleration) {
    double time = descent(MAX(gap, 0.0), rate, acceleration);
    return isnan(time) ? INFINITY : time;
}

static void stop_now(void) {
    A.age = A.given->stop;
    end_track(TIME_IS_OVER);
}

/* Let the particle leave a surface that vanishes under it now. */
static void drop(void) {
    part_from(O.all[A.on].surface);
    let_go(NONE, 0, 0, NONE);
}

/* Whether the way of a particle that hops is so short since a knot that a cubic along a circle would be accurate. */
static int is_near(const Knot *k) {
    const Obstacle *o = O.all + A.left;
    return o->met == FACE || 2.0 * length_of(A.x - k->x, A.y - k->y) < step_angle() * fabs(o->rho);
}

APART static void fly(void) {
    const double *box = A.given->exit_box, *up = A.given->up;
    Motion m = motion_of(0.0, -A.given->gravity);
    int again = A.hopped == A.rounds - 1;
    if (!again) A.free = 0.0;
    double stops = A.given->stop - A.age, leaves = INFINITY, time = hop(&m, stops);
    if (time < stops) {
        A.hopped = A.rounds;
        count_idle(time);
        move(&m, time);
        tell_here();
        /* Of small hops in a row a family keeps the knots of the last one. */
        if (E.brief && again && is_near(E.knots + E.knot_count - 3)) E.knot_count -= 2;
        write_knot();
        strike(A.left, A.left_side);
        return;
    }
    for (int n = 0; n < 2; n++) {
        double right = n ? -up[0] : up[1], above = up[n], pull = above * m.ay;
        double place = right * A.x + above * A.y, speed = right * A.vx + above * A.vy;
        leaves = MIN(leaves, MIN(when(place - box[n], speed, pull), when(box[2 + n] - place, -speed, -pull)));
    }
    double dt = MIN(leaves, stops);
    int obstacle, side, hits = first_contact(&m, &dt, &obstacle, &side);
    count_idle(dt);
    move(&m, dt);
    tell_here();
    write_knot();
    if (hits) strike(obstacle, side);
    else if (leaves <= stops) {
        record_event(EXIT, NONE);
        end_track(HAS_LEFT);
    } else
        stop_now();
}

static void put_round(double rho, double up, double across, double pace, double x, double y) {
    A.x = x + rho * up, A.y = y + rho * across;
    A.vx = pace * across, A.vy = -pace * up;
}

/* Carry the particle by adhesion round the pulley, from an angle to cos phi1 = v2/(g rho). */
APART static void carry_round(double start, double pace) {
    const Obstacle *pulley = O.all + O.pulley;
    Bound found[2];
    double up, across, g = A.given->gravity, stop = next_change(), left = stop - A.age, end = start;
    int struck = 0, cut = 0;
    sin_cos(start, &up, &across);
    double rho = A.x * up + A.y * across;
    A.x = rho * up, A.y = rho * across;
    double level = MIN(pace * pace / (g * rho), 1.0);
    if (level < across) {
        Obstacle own = *pulley;
        end = angle_of_cosine(level);
        /* A particle high in the bed rides further out than one on the pulley itself. */
        O.all[O.pulley].rho = rho;
        find_bounds(O.pulley, 1, start, epoch_now(), found);
        O.all[O.pulley] = own;
        struck = !found[1].handover && found[1].angle < end;
        if (struck) end = found[1].angle;
        cut = (end - start) * rho / pace > left;
        if (cut) end = start + left * pace / rho;
        double begin = A.age, above = rho * across, way = end - start, parts = ceil(way / step_angle());
        for (int n = 1; n <= parts; n++) {
            double turn = way * (n / parts);
            sin_cos(start + turn, &up, &across);
            put_round(rho, up, across, pace, 0.0, 0.0);
            A.age = begin + rho * turn / pace;
            /* The belt lifts the particle, or lets it down: F v = -m g v sin phi, since the last knot. */
            double height = rho * cosine(start + turn);
            record_entries(pulley->surface, -A.given->mass * g * (above - height), 0.0, 0.0);
            above = height;
            bear_round(pulley->surface, 0.0, 0.0, rho, rho - pulley->bend);
            write_knot_of(n < parts);
        }
        if (cut) A.age = stop;
    }
    /* Where a gate changes, the ride continues after another check of what is in the way. */
    if (A.age >= A.given->stop) end_track(TIME_IS_OVER);
    else if (cut) return;
    else if (struck) strike(found[1].obstacle, found[1].side);
    else {
        part_from(0);
        let_go(O.pulley, 0, end > start ? 3 : 2, NONE);
    }
}

/* Move the particle along the belt to the pulley, or to what is in the way. */
APART static void carry(void) {
    double up, across, incline = E.wheels[member_of(E.lone)].incline;
    sin_cos(incline, &up, &across);
    /* It was on the pulley already when a gate changed. */
    if (O.change_count && A.x * across + A.y * up > O.touch) {
        carry_round(angle_of(A.x, A.y), length_of(A.vx, A.vy));
        return;
    }
    Motion m = motion_of(0.0, 0.0);
    double pace = A.vx * across + A.vy * up, ends = -(A.x * across + A.y * up) / pace;
    double stops = A.given->stop - A.age, height = A.y;
    if (!(pace > 0.0)) ends = INFINITY;
    double dt = MIN(ends, stops);
    int obstacle, side, hits = first_contact(&m, &dt, &obstacle, &side);
    count_idle(dt);
    move(&m, dt);
    if (incline != 0.0) record_entries(O.all[0].surface, A.given->mass * A.given->gravity * (A.y - height), 0.0, 0.0);
    bear_since(O.all[0].surface, -up, across, A.y * across - A.x * up - E.wheels[member_of(E.lone)].radius);
    write_knot();
    if (hits) strike(obstacle, side);
    else if (stops < ends) stop_now();
    else carry_round(incline == 0.0 ? 0.0 : angle_of(-up, across), pace);
}

/* Move the particle by one step of a ride, or to the next event, and resolve that. */
APART static void ride(void) {
    int circle = A.on;
    const Obstacle *o = O.all + circle;
    Touch c = touch_now();
    double rho = o->rho, mass = A.given->mass, phi = angle_of(c.nx, c.ny), stop = next_change();
    double turn = surface_spin(circle), center_x = A.x - rho * c.nx, center_y = A.y - rho * c.ny;
    int rolls = A.turns && A.given->rolling > 0.0;
    if (!is_pressed(&c)) {
        count_idle(0.0);
        part_from(c.surface);
        let_go(circle, 0, 2, NONE);
        return;
    }
    /* The angle goes on beyond a full turn. */
    phi += TURN * rint((A.angle - phi) / TURN);
    Circle state = { phi, along(&c), A.z, rho, A.given->gravity, c.friction, c.belt, A.slip, A.share,
                     A.bounds[0].angle, A.bounds[1].angle, rolls ? A.given->rolling : 0.0, A.roll, turn };
    Ridden end, knots[MOST_KNOTS];
    int count = advance_ride(&state, stop - A.age, &end, knots);
    double age = A.age, before[3];
    count_idle(end.dt);
    for (int k = 0; k < 3; k++) before[k] = A.entries[k];
    for (int n = 0; n <= count; n++) {
        const Ridden *r = n < count ? knots + n : &end;
        double work = mass * (r->work * c.belt + (rolls ? r->twist * turn : 0.0)), heat = mass * r->heat;
        A.age = age + r->dt;
        put_round(rho, r->up, r->across, r->w, center_x, center_y);
        A.z = r->z;
        if (n == count) record_entries(c.surface, work, 0.0, heat);
        else A.entries[0] = before[0] + work, A.entries[2] = before[2] + heat;
        bear_round(c.surface, center_x, center_y, rho, A.given->radius);
        write_knot_of((n < count || (end.outcome == NOTHING && A.age < stop)) + 2 * r->round);
        for (int k = 0; k < 3 && n < count; k++) A.entries[k] = before[k];
    }
    A.angle = end.phi;
    const Bound *there = A.bounds + (end.outcome == HIGH);
    double tends = end.up;
    switch (end.outcome) {
    case NOTHING:
        if (A.age >= A.given->stop) end_track(TIME_IS_OVER);
        else if (O.change_count && A.age >= stop) {
            A.age = stop;
            if (is_there(circle, epoch_now())) look_round();
            else drop();
        }
        break;
    case LIFT:
        part_from(c.surface);
        let_go(circle, 0, 3, NONE);
        break;
    case ROLL: A.roll = -sign_of(end.up); break;
    case HALT: end_roll(); break;
    case ONSET:
        if (rolls) {
            double load = A.given->gravity * end.across - end.w * end.w / rho;
            tends = A.given->gravity * tends - A.lever * A.roll * A.given->rolling * load;
        }
        A.slip = sign_of(tends);
        record_event(SLIP, c.surface);
        break;
    case GRIP: end_slip(); break;
    default:
        if (there->handover) pass_on(there->obstacle, there->side, there->joint);
        else strike(there->obstacle, there->side);
    }
}

/* Continue at the end of a face: on the next segment, round the end, or in flight. */
APART static void leave_face(void) {
    const Obstacle *o = O.all + A.on;
    double foot = (A.x - o->x) * o->tx + (A.y - o->y) * o->ty;
    int tip = 2 * A.on + (foot > 0.5 * o->length), face = A.side < 0;
    Onward to = O.onward[2 * (epoch_now() * O.tip_count + tip) + face];
    if (to.meets) strike(to.obstacle, to.side);
    else pass_on(to.obstacle, to.side, O.tips[tip].sets[face]);
}

/* Move the particle on a face to its next event, and resolve that. */
APART static void slide(void) {
    Touch c = touch_now();
    const Obstacle *o = O.all + A.on;
    double force, couple, pull = face_force(&c, &force, &couple), mass = A.given->mass;
    int rolls = A.turns && A.given->rolling > 0.0;
    Motion m = motion_of(pull * c.tx, pull * c.ty);
    /* As long as there is slip, it is linear in time. */
    double slip = along(&c) + A.z - c.belt, twist = A.lever * (force + couple);
    double rate = (m.ax * c.tx + m.ay * c.ty) + twist, spin = A.z;
    double grips = A.slip * rate < 0.0 ? MAX(-slip / rate, 0.0) : INFINITY;
    double halts = rolls && A.roll * twist < 0.0 ? MAX(-spin / twist, 0.0) : INFINITY;
    double foot = (A.x - o->x) * o->tx + (A.y - o->y) * o->ty;
    double pace = A.vx * o->tx + A.vy * o->ty, push = m.ax * o->tx + m.ay * o->ty;
    double ends = MIN(when(foot, pace, push), when(o->length - foot, -pace, -push));
    /* If the surface vanishes, that counts as a stop. */
    double stop = MIN(A.given->stop, vanishes(A.on)), stops = MAX(stop - A.age, 0.0);
    double soonest = MIN(MIN(grips, halts), MIN(ends, stops)), dt = soonest;
    int obstacle, side, hits = first_contact(&m, &dt, &obstacle, &side);
    count_idle(dt);
    double mean = A.slip == 0.0 ? 0.0 : slip + 0.5 * rate * dt, heat = -mass * force * mean * dt;
    if (rolls) heat -= mass * couple * (spin + 0.5 * twist * dt) * dt;
    record_entries(c.surface, mass * force * c.belt * dt, 0.0, heat);
    move(&m, dt);
    snap(A.on, A.side);
    A.z += twist * dt;
    /* What it left at the beginning is some distance away now. */
    if (dt > 0.0) A.left = NONE;
    bear_at(&c);
    write_knot();
    if (hits) strike(obstacle, side);
    else if (rolls && halts <= soonest) end_roll();
    else if (stops < grips && stops < ends) {
        if (stop < A.given->stop) {
            A.age = MAX(A.age, stop);
            drop();
        } else
            stop_now();
    } else if (ends < grips) leave_face();
    else end_slip();
}

/* Start a particle; if it would start after the end of the run, it is over at once. */
APART static void begin(void) {
    const Lone *p = E.lones + E.lone;
    double inertia = p->inertia, arm = p->mass * p->radius * p->radius;
    A = (Particle){ .given = p, .x = p->position[0], .y = p->position[1], .vx = p->velocity[0],
                    .vy = p->velocity[1], .z = p->omega * p->radius, .share = 1.0,
                    .way = p->carried ? RIDES_BELT : FLIES, .on = NONE, .slip = 1.0, .left = NONE, .joint = NONE };
    A.turns = inertia > 0.0;
    if (A.turns) A.share = inertia / (inertia + arm);
    /* For a disk it must not depend on the rounding of its I. */
    if (fabs(A.share - DISK_SHARE) < 1e-15) A.share = DISK_SHARE;
    A.lever = 1.0 / A.share - 1.0;
    fit_obstacles();
    A.point = p->radius <= O.touch;
    tell_here();
    if (!(p->stop > 0.0)) {
        end_track(TIME_IS_OVER);
        return;
    }
    write_knot();
    record_event(RELEASE, NONE);
    if (E.until == UNTIL_SETTLED && p->carried && E.wheels[member_of(E.lone)].speed == 0.0) {
        record_event(SETTLE, O.all[O.pulley].surface);
        end_track(HAS_SETTLED);
    }
}

/* Move the particle to its next event. */
static void proceed(void) {
    if (A.way == OVER) return;
    if (A.rounds >= E.most) course = TOO_LONG;
    else if (A.rounds && A.rounds % E.window == 0) {
        E.passed = A.age - A.then;
        if (E.passed < E.window * E.tick / A.given->pace) course = DRIVEN;
        A.then = A.age;
    }
    if (course != FINISHED) return;
    A.rounds++;
    switch (A.way) {
    case FLIES: fly(); break;
    case RIDES_BELT: carry(); break;
    case ON_FACE: slide(); break;
    default: ride();
    }
}

/* Reserve the arrays that the host fills in, and those of the results. */
EXPORT int lay_out_exact(void) {
    /* Room that is not used costs nothing, and a lack of it a copy of all knots. */
    double members = E.each ? E.lone_count / E.each : 1, many = MIN(30.0 * E.lone_count, KEPT);
    RESERVE(E.segments, members * E.segment_count);
    RESERVE(E.arcs, members * E.arc_count);
    RESERVE(E.wheels, members * E.wheel_count);
    RESERVE(E.materials, (double)E.kind_count * (E.segment_count + E.arc_count + E.wheel_count));
    RESERVE(E.lones, E.lone_count);
    RESERVE(E.books, 3.0 * E.surface_count * (E.apart ? E.lone_count : 1));
    E.room_size = 100 * (E.segment_count + E.arc_count) + 200;
    E.knot_room = E.brief ? BRIEFLY : (int)many + 500;
    E.event_room = E.brief ? 15 * E.lone_count + ROUND_EVENTS : (int)many + 100;
    RESERVE(E.room, E.room_size);
    lay_out_shared();
    E.knots = set_apart(E.knot_room, sizeof *E.knots);
    E.events = set_apart(E.event_room, sizeof *E.events);
    return has_room();
}

/* Run the particles before `end` for at most so many rounds, which are counted down; return why it stopped, see `enum
   Course`. */
int follow_some(int end, int *rounds) {
    if (B.every > 0.0 && !B.bins && !lay_out_bins(E.surface_count)) return NO_MEMORY;
    for (; E.lone < end; E.lone++, E.begun = 0) {
        int member = member_of(E.lone);
        if (E.laid != member + 1) {
            while (!lay_obstacles(member)) {
                E.room_size *= 2;
                if (!RESERVE(E.room, E.room_size)) return NO_MEMORY;
            }
            E.laid = member + 1;
        }
        do {
            if (E.knot_room - E.knot_count < ROUND_KNOTS) {
                if (E.knot_room > KEPT) return FILLED;
                if (!STRETCH(E.knots, E.knot_count, E.knot_room)) return NO_MEMORY;
            }
            if (E.event_room - E.event_count < ROUND_EVENTS) {
                if (E.event_room > (E.brief ? BRIEF_KEPT : KEPT)) return FILLED;
                if (!STRETCH(E.events, E.event_count, E.event_room)) return NO_MEMORY;
            }
            if (!(*rounds)--) return PAUSING;
            course = FINISHED;
            if (E.begun) proceed();
            else if (!take_shared()) begin();
            E.begun = 1;
            if (course != FINISHED) {
                E.t = A.given->release + A.age, E.x = A.x, E.y = A.y;
                end_track(TIME_IS_OVER);
                return course;
            }
        } while (A.way != OVER);
        E.rounds = MAX(E.rounds, A.rounds);
    }
    return FINISHED;
}
