/* SPDX-License-Identifier: MIT */
/*
 * submap - one local map m_i of the free water (Oliveira, Ferreira and Cruz 2023, sections III-C and III-D): a box of
 * the world's lattice around a base place, a byte of vacancy per voxel, and beside it, where asked for, a byte of
 * echoes. Tiles come from a pool when something is first written to them. Pure; one thread owns it.
 *
 * Vacancy counts the range measurements that found a voxel free; echoes count those that detected something which may
 * lie in it. Both stop at 255, and neither is ever taken from the other. A voxel is
 *   free      when vacancy > threshold + echo_weight * echoes
 *   occupied  when not free, and echoes > 0
 *   unknown   otherwise: also beyond the box, and where no memory was left.
 */
#ifndef SONARD_SUBMAP_H
#define SONARD_SUBMAP_H

#include "cast.h"
#include "tiles.h"

enum voxel_state { VOXEL_FREE, VOXEL_UNKNOWN, VOXEL_OCCUPIED }; /* in order of severity */

enum submap_plane { SUBMAP_VACANCY, SUBMAP_ECHOES };

struct voxel_rule {
    uint16_t threshold;   /* the paper's; at most 254 makes sense for one submap */
    uint16_t echo_weight; /* how many vacancies one echo outweighs */
};

struct submap_stats {
    uint64_t clipped; /* beams and bodies that reached beyond the box */
    uint64_t starved; /* runs of voxels not entered because the pool was exhausted */
};

struct submap {
    struct tiles *tiles;
    struct lattice_box box; /* plan size in whole tiles; size[2] = tiles->height */
    uint32_t *tile;         /* [size[0]/16][size[1]/16], TILE_NONE: never written to */
    uint64_t
        *written;    /* [size[0]/16][size[1]/16][slices]: the value of `now` when a count last changed, or later */
    uint32_t slices; /* of SUBMAP_SLICE cells of the world's lattice, some of which the box holds */
    uint64_t now;    /* set by the owner before it writes: a count of its changes */
    uint32_t n_tiles; /* taken */
    struct submap_stats stats;
};

#define SUBMAP_SLICE 64

/** submap_bytes - memory (8-byte aligned) of the directory of side x side tiles, side in [1, 4096], of a height in
 * [1, 2^20] voxels; else 0. */
size_t submap_bytes(uint32_t side, uint32_t height);

/**
 * submap_init - an empty map of side x side tiles whose middle is near the base place, snapped to whole tiles of the
 * world's lattice so that tiles of all submaps coincide. memory: submap_bytes(side,
 * tiles->height); tiles outlive the map.
 */
void submap_init(struct submap *m, void *memory, uint32_t side, struct tiles *tiles,
                 const struct lattice_place *base);

/** submap_clear - gives all tiles back; the box stays. */
void submap_clear(struct submap *m);

/** submap_cast - raises one plane's count by 1, up to 255, in every voxel that the beam covers. A run of voxels that
 * all stand at 255 costs no write, and what is made from a tile's counts stays valid. */
void submap_cast(struct submap *m, const struct cast_beam *b, enum submap_plane plane);

/**
 * submap_body - the water a body displaces is free: sets vacancy to at least `score` in every voxel whose centre lies
 * within radius (voxels) of the line from a to b.
 */
void submap_body(struct submap *m, const struct lattice_place *a, const struct lattice_place *b, double radius,
                 uint8_t score);

/** submap_halve - ageing: halves all counts, so that what is not confirmed is forgotten: vacancy rounded down, echoes
 * up, so that no voxel becomes free by it. Age before merging. */
void submap_halve(struct submap *m);

/** submap_count - one plane's count at a cell: 0 outside the box, where never written to, or without that plane. */
uint8_t submap_count(const struct submap *m, enum submap_plane plane, const int64_t cell[3]);

/** submap_entry - the directory's entry of the tile over a column of the box, counted from the box's first. */
static inline size_t submap_entry(const struct submap *m, int32_t i, int32_t j)
{
    return (uint32_t)i / TILE_SIDE * ((uint32_t)m->box.size[1] / TILE_SIDE) + (uint32_t)j / TILE_SIDE;
}

/** submap_slice - which slice holds a level of the box. */
static inline uint32_t submap_slice(const struct submap *m, int32_t level)
{
    return ((uint32_t)(m->box.first[2] & (SUBMAP_SLICE - 1)) + (uint32_t)level) / SUBMAP_SLICE;
}

/** submap_column - and which column of that tile it is. */
static inline uint32_t submap_column(int32_t i, int32_t j)
{
    return (uint32_t)i % TILE_SIDE * TILE_SIDE + (uint32_t)j % TILE_SIDE;
}

/** voxel_judge - the rule above for (merged) counts. */
static inline enum voxel_state voxel_judge(const struct voxel_rule *rule, uint32_t vacancy, uint32_t echoes)
{
    if (vacancy > rule->threshold + rule->echo_weight * echoes)
        return VOXEL_FREE;
    return echoes ? VOXEL_OCCUPIED : VOXEL_UNKNOWN;
}

#endif
