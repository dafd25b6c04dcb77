/* SPDX-License-Identifier: MIT */
/*
 * arcs - circular arcs among the echoes of a scan, beside the lines of tangents.h: least-squares primitives (Mathisen
 * 1993, after Auran and Silven 1996, 2.1). A round tank is one around the scanner, a pile one that bulges towards it.
 * In the plane of the scan. Pure.
 */
#ifndef SONARD_ARCS_H
#define SONARD_ARCS_H

#include <stdbool.h>
#include <stdint.h>

#include "tangents.h"

struct arcs_conf {
    double reach_m;   /* neighbours farther apart than this are of different runs */
    uint32_t least_n; /* points of an arc, >= 3 */
    double round_m;   /* rms off its circle at most, and half of that off the best line */
    double radius_m;  /* at most */
};

struct arc {
    struct tangent_point centre;
    double radius_m;
    double rms_m;    /* of its points off the circle */
    uint32_t first;  /* number of its first point; past the end of the turn it goes on at the beginning */
    uint32_t points; /* that it accounts for */
};

/**
 * arcs_find - of n points in order of bearing around a whole turn (n <= TANGENTS_MAX), runs of those that belong to no
 * wall (of[i] is TANGENTS_NONE) and that a circle fits all of. In order of bearing; returns how many there are, at
 * most `room` are stored. O(n).
 */
uint32_t arcs_find(const struct arcs_conf *conf, const struct tangent_point *points, uint32_t n,
                   const uint32_t *of, struct arc *arc, uint32_t room);

#endif
