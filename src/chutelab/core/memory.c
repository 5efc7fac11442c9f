#include <string.h>
#include "layout.h"
#include "memory.h"

#define MIN(a, b) ((a) < (b) ? (a) : (b))
#define MAX(a, b) ((a) > (b) ? (a) : (b))
#define PAGE 65536.0
#define MOST 4294901760.0 /* bytes that addresses of 32 bits reach, and whole pages make */

extern unsigned char __heap_base;
extern World W;
extern Plan P;
extern Drawing D;
extern Laws L;

/* Where the next array begins, and up to where memory has been in use: beyond it is zero. */
static double end, used;
static int lacks;

EXPORT double reserved(void) { return end; }

/* Free all arrays from a place on that `reserved` told; from 0 on all of them, and reset all structs. */
EXPORT void forget(double from) {
    used = MAX(used, end);
    end = from;
    lacks = 0;
    if (from > 0.0) return;
    end = (double)(unsigned long)&__heap_base;
    memset(&W, 0, sizeof W);
    memset(&P, 0, sizeof P);
    memset(&D, 0, sizeof D);
    memset(&L, 0, sizeof L);
}

void *reserve(double count, unsigned size) {
    double begin = 16.0 * (double)(unsigned long)((end + 15.0) / 16.0), bytes = size * count;
    double to = begin + (bytes > 1.0 ? bytes : 1.0), have = PAGE * __builtin_wasm_memory_size(0);
    if (to > MOST || (to > have
        && __builtin_wasm_memory_grow(0, (unsigned long)((to - have + PAGE - 1.0) / PAGE)) == (unsigned long)-1)) {
        lacks = 1;
        return 0;
    }
    end = to;
    void *place = (void *)(unsigned long)begin;
    if (begin < used) memset(place, 0, (unsigned long)(MIN(used, to) - begin));
    return place;
}

int has_room(void) { return !lacks; }
