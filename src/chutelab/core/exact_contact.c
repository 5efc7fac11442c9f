/* A contact of the exact engine: its properties, and what it does to the particle.

   An impact follows Newton's restitution with Coulomb friction. Afterwards the particle flies, slides, grips, rolls, or
   rests in a corner. */

#include "exact.h"

/* Number of consecutive contacts without time after which a particle counts as at rest in a corner. An elastic particle
   leaves a wedge of angle beta after pi/beta contacts. */
#define COLLAPSE (MOST_IDLE / 2)
/* Restitution from which on they do not count as rest: 40 impacts then take half of the normal velocity. */
#define LASTING 0.9914
/* Share of the speeds involved; a smaller slip is rounding. */
#define NO_SLIP 1e-13
/* Share of the weight; a smaller pull away from a surface is rounding. */
#define WEIGHTLESS 1e-9
/* m/s times `Lone.pace`, like the two that follow; a slower approach is no impact. */
#define NEGLIGIBLE 1e-12
/* A rebound this slow is summed with all that would follow: u_n (1 + e)/(1 - e) of normal impulse per mass in the time 2
   u_n/(g_n (1 - e)). At e = 0.999 some 20,000 bounces come before. At e = 1 such a rebound, 1e-19 m high, counts as rest. */
#define REST 1e-9
/* s times `Lone.pace`, and rad: where a family keeps no more impacts on a circle, it leaves out the last ones, if all of them
   take no longer. */
#define SHORTLY 1e-6
#define HARDLY_TURNED 1e-5
/* A particle this slow that goes to and fro between two obstacles is coming to rest there. */
#define CRAWL (1000.0 * REST)
/* Sine of the angle at which two surfaces must meet to hold a particle between them. */
#define OPPOSED 1e-9
/* Greatest number of rounds for friction and rolling friction of an impact: each changes what the other has to stop, by
   5/7 at most. */
#define SHARES 100

/* Its properties. */

int epoch_now(void) { return epoch_at(A.age); }

/* Age at which the next gate changes, or the run ends. */
double next_change(void) {
    int epoch = epoch_now();
    double stop = A.given->stop;
    return epoch < O.change_count ? MIN(stop, O.changes[epoch] - A.given->release) : stop;
}

double vanishes(int obstacle) { return O.all[obstacle].went - A.given->release; }

static void normal_at(const Obstacle *o, int side, double *nx, double *ny) {
    if (o->met == FACE) {
        *nx = side * o->nx, *ny = side * o->ny;
        return;
    }
    double x = A.x - o->x, y = A.y - o->y, distance = copysign(length_of(x, y), o->rho);
    *nx = x / distance, *ny = y / distance;
}

/* The half of a circle that a normal points to: 1, or -1 away from the crown; inside an arc it is -1. Round the end of a
   segment with speed v the surface moves with v or -v along (n_y, -n_x), which on both its faces is v along the segment. */
static int rim_side(const Obstacle *o, double nx, double ny) {
    const double none[2] = { 0.0, 0.0 }, *crown = o->met == END ? crown_of(o, epoch_now()) : none;
    int half = nx * crown[0] + ny * crown[1] >= 0.0 ? 1 : -1;
    return o->rho < 0.0 ? -half : half;
}

/* The contact with an obstacle at the particle's present place. If the side of a circle is 0, it is found from that
   place. */
static Touch touch_of(int obstacle, int side) {
    const Obstacle *o = O.all + obstacle;
    if (o->met == END && O.change_count && O.owned_in != epoch_now()) own_ends(epoch_now());
    int columns = E.segment_count + E.arc_count + (E.wheel_count > 0);
    const Pair *pair = E.materials + A.given->kind * columns + o->source;
    Touch c;
    normal_at(o, side, &c.nx, &c.ny);
    c.tx = c.ny, c.ty = -c.nx;
    if (!side) side = rim_side(o, c.nx, c.ny);
    c.belt = side * o->speed, c.friction = pair->friction, c.restitution = pair->restitution, c.falls = pair->falls;
    c.surface = o->surface, c.obstacle = obstacle;
    return c;
}

