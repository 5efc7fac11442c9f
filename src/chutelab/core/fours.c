/* Gauss-Seidel sweeps over the rows of a crowd, four rows at a time, in single precision. That is enough, as they end
   when velocities change by 1e-5 of their size. Rows of one colour share no disk, so one vector instruction can solve
   four of them. Where two particles with corners touch at two places, the two rows are twins: of four such pairs of rows
   the bodies are loaded and stored once. rows.c takes the impulses over in double precision, and explains what a row
   does. */

#include "core.h"

/* Number of colours. Rows that share a disk have different ones; a disk among equal ones touches six. Rows beyond the last
   colour are solved one by one. */
#define COLOURS 24
/* Friction below this share of the normal impulse, and a moment below this share of its bound, is rounding: it becomes 0. */
#define NOTHING 1e-12
/* Replaces infinity, which cannot be multiplied by 0. */
#define ANY 1e30f

/* Numbers of fours, of pairs of fours for twins, which come first, and of bodies. */
static int fours, twins, bodies;

typedef v128_t Four;

static inline Four all(float a) { return wasm_f32x4_splat(a); }
static inline Four get(const float *from) { return wasm_v128_load(from); }
static inline void set(float *to, Four v) { wasm_v128_store(to, v); }
static inline Four by(Four a, Four b) { return wasm_f32x4_mul(a, b); }
static inline Four sum(Four a, Four b) { return wasm_f32x4_add(a, b); }
static inline Four less(Four a, Four b) { return wasm_f32x4_sub(a, b); }
static inline Four low(Four a, Four b) { return wasm_f32x4_pmin(b, a); }
static inline Four high(Four a, Four b) { return wasm_f32x4_pmax(b, a); }
static inline Four within(Four a, Four bound) { return low(high(a, wasm_f32x4_neg(bound)), bound); }

static float total(Four v) {
    return (wasm_f32x4_extract_lane(v, 0) + wasm_f32x4_extract_lane(v, 1))
        + (wasm_f32x4_extract_lane(v, 2) + wasm_f32x4_extract_lane(v, 3));
}

static float greatest(Four v) {
    float one = MAX(wasm_f32x4_extract_lane(v, 0), wasm_f32x4_extract_lane(v, 1));
    return MAX(one, MAX(wasm_f32x4_extract_lane(v, 2), wasm_f32x4_extract_lane(v, 3)));
}

/* Transpose four vectors of four. */
static inline void transpose(Four *v) {
    Four a = wasm_i32x4_shuffle(v[0], v[1], 0, 4, 1, 5), b = wasm_i32x4_shuffle(v[2], v[3], 0, 4, 1, 5);
    Four c = wasm_i32x4_shuffle(v[0], v[1], 2, 6, 3, 7), d = wasm_i32x4_shuffle(v[2], v[3], 2, 6, 3, 7);
    v[0] = wasm_i64x2_shuffle(a, b, 0, 2);
    v[1] = wasm_i64x2_shuffle(a, b, 1, 3);
    v[2] = wasm_i64x2_shuffle(c, d, 0, 2);
    v[3] = wasm_i64x2_shuffle(c, d, 1, 3);
}

/* Load x, y and rim of the bodies of four rows. */
static inline void gather(const LightBody *from, const int *which, Four *v) {
    for (int k = 0; k < 4; k++) v[k] = get(&from[which[k]].x);
    transpose(v);
}
static inline void scatter(LightBody *to, const int *which, Four *v) {
    v[3] = all(0);
    transpose(v);
    for (int k = 0; k < 4; k++) set(&to[which[k]].x, v[k]);
}

/* `give` of rows.c for four rows with the velocities of their bodies; `rolls` and `cornered` are true if they are for any
   row of all. Each loop over it has a copy of its own, in which both are known. */
