/* SPDX-License-Identifier: MIT */
/* test_pose_log - the pose at a ping's own time: between samples, after the last, before the first, in a gap. */
#include "tests/lib/test.h"

#include <math.h>

#include "daemon/input/pose_log.h"

#define MS 1000000ull

static struct pose_log poses;

static bool put(uint64_t t_ns, unsigned has, double north, double yaw_rad, double vn)
{
    struct pose p = pose_identity;
    p.t_ns = t_ns;
    p.has = has;
    p.position_m[0] = north;
    p.velocity_mps[0] = vn;
    quat_from_rpy(0, 0, yaw_rad, p.attitude);
    return pose_log_put(&poses, &p);
}

static double yaw(const struct pose *p)
{
    double r, pitch, y;
    quat_to_rpy(p->attitude, &r, &pitch, &y);
    return y;
}

TEST(between_two_samples_the_pose_is_interpolated)
{
    struct pose p;
    pose_log_init(&poses, 1000 * MS);
    put(1000 * MS, POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH, 0, 0, 0);
    put(1100 * MS, POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH, 1, 0.2, 0);
    CHECK(pose_log_at(&poses, 1050 * MS, &p));
    CHECK_NEAR(p.position_m[0], 0.5, 1e-12, 0);
    CHECK_NEAR(yaw(&p), 0.1, 1e-12, 0);
    CHECK(pose_log_at(&poses, 1000 * MS, &p));
    CHECK_NEAR(p.position_m[0], 0, 0, 0);
}

TEST(a_time_that_is_known_within_bounds_has_the_poses_of_all_of_them)
{
    struct pose p;
    pose_log_init(&poses, 1000 * MS);
    for (int i = 0; i <= 10; i++) /* out to 1 rad and 5 m, and back */
        put((1000 + (uint64_t)i * 100) * MS, POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH, 5 - fabs(i - 5.0),
            1 - 0.2 * fabs(i - 5.0), 0);
    CHECK(pose_log_within(&poses, 1000 * MS, 2000 * MS, &p));
    CHECK_INT(p.t_ns, 1000 * MS);
    CHECK_NEAR(yaw(&p), 0, 0, 1e-9);
    CHECK_NEAR(p.uncertain_rad, 1, 1e-6, 0);
    CHECK_NEAR(p.uncertain_m, 5, 1e-9, 0);
    CHECK(pose_log_within(&poses, 1420 * MS, 1440 * MS, &p)); /* between two samples: the ends count */
    CHECK_NEAR(p.uncertain_rad, 0.04, 1e-6, 0);
    CHECK_NEAR(p.uncertain_m, 0.2, 1e-6, 0);
    CHECK(pose_log_within(&poses, 2000 * MS, 3500 * MS,
                          &p)); /* at the end too old: no part is known all the while */
    CHECK_INT(p.has, 0);
    CHECK(!pose_log_within(&poses, 900 * MS, 1100 * MS, &p));
    CHECK_INT(p.has, 0);
}

/* It may be as far off as the farthest of them, and each is uncertain itself. */
TEST(within_bounds_the_doubt_of_each_pose_counts)
{
    struct pose p;
    pose_log_init(&poses, 1000 * MS);
    pose_log_set_most(&poses, 2, 1);
    put(1000 * MS, POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH, 0, 0, 0);
    put(1100 * MS, POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH, 0.1, 0.02, 0);
    CHECK(pose_log_within(&poses, 1000 * MS, 1600 * MS, &p)); /* for 0.1 s it goes on, and 0.4 s are left */
    CHECK_NEAR(p.uncertain_m, 0.2 + hypot(2, 2) * 0.4, 1e-9, 0);
    CHECK_NEAR(p.uncertain_rad, 0.04 + 0.4, 1e-6, 0);
}

/* By what its own time is uncertain, and the poses' times as well. */
TEST(a_ping_is_blurred_by_the_doubt_of_the_poses_too)
{
    struct pose p;
    pose_log_init(&poses, 1000 * MS);
    for (uint64_t i = 0; i <= 10; i++)
        put((1000 + 100 * i) * MS, POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH, 0.1 * (double)i, 0, 0);
    CHECK(pose_log_blurred(&poses, 1500 * MS, 50 * MS, &p));
    CHECK_NEAR(p.blur_m[0], 0.05, 1e-9, 0);
    pose_log_set_delay(&poses, 0, 100 * MS);
    CHECK(pose_log_blurred(&poses, 1500 * MS, 50 * MS, &p));
    CHECK_NEAR(p.blur_m[0], 0.15, 1e-9, 0);
}

TEST(of_the_newest_pose_a_part_that_is_old_is_not_told)
{
    struct pose p;
    pose_log_init(&poses, 500 * MS);
    CHECK(!pose_log_newest(&poses, &p));
    put(1000 * MS, POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH, 7, 0, 0);
    put(1600 * MS, POSE_ATTITUDE, 0, 1, 0);
    CHECK(pose_log_newest(&poses, &p));
    CHECK_INT(p.has, POSE_ATTITUDE);
    CHECK_NEAR(p.position_m[0], 7, 0, 0);
}

TEST(a_velocity_that_ended_is_not_missed_where_the_place_is_given)
{
    pose_log_init(&poses, 500 * MS);
    put(1000 * MS, POSE_ATTITUDE | POSE_VELOCITY, 0, 0, 1);
    put(2000 * MS, POSE_ATTITUDE | POSE_POSITION, 0, 0, 0);
    CHECK(pose_log_fresh(&poses, 2100 * MS));
    put(2600 * MS, POSE_ATTITUDE, 0, 0, 0);
    CHECK(!pose_log_fresh(&poses, 2600 * MS));
}

TEST(before_the_first_and_too_long_after_the_last_there_is_none)
{
    struct pose p;
    pose_log_init(&poses, 500 * MS);
    CHECK(!pose_log_at(&poses, 1, &p));
    put(1000 * MS, POSE_ATTITUDE, 0, 1, 0);
    CHECK(!pose_log_at(&poses, 999 * MS, &p));
    CHECK_INT(p.has, 0);
    CHECK(pose_log_at(&poses, 1400 * MS, &p));
    CHECK_NEAR(yaw(&p), 1, 1e-12, 0);
    CHECK(!pose_log_at(&poses, 1501 * MS, &p));
    CHECK(pose_log_fresh(&poses, 1500 * MS));
    CHECK(!pose_log_fresh(&poses, 1501 * MS));
    CHECK(pose_log_fresh(&poses, 900 * MS)); /* of a ping that came before it */
    pose_log_init(&poses, 500 * MS);
    CHECK(!pose_log_fresh(&poses, 100 * MS)); /* soon after the clock began nothing is fresh, either */
}

