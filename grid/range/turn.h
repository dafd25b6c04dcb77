/* SPDX-License-Identifier: MIT */
/*
 * turn - the rows of one image as they came during the last turn, and their histograms, kept up to date row by row:
 * what a new row adds, the row it replaces takes away, and so does a row that was not seen for a turn and a half.
 * Rows are indexed by head angle; the order in which they come does not matter. Knows no sonar and no filter.
 */
#ifndef SONARD_TURN_H
#define SONARD_TURN_H

#include <stddef.h>
#include <stdint.h>

struct turn {
    uint32_t rows, bins;       /* of the image */
    uint32_t tiles_y, tiles_x; /* histograms, bounded as in clahe.h; 1 and 1: one for the whole image */
    uint32_t max_rows, max_bins, max_tiles;
    uint64_t puts;    /* rows that have come */
    uint64_t *put_of; /* [rows] which of the puts a row is from, from 1; 0: it holds nothing */
    uint32_t *row_of; /* [1.5 rows] the row of a put, by its number modulo that */
    uint8_t *bin;     /* [rows][bins] */
    uint32_t *count;  /* [tiles_y][tiles_x][256] */
    uint64_t *pixels; /* [tiles_y][tiles_x] */
};

/** turn_size - bytes of memory (aligned to uint64_t) for images up to this size. */
size_t turn_size(uint32_t max_rows, uint32_t max_bins, uint32_t max_tiles);

/** turn_init - in mem of turn_size bytes, which the caller keeps; turn_begin comes next. */
void turn_init(struct turn *t, void *mem, uint32_t max_rows, uint32_t max_bins, uint32_t max_tiles);

/** turn_begin - an empty image of rows x bins with tiles_y * tiles_x histograms, all at least 1 and within the room. */
void turn_begin(struct turn *t, uint32_t rows, uint32_t bins, uint32_t tiles_y, uint32_t tiles_x);

/** turn_put - the newest bins[bins] of a row. */
void turn_put(struct turn *t, uint32_t row, const uint8_t *bin);

/** turn_histogram - count[256] of a tile, and how many pixels that is. */
const uint32_t *turn_histogram(const struct turn *t, uint32_t tile_y, uint32_t tile_x, uint64_t *pixels);

#endif
