/* SPDX-License-Identifier: MIT */
/*
 * test_active_sensing - a steered head (active_sensing_rig.h): how long until something new ahead is pinged for the
 * first time, and how long any bearing waits.
 */
#include "core/fault.h"
#include "tests/lib/active_sensing_rig.h"

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The same over all runs; returns the longest wait of any bearing. */
static double measure(enum way way, double delay_s[ALL])
{
    static const char *const names[] = {"plain, by itself", "plain, polled mode", "active",
                                        "active, circle = 90 s"};
    const uint64_t seed = test_seed();
    double wait_s = 0;
    for (uint64_t run = 0; run < RUNS; run++) {
        measure_run(way, seed + 1000003 * run, delay_s + run * THINGS);
        wait_s = fmax(wait_s, rig.longest_wait_s);
    }
    qsort(delay_s, ALL, sizeof *delay_s, by_size);
    printf("# %s: %d new things ahead pinged after median %.1f s, 90 %% %.1f s, at most %.1f s; %.0f ms a ping, a "
           "turn in %.0f s, longest wait of any bearing %.1f s\n",
           names[way], ALL, delay_s[ALL / 2], delay_s[ALL * 9 / 10], delay_s[ALL - 1],
           (double)(rig.now_ns - 1000 * SECOND) * 1e-6 / rig.pings,
           (double)(rig.now_ns - 1000 * SECOND) * 1e-9 / rig.turns, wait_s);
    return wait_s;
}

TEST(something_new_ahead_is_noticed_sooner_and_the_circle_is_kept)
{
    static double auto_s[ALL], plain_s[ALL], active_s[ALL], circle_s[ALL];
    measure(PLAIN_AUTO, auto_s);
    const double plain_wait_s = measure(PLAIN_ASKED, plain_s), active_wait_s = measure(ACTIVE, active_s);
    CHECK(active_s[ALL / 2] < 0.7 * auto_s[ALL / 2]);
    CHECK(active_s[ALL / 2] < 0.7 * plain_s[ALL / 2]);
    CHECK(active_s[ALL * 9 / 10] < 0.7 * plain_s[ALL * 9 / 10]);
    CHECK(active_wait_s < 2.8 * plain_wait_s);
    const double circle_wait_s = measure(ACTIVE_CIRCLE, circle_s);
    CHECK(circle_wait_s < CIRCLE_S);
    CHECK(circle_wait_s > 1.1 * plain_wait_s); /* what time there was is used */
    CHECK(circle_s[ALL / 2] < 0.7 * plain_s[ALL / 2]);
    CHECK(circle_s[ALL * 9 / 10] < 0.85 * plain_s[ALL * 9 / 10]);
}

TEST(without_a_velocity_it_scans_plainly)
{
    int pings[2];
    double wait_s[2];
    for (int steered = 0; steered < 2; steered++) {
        start(ACTIVE);
        rig.pose.has = POSE_ATTITUDE;
        run_until(rig.now_ns + 150 * SECOND, steered, NULL, 0);
        pings[steered] = rig.pings;
        wait_s[steered] = rig.longest_wait_s;
    }
    CHECK_INT(pings[1], pings[0]);
    CHECK_NEAR(wait_s[1], wait_s[0], 0, 0);
}

TEST(a_sector_that_is_attended_is_every_second_angle_and_all_others_come)
{
    struct ping360_scan scan;
    struct steer_seen seen = {0};
    int count[PING360_TURN] = {0}, turns = 0;
    ping360_scan_init(&scan, 0, GEO_TURN, geo_rad(0.9));
    ping360_scan_steer(&scan, geo_rad(342), geo_rad(18), false);
    for (int i = 0; i < 820; i++) { /* two passes more than the circle twice */
        const uint16_t angle = ping360_scan_angle(&scan);
        turns += steer_seen_add(&seen, angle, 1, PING360_TURN);
        count[angle]++;
        ping360_scan_advance(&scan, 0);
    }
    int ahead = 0;
    for (int a = 0; a < PING360_TURN; a++) {
        CHECK(count[a] >= 1);
        ahead += a >= 180 && a <= 220 ? count[a] : 0;
    }
    CHECK(ahead >= 400);
    CHECK_INT(turns, 1);
}

