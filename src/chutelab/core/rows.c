/* Solver rows, one for each contact of an island, and sweeps over them: projected Gauss-Seidel with momentum.

   A row's matrix (normal, tangent) = ((nx, ny), (ny, -nx)) is its own inverse: it turns a velocity into
   normal velocity and slip, and a normal and a tangential impulse into a vector. */

#include "core.h"

/* Sine of the angle below which two surfaces count as parallel: rounding leaves no digits of a smaller one. */
#define PARALLEL 1e-7
/* Sweeps diverge if a change is so many times the first one. */
#define DIVERGES 1e3
/* Share of a disk's momentum; a smaller normal impulse is rounding. */
#define NOISE 1e-11
/* Number of rows from which they are swept by fours first. */
#define LARGE 32
/* Bisections of an interval until it is as small as rounding. */
#define HALVINGS 50
/* m/s; speed at which a contact that asks for nothing is free to open. Finite, since infinity cannot be multiplied by 0. */
#define ANY 1e100

/* Rows before `pairs` are contacts of two free particles, the others are contacts with something that is fixed or carried.
   `clings`: a row has cohesion. `cornered`: a row has levers (particles with corners, hinges). */
static int pairs, rows, bodies, clings, cornered;
/* Number of rows of contacts; rows of hinges follow. The first body that is a hinge. */
static int contacts, hinges;

/* Minimum and maximum by vectors: compilers of WebAssembly make a branch of a choice between doubles. */
static inline double least(double a, double b) {
    return wasm_f64x2_extract_lane(wasm_f64x2_pmin(wasm_f64x2_splat(b), wasm_f64x2_splat(a)), 0);
}
static inline double most(double a, double b) {
    return wasm_f64x2_extract_lane(wasm_f64x2_pmax(wasm_f64x2_splat(b), wasm_f64x2_splat(a)), 0);
}
static inline double first(Two v) { return wasm_f64x2_extract_lane(v, 0); }
static inline double second(Two v) { return wasm_f64x2_extract_lane(v, 1); }
/* Turn a velocity into normal velocity and slip, or a normal and a tangential impulse into a vector. */
static inline Two turned(const SolverRow *c, Two v) {
    return plus(times(first(v), two(c->normal)), times(second(v), two(c->tangent)));
}

static inline RowLever *lever_of(const SolverRow *c) { return W.levers + (c - W.rows); }

/* Normal velocity less what the gap asks for, and slip, with the impulses so far. */
static inline Two moves(const SolverRow *c) {
    const SolverBody *a = W.solver_bodies + c->a, *b = W.solver_bodies + c->b;
    Two v = plus(turned(c, minus(two(&a->x), two(&b->x))), two(c->free));
    if (cornered) {
        const RowLever *l = lever_of(c);
        return plus(v, plus(times(a->rim, two(l->own)), times(b->rim, two(l->others))));
    }
    return plus(v, wasm_f64x2_make(0, a->rim + b->rim));
}

double slip_of(const SolverRow *row) { return second(moves(row)); }

static inline double rolls(const SolverRow *c) {
    const SolverBody *a = W.solver_bodies + c->a, *b = W.solver_bodies + c->b;
    return a->rim * a->bend - b->rim * b->bend + c->spin;
}

/* By how much the normal velocity exceeds what the gap asks for at a normal impulse. */
static inline double above(const SolverRow *c, double opens, double impulse) {
    return least(most(opens + c->gives * impulse, opens - c->more), opens + c->parts);
}

static inline void push_row(const SolverRow *c, Two impulse, double moment) {
    SolverBody *a = W.solver_bodies + c->a, *b = W.solver_bodies + c->b;
    Two v = turned(c, impulse);
    double along = second(impulse), others = along;
    if (cornered) {
        const RowLever *l = lever_of(c);
        along = l->own[0] * first(impulse) + l->own[1] * second(impulse);
        others = l->others[0] * first(impulse) + l->others[1] * second(impulse);
    }
    wasm_v128_store(&a->x, plus(two(&a->x), times(a->mass, v)));
    a->rim += a->turn * along + a->twist * moment;
    wasm_v128_store(&b->x, minus(two(&b->x), times(b->mass, v)));
    b->rim += b->turn * others - b->twist * moment;
}

