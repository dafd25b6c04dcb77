/* SPDX-License-Identifier: MIT */
/* test_horizon - what the records of free water say about where `near` holds, part by part of the horizon. */
#include "grid/answer/horizon.h"
#include "grid/water/store.h"

#include "tests/lib/looks_rig.h"

#define NEAR_M 3.4

static struct horizon horizon;
static struct ask ask;
static struct water_view view[ASK_RECORDS];
static struct store *store;
static struct pose pose;
static struct mount mount;
static uint64_t t_ns;
static uint32_t seq;

static void begin(void)
{
    static const struct store_conf conf = {.beams = {1}, .spare = 1};
    static void *memory;
    start_with(rings_full(&rings, geo_rad(3)), true);
    looks_at(UINT64_MAX, 0, false);
    memory = memory ? memory : malloc(store_bytes(&conf));
    store = store_init(memory, &conf);
    mount = mount_identity;
    pose = pose_identity;
    pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    t_ns = NOW - 9 * SECOND;
    seq = 0;
}

static void look(double az_deg, double from_m, double free_m, bool echo, uint64_t after_ns)
{
    struct beam_echoes beam = {.az_rad = (float)geo_wrap(geo_rad(az_deg)),
                               .blind_m = (float)from_m,
                               .free_to_m = (float)free_m,
                               .n = echo,
                               .state = echo ? BEAM_ECHO : BEAM_SILENT};
    const struct echoes ping = {.t_ns = t_ns += after_ns,
                                .seq = ++seq,
                                .n_beams = 1,
                                .turns = true,
                                .range_max_m = 20,
                                .beam = &beam,
                                .az_aperture_rad = (float)geo_rad(3),
                                .el_aperture_rad = (float)geo_rad(25),
                                .pose = pose};
    store_enter(store, &ping, &mount);
}

/* The head is mounted so far ahead of the middle and to its right, and looks at those bearings. */
static void mount_at(double ahead_m, double right_m, uint64_t bearings)
{
    struct picture_frame frame;
    mount.position_m[0] = ahead_m;
    mount.position_m[1] = right_m;
    picture_get_frame(&picture, &frame);
    frame.looks.bearings[0] = bearings;
    memcpy(frame.looks.place_m[0], mount.position_m, sizeof mount.position_m);
    picture_begin(&picture);
    picture_set_frame(&picture, &frame);
    picture_end(&picture);
}

/* On a way to the north, from where the vehicle is now. */
static void end(void)
{
    const struct store_now at = {.now_ns = NOW, .pose = &pose, .clear_for_s = 30, .move_limit_m = 10};
    const struct horizon_now then = {NOW, view};
    const double along[3] = {1, 0, 0};
    struct picture_frame frame;
    struct sight_place place;
    now.pose = pose;
    picture_get_frame(&picture, &frame);
    sight_locate(&frame, &limits, &now, &place);
    const int n = store_view(store, &at, view);
    horizon.promise = promise_begin(&picture, &limits, &frame, &now, &place);
    if (horizon_begin(&horizon, along, 0, NEAR_M))
        do {
            const struct ask_question q = horizon_question(&horizon);
            ask_begin(&ask, view, n, &q);
            while (ask_step(&ask))
                ;
        } while (horizon_take(&horizon, &ask, &then));
    horizon_end(&horizon, view, n, view, n);
}

/* A head passed 10 m away and had water ahead of here crosswise, beyond `near`; a thing hid from it what is nearer. */
TEST(near_holds_nowhere_for_water_seen_from_afar)
{
    begin();
    pose.position_m[0] = 8;
    pose.position_m[1] = 6;
    for (int i = 0; i < 60; i++) {
        const double az_deg = -150 + 2 * i;
        const bool hides = az_deg < -120;
        look(az_deg, 0.3, hides ? 2 : 15, hides, SECOND / 50);
    }
    for (int i = 1; i <= 40; i++) { /* looks aft on the way here */
        pose.position_m[0] = 8 - 8 * i / 40.0;
        pose.position_m[1] = 6 - 6 * i / 40.0;
        pose.path_m = 8 * i / 40.0;
        look(120 + 1.5 * i, 0.3, 15, false, SECOND / 8);
    }
    end();
    CHECK(!horizon.look[0].goes_on);
    CHECK_NEAR(horizon.level_m[0], 0, 1e-9, 0);
}

/* The same water, free from beyond `near` on, seen from here: its beam begins late. */
TEST(near_holds_where_a_beam_from_here_begins_late)
{
    begin();
    for (int i = 0; i < 60; i++)
        look(2 * i - 60, NEAR_M + 1, 15, false, SECOND / 50);
    end();
    CHECK(horizon.look[0].goes_on);
    CHECK_NEAR(horizon.level_m[0], NEAR_M, 1e-9, 0);
}

static uint32_t part_of(double az_deg)
{
    return (uint32_t)(geo_wrap(geo_rad(az_deg)) / GEO_TURN * ASK_LEVEL);
}

