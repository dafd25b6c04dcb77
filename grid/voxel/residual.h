/* SPDX-License-Identifier: MIT */
/*
 * residual - echoes that no submap keeps: of submaps that were forgotten, and those that lay beyond the current one's
 * box or found no memory. Per cube of 8 voxels of the world's lattice,
 * how many echoes the looks of others must outweigh there.
 *
 * A table of counts by two hashes of the cube, of which the lesser is believed (a count-min sketch; Cormode and
 * Muthukrishnan 2005): a count is never less than what was added, whatever the table's size. More than that it is
 * where cubes meet in the table, so a table that is too small makes water unknown,
 * and none free. Pure; the map owns it.
 */
#ifndef SONARD_RESIDUAL_H
#define SONARD_RESIDUAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define RESIDUAL_CUBE   8    /* voxels along a cube's side */
#define RESIDUAL_STAMPS 1024 /* of when something was added, by tile in plan */

struct residual {
    uint8_t *count;  /* [n], 0: nothing is known; else one more than the echoes */
    uint64_t *stamp; /* [RESIDUAL_STAMPS] the map's change at the last addition */
    uint32_t n;      /* a power of 2; 0: none */
    bool any;        /* something was added */
};

/** residual_cells - counts of a table beside so many bytes of tiles: a 64th of them, a power of 2 in [2^12, 2^22]. */
uint32_t residual_cells(size_t tile_bytes);

/** residual_good - may a table have so many? */
bool residual_good(size_t n);

/** residual_bytes - memory of n counts. */
size_t residual_bytes(uint32_t n);

/** residual_init - memory: residual_bytes(n), 8-byte aligned. */
void residual_init(struct residual *v, void *memory, uint32_t n);

void residual_clear(struct residual *v);

/** residual_add - something was forgotten in this cube (its voxels' places divided by RESIDUAL_CUBE) that
 * held so many echoes, or 0. */
void residual_add(struct residual *v, const int64_t cube[3], uint32_t echoes, uint64_t change);

/** residual_echoes - at most so many echoes were added to the cube that holds a voxel, and not fewer than in truth;
 * beyond 254 no more are counted. *known: something was forgotten there. */
uint32_t residual_echoes(const struct residual *v, const int64_t cell[3], bool *known);

/** residual_stamp - the last change that may have added something to the tile that holds a column. */
uint64_t residual_stamp(const struct residual *v, int64_t i, int64_t j);

/** residual_halve - ageing: counts are halved and rounded up, as all echoes are. */
void residual_halve(struct residual *v);

/** residual_join - adds another table of n counts, residual_good(n). The map has changed everywhere. */
void residual_join(struct residual *v, const uint8_t *count, uint32_t n);

#endif