Touch touch_now(void) { return touch_of(A.on, A.side); }

double along(const Touch *c) { return A.vx * c->tx + A.vy * c->ty; }
static double weight_on(const Touch *c) { return A.given->gravity * c->ny; }
static double weight_along(const Touch *c) { return A.given->gravity * c->nx; }

static void go_along(const Touch *c, double pace) { A.vx = pace * c->tx, A.vy = pace * c->ty; }

/* Slip of the contact point on the surface at a speed along it, m/s; exactly 0 if it is rounding. */
static double slip_of(const Touch *c, double pace) {
    double slip = pace + A.z - c->belt;
    return fabs(slip) <= NO_SLIP * (fabs(pace) + fabs(c->belt) + fabs(A.z)) ? 0.0 : slip;
}

/* Make a vanished slip exactly zero: change the spin, or if it doesn't rotate the speed. Return the speed. */
static double stop_slip(double belt, double pace) {
    if (!A.turns) return belt;
    A.z = belt - pace;
    return pace;
}

/* r times the angular velocity of a surface, m/s. */
double surface_spin(int obstacle) {
    const Obstacle *o = O.all + obstacle;
    return A.given->radius * (o->met == WHEEL ? -o->speed / o->bend : o->turning);
}

/* Greatest friction; infinite if the coefficient is, even without a normal force. */
static double grip_limit(double friction, double normal) {
    return isinf(friction) ? INFINITY : friction * normal;
}

static double limited(double value, double most) { return MIN(MAX(value, -most), most); }

/* Move the particle exactly to contact distance, so that rounding does not add up. */
void snap(int obstacle, int side) {
    const Obstacle *o = O.all + obstacle;
    if (o->met == FACE) {
        double nx = side * o->nx, ny = side * o->ny;
        double off = (A.x - o->x) * nx + (A.y - o->y) * ny - A.given->radius;
        A.x -= off * nx, A.y -= off * ny;
    } else {
        double x = A.x - o->x, y = A.y - o->y, ratio = fabs(o->rho) / length_of(x, y);
        A.x = o->x + ratio * x, A.y = o->y + ratio * y;
    }
}

/* Normal force per mass that would keep the particle on an obstacle, m/s2. */
static double load_on(const Touch *c) {
    const Obstacle *o = O.all + c->obstacle;
    return weight_on(c) - (o->met == FACE ? 0.0 : square(along(c)) / o->rho);
}

/* Whether an obstacle supports the particle: with a positive load, or one that is about to become positive. Where a path
   round a circle turns towards the weight, the hops of a particle shrink towards the point of zero load, and with
   rounding its load there is never above 0. */
int is_pressed(const Touch *c) {
    const Obstacle *o = O.all + c->obstacle;
    double load = load_on(c);
    if (load > 0.0) return 1;
    return o->met != FACE && load >= -WEIGHTLESS * A.given->gravity
        && along(c) * weight_along(c) / o->rho < 0.0;
}

/* Its effects. */

/* Change the spin by the tangential impulse that goes with a normal one (both per mass), and by rolling friction. Return
   the tangential impulse per mass; set the change of the slip, m/s, and the work and heat of rolling friction, J. */
static double rub(const Touch *c, double slip, double normal, double *change, double *work, double *heat) {
    double grip = grip_limit(c->friction, normal), push = limited(-A.share * slip, grip);
    *work = *heat = 0.0;
    if (!(A.given->rolling > 0.0 && A.turns)) {
        A.z += A.lever * push;
        *change = push / A.share;
        return push;
    }
    /* Friction stops the slip, up to mu J_n; rolling friction stops the spin, up to kappa J_n. */
    double turn = surface_spin(c->obstacle), spin = A.z - turn, most = A.given->rolling * normal, couple = 0.0;
    for (int n = 0; n < SHARES && most > 0.0; n++) {
        couple = limited(-spin / A.lever - push, most);
        double next = limited(-A.share * (slip + A.lever * couple), grip);
        if (next == push) break;
        push = next;
    }
    double gain = A.lever * (push + couple);
    A.z += gain;
    *change = push + gain;
    *work = A.given->mass * couple * turn;
    *heat = -0.5 * A.given->mass * couple * (2.0 * spin + gain);
    return push;
}

