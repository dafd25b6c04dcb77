/* SPDX-License-Identifier: MIT */
/*
 * free_query - is this place, box or corridor free, and where is it not? Answers from the judged map, voxel by voxel:
 * free only if every voxel that the place touches is. Larger places are never more free than smaller ones within them.
 * Positions in metres, NED. Knows no client.
 */
#ifndef SONARD_FREE_QUERY_H
#define SONARD_FREE_QUERY_H

#include "voxmask.h"

#define FREE_QUERY_MOST_VOXELS 20e6  /* a question about more is refused */
#define FREE_QUERY_SLICE       16384 /* voxels looked at in one step */
#define FREE_QUERY_BLOCK       4096  /* a block that must be judged anew counts as so many */

struct free_answer {
    enum voxel_state state; /* the severest of all voxels touched */
    uint64_t voxels;        /* touched (by a corridor: per leg) */
    uint64_t unknown, occupied;
    bool lost; /* some that are not free may have been free in a submap that was forgotten */
    /* When not free, the first voxel that is not: of a box the first by north, east, down; of a corridor or ray the one
     * met first. */
    enum voxel_state first_state;
    double first_m[3]; /* its centre */
    /* Corridor: how far along the path the swept ball may go before it touches that voxel (never too far). All the way
     * when free. */
    double clear_m;
};

/* A question that is answered in steps, between which the map may take pings. */
struct free_query {
    struct free_answer answer; /* whole when free_query_step() says so */
    double voxel_m;
    bool found; /* a voxel that is not free */
    /* A box: its cells, and the next one. */
    int64_t low[3], high[3], cell[3];
    /* A corridor: its way points (NULL: it is a box), and the leg and the cell from its start at which to go on. */
    const double (*way_m)[3];
    uint32_t n, leg;
    double radius_m, before_m, at[3];
};

/** free_query_begin_box - every voxel that the box touches; low <= high per axis; a point is a box. False: no question,
 * or about too much (not finite, too far). So for the next. */
bool free_query_begin_box(struct free_query *q, double voxel_m, const double low_m[3], const double high_m[3]);

/** free_query_begin_corridor - every voxel whose box touches a ball of radius_m >= 0 swept along n >= 1 way points,
 * which outlive the question. */
bool free_query_begin_corridor(struct free_query *q, double voxel_m, const double (*way_m)[3], uint32_t n,
                               double radius_m);

/**
 * free_query_step - looks at FREE_QUERY_SLICE voxels at most, a block judged anew counted as FREE_QUERY_BLOCK of them
 * (and at most one over). True: the answer is whole. Each voxel is judged when it is looked at: begin anew when
 * anything but pings has changed the map since (change_of_all in voxmap.h),
 * or what is free may have been so at no one time.
 */
bool free_query_step(struct free_query *q, struct voxmask *v);

#endif
