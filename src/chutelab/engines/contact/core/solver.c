/* Lasting contacts, once a step: impulses such that no gap is negative at the step's end, and that
   friction, within its bound, brings the slip in the middle of the step to zero.

   Contact dynamics after Moreau and Jean: projected Gauss-Seidel, started from the impulses of the
   step before. The gap at the end is that of the path without impulses, to the true surface: so
   curves, ends and rolling over each other need no cases. What rests hops by g h^2/8 in each step
   and is where it was at its end; positions at the steps are of second order in h. */

#include "core.h"

/* Overlap that is left alone, in radii; of what is beyond, a tenth is parted in each step: gently,
   since parting does work. Of an overlap as deep as DEEP more, up to all. */
#define SLOP 1e-3
#define PART 0.1
#define DEEP 0.03
/* Gap, in radii, up to which what was pressed still touches: what sweeps leave open. */
#define LEAVE 1e-4
/* Friction from which on it is lowered where sweeps diverge: 76 degrees. */
#define ROUGH 4.0
/* Of the greatest change where sweeps diverge: contacts that change by so much are lowered. */
#define FOLLOWS 0.01
/* Times that friction is lowered, to a quarter and at last to nothing. */
#define TRIES 4
/* Sine of the angle between surfaces that count as one: of less nothing is left by rounding. */
#define PARALLEL 1e-7
/* Steps that a contact in a crowd lasts at least if its end is told as a separation. */
#define LASTS 10
/* Contacts; an island of fewer is swept so many times as often where its gaps need it: disks that
   moving surfaces draw into a wedge take up to thousands of sweeps, or sink into each other. */
#define SMALL 500
#define MOST_ROUNDS 50
/* Sweeps before they are hastened: most solves need no more. */
#define PLAIN 6
/* Of momentum. */
#define NOISE 1e-11
/* Times the first change: sweeps whose changes grow so far never end. */
#define DIVERGES 1e3
/* Times the change at the end of the first round: sweeps that have not crawled to less in the last one
   press harder by as much in each, without end. */
#define CRAWLS 0.5
/* m/s; below it the contacts of a crowd count as calm: `settled` in the contract. */
#define CALM 1e-3
/* m/s; of a disk by itself: what is left of a speed that has come to nothing. */
#define STOPPED 1e-9
/* Of sqrt(g r): below it an island may fall asleep; 0.5 mm/s for r = 4 mm. */
#define REST 2.5e-3

static double gap_later(const Contact *c, double h) {
    const Disk *a = W.disks + c->i;
    double x = a->x + (a->vx + 0.5 * W.gx * h) * h, y = a->y + (a->vy + 0.5 * W.gy * h) * h, nx, ny;
    if (c->j < 0) return gap_to(face_at(W.surfaces + (-1 - c->j), x, y), x, y, a->radius, &nx, &ny);
    const Disk *b = W.disks + c->j;
    x -= b->x + (b->vx + 0.5 * W.gx * h) * h;
    y -= b->y + (b->vy + 0.5 * W.gy * h) * h;
    return sqrt(x * x + y * y) - a->radius - b->radius;
}

/* Time until the foot of a disk on a face passes its end, INFINITY where there is none or the face
   goes on smoothly, and not so bent that the disk flies on. */
static double time_on_face(const Contact *c) {
    const Disk *d = W.disks + c->i;
    const Surface *s = W.surfaces + (-1 - c->j);
    double x = d->x - s->x, y = d->y - s->y, along, run, length = s->length;
    if (s->shape == CIRCLE) return INFINITY;
    if (s->shape == SEGMENT) {
        along = x * s->tx + y * s->ty;
        run = d->vx * s->tx + d->vy * s->ty;
    } else {
        /* Angles; the foot of a disk in contact turns with its centre. */
        double half = acos(s->cos_half), square_away = x * x + y * y;
        if (square_away == 0) return INFINITY;
        along = atan2(s->tx * y - s->ty * x, s->tx * x + s->ty * y) + half;
        run = (x * d->vy - y * d->vx) / square_away;
        length = 2 * half;
    }
    if (along < 0 || along > length || run == 0) return INFINITY;
    if (s->mates[run > 0] >= 0) {
        const Surface *next = W.surfaces + s->mates[run > 0];
        double load = -(W.gx * c->nx + W.gy * c->ny), fast = d->vx * c->ny - d->vy * c->nx;
        int round = next->shape != SEGMENT
            && square(d->x - next->x) + square(d->y - next->y) >= square(next->radius);
        if (!round || load > fast * fast / (next->radius + d->radius)) return INFINITY;
    }
    return (run > 0 ? length - along : along) / fabs(run);
}

