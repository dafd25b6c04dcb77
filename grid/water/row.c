/* SPDX-License-Identifier: MIT */
#include "row.h"

#include <math.h>

#define ROWS      5
#define TOUCH_RAD 1e-3 /* beams that are no farther apart touch: their bearings are rounded */

static uint16_t units(double m)
{
    return m > 0 ? (uint16_t)fmin(floor(m / WATER_UNIT_M), UINT16_MAX - 3) : 0;
}

static struct water_cell cell_of(double to_m, bool echo)
{
    const uint16_t least = units(to_m);
    return (struct water_cell){least, (uint16_t)(((least + 1) & ~1) | echo)};
}

static void write_column(struct row_room *room, uint32_t columns, uint32_t column, const struct row_beam *beam)
{
    const double to_m[ROWS] = {beam->edge_m, beam->side_m, beam->axis_m, beam->side_m, beam->edge_m};
    for (uint32_t row = 0; row < ROWS; row++)
        room->cell[row * columns + column] = cell_of(to_m[row], beam->echo);
}

static bool is_apart(const struct row_shape *shape, const struct row_beam *a, const struct row_beam *b)
{
    return b->az_rad - a->az_rad > 2 * shape->half_az_rad + TOUCH_RAD;
}

static uint32_t columns_of(const struct row_shape *shape, const struct row_beam *beam, size_t n)
{
    uint32_t columns = (uint32_t)n;
    for (size_t i = 1; i < n; i++)
        columns += is_apart(shape, &beam[i - 1], &beam[i]);
    return columns;
}

void row_write(struct water_record *record, struct row_room *room, const struct row_shape *shape,
               const struct row_beam *beam, size_t n)
{
    static const struct row_beam silent = {0};
    static const double share[ROWS + 1] = {-1, -0.5, -0.25, 0.25, 0.5, 1};
    const uint32_t columns = columns_of(shape, beam, n);
    uint32_t column = 0;
    record->echoes = false;
    room->tan_az[0] = tan(shape->from_rad);
    for (size_t i = 0; i < n; i++) {
        const double az = beam[i].az_rad;
        write_column(room, columns, column++, &beam[i]);
        record->echoes = record->echoes || beam[i].echo;
        if (i + 1 == n)
            room->tan_az[column] = tan(shape->to_rad);
        else if (is_apart(shape, &beam[i], &beam[i + 1]))
            room->tan_az[column] = tan(az + shape->half_az_rad);
        else
            room->tan_az[column] = tan((az + beam[i + 1].az_rad) / 2);
        if (i + 1 < n && is_apart(shape, &beam[i], &beam[i + 1])) {
            write_column(room, columns, column++, &silent);
            room->tan_az[column] = tan(beam[i + 1].az_rad - shape->half_az_rad);
        }
    }
    for (int row = 0; row <= ROWS; row++)
        room->tan_el[row] = tan(shape->el_rad + share[row] * shape->half_el_rad);
    for (int row = 0; row < ROWS; row++)
        room->near_m[row] = row == 0 || row + 1 == ROWS ? fmax(shape->near_m, shape->edge_near_m) : shape->near_m;
    record->image = (struct water_image){.columns = (uint16_t)columns,
                                         .rows = ROWS,
                                         .tan_az = room->tan_az,
                                         .tan_el = room->tan_el,
                                         .near_m = room->near_m};
    water_image_fill(&record->image, room->cell);
}
