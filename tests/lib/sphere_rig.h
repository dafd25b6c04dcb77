/* SPDX-License-Identifier: MIT */
/* sphere_rig.h - a grid, and clusters of it, in memory that is not zeroed, as the tests of grid/sphere want them. */
#ifndef SONARD_TEST_SPHERE_RIG_H
#define SONARD_TEST_SPHERE_RIG_H

#include "core/fault.h"
#include "grid/answer/answer.h"
#include "grid/sphere/clusters.h"
#include "grid/sphere/sphere.h"
#include "test.h"

#define SECOND 1000000000ull

static struct sphere *sphere;
static struct answer_now now;
static const struct answer_conf limits = {.clear_for_s = 30, .move_limit_m = 0.5};

static inline void *rig_memory(void *old, size_t n)
{
    free(old);
    void *memory = aligned_alloc(64, (n + 63) / 64 * 64);
    if (!memory) {
        printf("no memory\n");
        exit(1);
    }
    return memset(memory, 0xa5, n); /* nothing may rely on zeroed memory */
}

/* A new grid in `sphere`; the one before is gone. */
static inline void rig_sphere(const struct sphere_conf *conf)
{
    static void *memory;
    struct fault fault;
    memory = rig_memory(memory, sphere_bytes(conf, &fault));
    sphere = sphere_init(memory, conf);
}

/* Clusters for that grid; those before are gone. */
static inline struct clusters *rig_clusters(const struct sphere_conf *conf)
{
    static void *memory;
    const struct rings *rings = sphere_picture(sphere)->rings;
    memory = rig_memory(memory, clusters_bytes(rings, conf->max_cells));
    return clusters_init(memory, rings, conf->max_cells, (double)sphere_picture(sphere)->blocked_logodds);
}

/* Is the water free in a cone of 5 degrees, as of `now`? */
static inline struct answer ask(double az_deg, double distance_m)
{
    struct answer_query q = {.az_rad = geo_rad(az_deg), .distance_m = distance_m, .half_angle_rad = geo_rad(5)};
    struct answer a;
    answer_direction(sphere_picture(sphere), &limits, &now, &q, &a);
    return a;
}

#endif