/* When a load (N s of impulse per time, newest first) falls to nothing, by the line through two. */
static double time_unloaded(const double *load, const double *t) {
    return load[1] > load[0] ? t[0] + load[0] / (load[1] - load[0]) * (t[0] - t[1]) : INFINITY;
}

/* Add a contact if it touches and hardly approaches; `least` is the smaller radius. */
static int add(int i, int j, double least, double bound, double h) {
    if (W.contact_count >= W.contact_room) return 0;
    Contact *c = W.contacts + W.contact_count;
    const Disk *d = W.disks + i;
    double u[3], later;
    if (j < 0 && face_at(W.surfaces + (-1 - j), d->x, d->y) != W.surfaces + (-1 - j)) return 1;
    describe(c, i, j);
    /* The next face or pulley that a disk by itself slides on to may be further off. */
    int far = c->gap > TOUCH * least;
    if (far && (W.interact || j >= 0 || !d->supports)) return 1;
    later = gap_later(c, h);
    if (far && later > 0) return 1;
    relative(c, 0, u);
    /* What has sunk in counts however it moves: else what parts others would press it, or what knocks
       on it in each step. */
    if (c->gap > -SUNK * least && (-u[0] > bound || u[0] > W.soft)) return 1;
    double aim = MIN(c->gap, 0);
    if (c->gap < -SLOP * least) {
        double part = MIN(MAX(PART, -c->gap / (DEEP * least)), 1);
        aim = -SLOP * least + (1 - part) * (c->gap + SLOP * least);
    }
    c->need = (aim - later) / h;
    c->drift = 0.5 * h * c->pull;
    c->impulse[0] = c->impulse[1] = c->impulse[2] = 0;
    for (int k = d->before; k >= 0; k = W.earlier[k].next)
        if (goes_on(W.earlier[k].j, j))
            for (int n = 0; n < 3; n++) c->impulse[n] = W.again * W.earlier[k].impulse[n];
    int pressed = c->impulse[0] > 0;
    for (int n = 0; n < d->held_count; n++) pressed |= goes_on(-1 - d->held[n], j);
    /* What was pressed came down from its last hop: it may leave along the surface, not into it, and
       above the face while that lasts. Beyond, the end presses it only if it is slow enough. */
    double floor = -u[0], until = j < 0 ? time_on_face(c) : INFINITY, least_need = floor;
    if (until < h) {
        double press = press_on(d, W.surfaces + (-1 - j), c->nx, c->ny);
        double along = d->vx * c->ny - d->vy * c->nx;
        floor += 0.5 * until * MAX(press, 0);
        least_need = press > along * along / d->radius ? floor : -u[0] + until * MAX(press, 0);
    } else least_need = floor;
    int gone = j < 0 && W.surfaces[-1 - j].there == LEAVING, ends = until < h || gone;
    if (gone && !pressed) return 1;
    if (gone) c->need = -INFINITY;
    /* A load that wears off leaves nothing to stop; friction goes on as long as the load does, not to
       the middle of the step. */
    const Track *track = W.tracks + i;
    double wears = W.interact || ends ? INFINITY : time_unloaded(track->load, track->load_t) - W.t;
    /* In a corner the other surface may press it on this one. */
    int alone = d->supports <= 1 || gone;
    c->leaves = pressed && alone && wears > 3 * h && c->gap <= LEAVE * least && c->need < least_need;
    if (c->leaves) c->need = floor;
    if (c->leaves) c->drift = (until < h ? until : 0) * c->pull;
    else if (pressed && wears < h) c->drift = MAX(wears, -0.5 * W.length_before) * c->pull;
    W.contact_count++;
    return 1;
}

/* A disk that leaves all surfaces in this step, over the end of a face, is carried until then: it
   gets what gravity takes from it up to there. */
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
    /* Without a hop it would fall from the end on; whatever it would fall into carries it on. */
    double u[3], fall = 0.5 * square(h - until);
    relative(last, 0, u);
    double x = d->x + (d->vx - u[0] * last->nx) * h + fall * W.gx;
    double y = d->y + (d->vy - u[0] * last->ny) * h + fall * W.gy;
    const int *list;
    int count = surfaces_near(i, &list);
    for (int n = 0; n < count; n++) {
        const Surface *s = W.surfaces + list[n];
        if (is_near(s, d) && gap_to(s, x, y, d->radius, &nx, &ny)
                < MIN(0, gap_to(s, d->x, d->y, d->radius, &nx, &ny)))
            return;
    }
    double press = press_on(d, W.surfaces + (-1 - last->j), last->nx, last->ny);
    last->need += 0.5 * MAX(press, 0) * until;
}

