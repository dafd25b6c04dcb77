/* SPDX-License-Identifier: MIT */
/*
 * relax - relaxation (Auran and Silven 1996, section 4.1): a cell shares in the evidence of those that it stands among.
 * One Jacobi step for a cell i of evidence L_i (log-odds, >= 0; 0 when it does not exist):
 *
 *     L_i + mu * sum_j max(0, L_j - L_i) / n,     0 <= mu <= 1
 *
 * over the n directions that touch that of i (eight, fewer or more near a pole); L_j is the strongest of direction j's
 * cells in the same layer and the two next to it. So the result is never above the strongest
 * neighbour, and never below L_i.
 *
 * The step is taken when a direction is published, and only the picture gets it: the cells keep their own evidence, so
 * no echo is counted twice, no order matters, and what is raised goes when its neighbours go. All evidence fades alike,
 * and so does the sum. What becomes an obstacle by it is put beside those that the direction has by itself, where the
 * picture has room; nothing else changes. So what is blocked without it is blocked with it,
 * and what is clear with it is clear without. Clusters may be made of cells so relaxed (conf.cluster_relaxation).
 */
#ifndef SONARD_RELAX_H
#define SONARD_RELAX_H

#include "state.h"
#include "view.h"

/* A layer of the direction that is relaxed. */
struct relaxed {
    double own;         /* evidence of the direction's cell; 0: it has none */
    double more;        /* sum of what the neighbours have more */
    uint64_t t_echo_ns; /* their newest echo */
    float sd_m;         /* their greatest deviation in range */
    uint32_t cell;      /* 1 + the direction's cell; 0: none */
    uint32_t of;        /* 1 + the neighbour that gave last, so far at most */
    double most;        /* this */
};

/** relax_init - layer: memory for [layers of s]. */
void relax_init(struct sphere *s, struct relaxed *layer);

/** relax_reach - directions whose neighbours are to be published are to be published, too. */
void relax_reach(struct sphere *s);

/**
 * relax_direction - the obstacles that direction d has by its neighbours as of t_ns, put among the n it has by itself,
 * nearest first; n is at most PICTURE_OBSTACLES. None in a direction that was never pinged. Cost: the cells of the
 * directions that touch d.
 */
void relax_direction(struct sphere *s, uint32_t d, uint64_t t_ns, struct picture_obstacle *obstacle, unsigned n);

typedef void relax_take(void *context, const struct sphere_cell *cell);

/**
 * relax_cells - gives each cell of direction d as one step of mu leaves it as of t_ns, nearest first, and with it those
 * that only their neighbours make: without an echo, in the middle of their layer, none in a direction that was never
 * pinged. The grid stays as it is. Only while conf.relaxation or conf.cluster_relaxation is above 0: room for the work.
 */
void relax_cells(const struct sphere *s, uint32_t d, double mu, uint64_t t_ns, relax_take *take, void *context);

#endif
