/* SPDX-License-Identifier: MIT */
/*
 * obstacles - the nearest obstacle of a picture in a cone, a corridor, each sector of a band or a body's way, as seen
 * from where the vehicle may be. Knows no free water.
 */
#ifndef SONARD_OBSTACLES_H
#define SONARD_OBSTACLES_H

#include "corridor.h"
#include "scope.h"

/* A cone or corridor, the sectors of a band, or a body that moves. */
struct obstacles_query {
    bool around, moves;
    struct answer_query line;
    struct answer_band band; /* reach_m > 0 */
    struct corridor_query move;
};

/* Of one part of the question. */
struct obstacles_found {
    bool any;
    double near_m; /* it may begin so near */
    double range_m, sd_m;
    double confidence, age_s;
    double hint_m; /* within near_m of the query, and before the obstacle, is an echo that is too little to block;
                      INFINITY: there is none */
    double at[3];  /* of a sector, or a body's way: in which direction the obstacle is, in the axes asked about */
    /* of a body's way, along which its ranges are: in which direction the echo is; from where on the picture does not
     * keep all of it, or INFINITY */
    double hint_at[3], kept_m;
};

/* Who asks, from where. */
struct obstacles_scene {
    struct picture *picture;
    const struct picture_frame *frame;
    const struct answer_conf *conf;
    const struct answer_now *now;
    const struct sight_place *place;
};

static inline size_t obstacles_parts(const struct obstacles_query *q)
{
    return q->around ? q->band.count : 1;
}

/** obstacles_find - in each part, those of a cone or corridor up to its distance; found: room for the parts. Returns
 * ANSWER_HEARD; ANSWER_OUTSIDE: not all directions asked about are kept. Cost: a glance at each direction, and a look
 * at those that may be the nearest of their part so far. */
enum answer_reason obstacles_find(const struct obstacles_scene *scene, const struct obstacles_query *query,
                                  struct obstacles_found *found);

#endif
