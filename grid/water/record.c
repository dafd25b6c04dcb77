/* SPDX-License-Identifier: MIT */
#include "record.h"

static uint32_t halved(uint32_t n)
{
    return (n + 1) / 2;
}

uint32_t water_image_cells(uint32_t columns, uint32_t rows)
{
    uint32_t n = columns * rows;
    while (columns > 1 || rows > 1) {
        columns = halved(columns);
        rows = halved(rows);
        n += columns * rows;
    }
    return n;
}

static void add_cell(struct water_cell *sum, struct water_cell cell)
{
    sum->least = cell.least < sum->least ? cell.least : sum->least;
    sum->most = cell.most > sum->most ? cell.most : sum->most;
    sum->ends = cell.ends < sum->ends ? cell.ends : sum->ends;
}

/* Of four cells of a level one of the next. */
static struct water_cell join_four(const struct water_cell *level, uint32_t columns, uint32_t rows, uint32_t x,
                                   uint32_t y)
{
    struct water_cell sum = {.least = UINT16_MAX, .ends = WATER_NO_END};
    for (uint32_t j = 2 * y; j < rows && j < 2 * y + 2; j++)
        for (uint32_t i = 2 * x; i < columns && i < 2 * x + 2; i++)
            add_cell(&sum, level[j * columns + i]);
    return sum;
}

void water_image_fill(struct water_image *image, struct water_cell *cell)
{
    uint32_t columns = image->columns, rows = image->rows;
    image->cell = cell;
    image->levels = 1;
    while (columns > 1 || rows > 1) {
        struct water_cell *next = cell + columns * rows;
        const uint32_t wide = halved(columns), high = halved(rows);
        for (uint32_t y = 0; y < high; y++)
            for (uint32_t x = 0; x < wide; x++)
                next[y * wide + x] = join_four(cell, columns, rows, x, y);
        cell = next;
        columns = wide;
        rows = high;
        image->levels++;
    }
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
    int x0 = part->column[0], x1 = part->column[1], y0 = part->row[0], y1 = part->row[1];
    uint32_t columns = image->columns, rows = image->rows;
    const struct water_cell *level = image->cell;
    struct water_cell sum = {.least = UINT16_MAX, .ends = WATER_NO_END};
    while (x1 - x0 > 3 || y1 - y0 > 3) {
        level += columns * rows;
        columns = halved(columns);
        rows = halved(rows);
        x0 /= 2;
        x1 /= 2;
        y0 /= 2;
        y1 /= 2;
    }
    for (int y = y0; y <= y1; y++)
        for (int x = x0; x <= x1; x++)
            add_cell(&sum, level[(uint32_t)y * columns + (uint32_t)x]);
    return sum;
}