/* Whether the latest events are many impacts of the particle on a surface, of which a family does not keep more. */
static int is_one_of_many(int surface) {
    return E.brief && A.hits >= MANY_TOUCHES && surface == A.hit;
}

/* An impact: change the velocities, book the energies, write event and knot. */
static void resolve_impact(const Touch *c, double approach, double rebound, int lands) {
    double vx = A.vx, vy = A.vy, spin = A.turns ? A.z / A.given->radius : 0.0, mass = A.given->mass;
    double pace = along(c), slip = slip_of(c, pace), change, work, heat;
    double normal = (1.0 + c->restitution) * approach;
    double push = rub(c, slip, normal, &change, &work, &heat);
    /* The normal speed is set, not changed: it is e |v_n| to the last bit. */
    A.vx = rebound * c->nx + (pace + push) * c->tx;
    A.vy = rebound * c->ny + (pace + push) * c->ty;
    record_entries(c->surface, mass * push * c->belt + work,
         0.5 * mass * (approach - rebound) * (approach + rebound),
         -0.5 * mass * push * (slip + (slip + change)) + heat);
    bear_at(c);
    write_knot();
    if (!(approach > NEGLIGIBLE * A.given->pace || push != 0.0 || lands)) return;
    E.contacts++;
    if (is_one_of_many(c->surface)) return;
    record_event(lands ? LANDING : IMPACT, c->surface);
    Event *e = E.events + E.event_count - 1;
    e->before[0] = vx, e->before[1] = vy, e->before[2] = spin;
    e->normal = mass * normal, e->tangent = mass * push;
}

/* Choose between rotating and not, with rolling friction. `tends` is the acceleration of the slip, m/s2, `share` the part
   of it that friction must supply to hold it. Return whether the particle can be at rest. */
static int settle_roll(const Touch *c, double slip, double load, double grip, double *tends, double *share) {
    double most = A.given->rolling * load, pull = *tends;
    double spin = A.z - surface_spin(A.on);
    int turns = fabs(spin) > NO_SLIP * (fabs(A.z) + fabs(c->belt)), still = slip == 0.0;
    if (!turns) A.z -= spin;
    /* Without slip the pull must make it rotate, with slip friction does. */
    int holds = still ? fabs(pull) <= most && fabs(pull) <= grip : grip <= most;
    /* It begins to rotate in the direction of the force at the rim; it slides instead if friction is the weaker of the
       two. */
    int slides = still && grip <= most;
    A.roll = turns ? sign_of(spin) : holds || slides ? 0.0 : -sign_of(still ? pull : slip);
    if (A.roll == 0.0) {
        *share = 1.0;
        return 1;
    }
    *tends = pull - A.lever * A.roll * most;
    return 0;
}

/* Choose between gripping and slipping, and end tracks that have settled. Without slip, friction must hold against
   gravity: share |g_t| <= mu N. If it cannot, slip begins in the direction of gravity. */
static void settle(void) {
    Touch c = touch_now();
    double pace = along(&c), slip = slip_of(&c, pace);
    int arc = A.way == ON_ARC;
    if (isinf(c.friction) && slip != 0.0) {
        /* Infinite friction stops a slip even without a normal impulse. */
        resolve_impact(&c, 0.0, 0.0, 0);
        pace = along(&c), slip = slip_of(&c, pace);
    }
    int still = slip == 0.0;
    if (still) pace = stop_slip(c.belt, pace);
    go_along(&c, pace);
    double pull = weight_along(&c), load = load_on(&c), grip = grip_limit(c.friction, load);
    double tends = pull, share = A.share;
    int rests = !A.turns || pull == 0.0;
    if (A.turns && A.given->rolling > 0.0) rests = settle_roll(&c, slip, load, grip, &tends, &share);
    int grips = still && share * fabs(tends) <= grip, begins = grips && A.slip != 0.0;
    A.slip = grips ? 0.0 : still ? sign_of(tends) : sign_of(slip);
    if (begins) record_event(STICK, c.surface);
    if (E.until != UNTIL_SETTLED) return;
    /* A particle that rolls down a slope is not at rest. */
    int steady = grips && rests && !(arc && pace != 0.0);
    if (!steady || !(c.belt == 0.0 || c.surface == E.landing) || !isinf(vanishes(A.on))) return;
    record_event(SETTLE, c.surface);
    end_track(HAS_SETTLED);
}