/* List the contacts of the step, waking sleepers that are touched; 0 if there is no room. */
int find_contacts(double h, int *woke) {
    W.contact_count = 0;
    *woke = 0;
    for (int n = 0; n < W.near_count; n++) {
        int i = W.near[2 * n], j = W.near[2 * n + 1];
        Disk *a = W.disks + i, *b = W.disks + j;
        double least = MIN(a->radius, b->radius), reach = a->radius + b->radius + TOUCH * least;
        if (square(a->x - b->x) + square(a->y - b->y) > reach * reach) continue;
        /* What the step before left over is taken up here. */
        int impacts = MAX(a->impacts, b->impacts);
        double bound = impacts > CROWDED ? INFINITY : left_over(a, impacts, -1, least);
        if (a->supports || b->supports || a->mode != FREE || b->mode != FREE)
            bound = MAX(bound, MAX(W.soft, W.skip * least));
        if (a->mode == ASLEEP || b->mode == ASLEEP) {
            wake(a->mode == ASLEEP ? i : j, W.t);
            *woke = 1;
        }
        if (a->mode != FREE) { int k = i; i = j; j = k; }
        if (!add(i, j, least, bound, h)) return 0;
    }
    if (*woke) return 1;
    for (int i = W.low; i < W.high; i++) {
        Disk *d = W.disks + i;
        if (d->mode != FREE) continue;
        int first = W.contact_count;
        double bound = d->impacts > CROWDED ? INFINITY : left_over(d, d->impacts, -1, d->radius);
        if (d->supports) bound = MAX(bound, W.interact ? MAX(W.soft, W.skip * d->radius) : W.soft);
        const int *list;
        int count = surfaces_near(i, &list);
        for (int n = 0; n < count; n++) {
            int k = list[n];
            if (!is_near(W.surfaces + k, d)) continue;
            double inside = pressed_inside(d, k), most = MAX(bound, inside ? W.soft + 2 * h * inside : 0);
            if (!add(i, -1 - k, d->radius, most, h)) return 0;
        }
        if (W.contact_count > first) carry_to_end(i, first, h);
    }
    return 1;
}

/* Give a contact the normal impulse that keeps its gap closed; return by how much it changed, m/s. */
static double press(Contact *c) {
    const Disk *a = W.disks + c->i, *b = W.disks + MAX(c->j, 0);
    double x = a->vx - a->ux, y = a->vy - a->uy;
    if (c->two) {
        x -= b->vx - b->ux;
        y -= b->vy - b->uy;
    }
    double normal = MAX(c->impulse[0] - c->mass[0] * (x * c->nx + y * c->ny - c->need), 0);
    double change[3] = {normal - c->impulse[0], 0, 0};
    if (change[0] != 0) push(c, change);
    c->impulse[0] = normal;
    return fabs(change[0]) * c->light[0];
}

/* How far a change of velocity (x, y) is from keeping all gaps closed, m/s. */
static double violation(const Contact *list, int count, double x, double y) {
    double worst = 0;
    for (int n = 0; n < count; n++)
        worst = MAX(worst, list[n].need - x * list[n].nx - y * list[n].ny);
    return worst;
}

/* The same for all surfaces that one disk touches, at once: in a narrow wedge impulses one by one
   would take a thousand sweeps. The change of velocity becomes the one nearest to what it is without
   them that keeps all gaps closed: itself, or on the bound of one surface, or of two. */
static double press_corner(Contact *list, int count) {
    Disk *d = W.disks + list->i;
    double x = d->vx - d->ux, y = d->vy - d->uy, m = d->inv_mass;
    double best[2] = {0, 0}, rounding = 1e-15 * (fabs(x) + fabs(y)), changed = 0;
    int at[2] = {0, 0};
    for (int n = 0; n < count; n++) {
        x -= list[n].impulse[0] * m * list[n].nx;
        y -= list[n].impulse[0] * m * list[n].ny;
    }
    double least = violation(list, count, x, y);
    for (int i = 0; i < count && least > rounding; i++) {
        const Contact *c = list + i;
        double one = c->need - x * c->nx - y * c->ny;
        double left = violation(list, count, x + one * c->nx, y + one * c->ny);
        if (one <= 0 || left >= least) continue;
        least = left;
        best[0] = one; best[1] = 0;
        at[0] = at[1] = i;
    }
    for (int i = 0; i < count && least > rounding; i++)
        for (int j = 0; j < i && least > rounding; j++) {
            const Contact *c = list + i, *o = list + j;
            double cosine = c->nx * o->nx + c->ny * o->ny, sine = c->nx * o->ny - c->ny * o->nx;
            double one = c->need - x * c->nx - y * c->ny, two = o->need - x * o->nx - y * o->ny;
            if (fabs(sine) < PARALLEL) continue;
            double first = (one - cosine * two) / (sine * sine), then = (two - cosine * one) / (sine * sine);
            double left = violation(list, count, x + first * c->nx + then * o->nx,
                                    y + first * c->ny + then * o->ny);
            if (first < 0 || then < 0 || left >= least) continue;
            least = left;
            best[0] = first; best[1] = then;
            at[0] = i; at[1] = j;
        }
    for (int n = 0; n < count; n++) {
        double normal = (n == at[0] ? best[0] : 0) + (n == at[1] && at[1] != at[0] ? best[1] : 0);
        double change[3] = {normal / m - list[n].impulse[0], 0, 0};
        push(list + n, change);
        list[n].impulse[0] = normal / m;
        changed = MAX(changed, fabs(change[0]) * m);
    }
    return changed;
}

