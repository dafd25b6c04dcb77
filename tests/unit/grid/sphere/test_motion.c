/* SPDX-License-Identifier: MIT */
/* test_motion - by how much an echo is nearer once the vehicle may have drifted, and when the centre follows. */
#include "tests/lib/sphere_rig.h"

static const struct sphere_conf conf = {.angular_step_rad = 2 * GEO_PI / 180,
                                        .level = true,
                                        .level_half_rad = 7.5 * GEO_PI / 180,
                                        .layers = {.r_max_m = 60, .dr_m = 0.05, .n_const = 29, .growth = 1.035},
                                        .max_cells = 4096,
                                        .forget_s = 1e6,
                                        .blocked_above = 0.6,
                                        .recentre_m = 0.1};

#define NEAR_M 4.0 /* of the echo's near edge */

/* One beam, with an echo or deaf. */
static void hear(double az_deg, bool echo, uint64_t t_ns)
{
    struct beam_echoes beam = {
        .az_rad = (float)geo_rad(az_deg), .state = (uint8_t)(echo ? BEAM_ECHO : BEAM_BLIND), .n = echo};
    beam.echo[0] = (struct echo){
        .range_m = (float)NEAR_M + 0.02f, .near_m = (float)NEAR_M, .sd_m = 0.01f, .confidence = 0.9f};
    const struct echoes e = {.t_ns = t_ns,
                             .n_beams = 1,
                             .range_max_m = 60,
                             .az_aperture_rad = (float)geo_rad(1),
                             .el_aperture_rad = (float)geo_rad(15),
                             .pose = now.pose,
                             .max_beams = 1,
                             .beam = &beam};
    sphere_enter(sphere, &e, &mount_identity);
}

static void start(void)
{
    rig_sphere(&conf);
    now.pose = pose_identity;
    now.pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
}

/* Where the echo of that bearing begins, in the picture. */
static double edge_m(double az_deg)
{
    struct picture *p = sphere_picture(sphere);
    return picture_told_m(p, rings_index(p->rings, geo_rad(az_deg), 1e-6));
}

static void drift_to(double level_m, double depth_m)
{
    now.pose.drift_m[0] = level_m;
    now.pose.drift_m[1] = depth_m;
}

TEST(an_echo_is_nearer_by_the_drift_level_and_in_depth)
{
    static const double row[][3] = {{0.3, 0, 0.3}, {0, 0.3, 0.3}, {0.3, 0.4, 0.5}, {3, 0, NEAR_M / 2 - 0.01}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        start();
        hear(1, true, SECOND);
        CHECK_NEAR(edge_m(1), NEAR_M, 0, 1e-5);
        drift_to(row[i][0], row[i][1]);
        hear(181, false, 2 * SECOND);
        CHECK_NEAR(edge_m(1), NEAR_M - row[i][2], 0, 1e-4); /* no nearer than half its range, 4.02 m */
        drift_to(0, 0);                                     /* dated back: it takes nothing back */
        hear(181, false, 2 * SECOND + 1);
        CHECK_NEAR(edge_m(1), NEAR_M - row[i][2], 0, 1e-4);
    }
}

/* While it drifts the picture holds for a step of drift, both ways, that is not made yet: what is heard meanwhile is
 * nearer by what of that is left. */
TEST(what_is_heard_adrift_is_nearer_by_the_drift_ahead)
{
    const double ahead_m = conf.recentre_m;
    start();
    now.pose.drift_mps = 0.1;
    hear(1, true, SECOND);
    CHECK_NEAR(edge_m(1), NEAR_M - hypot(ahead_m, ahead_m), 0, 1e-5);
    drift_to(0.04, 0);
    hear(91, true, SECOND + 1);
    CHECK_NEAR(edge_m(91), NEAR_M - hypot(ahead_m - 0.04, ahead_m), 0, 1e-5);
    drift_to(0.04, 0.07);
    hear(181, true, SECOND + 2);
    CHECK_NEAR(edge_m(181), NEAR_M - hypot(ahead_m - 0.04, ahead_m - 0.07), 0, 1e-5);
    CHECK_NEAR(edge_m(1), NEAR_M - hypot(ahead_m, ahead_m), 0, 1e-5); /* it counted that before */
}

/* A pose without a ping moves the centre, if the vehicle went there and nothing was lost on the way. */
TEST(the_centre_follows_a_pose_that_goes_on)
{
    static const char *const what[] = {"goes on", "drifts", "older", "jumped", "withdrawn", "too far"};
    for (int i = 0; i < 6; i++) {
        start();
        now.pose.drift_mps = i == 1 ? 0.1 : 0;
        hear(1, true, SECOND);
        now.pose.position_m[0] = i == 5 ? POSE_STEP_MOST_M + 0.01 : 0.5;
        now.pose.t_ns = i == 2 ? SECOND - 1 : 2 * SECOND;
        now.pose.discontinuities = i == 3;
        now.pose.withdrawn = i == 4;
        sphere_follow(sphere, &now.pose);
        struct picture_frame frame;
        picture_get_frame(sphere_picture(sphere), &frame);
        if ((frame.centre_m[0] > 0) != (i == 0)) {
            printf("%s: the centre is at %g m\n", what[i], frame.centre_m[0]);
            CHECK(false);
        }
    }
}

int main(void)
{
    RUN(an_echo_is_nearer_by_the_drift_level_and_in_depth);
    RUN(what_is_heard_adrift_is_nearer_by_the_drift_ahead);
    RUN(the_centre_follows_a_pose_that_goes_on);
    return test_end();
}
