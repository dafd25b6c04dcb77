/* SPDX-License-Identifier: MIT */
#include "cell_edge.h"

#include <math.h>

struct cell_edge cell_edge_of(const struct rings *rings, uint32_t ring)
{
    const double top = rings->top_rad - ring * rings->height_rad, bottom = top - rings->height_rad,
                 half = rings_width(rings, ring) / 2;
    return (struct cell_edge){.sin_top = sin(top),
                              .cos_top = cos(top),
                              .sin_bottom = sin(bottom),
                              .cos_bottom = cos(bottom),
                              .cos_el = rings->cos_el[ring],
                              .sin_half = sin(half),
                              .cos_half = cos(half)};
}

/* The level part of the axis along the azimuth of the cell that is nearest to it; of all of it where the cell has its
 * azimuth, or is as wide as a half circle. */
static double level_along(const struct cell_edge *c, const double v[3], const double axis[3])
{
    const double along = v[0] * axis[0] + v[1] * axis[1], aside = fabs(v[0] * axis[1] - v[1] * axis[0]);
    if (c->cos_half <= 0 || (along > 0 && aside * c->cos_half <= along * c->sin_half))
        return sqrt(axis[0] * axis[0] + axis[1] * axis[1]);
    return (along * c->cos_half + aside * c->sin_half) / c->cos_el;
}

/* At that azimuth the cosine is up sin(el) + level cos(el): a wave with one crest, in the cell or beyond one end. */
double cell_edge_nearest(const struct cell_edge *c, const double v[3], const double axis[3])
{
    const double up = -axis[2], level = level_along(c, v, axis);
    if (c->cos_top * up < c->sin_top * level && c->cos_bottom * up > c->sin_bottom * level)
        return sqrt(up * up + level * level);
    return fmax(c->sin_top * up + c->cos_top * level, c->sin_bottom * up + c->cos_bottom * level);
}
