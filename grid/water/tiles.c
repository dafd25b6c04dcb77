/* SPDX-License-Identifier: MIT */
#include "tiles.h"

#include <math.h>

#include "grid/geometry.h"

#define ROW_DEG (180.0 / TILES_ROWS)

/* Fewer towards the poles: no tile is much higher than wide. */
uint32_t tiles_columns(uint32_t row)
{
    const double middle = fabs((row + 0.5) * ROW_DEG - 90);
    return middle < 60 ? 72 : middle < 75 ? 36 : 12;
}

struct tile_index tiles_part(const struct tile_index *tile, int part)
{
    return (struct tile_index){(uint8_t)(tile->level + 1), (uint16_t)(2 * tile->row + part / 2),
                               (uint16_t)(2 * tile->column + part % 2)};
}

static uint16_t part_of(double share, uint32_t parts)
{
    return (uint16_t)fmax(0, fmin(floor(share * parts), parts - 1));
}

struct tile_index tiles_at(const double v[3], int level)
{
    double az, el;
    geo_angles(v, &az, &el);
    const uint16_t row = part_of(el / GEO_PI + 0.5, (uint32_t)TILES_ROWS << level);
    const uint32_t columns = tiles_columns((uint32_t)row >> level) << level;
    return (struct tile_index){(uint8_t)level, row, part_of(geo_wrap(az) / GEO_TURN, columns)};
}

/*
 * The square of half the chord between two directions is that of half their elevations' difference and of half their
 * azimuths', the latter times both cosines; and sin(x / 2) <= x / 2. An arc is longer than its chord by less than a
 * thousandth below 0.15 rad.
 */
struct water_tile tiles_cone(const struct tile_index *tile)
{
    const double share = 1.0 / (1u << tile->level), half_el = geo_rad(ROW_DEG / 2) * share;
    const double el = geo_rad((tile->row + 0.5) * ROW_DEG * share - 90);
    const double wide = GEO_TURN / tiles_columns(tile->row >> tile->level) * share,
                 az = (tile->column + 0.5) * wide;
    const double most = cos(fmax(fabs(el) - half_el, 0)) * wide / 2;
    struct water_tile cone = {.half_rad = 1.001 * sqrt(half_el * half_el + most * most)};
    geo_direction(az, el, cone.v);
    return cone;
}