static int body_of(int i) {
    Disk *d = W.disks + i;
    SolverBody *b = W.solver_bodies + d->body;
    if (d->body > 0 && d->body < bodies && b->disk == i) return d->body;
    d->body = bodies;
    W.solver_bodies[bodies] = (SolverBody){.mass = d->inv_mass, .turn = square(d->radius) * d->inv_inertia,
                              .twist = d->radius * d->inv_inertia, .bend = 1 / d->radius, .disk = i};
    return bodies++;
}

/* Set the levers of a row. A disk turns by friction alone. */
static void set_lever(const SolverRow *r, const Contact *c) {
    const SolverBody *a = W.solver_bodies + r->a, *b = W.solver_bodies + r->b;
    RowLever *l = lever_of(r);
    for (int n = 0; n < 2; n++) {
        l->own[n] = c->cornered ? c->own[n] * a->bend : n;
        l->others[n] = c->hung ? -c->lever[n] : c->cornered ? c->others[n] * b->bend : n;
    }
    l->slips = a->turn * l->own[0] * l->own[1] + b->turn * l->others[0] * l->others[1];
}

/* Multiply all impulses by a factor and compute the velocities anew. The bound of a motor, kept in its normal impulse,
   stays. */
static void scale(double by) {
    for (SolverBody *b = W.solver_bodies; b < W.solver_bodies + bodies; b++) b->x = b->y = b->rim = 0;
    for (SolverRow *r = W.rows; r < W.rows + rows; r++) {
        r->impulse[0] *= r->mass[0] > 0 ? by : 1;
        r->impulse[1] *= by;
        r->moment *= by;
        push_row(r, two(r->impulse), r->moment);
    }
}

/* Add the impulses of cohesion to the bodies. */
static void cling(const Contact *list) {
    for (const SolverRow *r = W.rows; clings && r < W.rows + contacts; r++)
        push_row(r, wasm_f64x2_make(-list[r->from].clings, 0), 0);
}

/* Make rows of contacts and give their bodies the impulses that these begin with. The impulses of cohesion are known: they
   are part of the velocities without impulses. */
