/* SPDX-License-Identifier: MIT */
/*
 * test_where_methods - a place of the vehicle's axes is free where all of the water is in which it may lie: the pose
 * is some time old, and the vehicle may have gone on and turned since.
 */
#include "tests/lib/daemon_rig.h"

#define SECOND  1000000000ull
#define RANGE_M 10.0
#define PINGS   20

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

/* Free water in a beam that is 10 degrees wide and high, ahead. */
static void send_ping(uint32_t seq)
{
    struct ping *ping = pipeline_begin(d.pipeline);
    ping->t_ns = ping->t_in_ns = t_ns;
    ping->kind = PING_RANGES;
    ping->seq = seq;
    ping->n_beams = 1;
    ping->n_bins = 1000;
    ping->dr_m = (float)(RANGE_M / 1000);
    ping->az_aperture_rad = ping->el_aperture_rad = (float)geo_rad(10);
    ping->beam[0] = (struct ping_beam){.range_sd_m = 0.01f, .confidence = 0.95f};
    pose_log_at(&d.poses, t_ns, &ping->pose);
    pipeline_submit(d.pipeline, ping);
}

static bool begin(void)
{
    t_ns = 100 * SECOND;
    if (!rig_start(CONF))
        return false;
    for (uint32_t i = 0; i < PINGS; i++) {
        t_ns += SECOND / 10;
        loop_advance(d.loop, t_ns);
        tell_pose(0);
        send_ping(i);
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

int main(void)
{
    RUN(a_place_far_off_is_less_sure_the_more_the_vehicle_may_have_turned);
    RUN(places_turn_with_the_vehicle);
    return test_end();
}
