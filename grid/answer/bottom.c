/* SPDX-License-Identifier: MIT */
#include "bottom.h"

#include <math.h>

#include "grid/geometry.h"

#define SLOPE_RAD geo_rad(BOTTOM_SLOPE_DEG)

/* The bottom is taken to rise from below the vehicle to all sides, as a cone that stands on its tip. */
struct bottom bottom_below(double altitude_m, double above_m, double beside_m)
{
    const double least_m = altitude_m * (1 - BOTTOM_ALTITUDE_SHARE) - BOTTOM_ALTITUDE_M;
    return (struct bottom){fmax(least_m + above_m - beside_m * tan(SLOPE_RAD), 0) * cos(SLOPE_RAD)};
}

/*
 * A ray that points down by a meets a slope s that begins h below at h cos s / sin(a + s). Steeper than across the
 * slope a ray meets the other side of the cone later; what is across it is near enough.
 */
double bottom_reach_m(const struct bottom *b, double down)
{
    const double d = fmax(-1, fmin(down, 1)), level = sqrt(1 - d * d);
    const double sine =
        level * cos(SLOPE_RAD) > d * sin(SLOPE_RAD) ? d * cos(SLOPE_RAD) + level * sin(SLOPE_RAD) : 1;
    return sine > 0 ? b->least_m / sine : INFINITY;
}
