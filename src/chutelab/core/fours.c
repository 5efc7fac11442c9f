/* Gauss-Seidel sweeps over the rows of a crowd, four rows at a time, in single precision. That is enough, as they end
   when velocities change by 1e-5 of their size. Rows of one colour share no disk, so one vector instruction can solve
   four of them. rows.c takes the impulses over in double precision, and explains what a row does. */

#include "core.h"

/* Number of colours. Rows that share a disk have different ones; a disk among equal ones touches six. Rows beyond the last
   colour are solved one by one. */
#define COLOURS 24
/* Friction below this share of the normal impulse, and a moment below this share of its bound, is rounding: it becomes 0. */
#define NOTHING 1e-12
/* Replaces infinity, which cannot be multiplied by 0. */
#define ANY 1e30f

static int fours, bodies;

typedef v128_t Four;

static inline Four all(float a) { return wasm_f32x4_splat(a); }
static inline Four get(const float *from) { return wasm_v128_load(from); }
static inline void set(float *to, Four v) { wasm_v128_store(to, v); }
static inline Four by(Four a, Four b) { return wasm_f32x4_mul(a, b); }
static inline Four sum(Four a, Four b) { return wasm_f32x4_add(a, b); }
static inline Four less(Four a, Four b) { return wasm_f32x4_sub(a, b); }
static inline Four low(Four a, Four b) { return wasm_f32x4_pmin(b, a); }
static inline Four high(Four a, Four b) { return wasm_f32x4_pmax(b, a); }
static inline Four within(Four a, Four least, Four most) { return low(high(a, least), most); }

static float total(Four v) {
    return (wasm_f32x4_extract_lane(v, 0) + wasm_f32x4_extract_lane(v, 1))
        + (wasm_f32x4_extract_lane(v, 2) + wasm_f32x4_extract_lane(v, 3));
}

static float greatest(Four v) {
    float one = MAX(wasm_f32x4_extract_lane(v, 0), wasm_f32x4_extract_lane(v, 1));
    return MAX(one, MAX(wasm_f32x4_extract_lane(v, 2), wasm_f32x4_extract_lane(v, 3)));
}

/* Interleave the first, or the last, two numbers of two vectors; join the first, or the last, halves of two. */
static inline Four mix(Four a, Four b) { return wasm_i32x4_shuffle(a, b, 0, 4, 1, 5); }
static inline Four mix_last(Four a, Four b) { return wasm_i32x4_shuffle(a, b, 2, 6, 3, 7); }
static inline Four join(Four a, Four b) { return wasm_i64x2_shuffle(a, b, 0, 2); }
static inline Four join_last(Four a, Four b) { return wasm_i64x2_shuffle(a, b, 1, 3); }

/* Make vectors (x, y, rim, 0) of each of four rows. */
static inline void each(Four *to, Four x, Four y, Four rim) {
    Four place = mix(x, y), turn = mix(rim, all(0)), last_place = mix_last(x, y), last_turn = mix_last(rim, all(0));
    to[0] = join(place, turn);
    to[1] = join_last(place, turn);
    to[2] = join(last_place, last_turn);
    to[3] = join_last(last_place, last_turn);
}

/* `give` of rows.c for four rows; `rolls` and `cornered` are true if they are for any row of all. Each loop over it has
   a copy of its own, in which both are known. */
