/* SPDX-License-Identifier: MIT */
/*
 * sphere_rig.h - a grid, clusters of it, and the records of free water beside it, in memory that is not zeroed, as the
 * tests of grid/sphere want them; and questions to both.
 */
#ifndef SONARD_TEST_SPHERE_RIG_H
#define SONARD_TEST_SPHERE_RIG_H

#include "core/fault.h"
#include "grid/sphere/clusters.h"
#include "grid/sphere/sphere.h"
#include "ask_both.h"
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

#define RIG_BEAMS 64 /* of a ping, at most */

static struct store *store;

/* New records in `store`; those before are gone. */
static inline void rig_store(void)
{
    static const struct store_conf conf = {.beams = {RIG_BEAMS, 1}, .spare = 1};
    static void *memory;
    memory = rig_memory(memory, store_bytes(&conf));
    store = store_init(memory, &conf);
}

/* A new grid in `sphere`, and new records; those before are gone. */
static inline void rig_sphere(const struct sphere_conf *conf)
{
    static void *memory;
    struct fault fault;
    memory = rig_memory(memory, sphere_bytes(conf, &fault));
    sphere = sphere_init(memory, conf);
    rig_store();
}

/* A ping, and a pose while none comes, for both. */
static inline void rig_enter(const struct echoes *e, const struct mount *mount)
{
    sphere_enter(sphere, e, mount);
    store_enter(store, e, mount);
}

static inline void rig_follow(const struct pose *pose)
{
    sphere_follow(sphere, pose);
    store_follow(store, pose);
}

/* Clusters for that grid; those before are gone. */
static inline struct clusters *rig_clusters(const struct sphere_conf *conf)
{
    static void *memory;
    const struct rings *rings = sphere_picture(sphere)->rings;
    memory = rig_memory(memory, clusters_bytes(rings, conf->max_cells));
    return clusters_init(memory, rings, conf->max_cells, (double)sphere_picture(sphere)->blocked_logodds);
}

#define RIG_OWN_M  0.5 /* nearer than this is the vehicle, ... */
#define RIG_NEAR_M 1.0 /* ... and up to here nothing stands that no beam shows */

/* Asked of both, as of `now`. */
static inline const struct verdict *rig_verdict(const struct answer_conf *by, const struct obstacles_query *q,
                                                double near_m)
{
    return ask_both(&(struct asker){sphere_picture(sphere), store, by, &now}, q, fmin(RIG_OWN_M, near_m));
}

static inline struct answer rig_line_by(const struct answer_conf *by, const struct answer_query *line)
{
    return *verdict_of(rig_verdict(by, &(struct obstacles_query){.line = *line}, line->near_m), 0);
}

static inline struct answer rig_line(const struct answer_query *line)
{
    return rig_line_by(&limits, line);
}

static inline void rig_band(const struct answer_band *band, struct answer *sectors)
{
    const struct verdict *v =
        rig_verdict(&limits, &(struct obstacles_query){.around = true, .band = *band}, band->near_m);
    for (size_t k = 0; k < band->count; k++)
        sectors[k] = *verdict_of(v, k);
}

/* Is the water free in a cone of 5 degrees, as of `now`? */
static inline struct answer ask(double az_deg, double distance_m)
{
    return rig_line(&(struct answer_query){
        .az_rad = geo_rad(az_deg), .distance_m = distance_m, .half_angle_rad = geo_rad(5), .near_m = RIG_NEAR_M});
}

#endif
