/* SPDX-License-Identifier: MIT */
/*
 * free_query - is this place, box or corridor free, and where is it not? Answers from the judged map, voxel by voxel:
 * free only if every voxel that the place touches is. Larger places are never more free than smaller ones within them.
 * Positions in metres, NED. Knows no client.
 */
#ifndef SONARD_FREE_QUERY_H
#define SONARD_FREE_QUERY_H

#include "voxmask.h"

#define FREE_QUERY_MOST_VOXELS 20e6 /* a question about more is refused */

struct free_answer {
    enum voxel_state state; /* the severest of all voxels touched */
    uint64_t voxels;        /* touched (by a corridor: per leg) */
    uint64_t unknown, occupied;
    bool away; /* some that are not free may become free when paged-out submaps are back */
    bool lost; /* some that are not free may have been free in a submap that was forgotten */
    /* When not free, the first voxel that is not: of a box the first by north, east, down; of a corridor or ray the one met
     * first. */
    enum voxel_state first_state;
    double first_m[3]; /* its centre */
    /* Corridor: how far along the path the swept ball may go before it touches that voxel (never too far). All the way when free. */
    double clear_m;
};

/** free_query_point - the voxel that holds the place. False: not a place (not finite, too far). So for all below. */
bool free_query_point(struct voxmask *v, const double at_m[3], struct free_answer *out);

/** free_query_box - every voxel that the box touches; low <= high per axis. */
bool free_query_box(struct voxmask *v, const double low_m[3], const double high_m[3], struct free_answer *out);

/** free_query_corridor - every voxel whose box touches a ball of radius_m >= 0 swept along n >= 1 way points. */
bool free_query_corridor(struct voxmask *v, const double (*way_m)[3], uint32_t n, double radius_m,
                         struct free_answer *out);

#endif
