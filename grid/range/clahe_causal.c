/* SPDX-License-Identifier: MIT */
#include "clahe_causal.h"

#include <string.h>

#define TILES CLAHE_CAUSAL_TILES

size_t clahe_causal_size(uint32_t max_rows, uint32_t max_bins)
{
    return turn_size(max_rows, max_bins, TILES * TILES);
}

void clahe_causal_init(struct clahe_causal *c, void *mem, uint32_t max_rows, uint32_t max_bins, uint32_t clip_q100)
{
    memset(c, 0, sizeof *c);
    turn_init(&c->turn, mem, max_rows, max_bins, TILES * TILES);
    c->grid = (struct clahe_grid){.clip_q100 = clip_q100, .wrap = true, .keep_zero = true};
    clahe_causal_begin(c, 1, 1);
}

void clahe_causal_begin(struct clahe_causal *c, uint32_t rows, uint32_t bins)
{
    c->grid.rows = rows;
    c->grid.columns = bins;
    c->grid.tiles_y = rows < TILES ? rows : TILES;
    c->grid.tiles_x = bins < TILES ? bins : TILES;
    c->tile = 0;
    memset(c->ready, 0, sizeof c->ready);
    turn_begin(&c->turn, rows, bins, c->grid.tiles_y, c->grid.tiles_x);
}

static void complete_tile(struct clahe_causal *c)
{
    for (uint32_t x = 0; x < c->grid.tiles_x; x++) {
        uint64_t pixels;
        const uint32_t *count = turn_histogram(&c->turn, c->tile, x, &pixels);
        if (pixels == 0)
            return;
        clahe_tabulate(count, pixels, c->grid.clip_q100, c->table[c->tile * c->grid.tiles_x + x]);
    }
    c->ready[c->tile] = true;
}

void clahe_causal_row(struct clahe_causal *c, uint32_t row, bool new_pass, const uint8_t *in, uint8_t *out)
{
    const uint32_t tile = clahe_tile_row(&c->grid, row);
    if (tile != c->tile || new_pass || c->grid.rows == 1)
        complete_tile(c);
    c->tile = tile;
    turn_put(&c->turn, row, in);
    clahe_row(&c->grid, (const clahe_table *)c->table, c->ready, row, in, out);
}