/* Nobody knows how it went on in a gap, or from then on: it may have gone as far as it can. */
TEST(in_a_gap_and_behind_it_the_pose_is_as_uncertain_as_its_age)
{
    struct pose p;
    pose_log_init(&poses, 500 * MS);
    pose_log_set_most(&poses, 2, 1);
    put(1000 * MS, POSE_ATTITUDE | POSE_POSITION, 0, 0, 0);
    put(2000 * MS, POSE_ATTITUDE | POSE_POSITION, 1, 0.5, 0);
    CHECK(pose_log_at(&poses, 1400 * MS, &p));
    CHECK_NEAR(p.position_m[0], 0, 0, 0);
    CHECK_NEAR(p.uncertain_m, 0.8, 1e-9, 0);
    CHECK_NEAR(p.uncertain_rad, 0.4, 1e-9, 0);
    CHECK(pose_log_at(&poses, 2100 * MS, &p));
    CHECK_NEAR(p.position_m[0], 1, 0, 0);
    CHECK_NEAR(p.uncertain_m, 0.2, 1e-9, 0);
    CHECK_NEAR(p.uncertain_rad, 0.1, 1e-9, 0);
}

static void put_altitude(uint64_t ms, double altitude_m)
{
    struct pose p = pose_identity;
    p.t_ns = ms * MS;
    p.has = POSE_ALTITUDE;
    p.altitude_m = altitude_m;
    CHECK(pose_log_put(&poses, &p));
}

TEST(an_altitude_is_less_by_how_far_the_vehicle_may_have_sunk)
{
    struct pose p;
    pose_log_init(&poses, 1000 * MS);
    put(2000 * MS, POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH, 0, 0, 0);
    put_altitude(1500, 5);
    put_altitude(2000, 4);
    CHECK(pose_log_at(&poses, 2000 * MS, &p) && p.has & POSE_ALTITUDE);
    CHECK_NEAR(p.altitude_m, 4, 1e-12, 0);
    CHECK(pose_log_at(&poses, 2500 * MS, &p));
    CHECK_NEAR(p.altitude_m, 3, 1e-12, 0); /* as it fell before */
    put(2400 * MS, POSE_VELOCITY, 0, 0, 0.5);
    CHECK(pose_log_at(&poses, 2500 * MS, &p));
    CHECK_NEAR(p.altitude_m, 3.75, 1e-12, 0);
    pose_log_set_most(&poses, 3, 0);
    CHECK(pose_log_at(&poses, 2500 * MS, &p));
    CHECK_NEAR(p.altitude_m, 2.5, 1e-12, 0);
    pose_log_set_most(&poses, 30, 0);
    CHECK(pose_log_at(&poses, 2500 * MS, &p) && p.has & POSE_ALTITUDE);
    CHECK_NEAR(p.altitude_m, 0, 0, 0); /* it may be aground */
    CHECK(pose_log_within(&poses, 2000 * MS, 2010 * MS, &p));
    CHECK_NEAR(p.altitude_m, 3.7, 1e-9, 0);
    CHECK(pose_log_at(&poses, 3000 * MS, &p) && p.has & POSE_ALTITUDE);
    put(3001 * MS, POSE_ATTITUDE, 0, 0, 0);
    CHECK(pose_log_at(&poses, 3001 * MS, &p));
    CHECK_INT(p.has & POSE_ALTITUDE, 0); /* too old */
}

/* It says nothing of the vehicle: neither does a pose wait for it, nor does the vehicle drift from then on. */
TEST(an_altitude_alone_is_no_pose)
{
    const struct pose_drift drift = {.mps = 1, .from_pose = true};
    struct pose p;
    pose_log_init(&poses, 1000 * MS);
    pose_log_set_drift(&poses, 0, &drift);
    put_altitude(1000, 5);
    CHECK(!pose_log_at(&poses, 1500 * MS, &p));
    CHECK_NEAR(p.drift_m[0], 0, 0, 0);
    CHECK_INT(p.has, 0);
    put(2000 * MS, POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH, 0, 0, 0);
    CHECK(pose_log_fresh(&poses, 2500 * MS));
    put_altitude(2500, 5);
    pose_log_withdraw(&poses, 2600 * MS);
    put(2700 * MS, POSE_ATTITUDE, 0, 0, 0);
    CHECK(pose_log_at(&poses, 2700 * MS, &p));
    CHECK_INT(p.has, POSE_ATTITUDE);
}

TEST(a_withdrawn_pose_is_as_if_never_given_but_what_drifted_stays)
{
    struct pose p;
    pose_log_init(&poses, 500 * MS);
    pose_log_set_drift(&poses, 1, &(struct pose_drift){.mps = 1, .from_pose = true});
    put(1000 * MS, POSE_ATTITUDE, 0, 1, 0);
    pose_log_withdraw(&poses, 3000 * MS);
    CHECK(!pose_log_at(&poses, 1000 * MS, &p));
    CHECK_INT(p.has, 0);
    CHECK_INT(p.withdrawn, 1);
    CHECK_NEAR(p.drift_m[0], 2, 1e-9, 0);
    CHECK_NEAR(p.drift_m[1], 2, 1e-9, 0);
    CHECK(!pose_log_at(&poses, 9000 * MS, &p)); /* before a pose the vehicle keeps its place */
    CHECK_NEAR(p.drift_m[0], 2, 1e-9, 0);
    CHECK(put(9100 * MS, POSE_ATTITUDE, 0, 2, 0));
    CHECK(pose_log_at(&poses, 9100 * MS, &p));
    CHECK_NEAR(yaw(&p), 2, 1e-12, 0);
    CHECK_INT(p.withdrawn, 1);
}

TEST(the_missing_part_is_named_with_its_age_and_sender)
{
    double age_s;
    const char *sender;
    pose_log_init(&poses, 500 * MS);
    CHECK_INT(pose_log_missing(&poses, 1000 * MS, &age_s, &sender), POSE_ATTITUDE);
    CHECK(age_s < 0 && !sender);
    put(1000 * MS, POSE_ATTITUDE | POSE_DEPTH, 0, 1, 0);
    pose_log_sent_by(&poses, POSE_ATTITUDE, "one");
    pose_log_sent_by(&poses, POSE_DEPTH, "another");
    CHECK_INT(pose_log_missing(&poses, 1500 * MS, &age_s, &sender), 0);
    CHECK_INT(pose_log_missing(&poses, 1600 * MS, &age_s, &sender), POSE_ATTITUDE);
    CHECK_NEAR(age_s, 0.6, 1e-9, 0);
    CHECK_STR(sender, "one");
    put(1600 * MS, POSE_ATTITUDE, 0, 1, 0);
    CHECK_INT(pose_log_missing(&poses, 1600 * MS, &age_s, &sender), POSE_DEPTH);
    CHECK_STR(sender, "another");
    put(1600 * MS, POSE_VELOCITY, 0, 0, 0.5); /* carries the depth on */
    CHECK_INT(pose_log_missing(&poses, 1600 * MS, &age_s, &sender), 0);
}

TEST(a_gap_is_not_bridged)
{
    struct pose p;
    pose_log_init(&poses, 500 * MS);
    put(1000 * MS, POSE_ATTITUDE, 0, 0, 0);
    put(3000 * MS, POSE_ATTITUDE, 0, 2, 0);
    CHECK(!pose_log_at(&poses, 2000 * MS, &p));
    CHECK(pose_log_at(&poses, 1200 * MS, &p));
    CHECK_NEAR(yaw(&p), 0, 0, 0);
}

