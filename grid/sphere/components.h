/* SPDX-License-Identifier: MIT */
/*
 * components - which cells of a spherical grid hang together: cells are neighbours when they, closed, share a point
 * (26 neighbours; azimuth wraps, the cells around a pole all meet there). Kept up as cells come and go: a union-find
 * joins them; what may have fallen apart is flooded anew by components_settle, over its own cells only. Knows where
 * cells are, not what they say. Pure; all memory comes from the caller.
 *
 * Every component has a label that lasts: of two that join, the larger's; of one that falls apart, the largest part
 * keeps it. Labels count up and are never used again.
 */
#ifndef SONARD_COMPONENTS_H
#define SONARD_COMPONENTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "grid/picture/rings.h"

#define COMPONENTS_NONE UINT32_MAX

struct component {
    uint32_t label;   /* from 1 */
    uint32_t cells;   /* in it */
    uint32_t seeds;   /* of these */
    uint64_t t_label; /* when the label was made, by the caller's clock */
};

/* A cell of the grid that was put in. */
struct component_cell {
    struct component own; /* of the root of each tree */
    uint32_t direction;
    uint16_t layer;
    uint8_t state;       /* enum component_state of components.c */
    bool seed;           /* member enough to make a component of its neighbours worth a report */
    uint8_t harm;        /* of a root: what the loss of cells did, enum component_harm */
    bool leaving;        /* in the list of cells that were removed since the last settling */
    uint32_t parent;     /* in the union-find's tree; a root is its own */
    uint32_t next, prev; /* circle of all cells of the component */
    uint32_t chain;      /* in the table's bucket; in the list of free cells */
    uint32_t round;      /* in which it was put last */
    uint64_t seen;       /* by which search last */
};

struct components {
    const struct rings *rings;
    struct component_cell *cell; /* [room] */
    uint32_t *bucket;            /* [buckets], a power of two */
    uint32_t *work, *left;       /* [room] each: of the flood; cells that leave */
    uint32_t room, buckets;
    uint32_t free, high; /* first free cell; no cell at or beyond `high` was ever used */
    uint32_t used;       /* cells that are in */
    uint32_t leaving;    /* how many */
    uint32_t round;
    uint32_t labels;   /* given out so far */
    uint64_t searches; /* for ways around cells that left, twice how many there were ... */
    uint32_t searched; /* ... and cells that they went through since the last settling */
    bool turned;       /* directions were numbered anew: who touches whom is not as it was */
};

/** components_bytes - memory for components_init; room in [1, 2^24]. */
size_t components_bytes(uint32_t room);

/** components_init - no cells; memory of components_bytes(room), max_align_t-aligned; rings is kept by reference. */
void components_init(struct components *c, void *memory, const struct rings *rings, uint32_t room);

/**
 * components_put - the cell (direction, layer) is in, as a seed or not, whether it was before or not. Returns its
 * index, by which callers may keep data of their own and which holds until it is removed; COMPONENTS_NONE: no room.
 * now_ns: what the label of a new component says of its age. Cost: the neighbours that exist, times the inverse of
 * Ackermann's function.
 */
uint32_t components_put(struct components *c, uint32_t direction, uint16_t layer, bool seed, uint64_t now_ns);

/** components_remove - the cell is out; false: it was not in. What hangs together is right again after settling. Cost:
 * its neighbours; where they do not touch each other, a search for a way around. */
bool components_remove(struct components *c, uint32_t direction, uint16_t layer);

/**
 * components_settle - take what left since the last time out of its component, and flood this anew if no way was found
 * around what left. Cost: the cells of these components; of those that are not flooded, a walk.
 */
void components_settle(struct components *c, uint64_t now_ns);

/**
 * components_begin, components_end - between them every cell that is in is put;
 * the end removes the others, settles. components_leave - before the end: removes at most so many of the others, from
 * cell *at on, which is 0 at first. True: there are no more.
 */
void components_begin(struct components *c);
bool components_leave(struct components *c, uint32_t *at, uint32_t most);
void components_end(struct components *c, uint64_t now_ns);

/**
 * components_turn - the axes of the rings have turned clockwise by turn_rad since the last end: each cell is in the
 * direction that holds its middle now (rings_turned), so that those put next keep their
 * labels. Before components_begin.
 */
void components_turn(struct components *c, double turn_rad);

/** components_of - the component of cell `index` (as returned by components_put), as of the last settling. */
const struct component *components_of(struct components *c, uint32_t index);

/* Visits a cell of each component; the others of it by its `next`, until they come round. Settled only. */
#define COMPONENTS_EACH(c, root)                                                                                  \
    for (uint32_t root = 0; root < (c)->high; root++)                                                             \
        if (components_is_root(c, root))

bool components_is_root(const struct components *c, uint32_t index);

#endif