void set_rows(Contact *list, int count) {
    W.solver_bodies[0] = (SolverBody){.disk = -1};
    bodies = 1;
    clings = pairs = 0;
    cornered = W.swings_too;
    for (int n = 0; n < count; n++) {
        body_of(list[n].i);
        if (list[n].two) body_of(list[n].j);
        pairs += list[n].two;
        cornered |= list[n].cornered;
    }
    hinges = bodies;
    for (int k = 0; k < W.mover_count && W.swings_too; k++) W.solver_bodies[bodies++] = hinge_body(k);
    rows = contacts = count;
    SolverRow *pair = W.rows, *other = W.rows + pairs;
    for (int n = 0; n < count; n++) {
        const Contact *c = list + n;
        SolverRow *r = c->two ? pair++ : other++;
        double u[3];
        relative(c, 1, u);
        r->normal[0] = c->nx;
        r->normal[1] = r->tangent[0] = c->ny;
        r->tangent[1] = -c->nx;
        r->free[0] = MIN(-c->need, ANY);
        r->free[1] = u[1] + c->drift;
        for (int k = 0; k < 2; k++) {
            r->mass[k] = c->mass[k];
            r->light[k] = 1 / c->mass[k];
            r->impulse[k] = c->impulse[k];
        }
        if (W.hastened > 0) {
            const Disk *a = W.disks + c->i, *b = W.disks + c->j;
            double x = a->kick[0] - (c->two ? b->kick[0] : 0), y = a->kick[1] - (c->two ? b->kick[1] : 0);
            r->free[0] += x * c->nx + y * c->ny;
            r->free[1] += x * c->ny - y * c->nx;
        }
        r->gives = c->gives;
        r->eases = 1 / (r->light[0] + c->gives);
        r->more = c->most + MIN(-c->need, ANY);
        r->parts = c->parts;
        r->rough = c->share < 1 ? c->share * MIN(c->friction, ROUGH) : c->friction;
        r->arm = c->share * c->arm;
        r->spin = u[2];
        r->roll_mass = c->mass[2];
        r->roll_light = c->mass[2] > 0 ? W.disks[c->i].radius / c->mass[2] : 0;
        r->moment = c->impulse[2];
        r->change = 0;
        r->a = W.disks[c->i].body;
        r->b = c->two ? W.disks[c->j].body : c->hung ? hinges + c->hung - 1 : 0;
        r->from = n;
        if (cornered) set_lever(r, c);
        clings |= c->clings > 0;
        if (!clings) push_row(r, two(r->impulse), r->moment);
    }
    if (W.swings_too) rows += set_hinge_rows(W.rows + count, hinges);
    for (SolverRow *r = W.rows + count; r < W.rows + rows; r++) push_row(r, two(r->impulse), 0);
    if (!clings) return;
    for (SolverBody *b = W.solver_bodies; b < W.solver_bodies + bodies; b++) b->x = b->y = b->rim = 0;
    cling(list);
    for (SolverRow *r = W.rows; r < W.rows + rows; r++) {
        Two free = moves(r);
        wasm_v128_store(r->free, free);
    }
    scale(1);
}

/* Copy the impulses to the contacts and the new velocities to the disks. With hinges, which may take thousands of sweeps,
   velocities are first summed up anew, as the rounding of all changes would add up. */
void take_rows(Contact *list, int count) {
    if (W.swings_too) scale(1);
    for (int n = 0; n < count; n++) {
        const SolverRow *r = W.rows + n;
        double *J = list[r->from].impulse;
        J[0] = r->impulse[0];
        J[1] = r->impulse[1];
        J[2] = r->moment;
    }
    cling(list);
    for (const SolverBody *b = W.solver_bodies + 1; b < W.solver_bodies + hinges; b++) {
        Disk *d = W.disks + b->disk;
        d->vx = d->ux + d->kick[0] + b->x;
        d->vy = d->uy + d->kick[1] + b->y;
        if (b->turn > 0) d->spin = d->uspin + b->rim * b->bend;
    }
    if (W.swings_too) take_hinge_rows(W.rows + count, rows - count, hinges);
}

void begin_anew(void) { scale(0); }

/* Solve one row: the normal impulse that keeps its gap from closing (if `in_corner`, `press_corner` has found it), and the
   friction that stops slip and rolling, within its bound. Return the changes, m/s. */
static inline Two give(SolverRow *c, int in_corner) {
    Two J = two(c->impulse), v = moves(c);
    double r = first(v), normal = c->impulse[0], moment = 0;
    if (!in_corner) {
        double given = least((c->more - r) * c->mass[0], -(r + c->gives * normal) * c->eases);
        normal = most(normal + most(given, -(r + c->parts) * c->mass[0]), 0);
    }
    double bound = c->rough * normal, slip = second(v);
    if (cornered) slip += lever_of(c)->slips * (normal - first(J));
    double along = least(most(c->impulse[1] - c->mass[1] * slip, -bound), bound);
    Two to = wasm_f64x2_make(normal, along), change = minus(to, J);
    Two speed = wasm_f64x2_mul(wasm_f64x2_abs(change), two(c->light));
    c->change = second(speed);
    if (c->arm > 0) {
        double arm = c->arm * normal;
        moment = least(most(c->moment - c->roll_mass * rolls(c), -arm), arm) - c->moment;
        c->moment += moment;
        c->change = most(c->change, fabs(moment) * c->roll_light);
        speed = wasm_f64x2_make(first(speed), c->change);
    }
    wasm_v128_store(c->impulse, to);
    push_row(c, change, moment);
    return speed;
}