TEST(times_that_do_not_rise_are_refused_and_counted)
{
    pose_log_init(&poses, 500 * MS);
    CHECK(put(1000 * MS, POSE_ATTITUDE, 0, 0, 0));
    CHECK(!put(1000 * MS, POSE_ATTITUDE, 0, 0, 0));
    CHECK(!put(1, POSE_ATTITUDE, 0, 0, 0));
    CHECK_INT(poses.refused, 2);
    CHECK_INT(poses.taken, 1);
}

TEST(parts_come_from_different_senders_and_end_by_themselves)
{
    struct pose p;
    pose_log_init(&poses, 500 * MS);
    put(1000 * MS, POSE_ATTITUDE, 0, 1, 0);
    put(1100 * MS, POSE_DEPTH, 0, 0, 0);
    CHECK(pose_log_at(&poses, 1100 * MS, &p));
    CHECK_INT(p.has, POSE_ATTITUDE | POSE_DEPTH);
    CHECK_NEAR(yaw(&p), 1, 1e-12, 0);
    put(1600 * MS, POSE_DEPTH, 0, 0, 0);
    CHECK(pose_log_at(&poses, 1600 * MS, &p));
    CHECK_INT(p.has, POSE_DEPTH);
    CHECK(!pose_log_fresh(&poses, 1600 * MS)); /* fresh speaks of the attitude */
}

TEST(without_a_position_the_velocity_carries_it)
{
    struct pose p;
    pose_log_init(&poses, 500 * MS);
    for (uint64_t i = 0; i <= 100; i++)
        put((1000 + 100 * i) * MS, POSE_ATTITUDE | POSE_VELOCITY, 0, 0, 0.5);
    CHECK(pose_log_at(&poses, 11000 * MS, &p));
    CHECK_NEAR(p.position_m[0], 5, 1e-12, 0);
    CHECK_NEAR(p.path_m, 5, 1e-12, POSE_LOG_LINE_M);
    CHECK(!(p.has & POSE_POSITION));
}

/* Of standard deviation 1, near enough to a normal one, and within 6. */
static double noise(uint64_t *seed)
{
    double sum = -6;
    for (int i = 0; i < 12; i++)
        sum += test_uniform(seed);
    return sum;
}

#define SAMPLES 6000 /* ten minutes of ten a second */

/* The noise of a place is no way driven: it would wear out every look around before the next. */
TEST(a_vehicle_that_hovers_drives_no_way)
{
    struct pose p;
    uint64_t seed = test_seed();
    pose_log_init(&poses, 500 * MS);
    for (uint64_t i = 0; i < SAMPLES; i++) {
        struct pose given = {
            .t_ns = (1 + i) * 100 * MS, .attitude = {1}, .has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH};
        for (int k = 0; k < 3; k++)
            given.position_m[k] = 1000 + 0.02 * noise(&seed);
        CHECK(pose_log_put(&poses, &given));
    }
    CHECK(pose_log_newest(&poses, &p));
    CHECK(p.path_m < 0.1);
}

/* Wherever it goes: it is no farther off than the way says. */
TEST(the_way_is_never_short_by_more_than_two_lines)
{
    static double at_m[SAMPLES][3], path_m[SAMPLES];
    uint64_t seed = test_seed();
    pose_log_init(&poses, 500 * MS);
    double heading = 0, most_m = 0, short_m = 0;
    struct pose given = {.attitude = {1}, .has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH};
    for (int i = 0; i < SAMPLES; i++) {
        struct pose p;
        heading += noise(&seed) * 0.3;
        const double step_m[3] = {0.05 * cos(heading), 0.05 * sin(heading), 0.01 * noise(&seed)};
        for (int k = 0; k < 3; k++)
            at_m[i][k] = given.position_m[k] += step_m[k];
        given.t_ns = (uint64_t)(1 + i) * 100 * MS;
        CHECK(pose_log_put(&poses, &given));
        pose_log_newest(&poses, &p);
        path_m[i] = p.path_m;
    }
    for (int i = 0; i < SAMPLES; i += 7)
        for (int j = i; j < SAMPLES; j++) {
            const double off_m =
                hypot(hypot(at_m[j][0] - at_m[i][0], at_m[j][1] - at_m[i][1]), at_m[j][2] - at_m[i][2]);
            short_m = fmax(short_m, off_m - (path_m[j] - path_m[i]));
            most_m = fmax(most_m, off_m);
        }
    CHECK(short_m <= 2 * POSE_LOG_LINE_M);
    CHECK(most_m > 1);
}

TEST(a_place_that_is_lost_is_not_a_vehicle_that_stands_still)
{
    pose_log_init(&poses, 500 * MS);
    put(1000 * MS, POSE_ATTITUDE, 0, 0, 0);
    CHECK(pose_log_fresh(&poses, 1100 * MS)); /* never a place: nobody knows better */
    put(1200 * MS, POSE_ATTITUDE | POSE_POSITION, 1, 0, 0);
    CHECK(pose_log_fresh(&poses, 1300 * MS));
    put(1800 * MS, POSE_ATTITUDE, 0, 0, 0);
    CHECK(!pose_log_fresh(&poses, 1800 * MS));
    put(1900 * MS, POSE_ATTITUDE | POSE_VELOCITY, 0, 0, 1);
    CHECK(pose_log_fresh(&poses, 1900 * MS));
}

TEST(a_depth_that_ends_is_missed)
{
    pose_log_init(&poses, 500 * MS);
    put(1000 * MS, POSE_ATTITUDE | POSE_DEPTH, 0, 0, 0);
    CHECK(pose_log_fresh(&poses, 1400 * MS));
    put(1800 * MS, POSE_ATTITUDE, 0, 0, 0);
    CHECK(!pose_log_fresh(&poses, 1800 * MS));
}

/* One late pose is none; without eight nobody knows. */
/* So many samples of both parts, so far apart. */
static uint64_t put_many(uint64_t t_ns, int n, uint64_t gap_ns)
{
    for (int i = 0; i < n; i++, t_ns += gap_ns)
        put(t_ns, POSE_ATTITUDE | POSE_POSITION, 0, 0, 0);
    return t_ns - gap_ns;
}

TEST(by_itself_max_age_follows_rare_poses_that_are_bounded)
{
    pose_log_init(&poses, POSE_LOG_AUTO);
    uint64_t t_ns = put_many(1000 * MS, 8, 2000 * MS);
    CHECK_INT(pose_log_max_age_ns(&poses, POSE_ATTITUDE) / MS, 1000); /* nobody says how far it can have turned */
    CHECK(!pose_log_fresh(&poses, t_ns + 2000 * MS));
    pose_log_set_most(&poses, 1, 0);
    CHECK_INT(pose_log_max_age_ns(&poses, POSE_ATTITUDE) / MS, 1000);
    pose_log_set_most(&poses, 0, 1);
    CHECK_INT(pose_log_max_age_ns(&poses, POSE_ATTITUDE) / MS, 1000);
    pose_log_set_most(&poses, 1, 1);
    CHECK_INT(pose_log_max_age_ns(&poses, POSE_ATTITUDE) / MS, 6000);
    CHECK_INT(pose_log_max_age_ns(&poses, POSE_DEPTH) / MS, 1000); /* never given */
    CHECK(pose_log_fresh(&poses, t_ns + 6000 * MS) && !pose_log_fresh(&poses, t_ns + 6001 * MS));
    pose_log_set_max_age(&poses, 500 * MS);
    CHECK_INT(pose_log_max_age_ns(&poses, POSE_ATTITUDE) / MS, 500);
}

