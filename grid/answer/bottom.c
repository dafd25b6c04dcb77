/* SPDX-License-Identifier: MIT */
#include "bottom.h"

#include <math.h>

#include "grid/geometry.h"

const struct bottom bottom_unknown = {.least_m = INFINITY, .cos = 1};

/* The bottom is taken to rise from below the vehicle to all sides, as a cone that stands on its tip. */
struct bottom bottom_below(double altitude_m, double above_m, double beside_m, double slack_rad)
{
    const double slope_rad = geo_rad(BOTTOM_SLOPE_DEG), more_rad = fmin(slope_rad + slack_rad, GEO_PI / 2);
    const double least_m = altitude_m * (1 - BOTTOM_ALTITUDE_SHARE) - BOTTOM_ALTITUDE_M;
    const double down_m = fmax(least_m + above_m - beside_m * tan(slope_rad), 0);
    return (struct bottom){.least_m = down_m * cos(slope_rad), .cos = cos(more_rad), .sin = sin(more_rad)};
}

/*
 * A ray that points down by a meets a slope s that begins h below at h cos s / sin(a + s). Steeper than across the
 * slope a ray meets the other side of the cone later; what is across it is near enough.
 */
double bottom_reach_m(const struct bottom *b, double down)
{
    if (!isfinite(b->least_m))
        return INFINITY;
    const double d = fmax(-1, fmin(down, 1)), level = sqrt(1 - d * d);
    const double sine = level * b->cos > d * b->sin ? d * b->cos + level * b->sin : 1;
    return sine > 0 ? b->least_m / sine : INFINITY;
}