static inline __attribute__((always_inline)) Four give(SolverFour *f, Four *a, Four *b, int rolls, int cornered) {
    const LeverFour *l = W.lever_fours + (cornered ? f - W.fours : 0);
    Four nx = get(f->nx), ny = get(f->ny), J = get(f->impulse), T = get(f->along), mass = get(f->mass);
    Four x = less(a[0], b[0]), y = less(a[1], b[1]);
    Four opens = sum(sum(by(x, nx), by(y, ny)), get(f->opens));
    Four turn = sum(a[2], b[2]);
    if (cornered) {
        opens = sum(opens, sum(by(a[2], get(l->own)), by(b[2], get(l->others))));
        turn = sum(by(a[2], get(l->own_slide)), by(b[2], get(l->others_slide)));
    }
    Four slips = sum(less(by(x, ny), by(y, nx)), sum(turn, get(f->slips)));
    Four given = low(by(less(get(f->more), opens), mass),
                     by(wasm_f32x4_neg(sum(opens, by(get(f->gives), J))), get(f->eases)));
    given = high(given, by(wasm_f32x4_neg(sum(opens, get(f->parts))), mass));
    Four normal = high(sum(J, given), all(0));
    if (cornered) slips = sum(slips, by(get(l->slips), less(normal, J)));
    Four along = within(less(T, by(get(f->slide_mass), slips)), by(get(f->rough), normal));
    Four more = less(normal, J), push = less(along, T);
    Four change = high(wasm_f32x4_abs(by(more, get(f->light))), wasm_f32x4_abs(by(push, get(f->slide_light))));
    Four px = sum(by(more, nx), by(push, ny)), py = less(by(more, ny), by(push, nx));
    Four ra = push, rb = push;
    if (cornered) {
        ra = sum(by(more, get(l->own)), by(push, get(l->own_slide)));
        rb = sum(by(more, get(l->others)), by(push, get(l->others_slide)));
    }
    ra = by(ra, get(f->turn_a));
    rb = by(rb, get(f->turn_b));
    set(f->impulse, normal);
    set(f->along, along);
    if (rolls) {
        Four M = get(f->moment), turns = less(by(a[2], get(f->bend_a)), by(b[2], get(f->bend_b)));
        turns = by(get(f->roll_mass), sum(turns, get(f->spin)));
        Four moment = within(less(M, turns), by(get(f->arm), normal)), twist = less(moment, M);
        change = high(change, wasm_f32x4_abs(by(twist, get(f->roll_light))));
        ra = sum(ra, by(twist, get(f->twist_a)));
        rb = less(rb, by(twist, get(f->twist_b)));
        set(f->moment, moment);
    }
    a[0] = sum(a[0], by(get(f->mass_a), px));
    a[1] = sum(a[1], by(get(f->mass_a), py));
    a[2] = sum(a[2], ra);
    b[0] = less(b[0], by(get(f->mass_b), px));
    b[1] = less(b[1], by(get(f->mass_b), py));
    b[2] = sum(b[2], rb);
    return change;
}

/* Load the bodies of four rows, solve these, if `both` also the next four, which are their twins, and store them.
   `way` is 1 or -1: forwards or backwards. */
static inline __attribute__((always_inline)) Four give_and_store(SolverFour *f, int both, int way, LightBody *body,
                                                                 int rolls, int cornered) {
    Four a[4], b[4], change = all(0);
    gather(body, f->a, a);
    gather(body, f->b, b);
    SolverFour *one = f + (both && way < 0);
    for (int left = both; left >= 0; left--, one += way) change = high(change, give(one, a, b, rolls, cornered));
    scatter(body, f->a, a);
    scatter(body, f->b, b);
    return change;
}

/* How far four impulses have come since the last momentum step, times that step. */
static inline Four went(const float *now, const float *swept, const float *course, const float *light) {
    return by(by(less(get(now), get(swept)), get(course)), get(light));
}

/* One momentum step of four numbers: a share of what two sweeps and the last momentum step changed. */
static inline void go_on_by(float *now, float *swept, float *course, Four go, int begun) {
    Four more = begun ? by(go, sum(less(get(now), get(swept)), get(course))) : all(0), to = sum(get(now), more);
    set(course, more);
    set(swept, to);
    set(now, to);
}