TEST(by_itself_max_age_has_limits_and_passes_over_a_pause)
{
    pose_log_init(&poses, POSE_LOG_AUTO);
    pose_log_set_most(&poses, 1, 1);
    uint64_t t_ns = put_many(1000 * MS, 7, 2000 * MS);
    CHECK_INT(pose_log_max_age_ns(&poses, POSE_POSITION) / MS, 1000); /* too few to tell */
    t_ns = put_many(t_ns + 100 * MS, 8, 100 * MS);
    CHECK_INT(pose_log_max_age_ns(&poses, POSE_POSITION) / MS, 1000);
    t_ns = put_many(t_ns + 60000 * MS, 2, 100 * MS);
    CHECK_INT(pose_log_max_age_ns(&poses, POSE_POSITION) / MS, 1000);
    t_ns = put_many(t_ns + 5000 * MS, 8, 5000 * MS);
    CHECK_INT(pose_log_max_age_ns(&poses, POSE_POSITION) / MS, 10000);
    pose_log_withdraw(&poses, t_ns);
    CHECK_INT(pose_log_max_age_ns(&poses, POSE_POSITION) / MS, 1000);
}

TEST(by_itself_max_age_follows_the_middle_gap_in_whatever_order_they_come)
{
    static const uint64_t gap_ms[] = {2000, 1200, 3000, 900, 2400, 1500, 1800};
    for (int first = 0; first < POSE_LOG_GAPS; first++) {
        uint64_t t_ms = 1000;
        pose_log_init(&poses, POSE_LOG_AUTO);
        pose_log_set_most(&poses, 1, 1);
        put(t_ms * MS, POSE_ATTITUDE, 0, 0, 0);
        for (int i = 0; i < POSE_LOG_GAPS; i++)
            put((t_ms += gap_ms[(first + i) % POSE_LOG_GAPS]) * MS, POSE_ATTITUDE, 0, 0, 0);
        CHECK_INT(pose_log_max_age_ns(&poses, POSE_ATTITUDE) / MS, 3 * 1800);
    }
}

/* What a velocity makes of a place that is given no more is no place given. */
TEST(by_itself_max_age_counts_no_carried_place)
{
    pose_log_init(&poses, POSE_LOG_AUTO);
    pose_log_set_most(&poses, 1, 1);
    const uint64_t t_ns = put_many(1000 * MS, 8, 2000 * MS);
    for (uint64_t i = 0; i < 8; i++)
        put(t_ns + (6100 + 100 * i) * MS, POSE_VELOCITY, 0, 0, 0.5);
    CHECK_INT(pose_log_max_age_ns(&poses, POSE_POSITION) / MS, 6000);
    CHECK(!pose_log_fresh(&poses, t_ns + 6900 * MS));
}

TEST(poses_rarer_than_max_age_are_sparse)
{
    pose_log_init(&poses, 500 * MS);
    for (uint64_t i = 0; i < 8; i++) {
        CHECK(!pose_log_sparse(&poses));
        put((1000 + 510 * i) * MS, POSE_ATTITUDE, 0, 0, 0);
    }
    CHECK(pose_log_sparse(&poses));
    pose_log_set_max_age(&poses, 510 * MS);
    CHECK(!pose_log_sparse(&poses));
    pose_log_set_max_age(&poses, 500 * MS);
    put(4600 * MS, POSE_ATTITUDE, 0, 0, 0);
    put(4630 * MS, POSE_ATTITUDE, 0, 0, 0);
    CHECK(!pose_log_sparse(&poses));
}

TEST(the_way_driven_counts_back_and_forth)
{
    struct pose p;
    pose_log_init(&poses, 500 * MS);
    for (uint64_t i = 0; i <= 10; i++)
        put((1000 + 100 * i) * MS, POSE_ATTITUDE | POSE_POSITION, (double)(i % 2), 0, 0);
    CHECK(pose_log_newest(&poses, &p));
    CHECK(p.path_m <= 10 && p.path_m >= 10 * (1 - 2 * POSE_LOG_LINE_M));
}

TEST(a_place_is_no_newer_for_an_attitude_that_is)
{
    pose_log_init(&poses, 1000 * MS);
    struct pose placed = {.has = POSE_POSITION | POSE_DEPTH, .t_ns = 10 * MS};
    struct pose turned = {.has = POSE_ATTITUDE, .t_ns = 30 * MS, .attitude = {1, 0, 0, 0}};
    struct pose sunk = {.has = POSE_DEPTH, .t_ns = 20 * MS};
    CHECK(pose_log_last_ns(&poses, POSE_POSITION | POSE_DEPTH) == 0);
    CHECK(pose_log_put(&poses, &placed) && pose_log_put(&poses, &sunk) && pose_log_put(&poses, &turned));
    CHECK(pose_log_last_ns(&poses, POSE_POSITION | POSE_DEPTH) == 10 * MS);
    CHECK(pose_log_last_ns(&poses, POSE_DEPTH) == 20 * MS);
    CHECK(pose_log_last_ns(&poses, POSE_ATTITUDE) == 30 * MS);
    CHECK(pose_log_last_ns(&poses, POSE_ATTITUDE | POSE_VELOCITY) == 0);
}

/* The vehicle goes north and turns: the line is its way within the time. What is off it counts all round. */
TEST(a_ping_whose_time_is_uncertain_is_blurred_by_the_way_within_it)
{
    struct pose p, q;
    pose_log_init(&poses, 1000 * MS);
    for (uint64_t i = 0; i <= 20; i++)
        put((1000 + i * 100) * MS, POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH, 0.1 * (double)i, 0.02 * (double)i,
            0);
    CHECK(pose_log_blurred(&poses, 2000 * MS, 400 * MS, &p));
    CHECK_INT(p.t_ns, 2000 * MS);
    CHECK_NEAR(p.position_m[0], 1, 1e-9, 0);
    CHECK_NEAR(fabs(p.blur_m[0]), 0.4, 1e-9, 0);
    CHECK_NEAR(p.blur_m[1], 0, 0, 1e-9);
    CHECK_NEAR(p.blur_any_m, 0, 0, 1e-9);
    CHECK_NEAR(p.blur_rad, 0.08, 1e-6, 0);
    CHECK_NEAR(p.uncertain_m, 0, 0, 0);
    CHECK(pose_log_blurred(&poses, 2000 * MS, 0, &p) && pose_log_at(&poses, 2000 * MS, &q));
    CHECK(memcmp(&p, &q, sizeof p) == 0);
    /* there and back: the middle is at the end of the line */
    pose_log_init(&poses, 1000 * MS);
    for (int i = 0; i <= 10; i++)
        put((1000 + (uint64_t)i * 100) * MS, POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH, -fabs(i - 5.0), 0, 0);
    CHECK(pose_log_blurred(&poses, 1500 * MS, 300 * MS, &p));
    CHECK_NEAR(geo_length(p.blur_m) + p.blur_any_m, 3, 1e-9, 0);
}