/* Make a vanished spin exactly that of the surface, then see what follows. */
void end_roll(void) {
    Touch c = touch_now();
    A.z = surface_spin(A.on);
    if (A.slip == 0.0) go_along(&c, c.belt - A.z);
    settle();
}

/* Make a vanished slip exactly zero, then see whether friction holds. */
void end_slip(void) {
    Touch c = touch_now();
    double pace = stop_slip(c.belt, along(&c));
    if (!A.turns) go_along(&c, pace);
    settle();
}

/* Forces on a face, per mass: friction along the tangent and, over r, the moment of rolling friction. Return the
   acceleration along the tangent. */
double face_force(const Touch *c, double *force, double *couple) {
    double pull = weight_along(c), load = weight_on(c), tends = pull, share = A.share;
    int rolls = A.turns && A.given->rolling > 0.0, held = rolls && A.roll == 0.0, grips = A.slip == 0.0;
    *couple = rolls ? -A.roll * A.given->rolling * load : 0.0;
    if (rolls) tends += A.lever * *couple;
    if (held) share = 1.0;
    *force = grips ? -share * tends : -A.slip * c->friction * load;
    if (held) *couple = -*force;
    return pull + *force;
}

/* Find where a ride round a circle, or round its other half, ends. */
void look_round(void) {
    const Obstacle *o = O.all + A.on;
    double nx, ny;
    normal_at(o, A.side, &nx, &ny);
    if (!A.side) A.side = rim_side(o, nx, ny);
    A.angle = angle_of(nx, ny);
    find_bounds(A.on, A.side, A.angle, epoch_now(), A.bounds);
}

/* The obstacle that the particle touches, or left at the beginning of the stretch, and its face. */
static int touched_before(int *side) {
    *side = A.on == NONE ? A.left_side : A.side;
    return A.on == NONE ? A.left : A.on;
}

/* Sum the bounces after a rebound slower than REST: their times and impulses are geometric series. */
static void last_bounces(int obstacle, int side, double u) {
    if (!(u > 0.0) || obstacle >= O.faces) return;
    Touch c = touch_of(obstacle, side);
    double weight = weight_on(&c), pull = weight_along(&c), mass = A.given->mass, change, work, heat;
    /* Without loss the series has no end; its motion is smaller than what is resolved, and is left out. */
    double lost = c.restitution < 1.0 ? 1.0 - c.restitution : INFINITY;
    double time = MIN(2.0 * u / (weight * lost), A.given->stop - A.age);
    int face, before = touched_before(&face);
    /* It came from another obstacle, which is in the way. */
    if (before != NONE && before != obstacle) time = 0.0;
    double pace = along(&c), way = time * (pace + 0.5 * pull * time);
    A.age += time;
    A.x += way * c.tx, A.y += way * c.ty;
    pace += pull * time;
    double slip = slip_of(&c, pace);
    double push = rub(&c, slip, MAX(weight * time - u, 0.0), &change, &work, &heat);
    go_along(&c, pace + push);
    record_entries(c.surface, mass * push * c.belt + work, 0.5 * mass * u * u,
         -0.5 * mass * push * (2.0 * slip + change) + heat);
    bear_at(&c);
    write_knot();
}

/* Begin to slide, grip or ride on an obstacle. */
static void rest_on(int obstacle, int side, double rebound) {
    last_bounces(obstacle, side, rebound);
    A.way = obstacle < O.faces ? ON_FACE : ON_ARC;
    A.on = obstacle, A.side = side;
    A.left = NONE, A.left_side = 0, A.order = 0, A.joint = NONE;
    if (A.way == ON_ARC) look_round();
    settle();
}