/* By how much a change of velocity (x, y) misses what the gaps of some rows ask for, at most, m/s. */
static double violation(const SolverRow *list, int count, double x, double y) {
    double worst = 0;
    for (const SolverRow *c = list; c < list + count; c++)
        worst = most(worst, -above(c, x * c->normal[0] + y * c->normal[1] + c->free[0], c->impulse[0]));
    return worst;
}

/* What a row asks for at a change of velocity (x, y), m/s. */
static double asks_at(const SolverRow *c, double x, double y) {
    return -above(c, x * c->normal[0] + y * c->normal[1] + c->free[0], c->impulse[0]);
}

/* Solve the normal impulses of all fixed surfaces that a disk touches at once: in a narrow wedge they would take a thousand
   sweeps one by one. The change of velocity becomes the admissible one nearest to that without these impulses: itself, or on
   the bound of one surface, or of two. Return the greatest change, m/s. */
static double press_corner(SolverRow *list, int count) {
    SolverBody *d = W.solver_bodies + list->a;
    double x = d->x, y = d->y, m = d->mass, best[2] = {0, 0}, changed = 0;
    double rounding = 1e-15 * (fabs(x) + fabs(y));
    int at[2] = {0, 0};
    for (int n = 0; n < count; n++) {
        x -= list[n].impulse[0] * m * list[n].normal[0];
        y -= list[n].impulse[0] * m * list[n].normal[1];
    }
    double last = violation(list, count, x, y);
    for (int i = 0; i < count && last > rounding; i++) {
        const SolverRow *c = list + i;
        double one = asks_at(c, x, y);
        double left = violation(list, count, x + one * c->normal[0], y + one * c->normal[1]);
        if (one <= 0 || left >= last) continue;
        last = left;
        best[0] = one; best[1] = 0;
        at[0] = at[1] = i;
    }
    for (int i = 0; i < count && last > rounding; i++)
        for (int j = 0; j < i && last > rounding; j++) {
            const SolverRow *c = list + i, *o = list + j;
            double cosine = c->normal[0] * o->normal[0] + c->normal[1] * o->normal[1];
            double sine = c->normal[0] * o->normal[1] - c->normal[1] * o->normal[0];
            double one = asks_at(c, x, y), then = asks_at(o, x, y);
            if (fabs(sine) < PARALLEL) continue;
            double by = (one - cosine * then) / (sine * sine), more = (then - cosine * one) / (sine * sine);
            double left = violation(list, count, x + by * c->normal[0] + more * o->normal[0],
                                    y + by * c->normal[1] + more * o->normal[1]);
            if (by < 0 || more < 0 || left >= last) continue;
            last = left;
            best[0] = by; best[1] = more;
            at[0] = i; at[1] = j;
        }
    for (int n = 0; n < count; n++) {
        double normal = (n == at[0] ? best[0] : 0) + (n == at[1] && at[1] != at[0] ? best[1] : 0);
        double change = normal / m - list[n].impulse[0];
        push_row(list + n, wasm_f64x2_make(change, 0), 0);
        list[n].impulse[0] = normal / m;
        changed = most(changed, fabs(change) * m);
    }
    return changed;
}

/* Nesterov's momentum after each two sweeps (there and back): go on in the direction in which they led. It restarts where the
   sweeps lead back (O'Donoghue and Candes, Found. Comput. Math. 15, 2015). `age` counts the steps since a restart; returns
   the next one. */