/* Behind the last sample it may have gone as fast as it ever does, and nobody knows where to. */
TEST(a_ping_of_whose_time_no_pose_tells_is_blurred_by_the_greatest_speed)
{
    struct pose p;
    pose_log_init(&poses, 3000 * MS);
    pose_log_set_most(&poses, 2, 0.5);
    for (uint64_t i = 0; i <= 10; i++)
        put((1000 + i * 100) * MS, POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH, 0, 0, 0);
    CHECK(pose_log_blurred(&poses, 2000 * MS, 500 * MS, &p)); /* 0.1 s of it the log goes on */
    CHECK_NEAR(p.blur_any_m, hypot(0.8, 0.8), 1e-9, 0);
    CHECK_NEAR(p.blur_rad, 0.2, 1e-6, 0);
    /* without position and velocity it drifts, and may have begun to */
    pose_log_init(&poses, 3000 * MS);
    pose_log_set_drift(&poses, 1, &(struct pose_drift){.mps = 1});
    for (uint64_t i = 0; i <= 20; i++)
        put((1000 + i * 100) * MS, POSE_ATTITUDE, 0, 0, 0);
    CHECK(pose_log_blurred(&poses, 2000 * MS, 500 * MS, &p));
    CHECK_NEAR(p.drift_m[0], 1.5, 1e-6, 0);
}

/* It has moved since, by as much as the fastest that it was said to go. */
TEST(a_ping_from_before_the_drift_was_set_counts_its_drift_since)
{
    struct pose before, now;
    for (int reloads = 0; reloads < 3; reloads++) {
        pose_log_init(&poses, 3000 * MS);
        for (int i = 0; i <= reloads; i++)
            pose_log_set_drift(&poses, (4000 + (uint64_t)i * 2000) * MS,
                               &(struct pose_drift){.mps = i == 1 ? 0 : 1});
        const uint64_t set_ns = (4000 + (uint64_t)reloads * 2000) * MS;
        pose_log_blurred(&poses, set_ns - 400 * MS, 400 * MS, &before);
        pose_log_at(&poses, set_ns, &now);
        CHECK_NEAR(now.drift_m[0] - before.drift_m[0], 0.8, 1e-9, 0);
    }
    /* what drifts from the first pose on had kept its place before that */
    pose_log_init(&poses, 3000 * MS);
    pose_log_set_drift(&poses, 1, &(struct pose_drift){.mps = 1, .from_pose = true});
    put(3700 * MS, POSE_ATTITUDE, 0, 0, 0);
    pose_log_set_drift(&poses, 4000 * MS, &(struct pose_drift){.mps = 1, .from_pose = true});
    pose_log_blurred(&poses, 3600 * MS, 400 * MS, &before);
    pose_log_at(&poses, 4000 * MS, &now);
    CHECK_NEAR(now.drift_m[0] - before.drift_m[0], 0.3, 1e-9, 0);
}

/* Before the log begins there is no pose, and so none of a ping that may be as old. */
TEST(a_ping_that_may_be_older_than_the_log_has_no_pose)
{
    struct pose p;
    pose_log_init(&poses, 1000 * MS);
    put(1000 * MS, POSE_ATTITUDE | POSE_POSITION, 0, 0, 0);
    put(1500 * MS, POSE_ATTITUDE | POSE_POSITION, 0, 0, 0);
    pose_log_blurred(&poses, 1300 * MS, 200 * MS, &p);
    CHECK_INT(p.has, POSE_ATTITUDE | POSE_POSITION);
    pose_log_blurred(&poses, 1300 * MS, 400 * MS, &p);
    CHECK_INT(p.has, 0);
}

TEST(poses_that_come_late_are_older_and_as_uncertain_as_their_delay)
{
    struct pose p;
    pose_log_init(&poses, 1000 * MS);
    pose_log_set_delay(&poses, 300 * MS, 100 * MS);
    CHECK_INT(pose_log_dated(&poses, 1000 * MS), 700 * MS);
    CHECK_INT(pose_log_dated(&poses, 100 * MS), 0);
    for (uint64_t i = 0; i <= 20; i++)
        put((1000 + i * 100) * MS, POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH, 0.1 * (double)i, 0.02 * (double)i,
            0);
    CHECK(pose_log_at(&poses, 2000 * MS, &p));
    CHECK_NEAR(p.position_m[0], 1, 1e-9, 0);
    CHECK_NEAR(p.uncertain_m, 0.1, 1e-9, 0); /* 1 m/s and 0.2 rad/s for 0.1 s */
    CHECK_NEAR(p.uncertain_rad, 0.02, 1e-6, 0);
    CHECK(pose_log_blurred(&poses, 2000 * MS, 0, &p));
    CHECK_NEAR(p.uncertain_m, 0.1, 1e-9, 0);
    CHECK_NEAR(geo_length(p.blur_m), 0, 0, 0);
    CHECK(pose_log_blurred(&poses, 2000 * MS, 400 * MS, &p));
    CHECK(geo_length(p.blur_m) + p.uncertain_m > 0.5 - 1e-9);
    CHECK(pose_log_within(&poses, 1800 * MS, 2000 * MS, &p));
    CHECK_NEAR(p.position_m[0], 0.8, 1e-9, 0);
    CHECK_NEAR(p.uncertain_m, 0.3, 1e-9, 0);
}

TEST(the_log_keeps_the_newest)
{
    struct pose p;
    pose_log_init(&poses, 500 * MS);
    for (uint64_t i = 1; i <= 4000; i++)
        put(i * 5 * MS / 2, POSE_ATTITUDE | POSE_POSITION, (double)i, 0, 0);
    CHECK(pose_log_at(&poses, 9995 * MS, &p));
    CHECK_NEAR(p.position_m[0], 3998, 1e-12, 0);
    CHECK(pose_log_at(&poses, 5000 * MS, &p)); /* as far back as a ping is dated at most, at 400 poses a second */
    CHECK_NEAR(p.position_m[0], 2000, 1e-12, 0);
    CHECK(!pose_log_at(&poses, 100 * MS, &p));
}

static bool put_depth(uint64_t t_ns, double depth_m)
{
    struct pose p = pose_identity;
    p.t_ns = t_ns;
    p.has = POSE_DEPTH;
    p.position_m[2] = depth_m;
    return pose_log_put(&poses, &p);
}

TEST(a_part_that_comes_late_is_put_at_its_own_time)
{
    struct pose p;
    pose_log_init(&poses, 500 * MS);
    put(1000 * MS, POSE_ATTITUDE, 0, 0, 0);
    put(1100 * MS, POSE_ATTITUDE, 0, 0.2, 0);
    CHECK(put_depth(1020 * MS, 5));
    CHECK(put_depth(1080 * MS, 8));
    CHECK(!put_depth(1080 * MS, 9));
    CHECK(pose_log_at(&poses, 1050 * MS, &p));
    CHECK_NEAR(yaw(&p), 0.1, 1e-12, 0);
    CHECK_NEAR(p.position_m[2], 6.5, 1e-12, 0);
    CHECK_INT(p.has, POSE_ATTITUDE | POSE_DEPTH);
}