static inline __attribute__((always_inline)) Four give(SolverFour *f, int rolls, int cornered) {
    const LeverFour *l = W.lever_fours + (cornered ? f - W.fours : 0);
    RollFour *r = W.roll_fours + (rolls ? f - W.fours : 0);
    Four a[4], b[4];
    for (int k = 0; k < 4; k++) {
        a[k] = get(&f->a[k]->x);
        b[k] = get(&f->b[k]->x);
    }
    Four own = join(mix_last(a[0], a[1]), mix_last(a[2], a[3]));
    Four others = join(mix_last(b[0], b[1]), mix_last(b[2], b[3]));
    Four one = mix(less(a[0], b[0]), less(a[1], b[1])), other = mix(less(a[2], b[2]), less(a[3], b[3]));
    Four x = join(one, other), y = join_last(one, other);
    Four nx = get(f->nx), ny = get(f->ny), J = get(f->impulse), mass = get(f->mass);
    Four opens = sum(sum(by(x, nx), by(y, ny)), get(f->opens));
    if (cornered) opens = sum(opens, sum(by(own, get(l->own)), by(others, get(l->others))));
    Four given = low(by(less(get(f->more), opens), mass), by(sum(opens, by(get(f->gives), J)), get(f->eases)));
    given = high(given, by(less(get(f->parts), opens), mass));
    Four normal = high(sum(J, given), all(0)), more = less(normal, J);
    set(f->impulse, normal);
    Four turn = cornered ? sum(by(own, get(l->own_slide)), by(others, get(l->others_slide))) : sum(own, others);
    Four slips = sum(less(by(x, ny), by(y, nx)), sum(turn, get(f->slips)));
    if (cornered) slips = sum(slips, by(get(l->slips), more));
    Four T = get(f->along), bound = by(get(f->rough), normal);
    Four along = within(less(T, by(get(f->slide_mass), slips)), less(all(0), bound), bound), push = less(along, T);
    set(f->along, along);
    Four change = high(wasm_f32x4_abs(by(more, get(f->light))), wasm_f32x4_abs(by(push, get(f->slide_light))));
    Four px = sum(by(more, nx), by(push, ny)), py = less(by(more, ny), by(push, nx));
    Four ra = push, rb = push;
    if (cornered) {
        ra = sum(by(more, get(l->own)), by(push, get(l->own_slide)));
        rb = sum(by(more, get(l->others)), by(push, get(l->others_slide)));
    }
    if (rolls) {
        Four M = get(r->moment), bend_a = get(r->bend_a), bend_b = get(r->bend_b);
        Four turns = by(get(r->roll_mass), sum(less(by(own, bend_a), by(others, bend_b)), get(r->spin)));
        Four hold = by(get(r->arm), normal);
        Four moment = within(less(M, turns), less(all(0), hold), hold), twist = less(moment, M);
        change = high(change, wasm_f32x4_abs(by(twist, get(r->roll_light))));
        ra = sum(ra, by(twist, bend_a));
        rb = less(rb, by(twist, bend_b));
        set(r->moment, moment);
    }
    each(a, px, py, ra);
    each(b, px, py, less(all(0), rb));
    for (int k = 0; k < 4; k++) set(&f->a[k]->x, sum(get(&f->a[k]->x), by(get(f->a[k]->response), a[k])));
    for (int k = 0; k < 4; k++) set(&f->b[k]->x, less(get(&f->b[k]->x), by(get(f->b[k]->response), b[k])));
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
        RollFour *r = W.roll_fours + (rolls ? f - W.fours : 0);
        if (rolls) along = sum(along, went(r->moment, r->roll_swept, r->roll_course, r->roll_light));
    }
    if (total(along) < 0) age = 1;
    Four go = all(age > 1 ? (age - 1) / (age + 2.0f) : 0);
    for (SolverFour *f = W.fours; f < W.fours + fours; f++) {
        go_on_by(f->impulse, f->swept, f->course, go, age > 0);
        go_on_by(f->along, f->slide_swept, f->slide_course, go, age > 0);
        RollFour *r = W.roll_fours + (rolls ? f - W.fours : 0);
        if (rolls) go_on_by(r->moment, r->roll_swept, r->roll_course, go, age > 0);
    }
    for (LightBody *b = W.light_bodies; b < W.light_bodies + bodies; b++)
        go_on_by(&b->x, &b->swept[0], &b->course[0], go, age > 0);
    return age + 1;
}

/* `sweep_rows` of rows.c. */
static inline double sweep(int sweeps, int plain, double accurate, double most, int rolls, int cornered) {
    double worst = 0;
    int age = 0;
    for (int n = 0; n < sweeps; n++) {
        Four change = all(0);
        if (n >= plain && (n - plain) % 2 == 0) age = hasten(n == plain ? 0 : age, rolls);
        for (int k = 0; k < fours; k++)
            change = high(change, give(W.fours + ((sweeps - n) % 2 ? k : fours - 1 - k), rolls, cornered));
        worst = greatest(change);
        W.sweep_count++;
        if (worst <= accurate) return worst;
        if (!(worst <= most)) return INFINITY;
    }
    return worst;
}

static inline float bounded(double a) { return (float)MIN(a, ANY); }