/* Give a contact the friction that stops its slip and its rolling, as far as it is pressed. */
static double rub(Contact *c) {
    double *J = c->impulse, v[3], change[3] = {0, 0, 0};
    double rough = c->share < 1 ? c->share * MIN(c->friction, ROUGH) : c->friction;
    double most = rough * J[0], arm = c->share * c->arm * J[0];
    relative(c, 0, v);
    change[1] = MIN(MAX(J[1] - c->mass[1] * (v[1] + c->drift), -most), most) - J[1];
    change[2] = MIN(MAX(J[2] - c->mass[2] * v[2], -arm), arm) - J[2];
    if (change[1] == 0 && change[2] == 0) return 0;
    push(c, change);
    J[1] += change[1];
    J[2] += change[2];
    return MAX(fabs(change[1]) * c->light[1], fabs(change[2]) * c->light[2] * W.disks[c->i].radius);
}

/* Hasten the sweeps of a crowd: go on where they are heading to, by nonlinear conjugate gradients, of
   which two sweeps, to and fro, are the gradient (Silcowitz-Hansen, Niebe and Erleben, The Visual
   Computer 26, 2010). A pile of 2,000 takes half as many. `size` is the square of the gradient
   before, in J, or -1 at first; returns that of this one. */
static double hasten(Contact *list, int count, double size) {
    double now = 0;
    for (int n = 0; n < count && size >= 0; n++)
        for (int k = 0; k < 3; k++)
            now += square(list[n].impulse[k] - list[n].swept[k]) * list[n].light[k];
    double go = now < size ? now / size : 0;
    for (int n = 0; n < count; n++) {
        Contact *c = list + n;
        double more[3] = {0, 0, 0};
        for (int k = 0; k < 3; k++) {
            if (go > 0) more[k] = go * c->course[k];
            c->course[k] = size >= 0 ? more[k] + c->impulse[k] - c->swept[k] : 0;
            c->impulse[k] += more[k];
            c->swept[k] = c->impulse[k];
        }
        if (go > 0) push(c, more);
    }
    return now;
}

/* Sweep over contacts, those of one disk with surfaces as one, until no relative velocity changes by
   more than `accurate`; the first `plain` ones are not hastened. Return by how much one changed in the
   last sweep, or INFINITY if the sweeps diverge. */
static double sweep(Contact *list, int count, int sweeps, int plain, double accurate) {
    double first = 0, worst = 0, size = 0;
    for (int n = 0; n < sweeps; n++) {
        if (n >= plain && (n - plain) % 2 == 0) size = hasten(list, count, n == plain ? -1 : size);
        worst = 0;
        for (int m = 0, many; m < count; m += many) {
            /* To and fro, so that what one end of a pile does reaches the other in one sweep; in the
               last one surfaces come last, which do not give way. */
            int to = (sweeps - n) % 2;
            Contact *c = list + (to ? m : count - 1 - m), *last = c;
            for (many = 1; c->j < 0 && m + many < count; many++, last += to ? 1 : -1)
                if ((to ? last + 1 : last - 1)->i != c->i || (to ? last + 1 : last - 1)->j >= 0) break;
            if (!to) c = last;
            double change = many > 1 ? press_corner(c, many) : press(c);
            for (int k = 0; k < many; k++) {
                c[k].change = rub(c + k);
                change = MAX(change, c[k].change);
            }
            if (many > 1) press_corner(c, many);
            worst = MAX(worst, change);
        }
        W.sweep_count++;
        if (n == 0) first = worst;
        if (worst <= accurate) return worst;
        if (!(worst <= DIVERGES * (first + W.soft + W.skip * W.disks[list->i].radius))) return INFINITY;
    }
    return worst;
}

/* Solve contacts by sweeps until changes are `accurate`; if gaps are closed but for `enough`, m/s, less
   will do. A crowd is swept again, up to so many rounds, of which the last is good enough if it crawls,
   and more finely where small changes leave gaps open. By itself (0 rounds), and where sweeps diverge,
   rigid bodies with all of the friction may have no solution, driven into a wedge that locks itself:
   there it is lowered until they have one. */
