/* SPDX-License-Identifier: MIT */
#include "verdict_bars.h"

#include <math.h>
#include <string.h>

#include "bottom.h"
#include "promise.h"
#include "verdict_ask.h"

/* ---- the bottom ---- */

#define BOTTOM_LEVELS TILES_LEVELS

/* So far may a part of the run be free of the bottom, as far as is known. */
static double most_bottom_m(const struct verdict *v, const struct question_run *run)
{
    double most_m = 0;
    for (size_t k = 0; k < run->n; k++)
        most_m = fmax(most_m, v->part[(run->at + k) % v->parts].bottom_m);
    return most_m;
}

/* How far the parts that the tile touches are free of the bottom. Roots come from the lowest on, so most that are
 * higher can tell nothing nearer and are not divided. Any direction that is asked, however its axes are turned, lies in
 * a tile that is: that tile's lowest direction is low enough. */
static void heed_bottom_in(struct verdict *v, const struct question_shape *q, const struct bottom *bottom,
                           const struct tile_index *tile)
{
    const struct water_tile cone = tiles_cone(tile);
    const struct question_run run = question_run(q, &cone);
    struct ask_stretch s;
    if (!run.n || !question_stretch(q, &cone, verdict_most_asked_m(v), &s))
        return;
    const double lowest = asin(fmax(-1, fmin(cone.v[2], 1))) + cone.half_rad;
    const double free_m = bottom_reach_m(bottom, sin(fmin(lowest, GEO_PI / 2)));
    const double least_m = question_measure(q, &cone, free_m);
    if (free_m >= s.to_m || least_m >= most_bottom_m(v, &run))
        return;
    for (int i = 0; i < 4 && tile->level + 1 < BOTTOM_LEVELS; i++) {
        const struct tile_index part = tiles_part(tile, i);
        heed_bottom_in(v, q, bottom, &part);
    }
    for (size_t k = 0; k < run.n && tile->level + 1 == BOTTOM_LEVELS; k++) {
        struct verdict_part *part = &v->part[(run.at + k) % v->parts];
        if (least_m < part->bottom_m)
            memcpy(part->bottom_at, cone.v, sizeof part->bottom_at);
        part->bottom_m = fmin(part->bottom_m, least_m);
    }
}

#define NO_NEAR_M 1e-3

/* From the vehicle on: the bottom ends what is free where nobody needs to have looked, too. */
void verdict_heed_bottom(struct verdict *v, const struct ask_question *asked)
{
    const struct answer_now *now = v->by.now;
    struct ask_question from_here = *asked;
    struct question_shape q;
    if (!v->frame.ned || !(now->pose.has & POSE_ALTITUDE))
        return;
    from_here.near_m = NO_NEAR_M;
    from_here.level_m = NULL;
    question_begin(&q, &from_here);
    const struct bottom bottom = bottom_below(now->pose.altitude_m, -v->place.uncertain_m, v->place.uncertain_m);
    for (uint32_t row = 0; row < TILES_ROWS; row++) {
        uint32_t n, column = question_columns(&q, row, &n);
        for (; n > 0; n--, column++) {
            const struct tile_index root = {0, (uint16_t)row, (uint16_t)(column % tiles_columns(row))};
            heed_bottom_in(v, &q, &bottom, &root);
        }
    }
}

/* ---- the promise ---- */

/* Something that a beam showed elsewhere may have come to where the tile is asked, however far that is asked. */
static void heed_shown_in(struct verdict *v, const struct promise *promise, const struct question_shape *q,
                          const struct tile_index *tile)
{
    const struct water_tile cone = tiles_cone(tile);
    const struct question_run run = question_run(q, &cone);
    struct ask_stretch s;
    if (!run.n || !question_stretch(q, &cone, VERDICT_FARTHEST_M, &s))
        return;
    double at[3] = {cone.v[0], cone.v[1], cone.v[2]};
    sight_to_grid(&v->frame, v->by.now, true, at);
    const double level = hypot(at[0], at[1]), half = sin(cone.half_rad) / fmax(level, 1e-9);
    const double come_m =
        promise_come_m(promise, atan2(at[1], at[0]), v->place.adrift_rad + (half < 1 ? asin(half) : GEO_PI));
    for (size_t k = 0; k < run.n && come_m < s.to_m; k++) {
        struct verdict_part *part = &v->part[(run.at + k) % v->parts];
        part->promised_m = fmax(v->own_m, fmin(part->promised_m, come_m));
    }
}

/* Of a vehicle that drifts. */
void verdict_heed_shown(struct verdict *v)
{
    if (v->by.now->pose.drift_mps <= 0)
        return;
    const struct ask_question from_own = verdict_question(v, 0, v->own_m);
    struct question_shape q;
    question_begin(&q, &from_own);
    for (uint32_t row = 0; row < TILES_ROWS; row++) {
        uint32_t n, column = question_columns(&q, row, &n);
        for (; n > 0; n--, column++) {
            const struct tile_index root = {0, (uint16_t)row, (uint16_t)(column % tiles_columns(row))};
            heed_shown_in(v, &v->horizon.promise, &q, &root);
        }
    }
}
