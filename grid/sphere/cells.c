/* SPDX-License-Identifier: MIT */
#include "cells.h"

#include <string.h>

#define EVICT_LOOK 64 /* cells looked at for the oldest when the pool is full: bounds the work */

size_t cells_bytes(uint32_t room, uint32_t directions)
{
    return room * sizeof(struct cell) + directions * sizeof(uint32_t);
}

void cells_init(struct cells *c, void *memory, uint32_t room, uint32_t directions)
{
    *c = (struct cells){.cell = memory, .room = room, .directions = directions};
    c->first = (uint32_t *)(void *)(c->cell + room);
    memset(c->cell, 0, room * sizeof *c->cell);
    cells_clear(c);
}

void cells_clear(struct cells *c)
{
    for (uint32_t i = 0; i < c->room; i++) {
        c->cell[i].next = i + 1 < c->room ? i + 1 : CELLS_NONE;
        c->cell[i].direction = RINGS_NONE;
    }
    for (uint32_t d = 0; d < c->directions; d++)
        c->first[d] = CELLS_NONE;
    c->free = 0;
    c->used = c->hand = 0;
}

void cells_release(struct cells *c, uint32_t i)
{
    struct cell *gone = &c->cell[i];
    uint32_t *at = &c->first[gone->direction];
    while (*at != i)
        at = &c->cell[*at].next;
    *at = gone->next;
    gone->direction = RINGS_NONE;
    gone->next = c->free;
    c->free = i;
    c->used--;
}

/* The direction that loses the cell. */
static uint32_t evict(struct cells *c)
{
    uint32_t oldest = c->hand;
    for (uint32_t i = 0; i < EVICT_LOOK; i++) {
        uint32_t at = (c->hand + i) % c->room;
        if (c->cell[at].t_ref_ns < c->cell[oldest].t_ref_ns)
            oldest = at;
    }
    c->hand = (c->hand + EVICT_LOOK) % c->room;
    uint32_t direction = c->cell[oldest].direction;
    cells_release(c, oldest);
    return direction;
}

/* Where the cell of `layer` hangs, or would: the link to it. */
static uint32_t *link_of(struct cells *c, uint32_t direction, uint16_t layer)
{
    uint32_t *at = &c->first[direction];
    while (*at != CELLS_NONE && c->cell[*at].layer < layer)
        at = &c->cell[*at].next;
    return at;
}

uint32_t cells_take(struct cells *c, uint32_t direction, uint16_t layer, uint32_t *evicted)
{
    uint32_t *at = link_of(c, direction, layer);
    *evicted = RINGS_NONE;
    if (*at != CELLS_NONE && c->cell[*at].layer == layer)
        return *at;
    if (c->free == CELLS_NONE) {
        *evicted = evict(c);
        at = link_of(c, direction, layer);
    }
    uint32_t i = c->free;
    c->free = c->cell[i].next;
    c->cell[i] = (struct cell){.next = *at, .direction = direction, .layer = layer};
    *at = i;
    c->used++;
    return i;
}
