/* SPDX-License-Identifier: MIT */
/* picture_rig.h - a picture made by hand, direction by direction, as the tests of grid/answer want it. */
#ifndef SONARD_TEST_PICTURE_RIG_H
#define SONARD_TEST_PICTURE_RIG_H

#include "grid/answer/answer.h"
#include "grid/picture/picture.h"
#include "test.h"

#define SECOND 1000000000ull
#define NOW    (1000 * SECOND)

static struct rings rings;
static struct picture picture;
static double axis[8192][3];
static const struct answer_conf limits = {.clear_for_s = 30, .move_limit_m = 0.5};
static struct answer_now now;

/* An empty picture over `rings`, which were made if good. */
static inline void start_with(bool good, bool ned)
{
    static void *word;
    CHECK(good);
    free(word);
    word = aligned_alloc(64, (picture_bytes(rings.n) + 63) / 64 * 64);
    for (uint32_t d = 0; d < rings.n; d++) {
        double az, el;
        rings_centre(&rings, d, &az, &el);
        geo_direction(az, el, axis[d]);
    }
    picture_init(&picture, &rings, (const double(*)[3])axis, 60, 0.4, word);
    const struct picture_frame frame = {
        .ned = ned, .pings = 1, .t_ping_ns = NOW, .range_max_m = 20, .recentre_m = 0.1};
    picture_begin(&picture);
    picture_set_frame(&picture, &frame);
    picture_end(&picture);
    now = (struct answer_now){.now_ns = NOW, .pose_fresh = true, .pose = pose_identity};
}

/* The picture changes, as by a ping, and its azimuth 0 lies there from now on. */
static inline void turn_axes(double axes_rad)
{
    struct picture_frame frame;
    picture_get_frame(&picture, &frame);
    frame.axes_rad = axes_rad;
    picture_begin(&picture);
    picture_set_frame(&picture, &frame);
    picture_end(&picture);
}

#endif
