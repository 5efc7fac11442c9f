/* Which disks may meet in a step: a hash grid of the boxes that the disks can reach. It also lists the surfaces near a
   disk. */

#include <string.h>
#include "core.h"

/* Greatest number of cells that one box is entered in. A disk with a larger box (a fast one among slow ones) is compared
   with all others instead: such disks are the `W.wide_count` last entries of `W.found`, which has room for two entries
   per disk. */
#define MOST_CELLS 256
/* Margin of the boxes, in radii: a blow may lead a disk so far off its path before its neighbours have to be looked up
   again. */
#define SKIN 0.05
/* Margin, in radii, round the box of a disk within which its nearby surfaces are listed. */
#define ROOM 1.0

static int bucket(int ix, int iy) {
    unsigned h = (unsigned)ix * 73856093u ^ (unsigned)iy * 19349663u;
    return (int)((h ^ h >> 15) & (unsigned)(W.bucket_count - 1));
}

static void box_of(const Disk *d, double end, double room, double *box) {
    double h = end - d->t, x = d->x + (d->vx + 0.5 * W.gx * h) * h;
    double y = d->y + (d->vy + 0.5 * W.gy * h) * h;
    /* Half of TOUCH for each of two disks, what the contact solver may change, and the sagitta of the parabola. */
    double margin = d->radius * (1 + TOUCH + room) + W.soft * h + 0.125 * W.g * h * h;
    box[0] = MIN(d->x, x) - margin;
    box[1] = MIN(d->y, y) - margin;
    box[2] = MAX(d->x, x) + margin;
    box[3] = MAX(d->y, y) + margin;
}

static int cell_at(double x) {
    double n = floor(x / W.cell);
    return n < -1e9 ? -1000000000 : n > 1e9 ? 1000000000 : (int)n;
}

/* The first and last columns and rows of a box, and its number of cells. */
typedef struct { int x0, x1, y0, y1; double cells; } Span;

static Span span_of(const double *box) {
    Span s = {cell_at(box[0]), cell_at(box[2]), cell_at(box[1]), cell_at(box[3]), 0};
    s.cells = ((double)s.x1 - s.x0 + 1) * ((double)s.y1 - s.y0 + 1);
    return s;
}

/* Box round all free disks, and whether disks outside it are in the grid, too: most steps need none of these. */
static double around[4];
static int has_all;

static void enter(int i, Span s) {
    Disk *d = W.disks + i;
    if (s.cells > MOST_CELLS || W.cell_count + s.cells > W.cell_room) {
        if (!d->wide) W.found[2 * W.disk_count - ++W.wide_count] = i;
        d->wide = 1;
        return;
    }
    for (int ix = s.x0; ix <= s.x1; ix++)
        for (int iy = s.y0; iy <= s.y1; iy++) {
            int b = bucket(ix, iy);
            Cell *c = W.cells + W.cell_count;
            c->disk = i; c->ix = ix; c->iy = iy; c->next = W.heads[b];
            W.heads[b] = W.cell_count++;
        }
}

/* Whether two disks can collide: their kinds may pass through each other, and joined ones may be exempt. */
static int can_collide(int i, int j) {
    if (!W.passes) return 1;
    return pair_of(W.disks[i].kind, W.disks[j].kind)->restitution >= 0 && !are_joined(i, j);
}

static int overlaps(const Disk *a, const double *box) {
    return a->left < box[2] && a->right > box[0] && a->bottom < box[3] && a->top > box[1];
}

/* Enter all disks, if a box that is to be compared with them is not within that of the free disks. */
static void enter_rest(const double *box) {
    int inside = box[0] >= around[0] && box[1] >= around[1] && box[2] <= around[2] && box[3] <= around[3];
    if (has_all || inside) return;
    has_all = 1;
    for (EACH_LIVE(i))
        if (!overlaps(W.disks + i, around)) enter(i, span_of(&W.disks[i].left));
}

