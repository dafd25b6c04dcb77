/* SPDX-License-Identifier: MIT */
/*
 * verdict_begins - from where on a verdict asks whether the water is free: near the vehicle no beam sees it.
 */
#ifndef SONARD_VERDICT_BEGINS_H
#define SONARD_VERDICT_BEGINS_H

#include <math.h>

#include "verdict.h"

#define VERDICT_UNSOUGHT (-INFINITY)

/** verdict_farthest_start_m - where the first water begins is told a little beyond the distance, too. */
double verdict_farthest_start_m(const struct verdict *v);

/** verdict_most_begin_m - where most parts' water begins, within `near`. */
double verdict_most_begin_m(const struct verdict *v);

/** verdict_begins_along_m - where beyond from_m the water begins to be free along a line, by any record that counts;
 * INFINITY: nowhere before most_m. */
double verdict_begins_along_m(const struct verdict *v, const struct water_tile *line, double from_m,
                              double most_m);

/** verdict_tile_begins_m - where from from_m on the tile in which the part ended the last time begins to be free before
 * most_m; else it ends at *ends_m at the latest. */
double verdict_tile_begins_m(struct verdict *v, const struct verdict_part *part, double from_m, double most_m,
                             double *ends_m);

/** verdict_begins_m - where that is beyond from_m, or a corridor leaves the tile; INFINITY: nowhere; VERDICT_UNSOUGHT:
 * to be called again. */
double verdict_begins_m(struct verdict *v, const struct verdict_part *part, double from_m, double most_m);

#endif
