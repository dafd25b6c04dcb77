/* SPDX-License-Identifier: MIT */
/* way_rig.h - what a picture has in the way of a body that moves. */
#ifndef SONARD_TEST_WAY_RIG_H
#define SONARD_TEST_WAY_RIG_H

#include "grid/answer/obstacles.h"
#include "tests/lib/test.h"

/* Along that way; near_m is INFINITY where there is nothing. */
static inline struct obstacles_found find_in_way(struct picture *p, const struct answer_conf *conf,
                                                 const struct answer_now *at, const struct corridor_query *q)
{
    struct picture_frame frame;
    struct sight_place place;
    const struct obstacles_scene scene = {p, &frame, conf, at, &place};
    const struct obstacles_query query = {.moves = true, .move = *q};
    struct obstacles_found found;
    picture_get_frame(p, &frame);
    sight_locate(p, &frame, conf, at, &place);
    CHECK_INT(obstacles_find(&scene, &query, &found), ANSWER_HEARD);
    if (!found.any)
        found.near_m = INFINITY;
    return found;
}

#endif
