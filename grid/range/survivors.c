/* SPDX-License-Identifier: MIT */
#include "survivors.h"

#include "otsu.h"

static size_t turn_bytes(uint32_t max_rows, uint32_t max_bins)
{
    return (turn_size(max_rows, max_bins, 1) + 7) / 8 * 8;
}

size_t survivors_size(uint32_t max_rows, uint32_t max_bins)
{
    return turn_bytes(max_rows, max_bins) + max_bins;
}

void survivors_init(struct survivors *s, void *mem, uint32_t max_rows, uint32_t max_bins)
{
    turn_init(&s->turn, mem, max_rows, max_bins, 1);
    s->bin = (uint8_t *)mem + turn_bytes(max_rows, max_bins);
    s->row = 0;
    s->lowest = -1;
}

void survivors_begin(struct survivors *s, uint32_t rows, uint32_t bins)
{
    turn_begin(&s->turn, rows, bins, 1, 1);
    s->lowest = -1;
}

int survivors_lowest(struct survivors *s, const uint8_t *clean, const uint8_t *found)
{
    uint64_t count[256], pixels;
    uint8_t t[2];
    for (uint32_t i = 0; i < s->turn.bins; i++)
        s->bin[i] = found[i] ? clean[i] : 0;
    turn_put(&s->turn, s->row, s->bin);
    const uint32_t *of_turn = turn_histogram(&s->turn, 0, 0, &pixels);
    count[0] = 0;
    for (int v = 1; v < 256; v++)
        count[v] = of_turn[v];
    s->lowest = otsu_three(count, t) || otsu_two(count, t) ? t[0] : -1;
    return s->lowest;
}
