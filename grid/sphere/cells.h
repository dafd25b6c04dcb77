/* SPDX-License-Identifier: MIT */
/*
 * cells - the pool of the sphere's cells and their lists: only cells that exist are stored, those of a direction hang
 * together in order of range. Knows where a cell belongs, not what its evidence means.
 *
 * Every cell of the pool is in exactly one list: a direction's, or the free one.
 */
#ifndef SONARD_CELLS_H
#define SONARD_CELLS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rings.h"

#define CELLS_NONE UINT32_MAX

struct cell {
    float point_m[3]; /* of the echo, from the anchor, in the grid's axes */
    float near_m;     /* how far the reflector's near edge lies before its point */
    float sd_m;
    float logodds;     /* at t_ref_ns */
    uint64_t t_ref_ns; /* last hit or miss */
    uint64_t t_first_ns, t_echo_ns;
    uint32_t next;      /* in the same direction, farther; in the free list: the next free */
    uint32_t direction; /* RINGS_NONE: free */
    float range_m;      /* of the point, from the grid's centre */
    uint16_t layer;
    uint16_t echoes; /* saturates */
};

struct cells {
    struct cell *cell; /* [room] */
    uint32_t *first;   /* [directions]: nearest cell of each, or CELLS_NONE */
    uint32_t room, directions;
    uint32_t used, free, hand;
};

/** cells_bytes - memory for cells_init. */
size_t cells_bytes(uint32_t room, uint32_t directions);

/** cells_init - an empty pool in memory of cells_bytes(room, directions), 64-aligned. */
void cells_init(struct cells *c, void *memory, uint32_t room, uint32_t directions);

/** cells_clear - all cells free. */
void cells_clear(struct cells *c);

/**
 * cells_take - the cell of (direction, layer), made with no evidence when it does not exist. When that needs room and
 * there is none, the oldest of the next few cells is released: *evicted is its direction, else RINGS_NONE.
 */
uint32_t cells_take(struct cells *c, uint32_t direction, uint16_t layer, uint32_t *evicted);

/** cells_release - cell i becomes free. */
void cells_release(struct cells *c, uint32_t i);

/* Visits all cells that exist, in the pool's order; the one visited may be released or replaced meanwhile. */
#define CELLS_EACH(c, i)                                                                                          \
    for (uint32_t i = 0; i < (c)->room; i++)                                                                      \
        if ((c)->cell[i].direction != RINGS_NONE)

#endif
