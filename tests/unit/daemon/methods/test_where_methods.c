/* SPDX-License-Identifier: MIT */
/*
 * test_where_methods - a place of the vehicle's axes is free where all of the water is in which it may lie: the pose
 * is some time old, and the vehicle may have gone on and turned since. And a slice shows the free water where it is.
 */
#include "tests/lib/daemon_rig.h"

#define SECOND 1000000000ull
#define PINGS  20

/* Goes 0.01 m/s and turns 20 degrees a second at most. */
#define CONF                                                                                                      \
    "[sonar head]\ndevice = echolist\nport = can:can0\nrange = 10 m\n"                                            \
    "[extract]\nminimum_range = 10 m\nno_echo = range\n"                                                          \
    "[pose]\nmax_age = 2 s\n[vehicle]\nmax_speed = 0.01 m/s\nmax_turn = 20 deg\n"                                 \
    "[map]\nvoxel = 0.2 m\nmemory = 16 MiB\n"

static const double place_m[3] = {30, -20, 4};
static uint64_t t_ns;

static void tell_pose(double heading_deg)
{
    struct pose pose = pose_identity;
    pose.t_ns = t_ns;
    memcpy(pose.position_m, place_m, sizeof place_m);
    pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    quat_from_rpy(0, 0, geo_rad(heading_deg), pose.attitude);
    CHECK(pose_log_put(&d.poses, &pose));
}

/* Has heard free water in a beam that is 10 degrees wide and high, ahead. */
static bool begin(void)
{
    t_ns = 100 * SECOND;
    if (!rig_start(CONF))
        return false;
    for (uint32_t i = 0; i < PINGS; i++) {
        t_ns += SECOND / 10;
        loop_advance(d.loop, t_ns);
        tell_pose(0);
        rig_send(&(struct rig_ping){.t_ns = t_ns, .seq = i + 1, .wide_deg = 10, .high_deg = 10});
    }
    return true;
}

static bool is_free(const char *method, json_t *params)
{
    json_t *a = ask(method, params);
    const bool said = says(a, "free");
    json_decref(a);
    return said;
}

static bool point_is_free(double ahead_m, double right_m)
{
    return is_free("point", json_pack("{s:[f, f, f], s:s}", "position_m", ahead_m, right_m, 0.0, "frame", "body"));
}

static bool path_is_free(double ahead_m)
{
    return is_free("path", json_pack("{s:[[f, f, f], [f, f, f]], s:s, s:f}", "points_m", ahead_m - 1, 0.0, 0.0,
                                     ahead_m, 0.0, 0.0, "frame", "body", "radius_m", 0.1));
}

/* 5 m away the beam is 0.9 m wide: a place there may be 0.9 m off when the vehicle turned by 10 degrees. */
TEST(a_place_far_off_is_less_sure_the_more_the_vehicle_may_have_turned)
{
    if (!begin()) {
        CHECK(false);
        return;
    }
    CHECK(point_is_free(5, 0) && path_is_free(5));
    CHECK(!point_is_free(12, 0));
    t_ns += SECOND / 2;
    loop_advance(d.loop, t_ns);
    CHECK(!point_is_free(5, 0) && !path_is_free(5));
    tell_pose(0);
    CHECK(point_is_free(5, 0) && path_is_free(5));
    rig_end();
}

/* What was free ahead is free abeam of one that has turned by a right angle, and nowhere else. */
TEST(places_turn_with_the_vehicle)
{
    if (!begin()) {
        CHECK(false);
        return;
    }
    t_ns += 5 * SECOND;
    loop_advance(d.loop, t_ns);
    tell_pose(90);
    CHECK(point_is_free(0, -5));
    CHECK(!point_is_free(5, 0));
    rig_end();
}

/* A wedge to the north of the vehicle, 10 m long, 1.8 m wide at its end: free there, and nowhere else. Cells of one
 * voxel, and of four. */
TEST(a_slice_lies_where_it_says)
{
    if (!begin()) {
        CHECK(false);
        return;
    }
    for (int wanted = 160; wanted >= 100; wanted -= 60) {
        json_t *a = ask("map_slice", json_pack("{s:f, s:i}", "size_m", 26.0, "cells", wanted)), *row;
        const double step_m = number(a, "step_m");
        size_t i, n_free = 0, astray = 0;
        json_array_foreach(json_object_get(a, "rows"), i, row)
        {
            const char *cells = json_string_value(row);
            const double north_m = number(a, "north_m") - (double)i * step_m - place_m[0];
            for (const char *c = cells; *c; c++) {
                const double east_m = number(a, "east_m") + (double)(c - cells) * step_m - place_m[1];
                n_free += *c == '.';
                astray += *c == '.' && !(north_m > 0 && north_m < 10.1 && fabs(east_m) < 0.1 * north_m + step_m);
            }
        }
        CHECK(n_free > (wanted == 160 ? 60 : 10));
        CHECK_INT(astray, 0);
        CHECK_NEAR(number(a, "depth_m"), place_m[2], 0, 0.1001);
        json_decref(a);
    }
    rig_end();
}

int main(void)
{
    RUN(a_place_far_off_is_less_sure_the_more_the_vehicle_may_have_turned);
    RUN(places_turn_with_the_vehicle);
    RUN(a_slice_lies_where_it_says);
    return test_end();
}
