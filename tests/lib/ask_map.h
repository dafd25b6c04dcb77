/* SPDX-License-Identifier: MIT */
/* ask_map.h - questions about places answered at once, as nobody waits for the map in a test: false, as it started. */
#ifndef SONARD_TEST_ASK_MAP_H
#define SONARD_TEST_ASK_MAP_H

#include "grid/voxel/free_query.h"

static inline bool ask_map(struct free_query *q, bool started, struct voxmask *v, struct free_answer *out)
{
    while (started && !free_query_step(q, v)) {
    }
    *out = started ? q->answer : (struct free_answer){0};
    return started;
}

static inline bool free_query_box(struct voxmask *v, const double low_m[3], const double high_m[3],
                                  struct free_answer *out)
{
    struct free_query q;
    return ask_map(&q, free_query_begin_box(&q, v->map->set.voxel_m, low_m, high_m), v, out);
}

static inline bool free_query_point(struct voxmask *v, const double at_m[3], struct free_answer *out)
{
    return free_query_box(v, at_m, at_m, out);
}

static inline bool free_query_corridor(struct voxmask *v, const double (*way_m)[3], uint32_t n, double radius_m,
                                       struct free_answer *out)
{
    struct free_query q;
    return ask_map(&q, free_query_begin_corridor(&q, v->map->set.voxel_m, way_m, n, radius_m), v, out);
}

#endif