/* Colour the rows and copy them into fours. Return whether there is room for them; set whether any has rolling friction. */
static int set_fours(int rows, int cornered, int *rolls) {
    int place[COLOURS + 1] = {0};
    for (int n = 0; n < rows; n++) {
        SolverRow *r = W.rows + n;
        SolverBody *a = W.solver_bodies + r->a, *b = W.solver_bodies + r->b;
        *rolls |= r->arm > 0;
        int used = r->b ? a->used | b->used : a->used, colour = 0;
        while (colour < COLOURS && used >> colour & 1) colour++;
        a->used |= 1 << colour;
        b->used |= 1 << colour;
        r->four = colour;
        place[colour]++;
    }
    fours = 0;
    for (int k = 0; k <= COLOURS; k++) {
        int many = place[k];
        place[k] = 4 * fours;
        fours += k < COLOURS ? (many + 3) / 4 : many;
    }
    if (fours > W.four_room) return 0;
    /* Places without a row change nothing of the first body. */
    LightBody *none = W.light_bodies;
    for (int n = 0; n < fours; n++) W.fours[n] = (SolverFour){.a = {none, none, none, none}, .b = {none, none, none, none}};
    for (int n = 0; n < fours && *rolls; n++) W.roll_fours[n] = (RollFour){.arm = {0}};
    for (int n = 0; n < fours && cornered; n++) W.lever_fours[n] = (LeverFour){.own = {0}};
    for (int n = 0; n < rows; n++) {
        SolverRow *r = W.rows + n;
        const SolverBody *a = W.solver_bodies + r->a, *b = W.solver_bodies + r->b;
        int *next = place + r->four, alone = r->four == COLOURS;
        r->four = *next;
        *next += alone ? 4 : 1;
        int k = r->four % 4;
        SolverFour *f = W.fours + r->four / 4;
        f->a[k] = W.light_bodies + r->a;
        f->b[k] = W.light_bodies + r->b;
        f->nx[k] = (float)r->normal[0];
        f->ny[k] = (float)r->normal[1];
        f->opens[k] = bounded(r->free[0]);
        f->slips[k] = (float)r->free[1];
        f->mass[k] = (float)r->mass[0];
        f->slide_mass[k] = (float)r->mass[1];
        f->light[k] = (float)r->light[0];
        f->slide_light[k] = (float)r->light[1];
        f->gives[k] = (float)r->gives;
        f->eases[k] = -(float)r->eases;
        f->more[k] = bounded(r->more);
        f->parts[k] = -bounded(r->parts);
        f->rough[k] = bounded(r->rough);
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
        RollFour *o = W.roll_fours + r->four / 4;
        o->arm[k] = (float)r->arm;
        o->spin[k] = (float)r->spin;
        o->bend_a[k] = (float)a->bend;
        o->bend_b[k] = (float)b->bend;
        o->roll_mass[k] = (float)r->roll_mass;
        o->roll_light[k] = (float)r->roll_light;
        o->moment[k] = (float)r->moment;
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
        float mass = (float)b->mass;
        W.light_bodies[n] = (LightBody){.x = (float)b->x, .y = (float)b->y, .rim = (float)b->rim,
                                        .response = {mass, mass, (float)b->turn}};
    }
    if (!set_fours(rows, cornered, &rolls)) return INFINITY;
    double worst;
    if (cornered) worst = rolls ? sweep(sweeps, plain, accurate, most, 1, 1) : sweep(sweeps, plain, accurate, most, 0, 1);
    else worst = rolls ? sweep(sweeps, plain, accurate, most, 1, 0) : sweep(sweeps, plain, accurate, most, 0, 0);
    for (SolverRow *r = W.rows; r < W.rows + rows && worst < INFINITY; r++) {
        const SolverFour *f = W.fours + r->four / 4;
        double normal = f->impulse[r->four % 4], bound = r->rough * normal, arm = r->arm * normal;
        double along = f->along[r->four % 4], moment = rolls ? W.roll_fours[r->four / 4].moment[r->four % 4] : 0;
        r->impulse[0] = normal;
        r->impulse[1] = fabs(along) > NOTHING * normal ? MIN(MAX(along, -bound), bound) : 0;
        r->moment = fabs(moment) > NOTHING * arm ? MIN(MAX(moment, -arm), arm) : 0;
    }
    return worst;
}