/* `hasten` of rows.c. Velocities are linear in the impulses, so the same step is taken for them. */
static inline int hasten(int age, int rolls) {
    Four along = all(0);
    for (SolverFour *f = W.fours; f < W.fours + fours && age > 1; f++) {
        along = sum(along, went(f->impulse, f->swept, f->course, f->light));
        along = sum(along, went(f->along, f->slide_swept, f->slide_course, f->slide_light));
        if (rolls) along = sum(along, went(f->moment, f->roll_swept, f->roll_course, f->roll_light));
    }
    if (total(along) < 0) age = 1;
    Four go = all(age > 1 ? (age - 1) / (age + 2.0f) : 0);
    for (SolverFour *f = W.fours; f < W.fours + fours; f++) {
        go_on_by(f->impulse, f->swept, f->course, go, age > 0);
        go_on_by(f->along, f->slide_swept, f->slide_course, go, age > 0);
        if (rolls) go_on_by(f->moment, f->roll_swept, f->roll_course, go, age > 0);
    }
    for (LightBody *b = W.light_bodies; b < W.light_bodies + bodies; b++)
        go_on_by(&b->x, &b->swept[0], &b->course[0], go, age > 0);
    return age + 1;
}

/* `sweep_rows` of rows.c. */
static inline double sweep(int sweeps, int plain, double accurate, double most, int rolls, int cornered) {
    LightBody *const body = W.light_bodies;
    double worst = 0;
    int age = 0;
    for (int n = 0; n < sweeps; n++) {
        Four change = all(0);
        if (n >= plain && (n - plain) % 2 == 0) age = hasten(n == plain ? 0 : age, rolls);
        int way = (sweeps - n) % 2 ? 1 : -1, loads = fours - twins;
        for (int k = 0; k < loads; k++) {
            int load = way > 0 ? k : loads - 1 - k, both = cornered && load < twins;
            SolverFour *f = W.fours + load + (both ? load : twins);
            change = high(change, give_and_store(f, both, way, body, rolls, cornered));
        }
        worst = greatest(change);
        W.sweep_count++;
        if (worst <= accurate) return worst;
        if (!(worst <= most)) return INFINITY;
    }
    return worst;
}

static inline float bounded(double a) { return (float)MIN(a, ANY); }

/* Give the rows of all colours their places in fours, `each` fours for four of them, from `fours` on. */
static void place_colours(int *begin, int each) {
    for (int k = 0; k <= COLOURS; k++) {
        int many = begin[k];
        begin[k] = 4 * fours;
        fours += each * (k < COLOURS ? (many + 3) / 4 : many);
    }
}