/* Whatever the step, and wherever a pass begins: no turn ends before it has been all around. */
TEST(a_turn_is_all_of_the_circle)
{
    static const uint16_t steps[] = {1, 2, 3, 4, 7, 10};
    for (size_t s = 0; s < sizeof steps / sizeof steps[0]; s++) {
        struct ping360_scan scan;
        struct steer_seen seen = {0};
        bool pinged[PING360_TURN] = {false};
        int gap = 0, longest = 0, pings = 0;
        ping360_scan_init(&scan, 0, GEO_TURN, geo_rad(0.9 * steps[s]));
        ping360_scan_steer(&scan, geo_rad(342.9), geo_rad(18), false);
        while (!steer_seen_add(&seen, ping360_scan_angle(&scan), steps[s], PING360_TURN) && pings < 1000) {
            pinged[ping360_scan_angle(&scan)] = true;
            ping360_scan_advance(&scan, 0);
            pings++;
        }
        for (int a = 0; a < 2 * PING360_TURN; a++) {
            gap = pinged[a % PING360_TURN] ? 0 : gap + 1;
            longest = gap > longest ? gap : longest;
        }
        CHECK(longest < 2 * steps[s]);
        CHECK(pings <= 2 * PING360_TURN / steps[s] + 100);
        if (test_case_failed)
            printf("(step %d: %d gradians not pinged, %d pings)\n", steps[s], longest, pings);
    }
}

/* All bearings but one were looked at just now: that one is asked for, in the sensor's own frame. */
TEST(the_sector_is_asked_for_in_the_frame_of_the_mounted_head)
{
    static const struct {
        const char *name;
        double yaw_deg, roll_deg, pitch_deg, mount_yaw_deg, want_deg;
    } row[] = {
        {"as the vehicle", 0, 0, 0, 0, 120},       {"the vehicle heads east", 90, 0, 0, 0, 30},
        {"mounted to starboard", 0, 0, 0, 90, 30}, {"both", 50, 0, 0, 90, 340},
        {"hung upside down", 0, 180, 0, 0, 240},   {"upside down, to port", 0, 180, 0, -90, 150},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct active_sensing_look look = {.only = true};
        start(ACTIVE);
        rig.pose.velocity_mps[0] = 0;
        for (int az = 0; az < 360; az += 2) {
            struct beam_echoes heard = {
                .az_rad = (float)geo_rad(az), .blind_m = 0.5f, .free_to_m = 15, .state = BEAM_SILENT};
            const struct echoes e = {.t_ns = rig.now_ns,
                                     .n_beams = 1,
                                     .range_max_m = 20,
                                     .az_aperture_rad = (float)geo_rad(6),
                                     .el_aperture_rad = (float)geo_rad(25),
                                     .pose = rig.pose,
                                     .max_beams = 1,
                                     .beam = &heard};
            if (fabs(az - 120.0) > 20)
                sphere_enter(rig.sphere, &e, &rig.mount);
        }
        quat_from_rpy(0, 0, geo_rad(row[i].yaw_deg), rig.pose.attitude);
        quat_from_rpy(geo_rad(row[i].roll_deg), geo_rad(row[i].pitch_deg), geo_rad(row[i].mount_yaw_deg),
                      rig.mount.attitude);
        const struct active_sensing_head head = {.pose = &rig.pose, .mount = &rig.mount};
        CHECK(active_sensing_sector(sphere_picture(rig.sphere), rig.now_ns, 30, &head, &look));
        CHECK(!look.only);
        CHECK_NEAR(geo_wrap_pi(look.from_rad + geo_rad(20) - geo_rad(row[i].want_deg)), 0, 0, geo_rad(6));
        CHECK_NEAR(geo_wrap(look.to_rad - look.from_rad), geo_rad(40), 1e-9, 0);
        if (test_case_failed)
            printf("(%s: %.0f to %.0f)\n", row[i].name, geo_deg(look.from_rad), geo_deg(look.to_rad));
    }
}

