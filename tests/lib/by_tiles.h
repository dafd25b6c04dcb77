/* SPDX-License-Identifier: MIT */
/*
 * by_tiles.h - questions in the body's axes, asked of the records of pings by tiles, beside the daemon's answers: how
 * far the water is free from `near` on. What stands nearer the echoes tell.
 */
#ifndef SONARD_TEST_BY_TILES_H
#define SONARD_TEST_BY_TILES_H

#include "daemon_rig.h"

#include "daemon/methods/query_context.h"
#include "grid/answer/limit.h"
#include "grid/answer/sight.h"

struct by_tiles {
    struct ask_question question;
    struct answer_now now;
    bool any; /* something can be said: there are poses, and pings */
    struct ask ask;
};
static struct by_tiles tiles;

static inline void by_tiles_ask(struct by_tiles *t)
{
    static struct water_view view[ASK_RECORDS];
    static struct records_reading reading;
    const struct answer_conf limits = grid_limits(pipeline_grid(d.pipeline, 0));
    const struct store_now now = {.now_ns = t->now.now_ns,
                                  .pose = &t->now.pose,
                                  .clear_for_s = limits.clear_for_s,
                                  .move_limit_m = limits.move_limit_m,
                                  .lost = t->now.lost};
    struct records *records = pipeline_records(d.pipeline);
    records_open(records, &reading);
    ask_begin(&t->ask, view, records_view(records, &reading, &now, view), &t->question);
    while (ask_step(&t->ask))
        ;
    records_close(records, &reading);
}

/* A question, to be filled in; axis is the body's. */
static inline struct ask_question *by_tiles_begin(enum ask_kind kind, const double axis[3], double to_m)
{
    struct ask_question *q = &tiles.question;
    struct picture_frame frame;
    enum answer_reason reason;
    tiles.now = query_now(&d);
    picture_get_frame(grid_picture(pipeline_grid(d.pipeline, 0)), &frame);
    tiles.any = sight_possible(&frame, &tiles.now, false, &reason);
    *q = (struct ask_question){.kind = kind,
                               .near_m = query_near_m(&d),
                               .to_m = to_m,
                               .loose_rad = tiles.now.pose.uncertain_rad,
                               .band = {.attitude = {1, 0, 0, 0}}};
    if (frame.ned)
        memcpy(q->band.attitude, tiles.now.pose.attitude, sizeof q->band.attitude);
    quat_rotate(q->band.attitude, axis, q->axis);
    return q;
}

/* The body of the configuration, as it moves. */
static inline struct ask_question *by_tiles_move(const double axis[3], double to_m, double margin_m,
                                                 double drift_m)
{
    static const double up[3] = {0, 0, -1};
    struct ask_question *q = by_tiles_begin(ASK_MOVE, axis, to_m);
    double across[3], mps;
    q->body = (struct ask_body){
        .radius_m = d.conf.vehicle.radius_m, .half_height_m = d.conf.vehicle.height_m / 2, .margin_m = margin_m};
    quat_rotate(q->band.attitude, up, q->body.up);
    for (int k = 0; k < 3; k++)
        across[k] = tiles.now.pose.velocity_mps[k] - geo_dot(tiles.now.pose.velocity_mps, q->axis) * q->axis[k];
    mps = geo_length(across);
    for (int k = 0; k < 3 && mps > 1e-3; k++)
        q->body.drift_m[k] = across[k] / mps * drift_m;
    return q;
}

/* False: nothing is said; only what goes beyond `near` is asked. */
static inline bool by_tiles_end(void)
{
    if (!tiles.any || tiles.question.to_m <= tiles.question.near_m)
        return false;
    by_tiles_ask(&tiles);
    return true;
}

static inline double by_tiles_free_m(size_t part)
{
    return ask_end(&tiles.ask, part).free_to_m;
}

#endif
