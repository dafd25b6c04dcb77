/* SPDX-License-Identifier: MIT */
/*
 * tiles - all directions, divided once and for all, in NED: 36 rows of 5 degrees, and each tile into four, five times.
 * A question asks all tiles that it touches. So a larger one asks all that a smaller one asks, and growing a question
 * never turns it clear.
 */
#ifndef SONARD_WATER_TILES_H
#define SONARD_WATER_TILES_H

#include <stdbool.h>
#include <stdint.h>

#include "decide.h"

#define TILES_ROWS   36
#define TILES_LEVELS 6    /* 5, 2.5, 1.25, 0.625, 0.31 and 0.16 degrees */
#define TILES_ROOTS  2016 /* in all rows */

/* Row 0 is the lowest, column 0 begins at north. */
struct tile_index {
    uint8_t level;
    uint16_t row, column;
};

/** tiles_columns - of a row of roots. */
uint32_t tiles_columns(uint32_t row);

/** tiles_part - part 0..3 of a tile that is not of the last level. */
struct tile_index tiles_part(const struct tile_index *tile, int part);

/** tiles_at - the tile of that level in which the unit vector v, NED, lies. */
struct tile_index tiles_at(const double v[3], int level);

/** tiles_cone - the least cone, but for a thousandth, that holds the tile. */
struct water_tile tiles_cone(const struct tile_index *tile);

#endif