/* Its heading does not matter, nor whether anybody knows it: the push is in its own axes, as the head is. */
TEST(a_vehicle_that_drifts_looks_where_it_is_pushed_and_nowhere_else)
{
    static const struct {
        double push[3], mount_yaw_deg, roll_deg, want_deg;
    } row[] = {{{5, 0, 0}, 0, 0, 0}, {{0, 5, 0}, 0, 0, 90}, {{-5, 0, 0}, 90, 0, 90}, {{0, 5, 0}, 0, 180, 270}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct active_sensing_look look = {0};
        struct active_sensing_head head = {.pose = &rig.pose, .mount = &rig.mount};
        start(ACTIVE);
        rig.pose.has = i % 2 ? POSE_ATTITUDE : 0;
        quat_from_rpy(0, 0, geo_rad(70), rig.pose.attitude);
        quat_from_rpy(geo_rad(row[i].roll_deg), 0, geo_rad(row[i].mount_yaw_deg), rig.mount.attitude);
        head.push = row[i].push;
        CHECK(!active_sensing_sector(sphere_picture(rig.sphere), rig.now_ns, 30, &head, &look));
        rig.pose.drift_mps = 0.5;
        CHECK(active_sensing_sector(sphere_picture(rig.sphere), rig.now_ns, 30, &head, &look));
        CHECK(look.only);
        CHECK_NEAR(geo_wrap_pi(look.from_rad + geo_rad(40) - geo_rad(row[i].want_deg)), 0, 0, 1e-6);
        CHECK_NEAR(geo_wrap(look.to_rad - look.from_rad), geo_rad(80), 1e-9, 0);
        head.push = NULL;
        CHECK(!active_sensing_sector(sphere_picture(rig.sphere), rig.now_ns, 30, &head, &look));
    }
}

/* To and fro, its ends twice; then on with the circle, from where it was left. */
TEST(one_sector_alone_is_every_angle)
{
    struct ping360_scan scan;
    int count[PING360_TURN] = {0}, n = 0;
    ping360_scan_init(&scan, 0, GEO_TURN, geo_rad(1.8));
    for (int i = 0; i < 7; i++)
        ping360_scan_advance(&scan, 0);
    ping360_scan_steer(&scan, geo_rad(-54), geo_rad(54), true);
    ping360_scan_advance(&scan, 0);
    for (int i = 0; i < 5 * 61; i++, n++) {
        CHECK(ping360_scan_is_alone(&scan));
        count[ping360_scan_angle(&scan)]++;
        ping360_scan_advance(&scan, 0);
    }
    for (int a = 140; a <= 260; a += 2)
        CHECK_INT(count[a], 5);
    ping360_scan_steer(&scan, 0, 0, false);
    for (int i = 0; i < 61; i++)
        ping360_scan_advance(&scan, 0);
    CHECK(!ping360_scan_is_alone(&scan));
    CHECK_INT(ping360_scan_angle(&scan), 200 + 2 * 8);
}

/* Each pass is a turn, as of a head with a sector; and a circle that was left begins anew. */
TEST(turns_are_passes_while_a_head_looks_at_one_sector_alone)
{
    start(ACTIVE);
    run_until(rig.now_ns + 150 * SECOND, false, NULL, 0);
    const int circles = rig.turns;
    CHECK(circles >= 1);
    device_ping360.steer(rig.device, geo_rad(-54), geo_rad(54), true);
    const int pings = rig.pings;
    run_until(rig.now_ns + 60 * SECOND, false, NULL, 0);
    CHECK_NEAR((rig.pings - pings) / 121.0, rig.turns - circles, 0, 2);
    device_ping360.steer(rig.device, 0, 0, false);
    run_until(rig.now_ns + 5 * SECOND, false, NULL, 0);
    const int turns = rig.turns, since = rig.pings;
    while (rig.turns == turns && rig.pings < since + 800)
        run_until(rig.now_ns + SECOND, false, NULL, 0);
    CHECK(rig.pings - since > 300);
}

TEST(a_sector_is_not_steered)
{
    struct device_conf conf = {.range_m = 20, .sound_speed_mps = 1500, .gain = -1, .steered = true};
    struct fault fault = {""};
    start(ACTIVE);
    CHECK(device_ping360.init(rig.device, &conf, &fault));
    conf.sector_end_rad = 1;
    CHECK(!device_ping360.init(rig.device, &conf, &fault));
    CHECK_STR(fault.text, "scan = active needs the full circle, sector = 0 360 deg");
}

int main(void)
{
    RUN(a_sector_is_not_steered);
    RUN(the_sector_is_asked_for_in_the_frame_of_the_mounted_head);
    RUN(a_sector_that_is_attended_is_every_second_angle_and_all_others_come);
    RUN(a_turn_is_all_of_the_circle);
    RUN(a_vehicle_that_drifts_looks_where_it_is_pushed_and_nowhere_else);
    RUN(one_sector_alone_is_every_angle);
    RUN(turns_are_passes_while_a_head_looks_at_one_sector_alone);
    RUN(something_new_ahead_is_noticed_sooner_and_the_circle_is_kept);
    RUN(without_a_velocity_it_scans_plainly);
    free(rig.device);
    return test_end();
}