/* Coefficient of friction of a moving surface, 0 if it is at rest or friction is infinite. */
static double grip_of(const Touch *c) {
    return c->belt == 0.0 || isinf(c->friction) ? 0.0 : c->friction;
}

static double cross(double ax, double ay, double bx, double by) { return ax * by - ay * bx; }

/* The normal forces per mass of two surfaces that hold a particle in a corner. Return whether friction locks it there. */
static int corner_loads(const Touch *a, const Touch *b, double *loads) {
    const Touch *both[] = { a, b };
    double g = A.given->gravity, x[2], y[2];
    int drawn[2], locked = 0;
    for (int n = 0; n < 2; n++) {
        double grip = sign_of(both[n]->belt) * grip_of(both[n]);
        x[n] = both[n]->nx + grip * both[n]->tx, y[n] = both[n]->ny + grip * both[n]->ty;
    }
    double determinant = cross(x[0], y[0], x[1], y[1]);
    loads[0] = g * -x[1] / determinant, loads[1] = g * x[0] / determinant;
    for (int n = 0; n < 2; n++)
        if (!isfinite(loads[n])) loads[n] = -1.0;
    int pulled = loads[0] < -WEIGHTLESS * g || loads[1] < -WEIGHTLESS * g;
    for (int n = 0; n < 2; n++) {
        const Touch *c = both[n], *against = both[1 - n];
        drawn[n] = sign_of(c->belt) * (c->tx * against->nx + c->ty * against->ny) < 0.0;
        locked |= drawn[n] && (isinf(c->friction) || (pulled && c->friction > 0.0));
    }
    return locked;
}

/* Bring the particle to rest in the corner of two obstacles, each given with its side.

   A moving surface continues to do work, all of which becomes heat. The friction of a surface at rest counts as zero: it
   dissipates nothing, and the balance of the two normal forces doesn't need it. If friction pulls the particle in with
   more than any normal force can balance (self-locking, as with adhesion), a real drive would stall: the particle stays,
   and nothing more is booked. If gravity pulls it out of the corner, it falls from rest, or rests on the other obstacle
   alone. */
static void rest_in_corner(int on, int side, int other, int other_side) {
    Touch a = touch_of(on, side), b = touch_of(other, other_side);
    const Touch *both[] = { &a, &b };
    int moving = a.belt != 0.0 || b.belt != 0.0;
    double g = A.given->gravity, mass = A.given->mass, loads[2];
    if (moving && A.turns) {
        E.other[0] = a.surface, E.other[1] = b.surface;
        course = HELD;
        end_track(TIME_IS_OVER);
        return;
    }
    double turning = A.turns ? A.z * A.z / A.lever : 0.0;
    double kinetic = 0.5 * mass * (A.vx * A.vx + A.vy * A.vy + turning);
    A.vx = A.vy = A.z = 0.0;
    record_entries(b.surface, 0.0, kinetic, 0.0);
    bear_at(&b);
    write_knot();
    int locked = corner_loads(&a, &b, loads);
    int stays = locked || (loads[0] >= -WEIGHTLESS * g && loads[1] >= -WEIGHTLESS * g);
    if (!stays) {
        int onto = loads[0] < 0.0 && weight_on(&b) > 0.0;
        if (onto) rest_on(other, other_side, 0.0);
        else let_go(other, other_side, 2, NONE);
        return;
    }
    /* A gate that opens lets it out of the corner: the wait ends then. */
    double gone[] = { vanishes(on), vanishes(other) }, first = MIN(gone[0], gone[1]);
    int opens = first < A.given->stop;
    if (!moving && E.until == UNTIL_SETTLED && isinf(first)) {
        record_event(SETTLE, a.surface);
        end_track(HAS_SETTLED);
        return;
    }
    double until = opens ? first : A.given->stop, time = until - A.age;
    for (int n = 0; n < 2; n++) {
        const Touch *c = both[n];
        double heat = locked ? 0.0 : mass * grip_of(c) * fabs(c->belt) * MAX(loads[n], 0.0) * time;
        record_entries(c->surface, heat, 0.0, heat);
        if (locked || B.every == 0.0) continue;
        double grip = sign_of(c->belt) * grip_of(c), load = mass * loads[n] * time;
        Push p = { .owner = c->surface, .from = A.given->release + A.age, .to = A.given->release + until,
                   .x = A.x - A.given->radius * c->nx, .y = A.y - A.given->radius * c->ny, .nx = c->nx, .ny = c->ny,
                   .jx = load * (c->nx + grip * c->tx), .jy = load * (c->ny + grip * c->ty) };
        bear(&p);
    }
    A.age = until;
    if (locked) bear_at(&a);
    else tell_here();
    write_knot();
    if (!opens) {
        end_track(TIME_IS_OVER);
        return;
    }
    let_go(NONE, 0, 0, NONE);
    for (int n = 0; n < 2; n++)
        if (gone[n] <= until && gone[1 - n] > until && weight_on(both[1 - n]) > 0.0)
            rest_on(n ? on : other, n ? side : other_side, 0.0);
}