/*
 * In a head's first turn the vehicle drives 4 m to the north. What is at 320 degrees by now, 2 m away, was at 347 when
 * the head began at 344, and to the right of every beam since. The water behind it was at 342. Where the head began to
 * the right of all that, it has looked.
 */
TEST(near_ends_where_no_beam_has_looked_on_the_way)
{
    for (int right = 0; right < 2; right++) {
        begin();
        for (int i = 0; i < 90; i++) {
            pose.path_m = pose.position_m[0] = 4 * i / 90.0;
            look((right ? 20 : -16) - 2 * i, 0.3, 15, false, SECOND / 15);
        }
        end();
        CHECK(horizon.look[part_of(320)].goes_on);
        CHECK_NEAR(horizon.level_m[part_of(320)], right ? NEAR_M : 0, 1e-9, 0);
    }
}

/* A head far ahead of the middle looks at that bearing, but at no place there that is nearer than `near`. */
TEST(near_waits_for_no_look_where_no_head_ever_looks)
{
    for (int ahead_m = 0; ahead_m < 5; ahead_m += 4) {
        begin();
        mount_at(ahead_m, 0, UINT64_C(0xff) | UINT64_C(0xff) << 56); /* 45 degrees to each side */
        end();
        CHECK_NEAR(horizon.level_m[part_of(20)], ahead_m ? NEAR_M : 0, 1e-9, 0);
    }
}

/* A head half a metre to the right began its first turn ahead: 40 degrees to the right it has looked at the water where
 * `near` ends, not at what is close by, which lies to its left. A vehicle that drifts a little knows no more. */
TEST(near_ends_where_a_head_off_the_middle_has_not_looked_close_by)
{
    for (int drifts = 0; drifts < 2; drifts++)
        for (int left = 0; left < 2; left++) {
            begin();
            mount_at(0, 0.5, UINT64_MAX);
            pose.has = POSE_ATTITUDE | POSE_DEPTH | (drifts ? 0 : POSE_POSITION);
            pose.drift_mps = drifts ? 1e-3 : 0;
            for (int i = 0; i < 70; i++)
                look((left ? -80 : 0) + 2 * i, 0.3, 15, false, SECOND / 15);
            end();
            CHECK(horizon.look[part_of(40)].goes_on);
            CHECK_NEAR(horizon.level_m[part_of(40)], left ? NEAR_M : 0, 1e-9, 0);
        }
}

/* Such a head looks at what lies to its left alone: 20 degrees to the vehicle's right that is what is close by. */
TEST(near_waits_for_a_look_close_by_where_no_head_looks_far_away)
{
    for (int looked = 0; looked < 2; looked++) {
        begin();
        mount_at(0, 0.5, UINT64_C(0xffff) << 48);
        for (int i = 0; i < 45; i++)
            look((looked ? -90 : -180) + 2 * i, 0.3, 15, false, SECOND / 15);
        end();
        CHECK_NEAR(horizon.level_m[part_of(20)], looked ? NEAR_M : 0, 1e-9, 0);
    }
}

/* A beam of 100 degrees that does not turn. */
static void look_still(void)
{
    struct beam_echoes beam = {.free_to_m = 15, .state = BEAM_SILENT};
    const struct echoes ping = {.t_ns = t_ns += SECOND,
                                .seq = ++seq,
                                .n_beams = 1,
                                .range_max_m = 20,
                                .beam = &beam,
                                .az_aperture_rad = (float)geo_rad(100),
                                .el_aperture_rad = (float)geo_rad(25),
                                .pose = pose};
    store_enter(store, &ping, &mount);
}

/* The vehicle goes to the left while nothing is heard: what has come into the beam to its left nobody has seen, though
 * farther away the last ping has shown the water at that bearing. */
TEST(near_ends_where_a_still_beam_that_is_silent_has_come)
{
    for (int heard = 0; heard < 2; heard++) {
        begin();
        struct picture_frame frame;
        picture_get_frame(&picture, &frame);
        frame.looks.bearings[0] = 0;
        open_still(&frame.looks, 0, 100);
        frame.centre_m[1] = -0.25 * NEAR_M;
        picture_begin(&picture);
        picture_set_frame(&picture, &frame);
        picture_end(&picture);
        look_still();
        pose.position_m[1] = -0.25 * NEAR_M;
        pose.path_m = 0.25 * NEAR_M;
        if (heard)
            look_still();
        end();
        CHECK(horizon.look[part_of(320)].goes_on);
        CHECK_NEAR(horizon.level_m[part_of(320)], heard ? NEAR_M : 0, 1e-9, 0);
    }
}

int main(void)
{
    RUN(near_holds_nowhere_for_water_seen_from_afar);
    RUN(near_holds_where_a_beam_from_here_begins_late);
    RUN(near_ends_where_no_beam_has_looked_on_the_way);
    RUN(near_waits_for_no_look_where_no_head_ever_looks);
    RUN(near_ends_where_a_head_off_the_middle_has_not_looked_close_by);
    RUN(near_waits_for_a_look_close_by_where_no_head_looks_far_away);
    RUN(near_ends_where_a_still_beam_that_is_silent_has_come);
    return test_end();
}