static int hasten(int age) {
    double along = 0;
    for (const SolverRow *c = W.rows; c < W.rows + rows && age > 1; c++) {
        Two went = wasm_f64x2_mul(minus(two(c->impulse), two(c->swept)), two(c->course));
        went = wasm_f64x2_mul(went, two(c->light));
        along += first(went) + second(went);
        if (c->arm > 0) along += (c->moment - c->roll_swept) * c->roll_course * c->roll_light;
    }
    if (along < 0) age = 1;
    double go = age > 1 ? (age - 1) / (age + 2.0) : 0;
    for (SolverRow *c = W.rows; c < W.rows + rows; c++) {
        Two more = wasm_f64x2_splat(0), J = two(c->impulse);
        double moment = 0;
        if (age > 0) {
            more = times(go, plus(minus(J, two(c->swept)), two(c->course)));
            moment = go * (c->moment - c->roll_swept + c->roll_course);
        }
        wasm_v128_store(c->course, more);
        wasm_v128_store(c->impulse, plus(J, more));
        wasm_v128_store(c->swept, two(c->impulse));
        c->moment += moment;
        c->roll_course = moment;
        c->roll_swept = c->moment;
        if (go > 0) push_row(c, more, moment);
    }
    return age + 1;
}

/* Sweep over the rows until no relative velocity changes by more than `accurate`. All fixed surfaces of a disk are solved
   together. The first `plain` sweeps have no momentum. Return the greatest change of the last sweep, m/s, or INFINITY if the
   sweeps diverge. */
double sweep_rows(int sweeps, int plain, double accurate) {
    double begins = 0, worst = 0, radius = 1 / W.solver_bodies[1].bend;
    int age = 0;
    for (int n = 0; n < sweeps; n++) {
        Two change = wasm_f64x2_splat(0);
        /* There and back, so that a change at one end of a pile reaches the other end in one sweep. In the last sweep
           fixed surfaces come last. */
        int to = (sweeps - n) % 2;
        worst = 0;
        if (n >= plain && (n - plain) % 2 == 0) age = hasten(n == plain ? 0 : age);
        if (to)
            for (int m = 0; m < pairs; m++) change = wasm_f64x2_pmax(change, give(W.rows + m, 0));
        for (int m = pairs, many; m < rows; m += many) {
            SolverRow *c = W.rows + (to ? m : rows - 1 - (m - pairs));
            for (many = 1; m + many < rows && !cornered && c[to ? many : -many].a == c->a;) many++;
            if (!to) c -= many - 1;
            if (many == 1) {
                change = wasm_f64x2_pmax(change, give(c, 0));
                continue;
            }
            worst = most(worst, press_corner(c, many));
            for (int k = 0; k < many; k++) change = wasm_f64x2_pmax(change, give(c + k, 1));
            press_corner(c, many);
        }
        if (!to)
            for (int m = pairs - 1; m >= 0; m--) change = wasm_f64x2_pmax(change, give(W.rows + m, 0));
        worst = MAX(worst, MAX(first(change), second(change)));
        W.sweep_count++;
        if (n == 0) begins = worst;
        if (worst <= accurate) return worst;
        if (!(worst <= DIVERGES * (begins + W.soft + W.skip * radius))) return INFINITY;
    }
    return worst;
}

/* Sweep by fours, if there are enough rows; INFINITY if there are not, or if the sweeps diverge. */
double sweep_lightly(int sweeps, int plain, double accurate) {
    double most = DIVERGES * (W.soft + W.skip / W.solver_bodies[1].bend);
    if (rows < LARGE) return INFINITY;
    double worst = sweep_fours(rows, bodies, cornered, sweeps, plain, accurate, most);
    if (worst < INFINITY) scale(1);
    return worst;
}

/* Slopes of the cost 1/2 J W J + J q along the impulses J, at two shares of them. W J are the changes of velocity, and
   W J + q is the difference between the velocities and what the contacts ask for (docs/physics.md, "The law of a solve"). */