void sweep_contacts(Contact *list, int count, int rounds, int plain, double accurate, double enough) {
    double first = INFINITY;
    for (int left = TRIES, more = rounds;;) {
        double change = sweep(list, count, W.sweeps, plain, accurate), worst = change;
        if ((change <= accurate && more < 2) || left == 0) break;
        if (change <= accurate) accurate *= 0.1;
        if (change < INFINITY) {
            worst = 0;
            for (int n = 0; n < count; n++) {
                const Contact *c = list + n;
                double u[3], v[3];
                relative(c, 1, u);
                relative(c, 0, v);
                worst = MAX(worst, c->need - v[0] + u[0]);
            }
        }
        if (worst <= enough) break;
        if (change < INFINITY && more > 1) {
            if (more-- == rounds) first = change;
            continue;
        }
        if (more == 1 && change < CRAWLS * first) break;
        more = rounds;
        worst = 0;
        for (int n = 0; n < count; n++) worst = MAX(worst, list[n].change);
        for (int n = 0; n < count; n++) {
            Contact *c = list + n;
            Disk *a = W.disks + c->i, *b = W.disks + MAX(c->j, 0);
            if (c->change >= FOLLOWS * worst) c->share = left > 1 ? 0.25 * c->share : 0;
            a->vx = a->ux;
            a->vy = a->uy;
            a->spin = a->uspin;
            if (c->two) {
                b->vx = b->ux;
                b->vy = b->uy;
                b->spin = b->uspin;
            }
            c->impulse[0] = c->impulse[1] = c->impulse[2] = 0;
        }
        left--;
    }
}

/* Where the slip of a disk by itself turns round within a step, since friction cannot hold it, the
   friction turns too. The sweeps would bring the slip to zero, which is wrong in first order. */
static void turn_slip(Contact *c) {
    double h = W.step_end - W.t, past = W.tracks[c->i].lasted ? 0.5 * W.length_before : 0, u[3], v[3];
    double span = past + 0.5 * h, pull = c->pull, hold = c->friction * c->impulse[0];
    relative(c, 1, u);
    relative(c, 0, v);
    double from = u[1] - pull * past, to = v[1] + c->drift, rate = hold / (c->mass[1] * span);
    if (c->j >= 0 || c->leaves || fabs(pull) <= rate || from * pull >= 0 || to * from > 1e-12 * from * from)
        return;
    double slow = pull + (pull > 0 ? rate : -rate), fast = pull - (pull > 0 ? rate : -rate);
    double change[3] = {0, c->mass[1] * (fast * (span + from / slow) - to), 0};
    if (-from / slow > span || fabs(c->impulse[1] + change[1]) > hold) return;
    push(c, change);
    c->impulse[1] += change[1];
}

/* Sort the contacts by islands of disks that touch each other, in the order in which these begin;
   within one they keep theirs. What the contacts of the step before were is not needed any more. */
static void sort_by_islands(void) {
    int *parent = W.queue, *first = W.moved, *next = W.links;
    for (int i = W.low; i < W.high; i++) {
        parent[i] = i;
        first[i] = -1;
    }
    for (int n = 0; n < W.contact_count; n++)
        if (W.contacts[n].two) parent[island_of(W.contacts[n].i)] = island_of(W.contacts[n].j);
    /* Of each island a list of its contacts, which begins with its last. */
    for (int n = W.contact_count - 1; n >= 0; n--) {
        int k = island_of(W.contacts[n].i);
        next[n] = first[k];
        first[k] = n;
    }
    int count = 0;
    for (int n = 0; n < W.contact_count; n++) {
        int k = island_of(W.contacts[n].i);
        for (int m = first[k]; m >= 0; m = next[m]) {
            W.earlier[count] = W.contacts[m];
            W.earlier[count++].island = k;
        }
        first[k] = -1;
    }
    Contact *c = W.contacts;
    W.contacts = W.earlier;
    W.earlier = c;
}

void solve_contacts(void) {
    if (W.interact) sort_by_islands();
    for (int n = 0; n < W.contact_count; n++) push(W.contacts + n, W.contacts[n].impulse);
    for (int from = 0, to = 0; from < W.contact_count; from = to) {
        Contact *list = W.contacts + from;
        double least = INFINITY;
        for (; to < W.contact_count && (!W.interact || W.contacts[to].island == list->island); to++) {
            const Contact *c = W.contacts + to;
            least = MIN(least, MIN(W.disks[c->i].radius, W.disks[c->j >= 0 ? c->j : c->i].radius));
        }
        if (W.interact)
            sweep_contacts(list, to - from, MIN(MAX(SMALL / (to - from), 1), MOST_ROUNDS), PLAIN,
                           W.accurate, W.skip * least);
        else sweep_contacts(list, to - from, 0, W.sweeps, W.accurate, MAX(W.accurate, 1e-9));
    }
    for (int n = 0; n < W.contact_count; n++) {
        /* Rounding presses nobody; with endless friction even that would pull. */
        Contact *c = W.contacts + n;
        const Disk *a = W.disks + c->i;
        if (c->impulse[0] >= NOISE * c->mass[0] * (fabs(a->vx) + fabs(a->vy))) continue;
        for (int k = 0; k < 3; k++) c->impulse[k] = -c->impulse[k];
        push(c, c->impulse);
        c->impulse[0] = c->impulse[1] = c->impulse[2] = 0;
    }
    if (!W.interact && W.contact_count == 1) turn_slip(W.contacts);
    W.solve_count++;
}