/* Write the disks whose boxes overlap a box, which covers the cells `s`, to `W.found`; return how many. */
static int query(int i, const double *box, Span s) {
    enter_rest(box);
    int n = 0, stamp = ++W.stamp;
    W.disks[i].mark = stamp;
    if (s.cells > MOST_CELLS) {
        for (EACH_LIVE(j))
            if (j != i && is_live(W.disks + j) && overlaps(W.disks + j, box)) W.found[n++] = j;
        return n;
    }
    for (int ix = s.x0; ix <= s.x1; ix++)
        for (int iy = s.y0; iy <= s.y1; iy++)
            for (int c = W.heads[bucket(ix, iy)]; c >= 0; c = W.cells[c].next) {
                int j = W.cells[c].disk;
                Disk *o = W.disks + j;
                if (W.cells[c].ix != ix || W.cells[c].iy != iy || o->mark == stamp) continue;
                o->mark = stamp;
                if (is_live(o) && overlaps(o, box)) W.found[n++] = j;
            }
    for (int k = 1; k <= W.wide_count; k++) {
        int j = W.found[2 * W.disk_count - k];
        if (W.disks[j].mark == stamp) continue;
        W.disks[j].mark = stamp;
        if (is_live(W.disks + j) && overlaps(W.disks + j, box)) W.found[n++] = j;
    }
    return n;
}

/* Write a pair to place n of `W.near` and link it to both disks. */
static void add_near(int n, int i, int j) {
    for (int k = 2 * n; k < 2 * n + 2; k++) {
        Disk *d = W.disks + (W.near[k] = k % 2 ? j : i);
        W.near_links[k] = d->nears;
        d->nears = k;
    }
}

/* Whether two sleepers move apart or towards each other: belts carry them, or one of them. */
static int differ(const Disk *a, const Disk *b) {
    double most = SAME_SPEED * W.pace;
    return a->mode == ASLEEP && b->mode == ASLEEP && (fabs(a->ux - b->ux) > most || fabs(a->uy - b->uy) > most);
}

/* Whether a disk looks for those that it may meet: a free one, or a sleeper that a belt carries if sleepers may `meet`. */
static int seeks(const Disk *d, int meet) {
    return d->mode == FREE || (meet && d->mode == ASLEEP && (d->ux != 0 || d->uy != 0));
}

/* Whether any two sleepers do. */
static int any_differ(void) {
    const Disk *one = 0;
    for (EACH_LIVE(i)) {
        const Disk *d = W.disks + i;
        if (d->mode != ASLEEP) continue;
        if (!one) one = d;
        if (differ(one, d)) return 1;
    }
    return 0;
}

/* List all pairs that may meet before `end`; return 0 if there is no room for them. */
int list_near(double end) {
    double extent = 0;
    int live = 0, meet = W.interact && any_differ();
    W.near_count = W.later_count = W.cell_count = W.wide_count = 0;
    has_all = 1;
    for (int k = 0; k < 4; k++) around[k] = k < 2 ? INFINITY : -INFINITY;
    for (EACH_LIVE(i)) {
        Disk *d = W.disks + i;
        d->wide = 0;
        d->nears = -1;
        box_of(d, end, W.interact ? SKIN : 0, &d->left);
        extent += MAX(d->right - d->left, d->top - d->bottom);
        live++;
        if (!seeks(d, meet)) continue;
        around[0] = MIN(around[0], d->left);
        around[1] = MIN(around[1], d->bottom);
        around[2] = MAX(around[2], d->right);
        around[3] = MAX(around[3], d->top);
    }
    if (!W.interact) return 1;
    /* With cells of 1.5 times the mean box, most boxes overlap two to four cells. */
    W.cell = live ? 1.5 * extent / live : 1;
    memset(W.heads, 0xff, (unsigned long)W.bucket_count * sizeof(int));
    /* Riders and most sleepers can meet free disks only: they are entered first and query no others. */
    for (EACH_LIVE(i)) {
        if (seeks(W.disks + i, meet)) continue;
        if (overlaps(W.disks + i, around)) enter(i, span_of(&W.disks[i].left));
        else has_all = 0;
    }
    for (EACH_LIVE(i)) {
        const Disk *d = W.disks + i;
        if (!seeks(d, meet)) continue;
        Span span = span_of(&d->left);
        int n = query(i, &d->left, span);
        for (int k = 0; k < n; k++) {
            const Disk *o = W.disks + W.found[k];
            if (!can_collide(i, W.found[k]) || (d->mode != FREE && o->mode != FREE && !differ(d, o))) continue;
            if (W.near_count >= W.near_room) return 0;
            add_near(W.near_count++, W.found[k], i);
        }
        enter(i, span);
    }
    return 1;
}

