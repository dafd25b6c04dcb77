/* SPDX-License-Identifier: MIT */
/*
 * voxmask - the merged and judged map as bits, kept block by block for those who ask: what questions, frontier and
 * exports read. A cache of fixed size in front of merge.h: a block is computed when it is asked for and something in it
 * may have changed; nothing is computed for a map that nobody asks. Pure; the map's thread owns it.
 */
#ifndef SONARD_VOXMASK_H
#define SONARD_VOXMASK_H

#include "merge.h"

/* What is kept of a block begins with this. */
struct block_head {
    struct block_key key;
    uint64_t checked; /* the change at which it was last known to be right; 0: empty */
};

struct voxmask_block {
    struct block_head head;
    uint64_t changed; /* the change with which its bits last became others, or later */
    struct merge_block bits;
};

struct voxmask {
    const struct voxmap *map;
    struct voxmask_block *block; /* [n], by hash; a power of 2 */
    uint32_t n;
    uint64_t computed; /* blocks: for statistics */
};

/** voxmask_bytes - memory for n blocks, a power of 2 in [1024, 2^24] (4.2 kB each); else 0. */
size_t voxmask_bytes(uint32_t n);

/** voxmask_init - memory: voxmask_bytes(n), max_align_t-aligned. map outlives it. */
void voxmask_init(struct voxmask *v, const struct voxmap *map, void *memory, uint32_t n);

/** voxmask_block - the block as it is now. Valid until the next call. */
const struct voxmask_block *voxmask_block(struct voxmask *v, const struct block_key *key);

/** voxmask_at - the state of a cell. */
enum voxel_state voxmask_at(struct voxmask *v, const int64_t cell[3]);

/**
 * block_find - a block's place in an array of n (a power of 2, >= 4) things of `size` bytes that begin with a
 * block_head: that which has the key, or else the one of its four places which was checked longest
 * ago, with `checked` set to 0.
 */
struct block_head *block_find(void *blocks, size_t size, uint32_t n, const struct block_key *key);

#endif