/* Stop the particle if it goes to and fro between two obstacles without progress; return whether it did. */
static int stop_jammed(int obstacle, int side) {
    int face, before = touched_before(&face);
    int slow = length_of(A.vx, A.vy) <= CRAWL * A.given->pace;
    int between = before != NONE && before != obstacle && A.way != OVER;
    A.crawls = slow ? A.crawls + between : 0;
    if (!between || !(A.idle > COLLAPSE || A.crawls > COLLAPSE)) return 0;
    /* Faces that lie on each other make no corner. */
    Touch one = touch_of(before, face), two = touch_of(obstacle, side);
    if (!(fabs(cross(one.nx, one.ny, two.nx, two.ny)) > OPPOSED)) return 0;
    /* A particle that loses hardly any energy in an impact, and does not rotate, gains from belts at each one: their work
       has no bound. */
    double best = MAX(one.restitution, two.restitution);
    if (!slow && !A.turns && best > LASTING && (one.belt != 0.0 || two.belt != 0.0)) {
        E.passed = 0.0;
        course = DRIVEN;
    } else {
        rest_in_corner(before, face, obstacle, side);
    }
    return 1;
}

/* After an impact with another obstacle, continue to slide, or stay in the corner of the two. A soft contact ends the
   approach along the face: where the two are not at right angles it stops only a part of it, and the next contact would
   follow at once. A faster particle meets something almost parallel, and continues. */
static void slide_past(int obstacle, int side, double rebound, int soft) {
    Touch c = touch_now(), against = touch_of(obstacle, side);
    A.left = obstacle, A.left_side = side;
    A.order = rebound > 0.0 ? 1 : 2;
    double pace = along(&c);
    if (soft && fabs(pace) <= REST * A.given->pace && pace * (c.tx * against.nx + c.ty * against.ny) < 0.0)
        go_along(&c, 0.0);
    settle();
    if (A.way != ON_FACE) return;
    c = touch_now();
    double force, couple, pull = face_force(&c, &force, &couple);
    double towards = pull * c.tx * against.nx + pull * c.ty * against.ny;
    double size = length_of(pull * c.tx, pull * c.ty);
    if (rebound <= REST * A.given->pace && towards < -OPPOSED * size) rest_in_corner(A.on, A.side, obstacle, side);
}

/* Whether an impact with a rebound brings a particle to rest on a circle. It needs no rebound then: all impulses up to a
   time t, when the bounces are over, are together the load times t less the rebound, and so is their effect on the place:
   as without bounces, but for terms with the third power of the time that they take. In a family these may be more, if
   the particle slips for longer than they take, and only meets what it has just hopped on. */
