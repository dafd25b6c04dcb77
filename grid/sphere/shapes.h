/* SPDX-License-Identifier: MIT */
/*
 * shapes - what clusters may be: the nearest obstacles all around, at the horizon, are looked at for walls, arcs
 * and regions of constant depth, and clusters for lying where a wall's ghost would be. Suspicions for people and
 * planners; no obstacle goes away for them. Pure.
 */
#ifndef SONARD_SHAPES_H
#define SONARD_SHAPES_H

#include "arcs.h"
#include "clusters.h"
#include "depth_regions.h"
#include "tangents.h"

#define SHAPES_WALLS   32
#define SHAPES_ARCS    32
#define SHAPES_REGIONS 64

/* Neighbouring bearings whose nearest obstacles are at one range, give or take what echoes of one wall scatter. */
struct shapes_region {
    double from_rad, width_rad; /* azimuth at which it begins, clockwise; 2 pi: all around */
    double least_m, most_m;
    uint32_t bearings;
    uint32_t wall; /* about whose normal it lies; TANGENTS_NONE: none's */
};

struct shapes {
    uint32_t n; /* walls, most points first */
    struct wall wall[SHAPES_WALLS];
    bool constant_depth[SHAPES_WALLS]; /* a region of constant depth lies about its normal */
    uint32_t corners;
    struct shapes_corner {
        uint32_t a, b; /* numbers of its walls */
        struct tangent_point place;
    } corner[SHAPES_WALLS];
    uint32_t arcs; /* in order of bearing */
    struct arc arc[SHAPES_ARCS];
    uint32_t regions; /* of constant depth, the widest first */
    struct shapes_region region[SHAPES_REGIONS];
};

/** shapes_look - of the obstacles that the picture shows at now_ns; in the grid's axes. O(directions of a ring ^2). */
void shapes_look(struct shapes *s, struct picture *picture, uint64_t now_ns);

/** shapes_ghost_of - the wall whose ghost the cluster may be, or TANGENTS_NONE: judged by its nearest place. */
uint32_t shapes_ghost_of(const struct shapes *s, const struct cluster *cluster);

#endif
