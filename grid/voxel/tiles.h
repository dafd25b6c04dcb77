/* SPDX-License-Identifier: MIT */
/*
 * tiles - the memory of voxel maps: tiles of 16 x 16 columns over a fixed height, taken from and given back to one pool
 * that never grows. A tile has one plane of bytes, vacancy, or a second one, echoes; within a plane a column is
 * contiguous. Knows no place and no meaning of the bytes.
 */
#ifndef SONARD_TILES_H
#define SONARD_TILES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define TILE_SIDE  16 /* columns */
#define TILE_NONE  UINT32_MAX
#define TILE_SLACK 32 /* bytes that may be read and written back past the end of a column */

struct tiles {
    uint8_t *bytes;
    uint32_t *next;      /* of a free tile: the next free one */
    uint32_t first_free; /* TILE_NONE: exhausted */
    uint32_t n, n_free;
    uint32_t height; /* voxels of a column */
    uint32_t planes; /* 1 or 2 */
    size_t plane_bytes, tile_bytes;
};

/** tiles_bytes - memory for n tiles; 0 when that overflows, or n, height or planes (1, 2) is 0 or too large. */
size_t tiles_bytes(uint32_t n, uint32_t height, uint32_t planes);

/** tiles_init - memory: tiles_bytes(n, height, planes), max_align_t-aligned. Touches all of it. */
void tiles_init(struct tiles *t, void *memory, uint32_t n, uint32_t height, uint32_t planes);

/** tiles_take - a zeroed tile, or TILE_NONE. */
uint32_t tiles_take(struct tiles *t);

void tiles_give(struct tiles *t, uint32_t tile);

/** tiles_column - byte 0 of a column: tile taken, column = (i % 16) * 16 + j % 16, plane < planes. */
static inline uint8_t *tiles_column(const struct tiles *t, uint32_t tile, uint32_t column, uint32_t plane)
{
    return t->bytes + tile * t->tile_bytes + plane * t->plane_bytes + (size_t)column * t->height;
}

#endif