/* Colour the rows and copy them into fours. Return whether there is room for them; set whether any has rolling friction. */
static int set_fours(int rows, int cornered, int *rolls) {
    int single[COLOURS + 1] = {0}, twin[COLOURS + 1] = {0};
    for (int n = 0; n < rows; n++) {
        SolverRow *r = W.rows + n;
        SolverBody *a = W.solver_bodies + r->a, *b = W.solver_bodies + r->b;
        *rolls |= r->arm > 0;
        r->twin = cornered && n > 0 && r[-1].a == r->a && r[-1].b == r->b && !r[-1].twin && r[-1].colour < COLOURS;
        if (r->twin) {
            single[r[-1].colour]--;
            twin[r[-1].colour]++;
            continue;
        }
        int used = r->b ? a->used | b->used : a->used, colour = 0;
        while (colour < COLOURS && used >> colour & 1) colour++;
        a->used |= 1 << colour;
        b->used |= 1 << colour;
        r->colour = colour;
        single[colour]++;
    }
    fours = 0;
    place_colours(twin, 2);
    twins = fours / 2;
    place_colours(single, 1);
    if (fours > W.four_room) return 0;
    for (int n = 0; n < fours; n++) W.fours[n] = (SolverFour){.a = {0}};
    for (int n = 0; n < fours && cornered; n++) W.lever_fours[n] = (LeverFour){.own = {0}};
    for (int n = 0; n < rows; n++) {
        SolverRow *r = W.rows + n;
        const SolverBody *a = W.solver_bodies + r->a, *b = W.solver_bodies + r->b;
        int has_twin = n + 1 < rows && r[1].twin;
        if (r->twin) r->four = r[-1].four + 4;
        else if (has_twin) {
            int *at = twin + r->colour;
            r->four = *at;
            *at += *at % 4 < 3 ? 1 : 5;
        } else {
            int *at = single + r->colour;
            r->four = *at;
            *at += r->colour < COLOURS ? 1 : 4;
        }
        int k = r->four % 4;
        SolverFour *f = W.fours + r->four / 4;
        f->a[k] = r->a;
        f->b[k] = r->b;
        f->nx[k] = (float)r->normal[0];
        f->ny[k] = (float)r->normal[1];
        f->opens[k] = bounded(r->free[0]);
        f->slips[k] = (float)r->free[1];
        f->mass[k] = (float)r->mass[0];
        f->slide_mass[k] = (float)r->mass[1];
        f->light[k] = (float)r->light[0];
        f->slide_light[k] = (float)r->light[1];
        f->gives[k] = (float)r->gives;
        f->eases[k] = (float)r->eases;
        f->more[k] = bounded(r->more);
        f->parts[k] = bounded(r->parts);
        f->rough[k] = bounded(r->rough);
        f->mass_a[k] = (float)a->mass;
        f->mass_b[k] = (float)b->mass;
        f->turn_a[k] = (float)a->turn;
        f->turn_b[k] = (float)b->turn;
        f->impulse[k] = (float)r->impulse[0];
        f->along[k] = (float)r->impulse[1];
        if (cornered) {
            const RowLever *from = W.levers + n;
            LeverFour *l = W.lever_fours + r->four / 4;
            l->own[k] = (float)from->own[0];
            l->own_slide[k] = (float)from->own[1];
            l->others[k] = (float)from->others[0];
            l->others_slide[k] = (float)from->others[1];
            l->slips[k] = (float)from->slips;
        }
        if (!*rolls) continue;
        f->arm[k] = (float)r->arm;
        f->spin[k] = (float)r->spin;
        f->twist_a[k] = (float)a->twist;
        f->twist_b[k] = (float)b->twist;
        f->bend_a[k] = (float)a->bend;
        f->bend_b[k] = (float)b->bend;
        f->roll_mass[k] = (float)r->roll_mass;
        f->roll_light[k] = (float)r->roll_light;
        f->moment[k] = (float)r->moment;
    }
    return 1;
}

/* Sweep over the rows by fours, as `sweep_rows` does; changes above `most` mean that the sweeps diverge, INFINITY is
   returned then. Else the rows have the new impulses; the caller updates the velocities by `scale`. */
double sweep_fours(int rows, int all_bodies, int cornered, int sweeps, int plain, double accurate, double most) {
    int rolls = 0;
    bodies = all_bodies;
    for (int n = 0; n < bodies; n++) {
        SolverBody *b = W.solver_bodies + n;
        b->used = 0;
        W.light_bodies[n] = (LightBody){.x = (float)b->x, .y = (float)b->y, .rim = (float)b->rim};
    }
    if (!set_fours(rows, cornered, &rolls)) return INFINITY;
    double worst;
    if (cornered) worst = rolls ? sweep(sweeps, plain, accurate, most, 1, 1) : sweep(sweeps, plain, accurate, most, 0, 1);
    else worst = rolls ? sweep(sweeps, plain, accurate, most, 1, 0) : sweep(sweeps, plain, accurate, most, 0, 0);
    for (SolverRow *r = W.rows; r < W.rows + rows && worst < INFINITY; r++) {
        const SolverFour *f = W.fours + r->four / 4;
        double normal = f->impulse[r->four % 4], bound = r->rough * normal, arm = r->arm * normal;
        double along = f->along[r->four % 4], moment = f->moment[r->four % 4];
        r->impulse[0] = normal;
        r->impulse[1] = fabs(along) > NOTHING * normal ? MIN(MAX(along, -bound), bound) : 0;
        r->moment = fabs(moment) > NOTHING * arm ? MIN(MAX(moment, -arm), arm) : 0;
    }
    return worst;
}
