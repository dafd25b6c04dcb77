/* SPDX-License-Identifier: MIT */
/*
 * depth_regions - regions of constant depth: runs of neighbouring bearings whose first echoes lie within a window of
 * range (Leonard, Durrant-Whyte and Cox 1992, after Auran and Silven 1996, 2.1). A wall that mirrors sound shows as
 * one around its normal. Knows bearings by number only. Pure.
 *
 * The window holds all of the run: a chain of small steps would drift without bound along a slope.
 */
#ifndef SONARD_DEPTH_REGIONS_H
#define SONARD_DEPTH_REGIONS_H

#include <stddef.h>
#include <stdint.h>

#define DEPTH_REGIONS_MAX 2048 /* bearings */

struct depth_region {
    uint32_t first, n; /* bearings, past the end of the turn too */
    double least_m, most_m;
};

/**
 * depth_regions - of n bearings around a whole turn (n <= DEPTH_REGIONS_MAX); range_m[i]: first echo, NaN or
 * infinite: none, which ends a run. window_m >= 0: most - least of a region. Regions of fewer than least_n bearings
 * (>= 1) are left out, and so is one that overlaps a longer one (of equals, one that begins earlier). The whole turn
 * is one region from bearing 0. Returns how many there are, longest first; at most `room` are stored.
 * O(n) for the runs, O(n) for each bearing at which one may begin.
 */
uint32_t depth_regions(const double *range_m, uint32_t n, double window_m, uint32_t least_n,
                       struct depth_region *region, uint32_t room);

#endif