/* Add the pairs that a disk may meet in and that are not listed yet, after its path has changed within the step. */
void list_again(int i) {
    const Disk *d = W.disks + i;
    int n = W.interact && W.later_count >= 0 ? query(i, &d->left, span_of(&d->left)) : 0;
    for (int k = 0; k < n; k++) {
        int j = W.found[k], link = d->nears;
        while (link >= 0 && W.near[link ^ 1] != j) link = W.near_links[link];
        if (link >= 0 || !can_collide(i, j)) continue;
        if (W.near_count + W.later_count >= W.near_room) {
            W.later_count = -1;
            return;
        }
        add_near(W.near_count + W.later_count++, j, i);
    }
}

/* Update the box of a disk whose path has changed within the step; return 1 if it reaches further now. */
int enter_again(int i, double end) {
    Disk *d = W.disks + i;
    double box[4];
    box_of(d, end, 0, box);
    if (box[0] >= d->left && box[1] >= d->bottom && box[2] <= d->right && box[3] <= d->top) return 0;
    box_of(d, end, W.interact ? SKIN : 0, box);
    d->left = MIN(d->left, box[0]);
    d->bottom = MIN(d->bottom, box[1]);
    d->right = MAX(d->right, box[2]);
    d->top = MAX(d->top, box[3]);
    if (W.interact) enter(i, span_of(&d->left));
    list_again(i);
    return 1;
}

/* Write the disks that disk i may meet in the rest of the step to `W.found`; return how many. */
int reachable(int i) {
    int n = W.interact ? query(i, &W.disks[i].left, span_of(&W.disks[i].left)) : 0, kept = 0;
    for (int k = 0; k < n; k++)
        if (can_collide(i, W.found[k])) W.found[kept++] = W.found[k];
    return kept;
}

/* List the surfaces that a disk may reach in this step, perhaps some more, in ascending order. The list is made anew only
   if the disk leaves its zone; among a hundred pegs a disk is near three. */
int surfaces_near(int i, const int **list) {
    Disk *d = W.disks + i;
    double *zone = d->zone;
    *list = W.everything;
    if (W.surface_count <= MAX_NEARBY) return W.surface_count;
    if (!(zone[0] <= d->left && zone[1] <= d->bottom && zone[2] >= d->right && zone[3] >= d->top)) {
        double room = ROOM * d->radius;
        zone[0] = d->left - room;
        zone[1] = d->bottom - room;
        zone[2] = d->right + room;
        zone[3] = d->top + room;
        d->nearby_count = 0;
        for (int k = 0; k < W.surface_count && d->nearby_count <= MAX_NEARBY; k++) {
            const double *box = W.surfaces[k].swept;
            if (box[0] >= zone[2] || box[2] <= zone[0] || box[1] >= zone[3] || box[3] <= zone[1]) continue;
            if (d->nearby_count < MAX_NEARBY) W.nearby[i * MAX_NEARBY + d->nearby_count] = k;
            d->nearby_count++;
        }
    }
    if (d->nearby_count > MAX_NEARBY) return W.surface_count;
    *list = W.nearby + i * MAX_NEARBY;
    return d->nearby_count;
}

/* Whether a disk released at (x, y) would overlap no other disk, no closed gate and no moving surface. */
int place_is_free(int i, double x, double y, double t) {
    double r = W.disks[i].radius, box[4] = {x - r, y - r, x + r, y + r}, nx, ny;
    for (int k = 0; k < W.surface_count && (W.gate_count || W.mover_count); k++) {
        const Surface *s = surface_at(k, t);
        if ((s->gate < 0 && s->mover < 0) || s->there != THERE) continue;
        double gap = has_corners(W.disks + i) ? clear_of_corners(W.disks + i, x, y, k, t) : gap_to(s, x, y, r, &nx, &ny);
        if (gap < -TOUCHING * r) return 0;
    }
    if (!W.interact) return 1;
    int n = query(i, box, span_of(box));
    for (int k = 0; k < n; k++) {
        if (is_cornered(i, W.found[k])) {
            if (can_collide(i, W.found[k]) && would_overlap(i, x, y, W.found[k], t, TOUCHING * r)) return 0;
            continue;
        }
        Disk o = W.disks[W.found[k]];
        advance(&o, t);
        double apart = square(o.radius + (1 - TOUCHING) * r);
        if (can_collide(i, W.found[k]) && square(o.x - x) + square(o.y - y) < apart) return 0;
    }
    return 1;
}