TEST(of_a_sample_only_the_parts_that_are_new_are_taken)
{
    struct pose p;
    pose_log_init(&poses, 500 * MS);
    put_depth(1000 * MS, 5);
    CHECK(put(900 * MS, POSE_ATTITUDE | POSE_DEPTH, 0, 1, 0));
    CHECK(pose_log_at(&poses, 1000 * MS, &p));
    CHECK_NEAR(p.position_m[2], 5, 0, 0);
    CHECK_NEAR(yaw(&p), 1, 1e-12, 0);
}

TEST(behind_the_last_sample_the_turn_goes_on_for_a_moment)
{
    struct pose p;
    pose_log_init(&poses, 1000 * MS);
    put(1000 * MS, POSE_ATTITUDE, 0, 0, 0);
    put(1050 * MS, POSE_ATTITUDE, 0, 0.1, 0);
    pose_log_at(&poses, 1075 * MS, &p);
    CHECK_NEAR(yaw(&p), 0.15, 1e-12, 0);
    pose_log_at(&poses, 1900 * MS, &p); /* no farther than the time between the two */
    CHECK_NEAR(yaw(&p), 0.2, 1e-12, 0);
    put(1450 * MS, POSE_ATTITUDE, 0, 0.5, 0);
    pose_log_at(&poses, 1900 * MS, &p); /* and no farther than a tenth of a second */
    CHECK_NEAR(yaw(&p), 0.6, 1e-12, 0);
}

TEST(the_noise_of_a_depth_sensor_is_no_way_driven)
{
    struct pose p;
    uint64_t seed = test_seed();
    pose_log_init(&poses, 500 * MS);
    for (uint64_t i = 1; i <= 10000; i++)
        put_depth(i * 100 * MS, 40 + 0.02 * test_uniform(&seed));
    CHECK(pose_log_newest(&poses, &p));
    CHECK_NEAR(p.path_m, 0, 0, 0);
}

TEST(a_place_that_is_told_no_more_stays_where_it_was)
{
    struct pose p;
    pose_log_init(&poses, 500 * MS);
    put(1000 * MS, POSE_ATTITUDE | POSE_POSITION, 7, 0, 0);
    put(2000 * MS, POSE_ATTITUDE, 0, 0, 0);
    CHECK(pose_log_at(&poses, 2000 * MS, &p));
    CHECK_INT(p.has, POSE_ATTITUDE);
    CHECK_NEAR(p.position_m[0], 7, 0, 0);
}

TEST(behind_the_last_sample_the_vehicle_may_be_as_far_as_it_goes)
{
    const unsigned all = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH | POSE_VELOCITY;
    struct pose p;
    pose_log_init(&poses, 2000 * MS);
    put(1000 * MS, all, 0, 0, 0.5);
    pose_log_at(&poses, 1600 * MS, &p); /* one sample: nothing to go on from, and no turn known */
    CHECK_NEAR(p.uncertain_m, 0.3, 1e-12, 0);
    CHECK_NEAR(p.uncertain_rad, 0, 0, 0);
    put(1200 * MS, all, 0.1, 0.04, 0.5);
    pose_log_at(&poses, 1100 * MS, &p);
    CHECK_NEAR(p.uncertain_m, 0, 0, 0);
    pose_log_at(&poses, 1300 * MS, &p); /* so far it goes on as before */
    CHECK_NEAR(p.uncertain_m, 0, 0, 0);
    pose_log_at(&poses, 1800 * MS, &p);
    CHECK_NEAR(p.uncertain_m, 0.25, 1e-12, 0);
    CHECK_NEAR(p.uncertain_rad, 0.1, 1e-12, 0);
    pose_log_set_most(&poses, 2, 1);
    pose_log_at(&poses, 1800 * MS, &p);
    CHECK(p.uncertain_m >= 1 && p.uncertain_m <= 1.5);
    CHECK_NEAR(p.uncertain_rad, 0.5, 1e-12, 0);
}

TEST(nothing_lies_between_the_attitudes_before_and_after_a_jump)
{
    struct pose p;
    pose_log_init(&poses, 2000 * MS);
    pose_log_set_most(&poses, 0, 0.5);
    put(1000 * MS, POSE_ATTITUDE, 0, 0, 0);
    put(1100 * MS, POSE_ATTITUDE, 0, 0.12, 0); /* less than 5 degrees more than it can turn */
    put(1200 * MS, POSE_ATTITUDE, 0, 1, 0);
    pose_log_at(&poses, 1050 * MS, &p);
    CHECK_INT(p.discontinuities, 0);
    CHECK_NEAR(yaw(&p), 0.06, 1e-12, 0);
    pose_log_at(&poses, 1150 * MS, &p);
    CHECK_INT(p.discontinuities, 0);
    CHECK_NEAR(yaw(&p), 0.12, 1e-12, 0);
    CHECK(p.uncertain_rad > 0);
    pose_log_at(&poses, 1250 * MS, &p);
    CHECK_INT(p.discontinuities, 1);
    CHECK_NEAR(yaw(&p), 1, 1e-12, 0);
    put(1300 * MS, POSE_ATTITUDE, 0, 1.02, 0);
    pose_log_at(&poses, 1250 * MS, &p);
    CHECK_INT(p.discontinuities, 1);
    CHECK_NEAR(yaw(&p), 1.01, 1e-12, 0);
    put(1400 * MS, POSE_ATTITUDE, 0, 0.12, 0); /* back is a jump, too */
    pose_log_at(&poses, 1400 * MS, &p);
    CHECK_INT(p.discontinuities, 2);
}

TEST(without_a_velocity_the_way_between_places_is_the_speed)
{
    struct pose p;
    pose_log_init(&poses, 2000 * MS);
    put(1000 * MS, POSE_ATTITUDE | POSE_POSITION, 0, 0, 0);
    put(1500 * MS, POSE_ATTITUDE | POSE_POSITION, 0.5, 0, 0);
    put(1501 * MS, POSE_ATTITUDE | POSE_POSITION, 0.52, 0,
        0); /* noise of two samples close together is no speed */
    pose_log_at(&poses, 2002 * MS, &p);
    CHECK_NEAR(p.uncertain_m, 0.52 / 0.501 * 0.5, 1e-9, 0);
}

/* As fast as lately, not as on average, and in any level direction. */
TEST(the_last_tenth_of_a_second_tells_the_speed)
{
    struct pose p = pose_identity, then;
    pose_log_init(&poses, 2000 * MS);
    p.has = POSE_ATTITUDE | POSE_POSITION;
    for (uint64_t i = 0; i < 4; i++) {
        p.t_ns = (i == 3 ? 1600 : 1000 + 250 * i) * MS;
        p.position_m[0] = i == 3 ? 5.12 : 5;
        p.position_m[1] = i == 3 ? 7.16 : 7;
        CHECK(pose_log_put(&poses, &p));
    }
    pose_log_at(&poses, 2000 * MS, &then); /* for 0.1 s it goes on as it went */
    CHECK_NEAR(then.uncertain_m, 2 * 0.3, 1e-9, 0);
}

