/* SPDX-License-Identifier: MIT */
#include "cells.h"

#include <string.h>

#define EVICT_LOOK 64 /* cells looked at for the oldest when the pool is full: bounds the work */

static size_t bits_bytes(uint32_t n)
{
    return ((size_t)n + 63) / 64 * sizeof(uint64_t);
}

static void set_bit(uint64_t *bits, uint32_t i, bool set)
{
    const uint64_t bit = UINT64_C(1) << i % 64;
    bits[i / 64] = set ? bits[i / 64] | bit : bits[i / 64] & ~bit;
}

size_t cells_bytes(uint32_t room, uint32_t directions)
{
    return room * sizeof(struct cell) + bits_bytes(room) + bits_bytes(directions) + directions * sizeof(uint32_t);
}

void cells_init(struct cells *c, void *memory, uint32_t room, uint32_t directions)
{
    *c = (struct cells){.cell = memory, .room = room, .directions = directions};
    c->live = (uint64_t *)(void *)(c->cell + room);
    c->held = c->live + bits_bytes(room) / sizeof *c->live;
    c->first = (uint32_t *)(void *)(c->held + bits_bytes(directions) / sizeof *c->held);
    memset(c->cell, 0, room * sizeof *c->cell);
    cells_clear(c);
}

void cells_clear(struct cells *c)
{
    for (uint32_t i = 0; i < c->room; i++) {
        c->cell[i].next = i + 1 < c->room ? i + 1 : CELLS_NONE;
        c->cell[i].state = CELL_FREE;
    }
    memset(c->live, 0, bits_bytes(c->room));
    cells_unlink_all(c);
    c->free = 0;
    c->gone = CELLS_NONE;
    c->hand = 0;
}

static void unlink_cell(struct cells *c, uint32_t i)
{
    uint32_t *at = &c->first[c->cell[i].direction];
    while (*at != i)
        at = &c->cell[*at].next;
    *at = c->cell[i].next;
    set_bit(c->held, c->cell[i].direction, c->first[c->cell[i].direction] != CELLS_NONE);
    c->used--;
}

/* At that link. */
static void hang_in(struct cells *c, uint32_t i, uint32_t direction, uint32_t *at)
{
    c->cell[i].direction = direction & CELLS_DIRECTION;
    c->cell[i].next = *at;
    *at = i;
    set_bit(c->held, direction, true);
    c->used++;
}

static void set_state(struct cells *c, uint32_t i, enum cell_state state)
{
    set_bit(c->live, i, state == CELL_LIVE);
    c->cell[i].state = state;
}

static void set_free(struct cells *c, uint32_t i)
{
    set_state(c, i, CELL_FREE);
    c->cell[i].next = c->free;
    c->free = i;
}

void cells_release(struct cells *c, uint32_t i)
{
    unlink_cell(c, i);
    set_free(c, i);
}

void cells_lose(struct cells *c, uint32_t i)
{
    unlink_cell(c, i);
    set_state(c, i, CELL_GONE);
    c->cell[i].next = c->gone;
    c->gone = i;
}

void cells_forget_gone(struct cells *c, uint32_t sensor)
{
    for (uint32_t *at = &c->gone; *at != CELLS_NONE;) {
        uint32_t i = *at;
        if (c->cell[i].sensor == sensor) {
            *at = c->cell[i].next;
            set_free(c, i);
        } else {
            at = &c->cell[i].next;
        }
    }
}

/* Makes room. The direction that loses a cell for it, or RINGS_NONE. */
static uint32_t evict(struct cells *c)
{
    uint32_t oldest = c->gone;
    if (oldest != CELLS_NONE) {
        c->gone = c->cell[oldest].next;
        set_free(c, oldest);
        return RINGS_NONE;
    }
    for (uint32_t i = 0; i < EVICT_LOOK; i++) {
        uint32_t at = (c->hand + i) % c->room;
        if (c->cell[at].state == CELL_LIVE &&
            (oldest == CELLS_NONE || c->cell[at].t_ref_ns < c->cell[oldest].t_ref_ns))
            oldest = at;
    }
    c->hand = (c->hand + EVICT_LOOK) % c->room;
    if (oldest == CELLS_NONE)
        return RINGS_NONE;
    cells_release(c, oldest);
    return c->cell[oldest].direction;
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
        if (c->free == CELLS_NONE)
            return CELLS_NONE;
        at = link_of(c, direction, layer);
    }
    uint32_t i = c->free;
    c->free = c->cell[i].next;
    c->cell[i] = (struct cell){.layer = layer & LAYERS_MAX};
    set_state(c, i, CELL_LIVE);
    hang_in(c, i, direction, at);
    return i;
}

void cells_unlink_all(struct cells *c)
{
    for (uint32_t d = 0; d < c->directions; d++)
        c->first[d] = CELLS_NONE;
    memset(c->held, 0, bits_bytes(c->directions));
    c->used = 0;
}

uint32_t cells_insert(struct cells *c, uint32_t i, uint32_t direction)
{
    struct cell *cell = &c->cell[i];
    uint32_t *at = direction == RINGS_NONE ? NULL : link_of(c, direction, cell->layer);
    const uint32_t there = at ? *at : CELLS_NONE;
    if (!at || (there != CELLS_NONE && c->cell[there].layer == cell->layer)) {
        set_free(c, i);
        return there;
    }
    hang_in(c, i, direction, at);
    return i;
}

uint32_t cells_move(struct cells *c, uint32_t i, uint32_t direction, int32_t layer)
{
    unlink_cell(c, i);
    c->cell[i].layer = (uint32_t)layer & LAYERS_MAX;
    return cells_insert(c, i, layer < 0 ? RINGS_NONE : direction);
}
