/* SPDX-License-Identifier: MIT */
/*
 * clahe - contrast-limited adaptive histogram equalisation of an 8-bit image in exact integers (Zuiderveld 1994):
 * every tile of the image has a table from counts to grey levels, and a pixel goes through the tables of the four
 * tiles around it. Knows no sonar; rows may close to a circle.
 */
#ifndef SONARD_CLAHE_H
#define SONARD_CLAHE_H

#include <stdbool.h>
#include <stdint.h>

#define CLAHE_MAX_TILES 16      /* along either axis */
#define CLAHE_MAX_CLIP  1000000 /* hundredths */

/* Tile row a covers the rows from floor(a * rows / tiles_y) on, tile column b the columns likewise. */
struct clahe_grid {
    uint32_t rows, columns;
    uint32_t tiles_y, tiles_x; /* 1..CLAHE_MAX_TILES, at most one per row and column */
    uint32_t clip_q100; /* no bin of a tile's histogram counts more than this / 100 times the mean; 0: no limit */
    bool corner;        /* pixels lie at their upper left corner, as widespread code has it, not at their centre */
    bool wrap;          /* the first row follows the last */
    bool keep_zero;     /* a count of 0 stays 0: it means "removed" */
};

typedef uint8_t clahe_table[256];

/** clahe_grid_ok - are the numbers in range? Everything below wants a grid that is. */
bool clahe_grid_ok(const struct clahe_grid *g);

/** clahe_tile_row - the tile that a row lies in. */
uint32_t clahe_tile_row(const struct clahe_grid *g, uint32_t row);

/** clahe_tabulate - the table of a tile of `pixels` > 0 (< 2^40) pixels with this histogram. Never falls; 255 stays. */
void clahe_tabulate(const uint32_t count[256], uint64_t pixels, uint32_t clip_q100, clahe_table table);

/**
 * clahe_row - equalise one row. table[tiles_y][tiles_x]. ready[tiles_y]: tile rows that have tables (NULL: all); one
 * without is left to its neighbour, and a row between two without stays as it is. in, out: [columns], may be the same.
 */
void clahe_row(const struct clahe_grid *g, const clahe_table *table, const bool *ready, uint32_t row,
               const uint8_t *in, uint8_t *out);

/**
 * clahe_image - equalise a whole image with its own tables: exact, but every row has to be there. in, out:
 * [rows][columns]; table: room for tiles_y * tiles_x.
 */
void clahe_image(const struct clahe_grid *g, const uint8_t *in, clahe_table *table, uint8_t *out);

#endif