/* Note whether a disk that lasts on one surface slips there, sticks, or has come to rest. */
static void note_grip(Disk *d, const Contact *c, const double *u, const double *v, double h) {
    int i = c->i;
    double most = c->friction * c->impulse[0], slip = v[1] + c->drift;
    /* The impulses stand for the second half of the last step, if it lasted, and the first of this. */
    double past = W.tracks[c->i].lasted ? 0.5 * W.length_before : 0, span = past + 0.5 * h;
    int grips = fabs(c->impulse[1]) < most * (1 - 1e-12) || (most == 0 && slip == 0 && c->drift == 0);
    Track *track = W.tracks + i;
    for (int n = 2; n > 0; n--) {
        track->load[n] = track->load[n - 1];
        track->load_t[n] = track->load_t[n - 1];
    }
    track->load[0] = c->impulse[0] / span;
    track->load_t[0] = d->t;
    if (d->on != c->owner) {
        /* It came to lie there without an impact that was told. */
        write_event(IMPACT, i, -1, c->owner, d->t, &d->x, &d->ux, &d->vx, c->impulse[0], c->impulse[1]);
        d->on = c->owner;
        d->slips = 1;
    }
    if (grips && d->slips) {
        /* Friction slows the slip evenly; it is used up so long after the last mid-step. */
        double s = u[1] - c->pull * past, pull = c->pull;
        double rate = most / (c->mass[1] * span) - (s > 0 ? pull : -pull);
        double t = d->t - past + (rate > 0 ? fabs(s) / rate : 0);
        t = MAX(t, d->since);
        double place[2] = {d->x + (t - d->t) * 0.5 * (d->ux + d->vx), d->y + (t - d->t) * 0.5 * (d->uy + d->vy)};
        double after[3] = {d->vx + 0.5 * W.gx * h, d->vy + 0.5 * W.gy * h, d->spin};
        write_event(STICK, i, -1, c->owner, t, place, after, after, 0, 0);
        d->since = t;
    } else if (!grips && !d->slips)
        event_here(SLIP, i, c->owner);
    d->slips = !grips;
}

/* Whether a disk by itself that grips stays as it is: nothing pulls it along, and on what is round, or
   slows its rolling, it has stopped. */
static int lies(const Disk *d, const Contact *c, double h) {
    const Surface *s = W.surfaces + (-1 - c->j);
    double speed = fabs(d->vx + 0.5 * h * W.gx) + fabs(d->vy + 0.5 * h * W.gy);
    if (s->speed != 0 && c->owner != W.landing) return 0;
    if (bending(s, d->x, d->y, d->radius) != 0 && (speed > STOPPED || c->other[1] != 0)) return 0;
    if (c->arm > 0 && fabs(d->spin - c->other[2]) * d->radius > STOPPED) return 0;
    /* Its arm may have stopped it for a moment, or holds it. */
    int held = speed <= STOPPED && fabs(c->pull) * d->radius <= c->arm * press_on(d, s, c->nx, c->ny);
    return d->inertia == 0 || c->pull == 0 || held;
}

/* End the track of a disk that came to rest on one surface, when its slip was used up: `d->since`.

   From the velocity after the impulses to that in the middle of the step it is a hop, which is left
   out: an impulse of its own. At that velocity it has gone since, and what gravity did then the
   drive paid. */
static void settle(int i, const Contact *last, double h) {
    Disk *d = W.disks + i;
    Contact hop = *last;
    double u[3], v[3], entries[3], given[3], jx = 0.5 * h * d->mass * W.gx, jy = 0.5 * h * d->mass * W.gy;
    hop.impulse[0] = jx * hop.nx + jy * hop.ny;
    hop.impulse[1] = jx * hop.ny - jy * hop.nx;
    hop.impulse[2] = 0;
    for (int n = 0; n < 3; n++) d->entries[n] += d->gain[n];
    relative(&hop, 0, u);
    d->vx += jx / d->mass;
    d->vy += jy / d->mass;
    relative(&hop, 0, v);
    share_out(&hop, u, v, 0, entries, given);
    double back = d->t - d->since;
    entries[0] += d->mass * (W.gx * hop.ny - W.gy * hop.nx) * hop.other[1] * back;
    book(d->entries, 0, hop.owner, entries);
    d->x -= d->vx * back;
    d->y -= d->vy * back;
    d->t = d->since;
    if (W.tracks[i].open) knot_held(i);
    W.tracks[i].lasted = 0;
    knot_now(i);
    event_here(SETTLE, i, hop.owner);
    finish(i, BY_SETTLING);
}

