/* SPDX-License-Identifier: MIT */
/*
 * merge - the submaps of a map added up (Oliveira, Ferreira and Cruz 2023, section III-D), and the sum judged once.
 * Sums of whole numbers: the same in any order. Knows no question.
 *
 * Submaps lie on the world's lattice, so adding up is exact. One whose base pose was corrected is asked at the centre
 * of the world's voxel: the least vacancy and the most echoes of the eight voxels around it, so no holes and no water
 * that was not there. Echoes that no submap keeps (residual.h) count as echoes.
 */
#ifndef SONARD_MERGE_H
#define SONARD_MERGE_H

#include "voxmap.h"

struct merge_sum {
    uint32_t vacancy, echoes;
    uint32_t residual; /* echoes that no submap keeps */
    bool lost;         /* something about here was forgotten */
};

/** merge_sum - what all submaps say of a cell. */
struct merge_sum merge_sum(const struct voxmap *m, const int64_t cell[3]);

/** merge_at - the state of a cell. */
enum voxel_state merge_at(const struct voxmap *m, const int64_t cell[3]);

/* Blocks of 16 x 16 columns of 64 cells; block b covers cells 16 b[0] .., 16 b[1] .., 64 b[2] ... */
#define BLOCK_SIDE    16
#define BLOCK_HEIGHT  64
#define BLOCK_COLUMNS 256

struct block_key {
    int64_t at[3];
};

/* Bit k of column i * 16 + j is the cell 64 b[2] + k. */
struct merge_block {
    uint64_t free[BLOCK_COLUMNS];
    uint64_t heard[BLOCK_COLUMNS]; /* echoes > 0; what has echoes and is not free is occupied */
    bool lost;                     /* something of it was forgotten */
};

/** merge_block_of - the block of a cell. (Shifts of negative numbers round down with all our compilers.) */
static inline struct block_key merge_block_of(const int64_t cell[3])
{
    return (struct block_key){{cell[0] >> 4, cell[1] >> 4, cell[2] >> 6}};
}

static inline bool block_same(const struct block_key *a, const struct block_key *b)
{
    return a->at[0] == b->at[0] && a->at[1] == b->at[1] && a->at[2] == b->at[2];
}

/** merge_block_at - the state of one of the block's cells. */
static inline enum voxel_state merge_block_at(const struct merge_block *b, const int64_t cell[3])
{
    uint32_t column = (uint32_t)(cell[0] & (BLOCK_SIDE - 1)) * BLOCK_SIDE + (uint32_t)(cell[1] & (BLOCK_SIDE - 1));
    unsigned k = (unsigned)(cell[2] & (BLOCK_HEIGHT - 1));
    if (b->free[column] >> k & 1)
        return VOXEL_FREE;
    return b->heard[column] >> k & 1 ? VOXEL_OCCUPIED : VOXEL_UNKNOWN;
}

/** merge_block - the states of all cells of a block: equal to merge_at for each. */
void merge_block(const struct voxmap *m, const struct block_key *key, struct merge_block *out);

/** merge_block_changed - whether the block may have changed after the change `since` (voxmap_changed). */
bool merge_block_changed(const struct voxmap *m, const struct block_key *key, uint64_t since);

/** merge_around_changed - whether it or one of its 26 neighbours may have. */
bool merge_around_changed(const struct voxmap *m, const struct block_key *key, uint64_t since);

/* Walks over all blocks in which anything may be known, each once. Start with {0};
 * the map must not change in between. */
struct merge_walk {
    uint32_t part;
    int64_t at;
};

/** merge_next - the next block; false: that was all. */
bool merge_next(const struct voxmap *m, struct merge_walk *walk, struct block_key *key);

enum merge_sought { MERGE_FOUND, MERGE_NOT_YET, MERGE_ALL };

/** merge_seek - the same, but skips no more than `most` blocks of which nothing is known: MERGE_NOT_YET, call again. */
enum merge_sought merge_seek(const struct voxmap *m, struct merge_walk *walk, uint32_t most,
                             struct block_key *key);

#endif
