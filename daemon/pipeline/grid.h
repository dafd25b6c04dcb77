/* SPDX-License-Identifier: MIT */
/*
 * grid - one spherical grid and all that belongs to it: its name, its limits, its counters for other threads, the
 * clusters made of it. Every ping goes into each of the pipeline's grids. Knows neither configuration nor sockets.
 */
#ifndef SONARD_GRID_H
#define SONARD_GRID_H

#include <stdbool.h>
#include <stddef.h>

#include "core/fault.h"
#include "core/snapshot.h"
#include "grid/answer/answer.h"
#include "grid/answer/next_look.h"
#include "grid/sphere/clusters.h"
#include "grid/sphere/sphere.h"

#define GRID_NAME_MAX 32

struct grid_setting {
    char name[GRID_NAME_MAX];
    struct sphere_conf sphere;
    struct answer_conf limits;
};

struct grid {
    struct grid_setting setting;
    size_t bytes;                           /* of its memory, the clusters' among it once they are made */
    void *memory;                           /* of the sphere */
    struct sphere *sphere;                  /* of the maps' owner; of the loop while the pipeline is at rest */
    SNAPSHOT_OF(struct sphere_stats) stats; /* from the owner to the loop */
    struct clusters *clusters; /* made by the loop, and the owner's from then on; NULL until somebody asks */
    struct next_look_score *look_score; /* [directions], likewise, in the same memory */
};

/** grid_new - NULL with a sentence in fault. */
struct grid *grid_new(const struct grid_setting *setting, struct fault *fault);

/** grid_free - no thread may know it any more. NULL is allowed. */
void grid_free(struct grid *g);

/** grid_enter - a ping, by the maps' owner. */
void grid_enter(struct grid *g, const struct echoes *e, const struct mount *mount);

/** grid_follow - its centre follows the vehicle without a ping (sphere_follow), by the maps' owner. */
void grid_follow(struct grid *g, const struct pose *pose);

/** grid_picture - for any thread. */
struct picture *grid_picture(struct grid *g);

/** grid_limits - its limits as they are in force: what is left to the head's turn is worked out. Any thread. */
struct answer_conf grid_limits(const struct grid *g);

/** grid_stats - as of the last ping. Loop thread. */
void grid_stats(struct grid *g, struct sphere_stats *out);

/** grid_looks_bytes - memory for clusters, and for the scores of next_look, of a grid of these rings. */
size_t grid_looks_bytes(const struct rings *rings, uint32_t max_cells);

/** grid_clusters_bytes - what they will take in addition; 0: they are made. Loop thread. */
size_t grid_clusters_bytes(struct grid *g);

/** grid_clusters - made at the first call; NULL without memory. Loop thread. */
struct clusters *grid_clusters(struct grid *g);

#endif
