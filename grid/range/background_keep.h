/* SPDX-License-Identifier: MIT */
/*
 * background_keep - takes out of a background template what is not the vehicle: walls and other surroundings that
 * stood still while it was learnt. Loud cells are clustered by distance; a cluster stays when it is loud, short, near
 * and narrow enough to be part of a vehicle.
 *
 * Oliveira, Ferreira and Cruz 2023, section III A, clusters by DBSCAN and judges by mean intensity and spread
 * without saying how; the rule is ours.
 */
#ifndef SONARD_BACKGROUND_KEEP_H
#define SONARD_BACKGROUND_KEEP_H

#include "background.h"

struct background_rule {
    double neighbour_m;  /* cells nearer to each other than this are neighbours, > 0 */
    uint32_t min_points; /* neighbours, itself counted, that make a cell a core */
    double min_level;    /* mean counts of a cluster, at least */
    double extent_m;     /* range from its nearest to its farthest cell, at most */
    double reach_m;      /* range of its farthest cell, at most */
    double share;        /* of all rows that it touches, at most, 0..1 */
    double ring_m;       /* cells nearer than this are the transducer's own ring: kept, and in no cluster */
};

struct background_kept {
    uint32_t clusters, kept; /* found; left in the template */
    uint32_t removed;        /* loud cells taken out, those of no cluster among them */
    uint32_t blind;          /* loud cells that stay */
};

/** background_keep_size - bytes of working memory, aligned to max_align_t. */
size_t background_keep_size(const struct background_shape *shape);

/**
 * background_keep - set to 0 the cells above mask_above of what the rule does not keep. Loud cells of no cluster go
 * too: what stays of them in the pings is an obstacle, which is the safe mistake.
 */
void background_keep(struct background *background, const struct background_rule *rule, void *work,
                     struct background_kept *kept);

#endif