/* Write the separation of a disk that no surface presses any more. */
static void tell_separation(int i) {
    const Disk *d = W.disks + i;
    const Track *track = W.tracks + i;
    if (track->lasted < 3) {
        event_here(SEPARATION, i, track->ground);
        return;
    }
    double t = time_unloaded(track->load + 1, track->load_t + 1);
    if (t > 2 * d->t - track->load_t[0]) {
        /* It was not worn off, the face ended: the last impulse tells how long the load went on. */
        double past = 0.5 * (track->load_t[0] - track->load_t[1]);
        double span = past + 0.5 * (d->t - track->load_t[0]);
        t = track->load_t[0] - past + track->load[0] / track->load[1] * span;
    }
    t = MIN(MAX(t, track->load_t[1]), d->t);
    /* It has flown since. */
    Disk then = *d;
    advance(&then, t);
    write_event(SEPARATION, i, -1, track->ground, t, &then.x, &then.vx, &then.vx, 0, 0);
}

/* After the solve: entries, supports, timers, tracks. */
void close_step(double h) {
    /* The share of the impulses that belongs to the step before; of a new contact, none. */
    W.before = W.length_before > 0 ? W.length_before / (W.length_before + h) : 0.5;
    if (!W.interact && !W.tracks[W.low].lasted) W.before = 0;
    for (int i = W.low; i < W.high; i++) {
        Disk *d = W.disks + i;
        d->links = d->before = -1;
        /* A disk by itself that leaves what it lay on may come back to it in this step, off by what a
           step is: that is no blow, and of endless friction it would be one however soft. */
        if (d->mode == FREE && (W.interact || !d->supports)) d->held_count = 0;
        d->supports = 0;
        if (W.length_before > 0.01 * W.dt) d->impacts = 0;
        for (int n = 0; n < 3; n++) d->gain[n] = d->ahead[n] = 0;
        if (d->mode == FREE) {
            d->calm += h;
            d->rest += h;
        }
    }
    for (int n = 0; n < W.contact_count; n++) {
        Contact *c = W.contacts + n;
        Disk *a = W.disks + c->i, *b = c->j >= 0 ? W.disks + c->j : 0;
        double u[3], v[3], entries[3], given[3];
        c->next = a->before;
        a->before = n;
        W.links[2 * n] = a->links;
        a->links = 2 * n;
        if (b) {
            W.links[2 * n + 1] = b->links;
            b->links = 2 * n + 1;
        }
        if (c->impulse[0] == 0) continue;
        if (!W.interact && !a->supports) a->held_count = 0;
        if (!b && a->held_count < MAX_HELD) a->held[a->held_count++] = -1 - c->j;
        relative(c, 1, u);
        relative(c, 0, v);
        share_out(c, u, v, 0, entries, given);
        book(a->gain, c->two ? b->gain : 0, c->owner, entries);
        if (given[0] != 0) book(a->gain, 0, W.ride_owner, given);
        share_out(c, u, v, W.before, entries, given);
        for (int k = 0; k < 3; k++) {
            a->ahead[k] += (c->two ? 0.5 : 1) * entries[k] + given[k];
            if (c->two) b->ahead[k] += 0.5 * entries[k];
        }
        a->supports++;
        if (b) b->supports++;
        else if (c->owner == W.landing && !a->landed) {
            write_event(LANDING, c->i, -1, c->owner, a->t, &a->x, &a->ux, &a->vx, c->impulse[0],
                        c->impulse[1]);
            a->landed = 1;
            a->on = c->owner;
            a->slips = 1;
        }
        /* Halfway through the impulses the hop is left out. */
        double off = fabs(0.5 * (u[0] + v[0])), slip = fabs(v[1] + c->drift);
        double turn = fabs(v[2]) * a->radius, rest = REST * sqrt(W.g * a->radius);
        int driven = !b && W.surfaces[-1 - c->j].speed != 0 && c->owner != W.landing;
        if (off > CALM || slip > CALM || driven || (b && b->mode == RIDING)) {
            a->calm = 0;
            if (b) b->calm = 0;
        }
        if (off > rest || slip > rest || turn > rest || (b && b->mode == RIDING)) {
            a->rest = 0;
            if (b) b->rest = 0;
        }
    }
    for (int i = W.low; i < W.high; i++) {
        Disk *d = W.disks + i;
        Track *track = W.tracks + i;
        d->ends = -1;
        if (d->mode != FREE) continue;
        if (!d->supports) {
            d->calm = d->rest = 0;
            if (track->stays >= (W.interact ? LASTS : 3)) tell_separation(i);
            if (track->lasted || track->stays) d->on = -1;
            track->stays = 0;
            flush_track(i);
            continue;
        }
        const Contact *only = 0;
        int reason = -1;
        int owners = 0;
        for (int link = d->links; link >= 0; link = W.links[link]) {
            const Contact *c = W.contacts + link / 2;
            if (c->impulse[0] == 0) continue;
            if (!only || c->owner != only->owner || c->j >= 0) owners++;
            if (!only || c->impulse[0] > only->impulse[0]) only = c;
        }
        if (owners == 1 && only->j < 0) {
            double u[3], v[3];
            relative(only, 1, u);
            relative(only, 0, v);
            note_grip(d, only, u, v, h);
            if (!W.interact && W.until == UNTIL_SETTLED && !d->slips && d->since <= d->t + h
                    && lies(d, only, h)) {
                /* What rolled stops now, not when it began to. */
                if (only->arm > 0 && d->inertia > 0) d->since = MAX(d->since, d->t);
                settle(i, only, h);
            }
        } else {
            /* On several; of a surface it lies on, if any, it may still part. */
            int ground = -1;
            for (int link = d->links; link >= 0; link = W.links[link]) {
                const Contact *c = W.contacts + link / 2;
                if (c->impulse[0] > 0 && c->j < 0) ground = c->owner;
            }
            if (ground < 0 && track->stays >= LASTS) event_here(SEPARATION, i, track->ground);
            if (track->ground != ground) track->stays = 0;
            d->slips = 1;
            d->on = ground;
        }
        track->ground = d->on;
        if (d->on >= 0) track->stays++;
        d->changes++;
        if (d->mode == GONE) continue;
        track_lasting(i);
        for (int n = 0; n < 3; n++) d->entries[n] += d->gain[n];
        /* Held in a corner by what is at rest. */
        if (owners > 1 && !W.interact && W.until == UNTIL_SETTLED && track->lasted > 3) {
            const double *s = track->held + 3, *p = track->past + 3;
            double most = MAX(fabs(s[0]) + fabs(s[1]), fabs(p[0]) + fabs(p[1]));
            for (int link = d->links; link >= 0; link = W.links[link])
                if (W.contacts[link / 2].impulse[0] > 0)
                    most = MAX(most, fabs(W.contacts[link / 2].other[1]));
            if (most + fabs(s[2]) * d->radius < STOPPED) reason = BY_SETTLING;
        }
        if (W.until == UNTIL_LANDED && d->landed) reason = BY_LANDING;
        d->ends = reason;
    }
    /* All are asked for what they are ahead before the state of any changes. */
    for (int i = W.low; i < W.high; i++)
        if (W.disks[i].mode == FREE && W.disks[i].ends >= 0) take_back(i);
    for (int i = W.low; i < W.high; i++)
        if (W.disks[i].mode == FREE && W.disks[i].ends >= 0) end_in_contact(i, W.disks[i].ends);
}

