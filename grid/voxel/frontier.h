/* SPDX-License-Identifier: MIT */
/*
 * frontier - the surface of the free volume (Oliveira, Ferreira and Cruz 2023, section III-E): free voxels with fewer
 * than 26 free neighbours, by whole words of bits, and kept: a block is computed anew only when its own bits or those
 * of a neighbour have changed since. Each voxel is tagged: echo where it or a neighbour has one, else
 * limit, the end of what was looked at. (Without echo evidence in the map all are limit.) Knows no file format.
 */
#ifndef SONARD_FRONTIER_H
#define SONARD_FRONTIER_H

#include "voxmask.h"

struct frontier_block {
    struct block_head head;
    uint64_t made;                   /* the change it was made at */
    uint64_t surface[BLOCK_COLUMNS]; /* bits as in merge_block */
    uint64_t echo[BLOCK_COLUMNS];    /* of these, the tagged ones */
};

struct frontier {
    struct voxmask *mask;
    struct frontier_block *block; /* [n], by hash; a power of 2 */
    uint32_t n;
    uint64_t computed; /* blocks: for statistics */
};

enum frontier_tag { FRONTIER_LIMIT, FRONTIER_ECHO };

struct frontier_point {
    int64_t cell[3];
    double position_m[3]; /* its centre, NED */
    /* unit, into the free water: gradient of the free volume over 27 voxels; 0 where it has none */
    float normal[3];
    uint8_t tag; /* enum frontier_tag */
};

/** frontier_bytes - memory for n blocks, a power of 2 in [1024, 2^24]; else 0. */
size_t frontier_bytes(uint32_t n);

/** frontier_init - memory: frontier_bytes(n), max_align_t-aligned. mask outlives it. */
void frontier_init(struct frontier *f, struct voxmask *mask, void *memory, uint32_t n);

/** frontier_block - the frontier within a block as it is now. Valid until the next call. */
const struct frontier_block *frontier_block(struct frontier *f, const struct block_key *key);

typedef void frontier_take(void *context, const struct frontier_point *point);

/** frontier_points - all of a block's frontier, with normals, in order of cells. */
void frontier_points(struct frontier *f, const struct block_key *key, frontier_take *take, void *context);

/** frontier_all - that of the whole map. Who wants it in pages walks over the blocks with
 * merge_next(), as this does. */
void frontier_all(struct frontier *f, frontier_take *take, void *context);

#endif
