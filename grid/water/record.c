/* SPDX-License-Identifier: MIT */
#include "record.h"

#define PYRAMID 4  /* columns of a level are one of the next */
#define BLOCK   16 /* rows of a level are one more row behind all of them: an upright fan has many */

static uint32_t joined(uint32_t columns)
{
    return (columns + PYRAMID - 1) / PYRAMID;
}

/* Of a level: the image's and those of blocks. */
static uint32_t all_rows(uint32_t rows)
{
    return rows + rows / BLOCK;
}

uint32_t water_image_cells(uint32_t columns, uint32_t rows)
{
    uint32_t n = columns * all_rows(rows);
    while (columns > 1) {
        columns = joined(columns);
        n += columns * all_rows(rows);
    }
    return n;
}

static void add_cell(struct water_cell *sum, struct water_cell cell)
{
    sum->from = cell.from > sum->from ? cell.from : sum->from;
    sum->least = cell.least < sum->least ? cell.least : sum->least;
    sum->most = cell.most > sum->most ? cell.most : sum->most;
    sum->ends = cell.ends < sum->ends ? cell.ends : sum->ends;
}

static struct water_cell sum_of(const struct water_cell *row, uint32_t from, uint32_t to)
{
    struct water_cell sum = {.least = UINT16_MAX, .ends = WATER_NO_END};
    for (uint32_t x = from; x < to; x++)
        add_cell(&sum, row[x]);
    return sum;
}

static void sum_blocks(struct water_cell *level, uint32_t columns, uint32_t rows)
{
    for (uint32_t y = 0; y + BLOCK <= rows; y += BLOCK)
        for (uint32_t x = 0; x < columns; x++) {
            struct water_cell *sum = &level[(rows + y / BLOCK) * columns + x];
            *sum = level[y * columns + x];
            for (uint32_t k = 1; k < BLOCK; k++)
                add_cell(sum, level[(y + k) * columns + x]);
        }
}

void water_image_fill(struct water_image *image, struct water_cell *cell)
{
    uint32_t columns = image->columns;
    image->cell = cell;
    image->levels = 1;
    sum_blocks(cell, columns, image->rows);
    while (columns > 1) {
        struct water_cell *next = cell + columns * all_rows(image->rows);
        const uint32_t wide = joined(columns);
        for (uint32_t y = 0; y < image->rows; y++)
            for (uint32_t x = 0; x < wide; x++) {
                const uint32_t end = (x + 1) * PYRAMID;
                next[y * wide + x] = sum_of(cell + y * columns, x * PYRAMID, end < columns ? end : columns);
            }
        sum_blocks(next, wide, image->rows);
        cell = next;
        columns = wide;
        image->levels++;
    }
}

struct water_cell water_cell_join(struct water_cell a, struct water_cell b)
{
    const uint16_t ends = a.ends < b.ends ? a.ends : b.ends;
    const bool touch = a.from < a.least && b.from < b.least && a.from <= b.least && b.from <= a.least;
    struct water_cell all = a.least - a.from > b.least - b.from ? a : b;
    if (touch) {
        all.from = a.from < b.from ? a.from : b.from;
        all.least = a.least > b.least ? a.least : b.least;
    }
    return (struct water_cell){all.from, all.least, all.least, ends};
}

int water_image_find(const double *between, int n, double x)
{
    int low = 0, high = n - 1;
    while (low < high) {
        const int middle = (low + high + 1) / 2;
        if (between[middle] <= x)
            low = middle;
        else
            high = middle - 1;
    }
    return low;
}

struct water_cell water_image_of(const struct water_image *image, const struct water_part *part)
{
    int x0 = part->column[0], x1 = part->column[1];
    uint32_t columns = image->columns;
    const struct water_cell *level = image->cell;
    struct water_cell sum = {.least = UINT16_MAX, .ends = WATER_NO_END};
    while (x1 - x0 >= 2 * PYRAMID) {
        level += columns * all_rows(image->rows);
        columns = joined(columns);
        x0 /= PYRAMID;
        x1 /= PYRAMID;
    }
    for (uint32_t y = (uint32_t)part->row[0], end = (uint32_t)part->row[1] + 1; y < end;) {
        const bool block = y % BLOCK == 0 && y + BLOCK <= end;
        const uint32_t row = block ? image->rows + y / BLOCK : y;
        add_cell(&sum, sum_of(level + row * columns, (uint32_t)x0, (uint32_t)x1 + 1));
        y += block ? BLOCK : 1;
    }
    return sum;
}
