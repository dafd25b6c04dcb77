/* SPDX-License-Identifier: MIT */
#include "turn.h"

#include <string.h>

static uint32_t memory_of_puts(uint32_t rows)
{
    return rows + (rows + 1) / 2;
}

size_t turn_size(uint32_t max_rows, uint32_t max_bins, uint32_t max_tiles)
{
    const size_t words = max_rows + max_tiles;
    const size_t half_words = memory_of_puts(max_rows) + (size_t)max_tiles * 256;
    return words * sizeof(uint64_t) + half_words * sizeof(uint32_t) + ((size_t)max_rows * max_bins + 7) / 8 * 8 +
           8;
}

void turn_init(struct turn *t, void *mem, uint32_t max_rows, uint32_t max_bins, uint32_t max_tiles)
{
    *t = (struct turn){.max_rows = max_rows, .max_bins = max_bins, .max_tiles = max_tiles};
    t->put_of = mem;
    t->pixels = t->put_of + max_rows;
    t->count = (uint32_t *)(t->pixels + max_tiles);
    t->row_of = t->count + (size_t)max_tiles * 256;
    t->bin = (uint8_t *)(t->row_of + memory_of_puts(max_rows));
    turn_begin(t, 1, 1, 1, 1);
}

void turn_begin(struct turn *t, uint32_t rows, uint32_t bins, uint32_t tiles_y, uint32_t tiles_x)
{
    t->rows = rows;
    t->bins = bins;
    t->tiles_y = tiles_y;
    t->tiles_x = tiles_x;
    t->puts = 0;
    memset(t->put_of, 0, t->max_rows * sizeof *t->put_of);
    memset(t->pixels, 0, t->max_tiles * sizeof *t->pixels);
    memset(t->count, 0, (size_t)t->max_tiles * 256 * sizeof *t->count);
}

/* Count the row into the histograms of its tiles, or (by -1) out of them. */
static void count_row(struct turn *t, uint32_t row, int by)
{
    const uint8_t *bin = t->bin + (size_t)row * t->bins;
    const uint32_t tile_y = (uint32_t)(((uint64_t)(row + 1) * t->tiles_y - 1) / t->rows);
    uint32_t i = 0;
    for (uint32_t x = 0; x < t->tiles_x; x++) {
        const uint32_t begin = i, end = (uint32_t)((uint64_t)(x + 1) * t->bins / t->tiles_x);
        const uint32_t tile = tile_y * t->tiles_x + x;
        uint32_t *count = t->count + (size_t)tile * 256;
        for (; i < end; i++)
            count[bin[i]] += (uint32_t)by;
        t->pixels[tile] += (uint64_t)(int64_t)by * (end - begin);
    }
}

static void take_out(struct turn *t, uint32_t row)
{
    count_row(t, row, -1);
    t->put_of[row] = 0;
}

void turn_put(struct turn *t, uint32_t row, const uint8_t *bin)
{
    const uint32_t memory = memory_of_puts(t->rows);
    uint32_t *slot = &t->row_of[t->puts % memory]; /* of the put a turn and a half ago */
    if (t->puts >= memory && t->put_of[*slot] == t->puts - memory + 1)
        take_out(t, *slot);
    if (t->put_of[row])
        take_out(t, row);
    memcpy(t->bin + (size_t)row * t->bins, bin, t->bins);
    count_row(t, row, 1);
    *slot = row;
    t->put_of[row] = ++t->puts;
}

const uint32_t *turn_histogram(const struct turn *t, uint32_t tile_y, uint32_t tile_x, uint64_t *pixels)
{
    const uint32_t tile = tile_y * t->tiles_x + tile_x;
    *pixels = t->pixels[tile];
    return t->count + (size_t)tile * 256;
}
