/* SPDX-License-Identifier: MIT */
/* test_pose_method - what a client tells with `pose` is what the log then has: angles, places and speeds. */
#include "tests/lib/daemon_rig.h"

#include "daemon/methods/query_context.h"

#define SECOND 1000000000ull

/* No sonar is asked here. */
#define CONF "[sonar head]\ndevice = echolist\nport = can:can0\nrange = 10 m\n"

static struct pose told(json_t *params)
{
    struct pose pose = pose_identity;
    d.replay = false; /* where poses come from the capture */
    json_decref(ask("pose", params));
    CHECK(pose_log_at(&d.poses, loop_now(d.loop), &pose));
    return pose;
}

/* A direction of the vehicle's, in NED. */
static void check_axis(const struct pose *pose, const double body[3], double north, double east, double down)
{
    double v[3];
    quat_rotate(pose->attitude, body, v);
    CHECK_NEAR(v[0], north, 0, 1e-9);
    CHECK_NEAR(v[1], east, 0, 1e-9);
    CHECK_NEAR(v[2], down, 0, 1e-9);
}

static json_t *turn_to(double yaw_deg, double north_mps)
{
    return json_pack("{s:[f, f, f], s:[f, f, f]}", "attitude_deg", 0.0, 0.0, yaw_deg, "velocity_mps", north_mps,
                     0.0, 0.0);
}

TEST(a_velocity_of_zero_is_not_used_while_the_vehicle_turns)
{
    CHECK(rig_start(CONF));
    for (int i = 0; i < 20; i++) {
        loop_advance(d.loop, (100 + (uint64_t)i) * SECOND);
        const struct pose pose = told(turn_to(2.0 * i, 0)); /* 12 degrees at the sixth */
        CHECK_INT((pose.has & POSE_VELOCITY) != 0, i < 7);  /* the sixth is a second old then */
        CHECK_INT(d.velocity_doubt.doubted, i >= 6);
    }
    loop_advance(d.loop, 130 * SECOND);
    json_t *alone = json_pack("{s:[f, f, f]}", "velocity_mps", 0.0, 0.0, 0.0);
    const struct rpc_call call = {.daemon = &d, .now_ns = loop_now(d.loop)};
    struct rpc_error error;
    CHECK(!method_pose(&call, alone, NULL, &error) && strstr(error.message, "exactly 0"));
    json_decref(alone);
    CHECK(told(turn_to(60, 0.001)).has & POSE_VELOCITY);
    CHECK(!d.velocity_doubt.doubted);
    rig_end();
}

static const double forward[3] = {1, 0, 0}, right[3] = {0, 1, 0}, down[3] = {0, 0, 1};

TEST(angles_are_roll_pitch_and_heading_in_degrees)
{
    const double s = sin(geo_rad(20)), c = cos(geo_rad(20));
    CHECK(rig_start(CONF));
    loop_advance(d.loop, 100 * SECOND);
    struct pose pose = told(json_pack("{s:[f, f, f]}", "attitude_deg", 20.0, 0.0, 0.0));
    CHECK_INT(pose.has, POSE_ATTITUDE);
    check_axis(&pose, right, 0, c, s); /* rolled to the right: that side is lower */
    loop_advance(d.loop, 200 * SECOND);
    pose = told(json_pack("{s:[f, f, f]}", "attitude_deg", 0.0, 20.0, 0.0));
    check_axis(&pose, forward, c, 0, -s); /* bow up */
    loop_advance(d.loop, 300 * SECOND);
    pose = told(json_pack("{s:[f, f, f]}", "attitude_deg", 0.0, 0.0, 90.0));
    check_axis(&pose, forward, 0, 1, 0); /* to the east */
    check_axis(&pose, down, 0, 0, 1);
    loop_advance(d.loop, 400 * SECOND);
    pose = told(json_pack("{s:[f, f, f, f]}", "quaternion", cos(geo_rad(10)), sin(geo_rad(10)), 0.0, 0.0));
    check_axis(&pose, right, 0, c, s);
    rig_end();
}

