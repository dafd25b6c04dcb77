/* SPDX-License-Identifier: MIT */
/* way_rig.h - what a picture has in a cone, a band, or the way of a body that moves. */
#ifndef SONARD_TEST_WAY_RIG_H
#define SONARD_TEST_WAY_RIG_H

#include "grid/answer/obstacles.h"
#include "tests/lib/test.h"

static inline enum answer_reason find_obstacles(struct picture *p, const struct answer_conf *conf,
                                                const struct answer_now *at, const struct obstacles_query *q,
                                                struct obstacles_found *found)
{
    struct picture_frame frame;
    struct sight_place place;
    const struct obstacles_scene scene = {p, &frame, conf, at, &place};
    picture_get_frame(p, &frame);
    sight_locate(&frame, conf, at, &place);
    return obstacles_find(&scene, q, found);
}

/* Along that way; near_m is INFINITY where there is nothing. */
static inline struct obstacles_found find_in_way(struct picture *p, const struct answer_conf *conf,
                                                 const struct answer_now *at, const struct corridor_query *q)
{
    struct obstacles_found found;
    CHECK_INT(find_obstacles(p, conf, at, &(struct obstacles_query){.moves = true, .move = *q}, &found),
              ANSWER_HEARD);
    if (!found.any)
        found.near_m = INFINITY;
    return found;
}

#endif