static Two slopes(double one, double other) {
    Two share = wasm_f64x2_make(one, other), sum = wasm_f64x2_splat(0);
    for (const SolverRow *c = W.rows; c < W.rows + rows; c++) {
        Two change = minus(moves(c), two(c->free));
        Two opens = plus(wasm_f64x2_splat(c->free[0]), times(first(change), share));
        Two slips = plus(wasm_f64x2_splat(c->free[1]), times(second(change), share));
        /* `above` for both shares. */
        Two gives = plus(opens, times(c->gives, times(c->impulse[0], share)));
        gives = wasm_f64x2_pmax(minus(opens, wasm_f64x2_splat(c->more)), gives);
        gives = wasm_f64x2_pmin(plus(opens, wasm_f64x2_splat(c->parts)), gives);
        sum = plus(sum, plus(times(c->impulse[0], gives), times(c->impulse[1], slips)));
        if (!(c->arm > 0)) continue;
        Two rolled = times(rolls(c) - c->spin, share);
        sum = plus(sum, times(c->moment, plus(wasm_f64x2_splat(c->spin), rolled)));
    }
    return sum;
}

/* Line search: scale all impulses by the share in [0, 1] at which the cost is least; return 0 if that is 1. Then
   J (W J + q) <= 0, however far the sweeps have come: the law of a solve. The slope increases with the share. It is
   piecewise linear, as overlaps ask for less up to a bound, so its zero is bracketed by bisection and secants. */
int lessen(void) {
    Two ends = slopes(0, 1);
    double none = first(ends), all = second(ends), share = 0, from = 0, to = 1, below = none, above = all;
    if (!(all > 0)) return 0;
    for (int n = 0; n < HALVINGS && below < 0 && from < to; n++) {
        double middle = 0.5 * (from + to);
        share = from - below / (above - below) * (to - from);
        Two at = slopes(share, middle);
        if (first(at) <= EPS * all) break;
        to = share;
        above = first(at);
        if (middle < to && second(at) <= 0) {
            from = middle;
            below = second(at);
        } else if (middle < to) {
            to = middle;
            above = second(at);
        }
        share = from;
    }
    scale(share);
    return 1;
}

/* Cut friction down to its bound. It may exceed that by the last change of its normal impulse: by momentum where sweeps were
   cut off, in corners by the last `press_corner`. */
void keep_bounds(void) {
    for (SolverRow *c = W.rows; c < W.rows + rows; c++) {
        double bound = c->rough * c->impulse[0], arm = c->arm * c->impulse[0];
        double along = MIN(MAX(c->impulse[1], -bound), bound) - c->impulse[1];
        double moment = MIN(MAX(c->moment, -arm), arm) - c->moment;
        if (along == 0 && moment == 0) continue;
        c->impulse[1] += along;
        c->moment += moment;
        push_row(c, wasm_f64x2_make(0, along), moment);
    }
}

/* Remove normal impulses of the size of rounding: with unbounded friction even these would pull. Return whether there were
   any. */
int drop_noise(void) {
    int dropped = 0;
    for (SolverRow *c = W.rows; c < W.rows + contacts; c++) {
        const SolverBody *a = W.solver_bodies + c->a;
        const Disk *d = W.disks + a->disk;
        if (c->impulse[0] >= NOISE * c->mass[0] * (fabs(d->ux + a->x) + fabs(d->uy + a->y))) continue;
        push_row(c, minus(wasm_f64x2_splat(0), two(c->impulse)), -c->moment);
        dropped |= c->impulse[0] != 0 || c->impulse[1] != 0 || c->moment != 0;
        c->impulse[0] = c->impulse[1] = c->moment = 0;
    }
    return dropped;
}

/* By how much gaps miss what they ask for, at most, m/s. */
double left_open(void) {
    double worst = 0;
    for (const SolverRow *c = W.rows; c < W.rows + rows; c++) worst = most(worst, -above(c, first(moves(c)), c->impulse[0]));
    return worst;
}