TEST(places_and_speeds_are_north_east_down)
{
    CHECK(rig_start(CONF));
    loop_advance(d.loop, 100 * SECOND);
    struct pose pose = told(json_pack("{s:[f, f, f]}", "position_m", 1.0, -2.0, 3.0));
    CHECK_INT(pose.has, POSE_POSITION | POSE_DEPTH);
    CHECK(pose.position_m[0] == 1 && pose.position_m[1] == -2 && pose.position_m[2] == 3);
    loop_advance(d.loop, 200 * SECOND);
    pose = told(json_pack("{s:f}", "depth_m", 7.0));
    CHECK_INT(pose.has & (POSE_DEPTH | POSE_POSITION), POSE_DEPTH); /* the place has become too old */
    CHECK(pose.position_m[2] == 7);
    loop_advance(d.loop, 300 * SECOND);
    pose = told(json_pack("{s:[f, f, f]}", "velocity_mps", 0.1, 0.2, -0.3));
    CHECK(pose.has & POSE_VELOCITY);
    CHECK(pose.velocity_mps[0] == 0.1 && pose.velocity_mps[1] == 0.2 && pose.velocity_mps[2] == -0.3);
    rig_end();
}

/* A ping of a head that hears nothing, and poses for two seconds, on the way north. */
static uint64_t steps_after_a_ping(bool pings_go_on)
{
    struct sphere_stats stats;
    CHECK(rig_start(CONF));
    for (uint32_t i = 0; i <= 40; i++) {
        const uint64_t t_ns = 100 * SECOND + i * (SECOND / 20);
        loop_advance(d.loop, t_ns);
        d.replay = false; /* where poses come from the capture */
        json_decref(ask("pose", json_pack("{s:[f, f, f], s:[f, f, f]}", "attitude_deg", 0.0, 0.0, 0.0,
                                          "position_m", 0.025 * i, 0.0, 0.0)));
        if (i == 0 || pings_go_on)
            rig_send(&(struct rig_ping){.t_ns = t_ns, .seq = i + 1, .wide_deg = 3, .high_deg = 25});
    }
    grid_stats(pipeline_grid(d.pipeline, 0), &stats);
    rig_end();
    return stats.recentred;
}

TEST(the_grids_follow_poses_while_no_ping_comes)
{
    const uint64_t without = steps_after_a_ping(false), with = steps_after_a_ping(true);
    CHECK(without >= 6 && without <= with);
    CHECK(with <= 10); /* poses add none to what pings do */
}

/* The compass tells half a second late, and says so; the place is told at once. */
TEST(the_grids_do_not_follow_a_pose_from_before_the_last)
{
    struct sphere_stats stats;
    CHECK(rig_start(CONF));
    for (uint32_t i = 0; i <= 40; i++) {
        const uint64_t t_ns = 100 * SECOND + i * (SECOND / 20);
        loop_advance(d.loop, t_ns);
        d.replay = false; /* where poses come from the capture */
        json_decref(ask("pose", json_pack("{s:[f, f, f], s:f}", "attitude_deg", 0.0, 0.0, 0.0, "t_unix",
                                          query_unix_s(&d) - 0.5)));
        json_decref(ask("pose", json_pack("{s:[f, f, f]}", "position_m", 0.05 * i, 0.0, 0.0)));
        if (i == 0)
            rig_send(&(struct rig_ping){.t_ns = t_ns, .seq = 1, .wide_deg = 3, .high_deg = 25});
    }
    grid_stats(pipeline_grid(d.pipeline, 0), &stats);
    CHECK(stats.recentred >= 10 && stats.recentred <= 20); /* 2 m, in steps of more than 0.1 m */
    rig_end();
}

int main(void)
{
    RUN(the_grids_follow_poses_while_no_ping_comes);
    RUN(the_grids_do_not_follow_a_pose_from_before_the_last);
    RUN(angles_are_roll_pitch_and_heading_in_degrees);
    RUN(a_velocity_of_zero_is_not_used_while_the_vehicle_turns);
    RUN(places_and_speeds_are_north_east_down);
    return test_end();
}