/* Take back what the second half of this step's impulses did to the ledger by disk i. */
void take_back(int i) {
    Disk *d = W.disks + i;
    for (int link = d->links; link >= 0; link = W.links[link]) {
        const Contact *c = W.contacts + link / 2;
        double u[3], v[3], entries[3], given[3];
        if (c->impulse[0] == 0) continue;
        relative(c, 1, u);
        relative(c, 0, v);
        share_out(c, u, v, W.before, entries, given);
        for (int n = 0; n < 3; n++) {
            double back = (c->two ? 0.5 : 1) * entries[n];
            if (c->i != i && !c->two) back = 0;
            W.books[3 * c->owner + n] -= back;
            d->entries[n] -= back;
            if (c->i == i) {
                W.books[3 * W.ride_owner + n] -= given[n];
                d->entries[n] -= given[n];
            }
        }
    }
}

/* End the track of a disk in lasting contact in the state halfway through this step's impulses. */
void end_in_contact(int i, int reason) {
    Disk *d = W.disks + i;
    Track *track = W.tracks + i;
    const double *s = track->held;
    d->x = s[1];
    d->y = s[2];
    d->vx = s[3];
    d->vy = s[4];
    d->spin = s[5];
    if (d->t > track->knot[0]) knot_now(i);
    track->lasted = 0;
    if (reason == BY_SETTLING) event_here(SETTLE, i, W.surfaces[d->held[0]].owner);
    finish(i, reason);
}
