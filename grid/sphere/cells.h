/* SPDX-License-Identifier: MIT */
/*
 * cells - the pool of the sphere's cells and their lists: only cells that exist are stored, those of a direction hang
 * together in order of range. Knows where a cell belongs, not what its evidence means.
 *
 * Every cell of the pool is in exactly one list: a direction's, that of the cells gone in this turn, or the free one.
 */
#ifndef SONARD_CELLS_H
#define SONARD_CELLS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "layers.h"
#include "grid/picture/rings.h"

#define CELLS_NONE UINT32_MAX
#define CELLS_DIRECTION                                                                                           \
    0xfffffu             /* the directions that a cell can tell apart: more than rings of 0.25 degrees have */
#define CELLS_MISSES 15u /* that a cell can count: the surest one is gone after ten that covered it all */

enum cell_state {
    CELL_FREE,
    CELL_GONE, /* beams passed it without an echo in the present revolution: kept for whoever asks what vanished */
    CELL_LIVE, /* this and the next: in the list of its direction */
    CELL_LOCKED, /* live, and frozen: it neither changes nor fades nor makes room */
};

/* One cache line. Its limits in range and angle are those of its layer and direction. */
struct cell {
    float point_m[3];    /* of the echo, from the anchor, in the grid's axes */
    float ball_m2;       /* variance of that point, along each axis */
    float near_m;        /* how far the reflector's near edge lies before its point */
    float sd_m;          /* of its range */
    float logodds;       /* at t_ref_ns */
    uint32_t t_first_ms; /* first echo, after the grid's first ping */
    uint64_t t_ref_ns;   /* last hit or miss */
    uint64_t t_echo_ns;  /* last echo */
    uint32_t next;       /* in the same direction, farther; in the other lists: just the next */
    uint32_t seq;        /* of the last ping that hit or missed it, of `sensor` */
    uint32_t direction : 20, state : 2, sensor : 6;
    uint32_t misses : 4; /* beams since the last echo that passed it without one; saturates */
    uint16_t layer : 15;
    uint16_t pending : 1; /* its one echo does not block until a second one confirms it */
    uint16_t echoes;      /* saturates */
};

_Static_assert(sizeof(struct cell) == 64, "a cell is one cache line");

struct cells {
    struct cell *cell; /* [room] */
    uint32_t *first;   /* [directions]: nearest cell of each, or CELLS_NONE */
    uint64_t *live;    /* a bit for each cell: most of a pool is free most of the time ... */
    uint64_t *held;    /* ... and for each direction that has some */
    uint32_t room, directions;
    uint32_t used; /* live */
    uint32_t free, gone, hand;
};

/** cells_bytes - memory for cells_init. */
size_t cells_bytes(uint32_t room, uint32_t directions);

/** cells_init - an empty pool in memory of cells_bytes(room, directions), 64-aligned. */
void cells_init(struct cells *c, void *memory, uint32_t room, uint32_t directions);

/** cells_clear - all cells free. */
void cells_clear(struct cells *c);

/**
 * cells_take - the cell of (direction, layer), made with no evidence when it does not exist. When that needs room and
 * there is none, a gone cell makes it, or the oldest of the next few live ones: *evicted is its direction, else
 * RINGS_NONE. CELLS_NONE when all of those are locked.
 */
uint32_t cells_take(struct cells *c, uint32_t direction, uint16_t layer, uint32_t *evicted);

/** cells_release - live cell i becomes free. */
void cells_release(struct cells *c, uint32_t i);

/** cells_lose - live cell i is gone: in no direction any more, but to be read until cells_forget_gone. */
void cells_lose(struct cells *c, uint32_t i);

/** cells_forget_gone - the cells that a ping of this sensor made go become free. */
void cells_forget_gone(struct cells *c, uint32_t sensor);

/**
 * cells_unlink_all, cells_insert - all live cells leave their directions; then each is hung into one, RINGS_NONE: it
 * becomes free. Returns where it is: not i when its layer's cell was hung there before; then i becomes free, too.
 * CELLS_NONE: nowhere. cells_move - the same of one that hangs in a direction, and in a layer; below 0: it becomes
 * free.
 */
void cells_unlink_all(struct cells *c);
uint32_t cells_insert(struct cells *c, uint32_t i, uint32_t direction);
uint32_t cells_move(struct cells *c, uint32_t i, uint32_t direction, int32_t layer);

/** cells_next - the first bit set from i on; n: there is none. */
static inline uint32_t cells_next(const uint64_t *bits, uint32_t i, uint32_t n)
{
    for (; i < n; i = (i | 63) + 1) {
        const uint64_t word = bits[i / 64] >> i % 64;
        if (word)
            return i + (uint32_t)__builtin_ctzll(word);
    }
    return n;
}

#define CELLS_BITS(bits, i, n) for (uint32_t i = cells_next(bits, 0, n); i < (n); i = cells_next(bits, i + 1, n))

/* Visits all live cells, in the pool's order; the one visited may be released or replaced meanwhile. */
#define CELLS_EACH(c, i) CELLS_BITS((c)->live, i, (c)->room)

/* Visits all directions that have cells. */
#define CELLS_DIRECTIONS(c, d) CELLS_BITS((c)->held, d, (c)->directions)

#endif
