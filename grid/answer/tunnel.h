/* SPDX-License-Identifier: MIT */
/*
 * tunnel - the nearest obstacle of a picture in the way of a body that moves along a line (corridor.h), as seen from
 * where the vehicle may be. A cell of the grid counts with whichever of its rays is the worst.
 */
#ifndef SONARD_TUNNEL_H
#define SONARD_TUNNEL_H

#include "obstacles.h"

/** tunnel_find - ranges in *found, which is empty, are along the line from the reference point, directions in the axes
 * asked about. */
void tunnel_find(const struct obstacles_scene *scene, const struct corridor_query *query,
                 struct obstacles_found *found);

#endif
