/* SPDX-License-Identifier: MIT */
/*
 * immersion - is a sonar's head in the water? In air it returns what open water returns: its ring-down, and no echo.
 * Knows poses and mounts, no samples.
 */
#ifndef SONARD_IMMERSION_H
#define SONARD_IMMERSION_H

#include <stdbool.h>

#include "grid/geometry.h"

#define IMMERSION_DOUBT_M 0.3 /* weather and waves make a depth of the surface */

/**
 * immersion_is_out - the head is above the surface by more than IMMERSION_DOUBT_M and the pose's uncertainty. False
 * without a depth. Without an attitude the head may hang as far below the vehicle's reference point as it is away.
 */
bool immersion_is_out(const struct pose *pose, const struct mount *mount);

#endif