TEST(a_first_attitude_is_no_first_place)
{
    struct pose p;
    pose_log_init(&poses, 2000 * MS);
    put(1000 * MS, POSE_POSITION, 0, 0, 0);
    put(1500 * MS, POSE_POSITION | POSE_ATTITUDE, 1, 0, 0);
    CHECK(pose_log_newest(&poses, &p));
    CHECK_NEAR(p.path_m, 1 - POSE_LOG_LINE_M, 1e-9, 0);
}

/* ---- drift ---- */

static void drifts(double mps, bool from_pose)
{
    pose_log_init(&poses, 500 * MS);
    pose_log_set_drift(&poses, 0, &(struct pose_drift){.mps = mps, .from_pose = from_pose});
}

TEST(without_position_and_velocity_the_drift_grows_with_time)
{
    struct pose p;
    drifts(0.5, false);
    pose_log_at(&poses, 2000 * MS, &p);
    CHECK_NEAR(p.drift_m[0], 1, 1e-9, 0);
    CHECK_NEAR(p.drift_m[1], 1, 1e-9, 0);
    CHECK(p.drift_mps > 0.5 && p.heading_adrift);
    put(2000 * MS, POSE_ATTITUDE | POSE_DEPTH, 0, 0, 0);
    pose_log_at(&poses, 3000 * MS, &p);
    CHECK_NEAR(p.drift_m[0], 1.5, 1e-9, 0);
    pose_log_at(&poses, 2400 * MS, &p);
    CHECK_NEAR(p.drift_m[1], 1, 1e-9, 0); /* the depth is told */
    CHECK_NEAR(p.drift_mps, 0.5, 1e-9, 0);
    CHECK(!p.heading_adrift);
}

TEST(a_heading_drifts_that_somebody_tells)
{
    struct pose p;
    pose_log_init(&poses, 500 * MS);
    pose_log_set_drift(&poses, 0, &(struct pose_drift){.heading_radps = 0.02});
    pose_log_at(&poses, 1000 * MS, &p);
    CHECK_NEAR(p.heading_radps, 0, 0, 0); /* nobody does */
    put(1000 * MS, POSE_ATTITUDE, 0, 0, 0);
    pose_log_at(&poses, 1100 * MS, &p);
    CHECK_NEAR(p.heading_radps, 0.02, 0, 0);
    pose_log_at(&poses, 9000 * MS, &p); /* that it is old makes it no better */
    CHECK_NEAR(p.heading_radps, 0.02, 0, 0);
}

TEST(before_any_pose_it_may_be_taken_to_keep_its_place)
{
    struct pose p;
    drifts(0.5, true);
    pose_log_at(&poses, 2000 * MS, &p);
    CHECK(p.drift_m[0] == 0 && p.drift_mps == 0 && !p.heading_adrift);
    put(2000 * MS, POSE_ATTITUDE, 0, 0, 0);
    put(2900 * MS, POSE_ATTITUDE, 0, 0, 0);
    pose_log_at(&poses, 3000 * MS, &p);
    CHECK_NEAR(p.drift_m[0], 0.5, 1e-9, 0);
    CHECK_NEAR(p.drift_mps, 0.5 * sqrt(2), 1e-9, 0);
}

TEST(a_position_stops_the_drift)
{
    struct pose p;
    drifts(0.5, false);
    put(1000 * MS, POSE_ATTITUDE | POSE_DEPTH, 0, 0, 0);
    put(2000 * MS, POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH, 0, 0, 0);
    put(2300 * MS, POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH, 0, 0, 0);
    pose_log_at(&poses, 2350 * MS, &p);
    CHECK_NEAR(p.drift_m[0], 1, 1e-9, 0);
    CHECK(p.drift_mps == 0);
}

TEST(a_velocity_carries_the_position_with_its_error)
{
    struct pose p;
    drifts(0.5, false);
    for (uint64_t t = 1000; t <= 11000; t += 100)
        put(t * MS, POSE_ATTITUDE | POSE_DEPTH | POSE_VELOCITY, 0, 0, 0.4);
    pose_log_at(&poses, 1000 * MS, &p);
    const double first_m = p.drift_m[0];
    pose_log_at(&poses, 11000 * MS, &p);
    CHECK_NEAR(p.position_m[0], 4, 1e-6, 0);
    CHECK_NEAR(p.drift_m[0] - first_m, 0.05 * 4 + 0.02 * 10, 1e-6, 0);
    CHECK_NEAR(p.drift_mps, 0.04, 1e-6, 0);
    /* a gap: nobody knows what it did meanwhile */
    const double before_m = p.drift_m[0];
    put(13000 * MS, POSE_ATTITUDE | POSE_DEPTH | POSE_VELOCITY, 0, 0, 0.4);
    pose_log_at(&poses, 13000 * MS, &p);
    CHECK_NEAR(p.drift_m[0] - before_m, 2 * (0.5 + 0.4), 1e-6, 0);
}

static void put_velocity(uint64_t ms, unsigned has, const double mps[3])
{
    struct pose p = pose_identity;
    p.t_ns = ms * MS;
    p.has = has | POSE_ATTITUDE | POSE_VELOCITY;
    memcpy(p.velocity_mps, mps, sizeof p.velocity_mps);
    CHECK(pose_log_put(&poses, &p));
}

/* Of the two velocities of a step nobody knows when the one became the other. Level and depth are carried apart. */
TEST(a_velocity_that_changes_carries_with_half_its_change_as_well)
{
    static const double first[3] = {0.4, 0.1, 0.2}, then[3] = {0.1, 0.5, 0.8};
    struct pose a, b;
    drifts(0.5, false);
    put_velocity(1000, 0, first);
    put_velocity(1100, 0, then);
    pose_log_at(&poses, 1000 * MS, &a);
    pose_log_at(&poses, 1100 * MS, &b);
    CHECK_NEAR(b.drift_m[0] - a.drift_m[0], (0.05 * hypot(0.1, 0.5) + 0.02 + 0.5 / 2) * 0.1, 1e-9, 0);
    CHECK_NEAR(b.drift_m[1] - a.drift_m[1], (0.05 * 0.8 + 0.02 + 0.6 / 2) * 0.1, 1e-9, 0);
    CHECK_NEAR(b.position_m[0] - a.position_m[0], 0.01, 1e-9, 0);
    CHECK_NEAR(b.position_m[1] - a.position_m[1], 0.05, 1e-9, 0);
    CHECK_NEAR(b.position_m[2] - a.position_m[2], 0.08, 1e-9, 0);
}

TEST(a_place_that_is_given_is_not_carried)
{
    static const double mps[3] = {1, 0, 1};
    struct pose p;
    drifts(0.5, false);
    put_velocity(1000, POSE_POSITION | POSE_DEPTH, mps);
    pose_log_at(&poses, 1000 * MS, &p);
    const double level_m = p.drift_m[0], depth_m = p.drift_m[1];
    put_velocity(1400, 0, mps);
    pose_log_at(&poses, 1400 * MS, &p);
    CHECK_NEAR(p.position_m[0], 0, 0, 0);
    CHECK_NEAR(p.position_m[2], 0, 0, 0);
    CHECK_NEAR(p.drift_m[0], level_m, 0, 0);
    CHECK_NEAR(p.drift_m[1], depth_m, 0, 0);
    CHECK(p.drift_mps == 0 && p.uncertain_m > 0.5); /* that it is old counts as that */
}

