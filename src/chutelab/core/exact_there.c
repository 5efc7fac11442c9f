/* Which obstacles exist at a time, and which are touched at once where pieces end: what the exact engine asks again and
   again about a machine. */

#include "exact_pieces.h"

/* The obstacle that a face of a piece is, 1 the left one or the outer one, -1 the other. */
int face_of(int piece, int face) {
    if (piece < O.faces) return piece;
    if (piece == O.faces + O.arcs) return face > 0 ? O.pulley : NONE;
    return O.first_arc + piece - O.faces + (face > 0 ? 0 : O.arcs);
}

/* Number of changes of gates up to an age of the particle. */
int epoch_at(double t) {
    int count = 0;
    while (count < O.change_count && O.changes[count] - A.given->release <= t) count++;
    return count;
}

/* Whether an obstacle exists in an epoch; an end shared by pieces does while any of them does. */
int is_there(int obstacle, int epoch) {
    if (!O.change_count) return 1;
    const Obstacle *o = O.all + obstacle;
    double since = epoch ? O.changes[epoch - 1] : -INFINITY;
    int there = is_open(o, NONE, since);
    for (int n = o->tips; n != NONE && !there; n = O.tips[n].next) there = is_open(o, n / 2, since);
    return there;
}

static const Member *member_of(int set, int obstacle) {
    for (int m = set == NONE ? NONE : O.sets[set]; m != NONE; m = O.members[m].next)
        if (O.members[m].obstacle == obstacle) return O.members + m;
    return 0;
}

/* Whether an obstacle, or a face of a segment (0 left, 1 right), is in a set. */
int is_shared(int set, int obstacle, int face) {
    const Member *m = member_of(set, obstacle);
    return m && (m->faces & (1 << face)) != 0;
}

/* Whether an end (0, 1) of an arc is at the place of a set. */
int has_edge(int set, int obstacle, int edge) {
    const Member *m = member_of(set, obstacle);
    return m && (m->edges & (1 << edge)) != 0;
}

/* The other face of an arc, or -1. */
int back_of(int circle) {
    if (circle < O.first_arc || circle >= O.first_arc + 2 * O.arcs) return NONE;
    return circle < O.first_arc + O.arcs ? circle + O.arcs : circle - O.arcs;
}

/* Whether something touches a circle without being met, since both are in one set: they are tangent there, and have no
   other point in common. For a mass point both faces of a piece are at the same place. */
int is_beside(int circle, int obstacle, int face) {
    int point = O.arcs && A.given->radius <= O.touch;
    for (int k = 0; k < 1 + point; k++) {
        int c = k ? back_of(circle) : circle;
        for (int m = c == NONE ? NONE : O.all[c].members; m != NONE; m = O.members[m].alike) {
            int set = O.members[m].set;
            if (is_shared(set, obstacle, face)) return 1;
            if (!point) continue;
            if (is_shared(set, obstacle, 1 - face)) return 1;
            int back = back_of(obstacle);
            if (back != NONE && is_shared(set, back, face)) return 1;
        }
    }
    return 0;
}

/* The corner that a mass point is in when it touches a face, or a circle, at a place: the number 2 tip + face of the
   sector beside the end there; else -1. */
int corner_at(int obstacle, int side, double x, double y) {
    int piece = obstacle, inside = side < 0;
    if (obstacle >= O.faces) {
        int bend = obstacle - O.first_arc;
        inside = bend >= O.arcs;
        if (inside) bend -= O.arcs;
        if (bend < 0 || bend >= O.bent) return NONE;
        piece = O.faces + bend;
    }
    for (int tip = 2 * piece; tip < 2 * piece + 2; tip++)
        if (MAX(fabs(x - O.tips[tip].x), fabs(y - O.tips[tip].y)) <= CLEAR * O.touch) return 2 * tip + inside;
    return NONE;
}

/* Whether a face, or a circle, is one of the two that bound the sector of a corner. */
int bounds(int corner, int obstacle, int side, int epoch) {
    int face = corner % 2 ? -1 : 1;
    Onward one = { face_of(corner / 4, face), face, 0 }, two = O.opposite[2 * epoch * O.tip_count + corner];
    return (one.obstacle == obstacle && (obstacle >= O.faces || one.side == side))
        || (two.obstacle == obstacle && (obstacle >= O.faces || two.side == side));
}
