#include <string.h>
#include "layout.h"
#include "memory.h"

#define PAGE 65536.0
#define MOST 4294901760.0 /* bytes; all that addresses of 32 bits reach, in whole pages */

extern unsigned char __heap_base;

static Room R;

/* End of the memory that has been in use; beyond it all bytes are zero. */
static double used;

EXPORT Room *room(void) {
    R.first = (int)(((unsigned long)&__heap_base + 15) / 16 * 16);
    return &R;
}

void *set_apart(double count, unsigned size) {
    double bytes = size * count, have = PAGE * __builtin_wasm_memory_size(0);
    double begin = R.end > 0.0 ? R.end : (double)(unsigned long)&__heap_base;
    begin = 16.0 * (double)(unsigned long)((begin + 15.0) / 16.0);
    double to = begin + (bytes > 1.0 ? bytes : 1.0);
    unsigned long pages = to > have ? (unsigned long)((to - have + PAGE - 1.0) / PAGE) : 0;
    if (to > MOST || (pages && __builtin_wasm_memory_grow(0, pages) == (unsigned long)-1)) {
        R.lacks = 1;
        return 0;
    }
    used = used > to ? used : to;
    R.end = to;
    return (void *)(unsigned long)begin;
}

void *reserve(double count, unsigned size) {
    double before = used;
    void *place = set_apart(count, size);
    double begin = (double)(unsigned long)place;
    if (place && begin < before) memset(place, 0, (unsigned long)((before < R.end ? before : R.end) - begin));
    return place;
}

void *stretch(const void *rows, int count, int had, unsigned size) {
    void *place = reserve(2.0 * had, size);
    if (place) memcpy(place, rows, (unsigned long)count * size);
    return place;
}

int has_room(void) { return !R.lacks; }
