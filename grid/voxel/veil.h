/* SPDX-License-Identifier: MIT */
/*
 * veil - echoes that no submap keeps: of submaps that were forgotten, and those that lay beyond the current one's box or
 * found no memory. Per cube of 8 voxels of the world's lattice, how many echoes the looks of others must outweigh there.
 *
 * A table of counts by two hashes of the cube, of which the lesser is believed (a count-min sketch; Cormode and
 * Muthukrishnan 2005): what is told is never less than what was added, whatever the table's size. More than that it is
 * where cubes meet in the table, so a table that is too small makes water unknown, and none free. Pure; the map owns it.
 */
#ifndef SONARD_VEIL_H
#define SONARD_VEIL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define VEIL_CUBE   8    /* voxels along a cube's side */
#define VEIL_STAMPS 1024 /* of when something was added, by tile in plan */

struct veil {
    uint8_t *count;  /* [n], 0: nothing is known; else one more than the echoes */
    uint64_t *stamp; /* [VEIL_STAMPS] the map's change at the last addition */
    uint32_t n;      /* a power of 2; 0: none */
    bool any;        /* something was added */
};

/** veil_cells - counts of a table beside so many bytes of tiles: a 64th of them, a power of 2 in [2^12, 2^22]. */
uint32_t veil_cells(size_t tile_bytes);

/** veil_good - may a table have so many? */
bool veil_good(size_t n);

/** veil_bytes - memory of n counts. */
size_t veil_bytes(uint32_t n);

/** veil_init - memory: veil_bytes(n), 8-byte aligned. */
void veil_init(struct veil *v, void *memory, uint32_t n);

void veil_clear(struct veil *v);

/** veil_add - something was forgotten in this cube (its voxels' places divided by VEIL_CUBE) that held so many echoes, or 0. */
void veil_add(struct veil *v, const int64_t cube[3], uint32_t echoes, uint64_t change);

/** veil_echoes - at most so many echoes were added to the cube that holds a voxel, and not fewer than in truth; beyond 254
 * no more are counted. *known: something was forgotten there. */
uint32_t veil_echoes(const struct veil *v, const int64_t cell[3], bool *known);

/** veil_stamp - the last change that may have added something to the tile that holds a column. */
uint64_t veil_stamp(const struct veil *v, int64_t i, int64_t j);

/** veil_halve - ageing: counts are halved and rounded up, as all echoes are. */
void veil_halve(struct veil *v);

/** veil_join - adds another table of n counts, veil_good(n). The map has changed everywhere. */
void veil_join(struct veil *v, const uint8_t *count, uint32_t n);

#endif
