/* SPDX-License-Identifier: MIT */
/* route - the way that somebody with a chart would take. */
#ifndef SONARD_PILOT_ROUTE_H
#define SONARD_PILOT_ROUTE_H

#include "tests/water/places.h"

#define PILOT_ROUTE_MAX 64

/**
 * pilot_route - corners of a short way from the start to the goal that keeps off_m from all that does not move.
 * Returns their number, 0: there is none.
 */
int pilot_route(const struct place *place, const struct place_hull *hull, double off_m,
                double route_m[PILOT_ROUTE_MAX][2]);

#endif
