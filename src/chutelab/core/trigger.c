/* Surfaces that appear, vanish or begin to move when another one is touched for the first time. If that is an impact, the
   step ends at it; if something comes to lie on the surface, it happens at the end of that step. */

#include "core.h"

/* Whether a surface has a trigger for something it does (`enum Doing`). */
int is_triggered(int owner, int doing) {
    for (const Trigger *g = W.triggers; g < W.triggers + W.trigger_count; g++)
        if (g->surface == owner && g->doing == doing) return 1;
    return 0;
}

/* Report that a surface is touched at t. */
void touch(int owner, double t) {
    for (Trigger *g = W.triggers; g < W.triggers + W.trigger_count; g++) {
        if (g->by != owner || g->t < INFINITY) continue;
        g->t = t > W.t ? t : W.step_end;
        W.step_end = MIN(W.step_end, g->t);
        for (Surface *s = W.surfaces; s < W.surfaces + W.surface_count; s++) {
            if (s->owner != g->surface) continue;
            if (g->doing == GOES) s->closes = g->t;
            if (g->doing == COMES) s->opens = g->t;
            if (g->doing != STARTS) continue;
            Mover *m = W.movers + s->mover;
            m->begins = g->t;
            m->t = s->posed = NAN;
        }
    }
}