static void put_depth_and_altitude(uint64_t ms, double depth_m, double altitude_m)
{
    struct pose p = pose_identity;
    p.t_ns = ms * MS;
    p.has = POSE_DEPTH | POSE_ALTITUDE;
    p.position_m[2] = depth_m;
    p.altitude_m = altitude_m;
    CHECK(pose_log_put(&poses, &p));
}

/* A depth comes twice a second, bounds of the speed twenty times: between two depths the vehicle has gone up or down as
 * far as these say, not as far as it ever could. What it was seen to do counts all the same. */
TEST(between_rare_samples_the_vehicle_goes_no_faster_than_its_bounds)
{
    const double uncertain_m = 15 * 0.05 * 0.05 / 2;
    struct pose p;
    for (int bounded = 0; bounded < 2; bounded++) {
        pose_log_init(&poses, 2000 * MS);
        pose_log_set_most(&poses, 1.5, 1);
        pose_log_set_drift(&poses, 900 * MS,
                           &(struct pose_drift){.mps = 1.5, .bounded = bounded, .water_mps = 0.05});
        put(1000 * MS, POSE_ATTITUDE, 0, 0, 0);
        for (uint64_t ms = 1000; ms <= 2400; ms += 50) {
            if (ms % 500 == 0)
                put_depth_and_altitude(ms, 2, 9);
            if (ms % 100 == 0)
                put(ms * MS, POSE_ATTITUDE, 0, 0, 0);
            pose_log_bound(&poses, ms * MS, (const double[]){0.1, 0.3});
        }
        CHECK(pose_log_at(&poses, 2450 * MS, &p)); /* 0.1 s after the last depth it went on as before */
        if (bounded) {
            CHECK_NEAR(p.uncertain_m, 0.35 * 0.35 + 2 * uncertain_m, 1e-9, 0);
            CHECK_NEAR(p.altitude_m, 9 - 0.45 * hypot(0.15, 0.35), 0.03, 0);
        } else {
            CHECK_NEAR(p.uncertain_m, 0.35 * 1.5, 1e-9, 0);
            CHECK_NEAR(p.altitude_m, 9 - 0.45 * 1.5, 1e-9, 0);
        }
    }
    put_depth_and_altitude(2500, 2.4, 9); /* 0.8 m/s: somebody pulls it */
    pose_log_bound(&poses, 2800 * MS, (const double[]){0.1, 0.3});
    CHECK(pose_log_at(&poses, 2800 * MS, &p));
    CHECK(p.uncertain_m >= 0.2 * 0.8 - 1e-9);
}

TEST(the_drift_never_falls_when_it_is_set_anew)
{
    struct pose p;
    drifts(0.5, false);
    pose_log_set_drift(&poses, 2000 * MS, &(struct pose_drift){.mps = 0.1, .keeps_heading = true});
    pose_log_at(&poses, 3000 * MS, &p);
    CHECK_NEAR(p.drift_m[0], 1.1, 1e-9, 0);
    CHECK(!p.heading_adrift);
}

int main(void)
{
    RUN(a_part_that_comes_late_is_put_at_its_own_time);
    RUN(of_a_sample_only_the_parts_that_are_new_are_taken);
    RUN(behind_the_last_sample_the_turn_goes_on_for_a_moment);
    RUN(the_noise_of_a_depth_sensor_is_no_way_driven);
    RUN(a_place_that_is_told_no_more_stays_where_it_was);
    RUN(between_two_samples_the_pose_is_interpolated);
    RUN(a_time_that_is_known_within_bounds_has_the_poses_of_all_of_them);
    RUN(within_bounds_the_doubt_of_each_pose_counts);
    RUN(a_ping_is_blurred_by_the_doubt_of_the_poses_too);
    RUN(of_the_newest_pose_a_part_that_is_old_is_not_told);
    RUN(a_velocity_that_ended_is_not_missed_where_the_place_is_given);
    RUN(before_the_first_and_too_long_after_the_last_there_is_none);
    RUN(a_withdrawn_pose_is_as_if_never_given_but_what_drifted_stays);
    RUN(the_missing_part_is_named_with_its_age_and_sender);
    RUN(an_altitude_is_less_by_how_far_the_vehicle_may_have_sunk);
    RUN(an_altitude_alone_is_no_pose);
    RUN(a_gap_is_not_bridged);
    RUN(in_a_gap_and_behind_it_the_pose_is_as_uncertain_as_its_age);
    RUN(times_that_do_not_rise_are_refused_and_counted);
    RUN(parts_come_from_different_senders_and_end_by_themselves);
    RUN(without_a_position_the_velocity_carries_it);
    RUN(a_vehicle_that_hovers_drives_no_way);
    RUN(the_way_is_never_short_by_more_than_two_lines);
    RUN(a_place_that_is_lost_is_not_a_vehicle_that_stands_still);
    RUN(a_depth_that_ends_is_missed);
    RUN(by_itself_max_age_follows_rare_poses_that_are_bounded);
    RUN(by_itself_max_age_has_limits_and_passes_over_a_pause);
    RUN(by_itself_max_age_follows_the_middle_gap_in_whatever_order_they_come);
    RUN(by_itself_max_age_counts_no_carried_place);
    RUN(poses_rarer_than_max_age_are_sparse);
    RUN(the_way_driven_counts_back_and_forth);
    RUN(a_ping_whose_time_is_uncertain_is_blurred_by_the_way_within_it);
    RUN(a_ping_of_whose_time_no_pose_tells_is_blurred_by_the_greatest_speed);
    RUN(a_ping_from_before_the_drift_was_set_counts_its_drift_since);
    RUN(a_ping_that_may_be_older_than_the_log_has_no_pose);
    RUN(poses_that_come_late_are_older_and_as_uncertain_as_their_delay);
    RUN(the_log_keeps_the_newest);
    RUN(a_place_is_no_newer_for_an_attitude_that_is);
    RUN(behind_the_last_sample_the_vehicle_may_be_as_far_as_it_goes);
    RUN(nothing_lies_between_the_attitudes_before_and_after_a_jump);
    RUN(without_a_velocity_the_way_between_places_is_the_speed);
    RUN(the_last_tenth_of_a_second_tells_the_speed);
    RUN(a_first_attitude_is_no_first_place);
    RUN(without_position_and_velocity_the_drift_grows_with_time);
    RUN(a_heading_drifts_that_somebody_tells);
    RUN(before_any_pose_it_may_be_taken_to_keep_its_place);
    RUN(a_position_stops_the_drift);
    RUN(a_velocity_carries_the_position_with_its_error);
    RUN(a_velocity_that_changes_carries_with_half_its_change_as_well);
    RUN(a_place_that_is_given_is_not_carried);
    RUN(between_rare_samples_the_vehicle_goes_no_faster_than_its_bounds);
    RUN(the_drift_never_falls_when_it_is_set_anew);
    return test_end();
}