static int is_last(const Touch *c, double approach, double rebound) {
    if (A.way != FLIES || c->obstacle < O.faces) return 0;
    if (rebound <= REST * A.given->pace) return is_pressed(c);
    if (!is_one_of_many(c->surface) || A.hopped != A.rounds || A.given->rolling > 0.0) return 0;
    double load = load_on(c), pace = along(c), g = A.given->gravity, time = 2.0 * rebound / (load * (1.0 - c->restitution));
    return time > 0.0 && time * A.given->pace <= SHORTLY && A.age + time < A.given->stop
        && time * fabs(pace) * MAX(load, g) <= HARDLY_TURNED * load * fabs(O.all[c->obstacle].rho)
        && A.share * fabs(slip_of(c, pace)) > c->friction * (approach + load * time) && is_free(time * fabs(pace));
}

/* Resolve a contact with an obstacle that has just been reached. */
void strike(int obstacle, int side) {
    if (is_parting(obstacle)) keep_shared(obstacle, side);
    if (A.way == RIDES_BELT) part_from(0);
    snap(obstacle, side);
    Touch c = touch_of(obstacle, side);
    double approach = MAX(-(A.vx * c.nx + A.vy * c.ny), 0.0);
    int soft = approach <= NEGLIGIBLE * A.given->pace;
    /* Restitution that falls with speed: above 1 / falls it goes with v^(-1/4). */
    if (c.falls * approach > 1.0) c.restitution /= sqrt(sqrt(c.falls * approach));
    if (soft) c.restitution = 0.0;
    if (is_last(&c, approach, c.restitution * approach)) c.restitution = 0.0;
    double rebound = c.restitution * approach;
    int lands = c.surface == E.landing && !A.landed;
    resolve_impact(&c, approach, rebound, lands);
    if (lands) {
        A.landed = 1;
        if (E.until == UNTIL_LANDED) {
            end_track(HAS_LANDED);
            return;
        }
    }
    if (stop_jammed(obstacle, side)) return;
    if (A.way >= ON_FACE) {
        /* After an impact with another obstacle it may stay on the one that it slides or rides on. */
        Touch under = touch_now();
        if (fabs(A.vx * under.nx + A.vy * under.ny) <= NEGLIGIBLE * A.given->pace && is_pressed(&under)) {
            slide_past(obstacle, side, rebound, soft);
            return;
        }
    }
    if (rebound <= REST * A.given->pace && is_pressed(&c)) {
        rest_on(obstacle, side, rebound);
        return;
    }
    if (A.on != NONE) part_from(O.all[A.on].surface);
    let_go(obstacle, side, rebound > 0.0 ? 1 : 2, NONE);
}

/* Continue from the end of a face or an arc on what follows, or fly if nothing supports it there. */
void pass_on(int obstacle, int side, int joint) {
    int ends = obstacle == NONE, left = A.on, face = A.side;
    if (ends) obstacle = left, side = face;
    is_parting(obstacle);
    Touch c = touch_of(obstacle, side);
    const Obstacle *o = O.all + obstacle, *from = O.all + left;
    if (ends || !is_pressed(&c)) {
        part_from(from->surface);
        /* From a tangential joint it flies off what follows; from an end it leaves what ends. */
        int flush = ends || o->met != END;
        let_go(flush ? obstacle : left, flush ? side : face, 2, joint);
        return;
    }
    /* It moves onto another surface without an impact: stick and slip on the one before end there. */
    int onto = o->surface != from->surface;
    if (onto) {
        A.slip = 1.0;
        if (o->surface == E.landing && !A.landed) {
            A.landed = 1;
            record_event(LANDING, o->surface);
            if (E.until == UNTIL_LANDED) {
                end_track(HAS_LANDED);
                return;
            }
            onto = 0;
        }
    }
    rest_on(obstacle, side, 0.0);
    /* A slight bend turns the path: without a knot after it the next cubic would reach into the next face. */
    const Knot *before = E.knots + E.knot_count - 1;
    double turned = length_of(A.vx - before->vx, A.vy - before->vy);
    if (turned > COLLINEAR * length_of(A.vx, A.vy)) write_knot();
    if (onto && A.slip != 0.0) record_event(SLIP, o->surface);
}
