/* SPDX-License-Identifier: MIT */
/*
 * test_sphere - the grid and its answers together, as a client meets them: what is blocked, clear or unknown after
 * given pings, ages, turns and moves. Truth is a scene whose walls are known in closed form.
 */
#include "core/fault.h"
#include "grid/ping.h"
#include "tests/lib/sphere_rig.h"

static const struct sphere_conf usual = {.angular_step_rad = 2 * GEO_PI / 180,
                                         .layers = {.r_max_m = 30, .dr_m = 0.05, .n_const = 29, .growth = 1.035},
                                         .max_cells = 20000,
                                         .forget_s = 160,
                                         .blocked_above = 0.6,
                                         .recentre_m = 0.1};
static struct mount mount;
static double ring_down_m;
static uint8_t flags; /* of the echoes that ping sends */

static void start(const struct sphere_conf *conf)
{
    rig_sphere(conf);
    now = (struct answer_now){.now_ns = 1000 * SECOND, .pose = pose_identity};
    mount = mount_identity;
    ring_down_m = 0.3;
    flags = 0;
}

static bool new_turn; /* the next pings begin one */

static uint32_t seq;
static bool twice; /* each beam has its echo twice, in the same cell */

/* One beam towards az (sensor frame) that heard an echo at range_m, or nothing (0) up to free_m. */
static void ping_el(double az_deg, double el_deg, double range_m, double free_m, double az_ap_deg,
                    double el_ap_deg)
{
    struct beam_echoes beam = {.az_rad = (float)geo_rad(az_deg),
                               .el_rad = (float)geo_rad(el_deg),
                               .blind_m = (float)ring_down_m,
                               .free_to_m = (float)free_m,
                               .state = BEAM_SILENT};
    if (range_m > 0) {
        beam.state = BEAM_ECHO;
        beam.n = 1;
        beam.echo[0] = (struct echo){.range_m = (float)range_m,
                                     .near_m = (float)(range_m - 0.02),
                                     .sd_m = 0.01f,
                                     .strength = 10,
                                     .confidence = 0.9f,
                                     .flags = flags};
        beam.free_to_m = (float)(range_m - 0.02);
        if (twice)
            beam.echo[beam.n++] = beam.echo[0];
    }
    struct echoes e = {.t_ns = now.now_ns,
                       .seq = ++seq,
                       .n_beams = 1,
                       .turns = true,
                       .flags = new_turn ? PING_NEW_TURN : 0,
                       .range_max_m = 20,
                       .az_aperture_rad = (float)geo_rad(az_ap_deg),
                       .el_aperture_rad = (float)geo_rad(el_ap_deg),
                       .pose = now.pose,
                       .max_beams = 1,
                       .beam = &beam};
    rig_enter(&e, &mount);
}

static void ping(double az_deg, double range_m, double free_m)
{
    ping_el(az_deg, 0, range_m, free_m, 2, 25);
}

/* Where the nearest obstacle level at az begins; 0: there is none. */
static double edge_m(double az_deg)
{
    struct picture *p = sphere_picture(sphere);
    struct picture_entry e;
    picture_get(p, rings_index(p->rings, geo_rad(az_deg), 0), &e);
    return (double)e.obstacle[0].near_m;
}

/* Where the nearest echo begins that does not suffice to block; 0: there is none. */
static double hint_m(double az_deg)
{
    struct picture *p = sphere_picture(sphere);
    struct picture_entry e;
    picture_get(p, rings_index(p->rings, geo_rad(az_deg), 0), &e);
    return (double)e.hint_m;
}

/* Somewhat more than a turn: where it begins there is no seam. */
static void turn_of(double range_m, double free_m)
{
    for (int u = 0; u < 420; u++)
        ping(u * 0.9, range_m, free_m);
}

TEST(nothing_pinged_is_unknown_everywhere)
{
    start(&usual);
    struct answer a = ask(0, 5);
    CHECK_INT(a.state, ANSWER_UNKNOWN);
    CHECK_INT(a.reason, ANSWER_NO_DATA);
    ping(180, 5, 0);
    a = ask(0, 5);
    CHECK_INT(a.state, ANSWER_UNKNOWN);
    CHECK_INT(a.reason, ANSWER_NEVER);
    CHECK(a.age_s < 0);
}

TEST(an_echo_blocks_beyond_it_and_the_water_before_it_is_clear)
{
    start(&usual);
    turn_of(5, 0);
    struct answer a = ask(77, 6);
    CHECK_INT(a.state, ANSWER_BLOCKED);
    CHECK_NEAR(a.range_m, 5, 0, 0.02);
    CHECK_NEAR(a.free_to_m, 4.98, 0, 0.02);
    a = ask(77, 4.5);
    CHECK_INT(a.state, ANSWER_CLEAR);
    CHECK_INT(a.reason, ANSWER_HEARD);
    CHECK(a.age_s >= 0 && a.age_s < 1e-9);
}

/* Nobody told the position for a while, then somebody does: the drift until the ping is none of its echoes'. */
TEST(a_drift_before_a_ping_brings_no_echo_of_it_nearer)
{
    for (int drifts = 0; drifts < 2; drifts++) {
        start(&usual);
        now.pose.has = POSE_ATTITUDE | (drifts ? 0 : POSE_POSITION | POSE_DEPTH);
        now.pose.drift_mps = drifts ? 0.5 : 0;
        now.pose.drift_m[0] = 50;
        ping(0, 5, 0);
        CHECK_NEAR(edge_m(0), drifts ? 4.98 - usual.recentre_m * sqrt(2) : 4.98, 0, 0.03);
        now.now_ns += SECOND;
        now.pose.drift_m[0] = 52; /* but what was heard before is, by as much */
        ping(90, 5, 0);
        CHECK_NEAR(edge_m(0), drifts ? 2.98 - usual.recentre_m * sqrt(2) : 2.98, 0, 0.03);
        CHECK(edge_m(90) < 4.99 && edge_m(90) > 4.97 - 2 * usual.recentre_m);
    }
    now.pose = pose_identity;
}

TEST(silence_is_worth_what_the_beam_claims_and_no_more)
{
    start(&usual);
    turn_of(0, 0.75);
    CHECK_INT(ask(10, 0.7).state, ANSWER_CLEAR);
    struct answer a = ask(10, 5);
    CHECK_INT(a.state, ANSWER_UNKNOWN);
    CHECK_INT(a.reason, ANSWER_BEYOND);
    CHECK_NEAR(a.free_to_m, 0.75, 0, 0.02);
}

TEST(a_beam_that_claims_nothing_clears_nothing)
{
    start(&usual);
    turn_of(0, 0);
    CHECK_INT(ask(10, 1).reason, ANSWER_BEYOND);
}

TEST(clear_grows_stale_and_blocked_fades_but_never_to_clear)
{
    start(&usual);
    turn_of(5, 0);
    now.now_ns += 29 * SECOND;
    CHECK_INT(ask(0, 4).state, ANSWER_CLEAR);
    now.now_ns += 2 * SECOND;
    CHECK_INT(ask(0, 4).reason, ANSWER_STALE);
    CHECK_INT(ask(0, 6).state, ANSWER_BLOCKED);
    CHECK_NEAR(ask(0, 6).age_s, 31, 1e-9, 0);
    for (int minute = 0; minute < 60; minute++) {
        now.now_ns += 60 * SECOND;
        CHECK(ask(0, 6).state != ANSWER_CLEAR);
    }
    CHECK_INT(ask(0, 6).state, ANSWER_UNKNOWN);
}

TEST(fading_is_the_closed_form_however_often_it_is_read)
{
    start(&usual);
    ping(0, 5, 0);
    struct picture_entry e;
    picture_get(sphere_picture(sphere), rings_index(sphere_picture(sphere)->rings, 1e-3, 1e-3), &e);
    uint64_t seed = test_seed(), t = now.now_ns;
    for (int i = 0; i < 100000; i++) {
        t += test_random(&seed) % 1000000;
        double want =
            e.obstacle[0].logodds * exp(-(double)(t - now.now_ns) * 1e-9 / (160 / log(6 / log(0.6 / 0.4))));
        CHECK_NEAR(picture_logodds(sphere_picture(sphere), &e.obstacle[0], t), want, 1e-12, 0);
    }
    CHECK_NEAR(picture_logodds(sphere_picture(sphere), &e.obstacle[0], 0), e.obstacle[0].logodds, 0, 0);
}

TEST(a_removed_obstacle_is_cleared_by_beams_that_pass_it)
{
    start(&usual);
    turn_of(5, 0);
    for (int turns = 0; turns < 8 && ask(0, 6).state == ANSWER_BLOCKED; turns++) {
        now.now_ns += 10 * SECOND;
        turn_of(8, 0);
    }
    CHECK_INT(ask(0, 6).state, ANSWER_CLEAR);
    CHECK_NEAR(ask(0, 10).range_m, 8, 0, 0.05);
}

/* Where a beam was is known to the uncertainty of its pose: it may have passed beside the pile, or ended before the
 * wall. */
TEST(what_a_beam_may_have_missed_within_its_slack_stays)
{
    static const struct {
        double uncertain_m, uncertain_rad, free_m;
        bool stays;
    } row[] = {
        {0, 0, 20, false},     {0, 0.9 * GEO_PI / 180, 20, true}, {0.09, 0, 20, true}, {0, 0, 5.15, false},
        {0.09, 0, 5.15, true},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        start(&usual);
        turn_of(0, 20);
        for (int n = 0; n < 3; n++)
            ping(0, 5, 0);
        now.pose.uncertain_m = row[i].uncertain_m;
        now.pose.uncertain_rad = row[i].uncertain_rad;
        for (int n = 0; n < 20; n++)
            ping(0.5 * (n % 5 - 2), 0, row[i].free_m);
        now.pose.uncertain_m = now.pose.uncertain_rad = 0;
        CHECK_INT(ask(0, 10).state == ANSWER_BLOCKED, row[i].stays);
        if (test_case_failed)
            printf("(row %zu)\n", i);
    }
}

/*
 * A cone of 30 degrees, of a vehicle that goes and turns within the time of a late reading. Along its way an echo is
 * nearer, across it it is wider.
 */
TEST(a_blurred_ping_has_its_echo_wherever_it_may_have_been)
{
    static const struct {
        double m[3], any_m, turned_deg;
        double near_m, seen_deg;
    } row[] = {
        {{0, 0, 0}, 0, 0, 4.98, 17},   {{0.4, 0, 0}, 0, 0, 4.58, 17}, {{0, 0.4, 0}, 0, 0, 4.82, 21},
        {{0, 0, 0}, 0.4, 0, 4.58, 21}, {{0, 0, 0}, 0, 6, 4.98, 23},   {{0, 0, 0}, 0, 13.9, 4.98, 29},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        start(&usual);
        now.pose.has = POSE_ATTITUDE | POSE_POSITION;
        memcpy(now.pose.blur_m, row[i].m, sizeof row[i].m);
        now.pose.blur_any_m = row[i].any_m;
        now.pose.blur_rad = geo_rad(row[i].turned_deg);
        for (int n = 0; n < 3; n++)
            ping_el(0, 0, 5, 0, 30, 30);
        CHECK_NEAR(edge_m(1), row[i].near_m, 0, 0.02);
        CHECK(edge_m(row[i].seen_deg - 2) > 0 && edge_m(row[i].seen_deg + 2) == 0);
        if (test_case_failed)
            printf("(row %zu: %g)\n", i, edge_m(1));
    }
}

/* Another sonar's newer ping has brought the centre on; what the late reading says lies where it was. */
TEST(a_ping_that_was_dated_back_does_not_bring_the_centre_back)
{
    struct sphere_stats stats;
    start(&usual);
    now.pose.has = POSE_ATTITUDE | POSE_POSITION;
    ping_el(0, 0, 5, 0, 30, 30);
    now.now_ns += SECOND;
    now.pose.position_m[0] = 1;
    ping_el(90, 0, 5, 0, 30, 30);
    sphere_stats(sphere, &stats);
    CHECK_INT(stats.recentred, 1);
    now.now_ns -= SECOND / 2;
    now.pose.position_m[0] = 0.5;
    for (int n = 0; n < 3; n++)
        ping_el(0, 0, 4.5, 0, 30, 30);
    sphere_stats(sphere, &stats);
    CHECK_INT(stats.recentred, 1);
    CHECK_NEAR(edge_m(1), 4 - 0.02, 0, 0.05);
    struct picture_frame frame;
    picture_get_frame(sphere_picture(sphere), &frame);
    CHECK_INT(frame.t_ping_ns, 1001 * SECOND);
}

/* One that has drifted since the echo may have taken the pile out of the beam; but a whole turn would have shown it. */
TEST(what_a_beam_may_have_missed_for_the_headings_drift_stays)
{
    static const struct {
        double drift_dps, age_s;
        bool turns, stays;
    } row[] = {{0, 10, false, false}, {0.1, 0, false, false}, {0.1, 10, false, true}, {0.1, 10, true, false}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        start(&usual);
        for (int k = 0; k < 3; k++) { /* each turn takes a second */
            new_turn = row[i].turns;
            ping(90, 0, 20);
            new_turn = false;
            turn_of(0, 20);
            now.now_ns += SECOND;
        }
        for (int n = 0; n < 3; n++)
            ping(0, 5, 0);
        now.now_ns += (uint64_t)(row[i].age_s * 1e9);
        now.pose.heading_radps = geo_rad(row[i].drift_dps);
        for (int n = 0; n < 20; n++)
            ping(0.5 * (n % 5 - 2), 0, 20);
        now.pose.heading_radps = 0;
        CHECK_INT(ask(0, 10).state == ANSWER_BLOCKED, row[i].stays);
        if (test_case_failed)
            printf("(row %zu)\n", i);
    }
}

/* A thin pile that one ping detects blocks, a ghost or not; a ghost is gone when the next one does not detect it. */
TEST(a_marked_echo_blocks_until_the_next_look)
{
    for (int marked = 0; marked < 2; marked++) {
        start(&usual);
        turn_of(0, 20);
        flags = marked ? ECHO_GHOST : 0;
        ping(0, 5, 0);
        CHECK_INT(ask(0, 10).state, ANSWER_BLOCKED);
        now.now_ns += 15 * SECOND;
        CHECK_INT(ask(0, 10).state, ANSWER_BLOCKED);
        for (double az_deg = -6; az_deg <= 6; az_deg += 0.9)
            ping(az_deg, 0, 4.8);
        CHECK_INT(ask(0, 10).state, ANSWER_BLOCKED); /* nobody has looked there since */
        ping(0, 0, 20);
        CHECK(marked ? ask(0, 10).state != ANSWER_BLOCKED : ask(0, 10).state == ANSWER_BLOCKED);
    }
    flags = 0;
}

/* It ends free water at once, and no beam that ends before it makes it clear. */
TEST(an_unconfirmed_echo_blocks_once_a_second_one_shows_it)
{
    static const uint8_t marks[] = {ECHO_BURST, ECHO_ALONE, ECHO_FAINT};
    for (int second = 0; second < 3; second++) {
        start(&usual);
        turn_of(0, 20);
        CHECK_INT(ask(0, 10).state, ANSWER_CLEAR);
        flags = marks[second];
        twice = true; /* which is no second beam */
        ping(0, 5, 0);
        twice = false;
        CHECK_INT(ask(0, 10).state, ANSWER_UNKNOWN);
        CHECK(ask(0, 10).free_to_m < 5);
        CHECK(hint_m(0) > 4.5 && hint_m(0) <= 5 && edge_m(0) == 0);
        CHECK_INT(ask(0, 4.5).state, ANSWER_CLEAR);
        for (double az_deg = -6; az_deg <= 6; az_deg += 0.9)
            ping(az_deg, 0, 4.8);
        CHECK_INT(ask(0, 10).state, ANSWER_UNKNOWN);
        flags = second == 0 ? 0 : marks[second];
        ping(0, 5, 0);
        CHECK_INT(ask(0, 10).state, ANSWER_BLOCKED);
        CHECK(hint_m(0) == 0 && edge_m(0) > 4.5);
    }
    flags = 0;
}

/* However often it is heard; what was free behind it is not any more. */
TEST(an_echo_of_the_vehicles_own_ends_free_water_and_never_blocks)
{
    start(&usual);
    turn_of(0, 20);
    CHECK_INT(ask(0, 10).state, ANSWER_CLEAR);
    flags = ECHO_OWN;
    for (int i = 0; i < 50; i++) {
        for (double az_deg = -6; az_deg <= 6; az_deg += 0.9)
            ping(az_deg, 5, 0);
        CHECK_INT(ask(0, 10).state, ANSWER_UNKNOWN);
        CHECK(ask(0, 10).free_to_m < 5);
        CHECK(hint_m(0) == 0 && edge_m(0) == 0);
        CHECK_INT(ask(0, 4.5).state, ANSWER_CLEAR);
    }
    flags = ECHO_OWN | ECHO_FAINT;
    ping(0, 5, 0);
    CHECK(hint_m(0) == 0);
    flags = 0;
    ping(0, 5, 0); /* another echo at the same place */
    CHECK_INT(ask(0, 10).state, ANSWER_BLOCKED);
}

/* Two of them may come by chance; a third is a thing in the water that our own pings keep in step with. */
TEST(what_came_when_another_sonar_was_due_blocks_once_a_third_one_shows_it)
{
    start(&usual);
    turn_of(0, 20);
    flags = ECHO_OTHER;
    ping(0, 5, 0);
    CHECK_INT(ask(0, 10).state, ANSWER_UNKNOWN);
    CHECK(ask(0, 10).free_to_m < 5);
    ping(0, 5, 0);
    CHECK_INT(ask(0, 10).state, ANSWER_UNKNOWN);
    ping(0, 5, 0);
    CHECK_INT(ask(0, 10).state, ANSWER_BLOCKED);
    start(&usual);
    turn_of(0, 20);
    ping(0, 5, 0);
    flags = 0; /* another time, when none was due */
    ping(0, 5, 0);
    CHECK_INT(ask(0, 10).state, ANSWER_BLOCKED);
}

/* Beside it another thing may be that does not block either. Near the head, and where the place is uncertain. */
TEST(an_echo_of_the_vehicles_own_takes_water_back_whatever_its_beam_frees)
{
    static const double range_m[] = {5, 0.35}, uncertain_m[] = {0.3, 0.06};
    for (int i = 0; i < 2; i++) {
        start(&usual);
        turn_of(0, 20);
        CHECK_INT(ask(0, 10).state, ANSWER_CLEAR);
        flags = ECHO_OWN;
        now.pose.uncertain_m = uncertain_m[i];
        for (double az_deg = -6; az_deg <= 6; az_deg += 0.9)
            ping(az_deg, range_m[i], 0);
        now.pose.uncertain_m = 0;
        CHECK_INT(ask(0, 10).state, ANSWER_UNKNOWN);
        CHECK_INT(ask(90, 10).state, ANSWER_CLEAR);
    }
}

TEST(a_pile_that_one_of_the_beams_over_it_hears_stays)
{
    start(&usual);
    for (int turns = 0; turns < 20; turns++) {
        now.now_ns += 10 * SECOND;
        for (int u = 0; u < 400; u++)
            ping(u * 0.9, u == 0 ? 4 : 8, 0);
        CHECK_INT(ask(0, 5).state, ANSWER_BLOCKED);
    }
}

TEST(an_old_clear_does_not_outlive_a_pile_that_came)
{
    start(&usual);
    turn_of(0, 10);
    CHECK_INT(ask(0, 8).state, ANSWER_CLEAR);
    ping(0, 4, 0);
    CHECK_INT(ask(0, 8).state, ANSWER_BLOCKED);
}

/* An echo too weak to block, or one that has faded: the water beyond it is unknown until beams have passed it. */
TEST(doubtful_echoes_are_neither_blocked_nor_clear_beyond)
{
    start(&usual);
    turn_of(0, 10);
    struct beam_echoes beam = {.blind_m = 0.3f, .free_to_m = 3.9f, .state = BEAM_ECHO, .n = 1};
    beam.echo[0] = (struct echo){.range_m = 4, .near_m = 3.9f, .sd_m = 0.01f, .confidence = 0.05f};
    struct echoes e = {.t_ns = now.now_ns,
                       .n_beams = 1,
                       .range_max_m = 20,
                       .az_aperture_rad = (float)geo_rad(2),
                       .el_aperture_rad = (float)geo_rad(25),
                       .pose = pose_identity,
                       .beam = &beam};
    rig_enter(&e, &mount);
    CHECK_INT(ask(0, 3).state, ANSWER_CLEAR);
    CHECK_INT(ask(0, 8).state, ANSWER_UNKNOWN);
    CHECK_INT(ask(0, 8).reason, ANSWER_BEYOND);
    turn_of(0, 10);
    CHECK_INT(ask(0, 8).state, ANSWER_CLEAR);
}

TEST(an_unpinged_gap_is_unknown_though_its_neighbours_are_clear)
{
    start(&usual);
    for (int u = 0; u < 400; u++)
        if (u < 45 || u > 65)
            ping(u * 0.9, 0, 10);
    CHECK_INT(ask(0, 8).state, ANSWER_CLEAR);
    CHECK_INT(ask(50, 8).state, ANSWER_UNKNOWN);
    CHECK_INT(ask(37, 8).state, ANSWER_UNKNOWN); /* its cone reaches into the gap */
}

TEST(a_wide_beam_blocks_its_whole_opening)
{
    start(&usual);
    ping_el(0, 0, 5, 0, 2, 25);
    struct answer_query q = {.el_rad = geo_rad(11), .distance_m = 6, .half_angle_rad = geo_rad(1)};
    struct answer a = rig_line(&q);
    CHECK_INT(a.state, ANSWER_BLOCKED);
    q.el_rad = geo_rad(20);
    a = rig_line(&q);
    CHECK_INT(a.state, ANSWER_UNKNOWN);
}

TEST(once_given_an_attitude_the_grid_is_north_up)
{
    start(&usual);
    ping(0, 5, 0); /* body axes: dropped when the first attitude comes */
    now.pose.has = POSE_ATTITUDE;
    now.pose_fresh = true;
    quat_from_rpy(0, 0, geo_rad(90), now.pose.attitude); /* nose to the east */
    turn_of(5, 0);
    for (int u = 0; u < 3; u++)
        ping(0, 3, 0);
    CHECK_NEAR(ask(0, 6).range_m, 3, 0, 0.05);
    quat_from_rpy(0, 0, 0, now.pose.attitude); /* nose to the north: it lies to starboard */
    CHECK_NEAR(ask(90, 6).range_m, 3, 0, 0.05);
    CHECK_NEAR(ask(0, 6).range_m, 5, 0, 0.05);
    struct answer_query q = {.az_rad = geo_rad(90), .ned = true, .distance_m = 6, .half_angle_rad = geo_rad(2)};
    struct answer a = rig_line(&q);
    CHECK_NEAR(a.range_m, 3, 0, 0.05);
}

TEST(without_an_attitude_north_is_unknown)
{
    start(&usual);
    turn_of(5, 0);
    struct answer_query q = {.ned = true, .distance_m = 6, .half_angle_rad = geo_rad(5)};
    struct answer a = rig_line(&q);
    CHECK_INT(a.state, ANSWER_UNKNOWN);
    CHECK_INT(a.reason, ANSWER_NO_FRAME);
}

TEST(a_lost_pose_makes_all_unknown_and_pings_without_it_are_counted)
{
    start(&usual);
    now.pose.has = POSE_ATTITUDE;
    now.pose_fresh = true;
    turn_of(5, 0);
    now.pose_fresh = false;
    CHECK_INT(ask(0, 4).reason, ANSWER_POSE_LOST);
    now.pose.has = 0;
    ping(0, 2, 0);
    struct sphere_stats s;
    sphere_stats(sphere, &s);
    CHECK_INT(s.no_attitude, 1);
    now.pose_fresh = true;
    CHECK_NEAR(ask(0, 6).range_m, 5, 0, 0.05);
}

TEST(after_a_withdrawal_the_axes_are_the_bodys_and_nothing_is_left)
{
    start(&usual);
    now.pose.has = POSE_ATTITUDE | POSE_POSITION;
    now.pose_fresh = true;
    now.pose.position_m[0] = 70;
    quat_from_rpy(0, 0, geo_rad(90), now.pose.attitude);
    turn_of(5, 0);
    now.pose = pose_identity;
    now.pose.withdrawn = 1;
    now.pose_fresh = false;
    CHECK_INT(ask(0, 4).state, ANSWER_UNKNOWN); /* until the next ping */
    now.pose_fresh = true;
    CHECK(ask(0, 4).state != ANSWER_CLEAR); /* a new pose makes the old picture no truer */
    now.pose_fresh = false;
    ping(0, 3, 0);
    CHECK_INT(ask(180, 4).reason, ANSWER_NEVER);
    turn_of(5, 0);
    for (int u = 0; u < 3; u++)
        ping(0, 3, 0);
    CHECK_NEAR(ask(0, 6).range_m, 3, 0, 0.05);
    CHECK_NEAR(ask(90, 6).range_m, 5, 0, 0.05);
    struct sphere_stats s;
    sphere_stats(sphere, &s);
    CHECK_INT(s.no_attitude, 0);
}

/* The wall x = 6 north; the vehicle drives towards it. */
TEST(obstacles_come_nearer_as_the_vehicle_drives_and_nothing_drifts)
{
    for (int far = 0; far < 2; far++) {
        start(&usual);
        double origin = far ? 1e7 : 0;
        now.pose.has = POSE_ATTITUDE | POSE_POSITION;
        now.pose_fresh = true;
        now.pose.position_m[0] = origin;
        ping(0, 6, 0);
        for (int step = 1; step <= 20000; step++) { /* 3 m in steps of 0.15 mm, looking elsewhere */
            now.pose.position_m[0] = origin + step * 1.5e-4;
            now.pose.path_m = step * 1.5e-4;
            if (step % 50 == 0)
                ping(180, 0, 2);
        }
        struct answer a = ask(0, 5);
        CHECK_INT(a.state, ANSWER_BLOCKED);
        CHECK_NEAR(a.range_m, 3, 0, 0.12); /* at most recentre_m nearer than it is */
        CHECK(a.range_m <= 3.01);
        struct sphere_stats s;
        sphere_stats(sphere, &s);
        CHECK(s.recentred > 10 && s.cells_lost == 0);
    }
}

/* A wall 140 m north, in the range of a big sonar; 120 m towards it without hearing it again. */
TEST(a_long_way_moves_obstacles_to_a_new_anchor)
{
    struct sphere_conf wide = usual;
    wide.layers.r_max_m = 150;
    wide.max_cells = 65536;
    start(&wide);
    now.pose.has = POSE_ATTITUDE | POSE_POSITION;
    now.pose_fresh = true;
    for (double az = -2; az <= 2; az += 0.5)
        ping(az, 140, 0);
    struct sphere_stats after;
    for (int step = 1; step <= 600; step++) {
        now.pose.position_m[0] = now.pose.path_m = 0.2 * step;
        now.now_ns += SECOND / 100;
        ping(180, 0, 2);
    }
    /* each direction's obstacle was the middle of 5 m of wall: seen from here it may be 10 degrees off */
    struct answer_query q = {.distance_m = 30, .half_angle_rad = geo_rad(10)};
    struct answer a = rig_line(&q);
    CHECK_INT(a.state, ANSWER_BLOCKED);
    CHECK_NEAR(a.range_m, 20, 0, 0.5);
    sphere_stats(sphere, &after);
    CHECK(after.cells_lost == 0 && after.recentred > 100 && after.cells > 0);
    now.pose.position_m[0] = now.pose.path_m = 130; /* at once: what was clear says nothing of the new place */
    ping(90, 0, 10);
    CHECK_INT(ask(180, 1).state, ANSWER_UNKNOWN);
    q.half_angle_rad = geo_rad(20);
    a = rig_line(&q);
    CHECK_INT(a.state, ANSWER_BLOCKED);
    CHECK_NEAR(a.range_m, 10, 0, 1);
}

TEST(cleared_water_is_unknown_once_the_vehicle_has_driven_on)
{
    start(&usual);
    now.pose.has = POSE_ATTITUDE | POSE_POSITION;
    now.pose_fresh = true;
    turn_of(0, 10);
    now.pose.position_m[1] = 0.15;
    now.pose.path_m = 0.15;
    CHECK_INT(ask(0, 8).state, ANSWER_CLEAR);
    now.pose.position_m[1] = POSE_STEP_MOST_M + 0.01; /* and no ping since */
    CHECK_INT(ask(0, 8).reason, ANSWER_MOVED);
    now.pose.position_m[1] = 0;
    now.pose.path_m = 0.8; /* there and back is a way too */
    CHECK_INT(ask(0, 8).reason, ANSWER_MOVED);
}

TEST(nothing_that_was_clear_is_so_after_the_heading_jumped)
{
    struct sphere_stats stats;
    start(&usual);
    now.pose.has = POSE_ATTITUDE;
    now.pose_fresh = true;
    turn_of(0, 10);
    for (int u = 0; u < 3; u++)
        ping(90, 3, 0);
    quat_from_rpy(0, 0, geo_rad(90),
                  now.pose.attitude); /* and no ping since: what is to starboard now lies ahead */
    now.pose.discontinuities = 1;
    CHECK_INT(ask(180, 8).state, ANSWER_UNKNOWN);
    CHECK_INT(ask(180, 8).reason, ANSWER_MOVED);
    CHECK_INT(ask(0, 8).state, ANSWER_BLOCKED);
    ping(180, 0, 10); /* and now pings as well */
    CHECK_INT(ask(135, 8).reason, ANSWER_NEVER);
    CHECK_INT(ask(0, 8).state, ANSWER_BLOCKED);
    sphere_stats(sphere, &stats);
    CHECK(stats.pinged > 0 && stats.pinged < 200);
    turn_of(0, 10);
    CHECK_INT(ask(180, 8).state, ANSWER_CLEAR);
    CHECK_INT(ask(0, 8).state, ANSWER_BLOCKED); /* until enough beams have passed it */
    for (int i = 0; i < 5; i++)
        turn_of(0, 10);
    CHECK_INT(ask(0, 8).state, ANSWER_CLEAR);
}

TEST(a_full_pool_loses_certainty_not_obstacles)
{
    struct sphere_conf small = usual;
    small.max_cells = 256;
    start(&small);
    uint64_t seed = test_seed();
    for (int i = 0; i < 20000; i++) {
        now.now_ns += SECOND / 100;
        ping(360 * test_uniform(&seed), 1 + 9 * test_uniform(&seed), 0);
    }
    struct sphere_stats s;
    sphere_stats(sphere, &s);
    CHECK(s.cells <= 256);
    CHECK(s.cells_lost > 0);
    for (int az = 0; az < 360; az += 3)
        CHECK(ask(az, 12).state != ANSWER_CLEAR);
}

TEST(counts_and_logodds_saturate)
{
    start(&usual);
    for (int i = 0; i < 100000; i++)
        ping(0, 5, 0);
    CHECK_INT(ask(0, 6).state, ANSWER_BLOCKED);
    int turns = 0;
    while (ask(0, 6).state == ANSWER_BLOCKED && turns < 20) {
        ping(-0.9, 8, 0);
        ping(0, 8, 0);
        ping(0.9, 8, 0);
        turns++;
    }
    CHECK(turns < 12); /* the past cannot outvote the present for long */
}

/* A pile that a head last showed age_s ago, which takes turn_s for a turn. */
static enum answer_state after(const struct sphere_conf *conf, double turn_s, double age_s)
{
    start(conf);
    for (int k = 0; k < 3; k++) {
        new_turn = true;
        ping(90, 0, 20);
        new_turn = false;
        for (int n = 0; n < 30; n++) /* as sure as can be */
            ping(0, 5, 0);
        for (int n = 0; n < 20; n++) {
            now.now_ns += (uint64_t)(turn_s / 20 * 1e9);
            ping(180, 0, 0);
        }
    }
    now.now_ns += (uint64_t)((age_s - turn_s) * 1e9);
    return ask(0, 6).state;
}

TEST(an_obstacle_blocks_for_some_turns_of_a_slow_head)
{
    struct sphere_conf slow = usual;
    slow.forget_turns = 2.5;
    CHECK_INT(after(&usual, 100, 155), ANSWER_BLOCKED);
    CHECK_INT(after(&usual, 100, 165), ANSWER_UNKNOWN);
    CHECK_INT(after(&slow, 100, 245), ANSWER_BLOCKED);
    CHECK_INT(after(&slow, 100, 255), ANSWER_UNKNOWN);
    CHECK_INT(after(&slow, 10, 155), ANSWER_BLOCKED);
    CHECK_INT(after(&slow, 10, 165), ANSWER_UNKNOWN); /* forget_s is the least */
}

TEST(a_clock_that_jumps_back_does_no_harm)
{
    start(&usual);
    turn_of(5, 0);
    now.now_ns -= 100 * SECOND;
    turn_of(5, 0);
    CHECK_INT(ask(0, 6).state, ANSWER_BLOCKED);
    now.now_ns -= 800 * SECOND;
    CHECK_INT(ask(0, 6).state, ANSWER_BLOCKED);
    CHECK(ask(0, 6).age_s >= 0);
}

TEST(senseless_grids_are_refused_with_a_sentence)
{
    struct sphere_conf bad[5] = {usual, usual, usual, usual, usual};
    bad[0].angular_step_rad = 0;
    bad[1].layers.growth = 0.5;
    bad[2].max_cells = 1;
    bad[3].forget_s = NAN;
    bad[4].blocked_above = 0.4;
    for (int i = 0; i < 5; i++) {
        struct fault fault = {""};
        CHECK_INT(sphere_bytes(&bad[i], &fault), 0);
        CHECK(strlen(fault.text) > 10);
    }
}

TEST(a_beam_that_hears_nothing_usable_takes_back_what_was_clear)
{
    start(&usual);
    turn_of(0, 8);
    CHECK_INT(ask(0, 5).state, ANSWER_CLEAR);
    now.now_ns += SECOND;
    turn_of(0, 0);
    CHECK_INT(ask(0, 5).state, ANSWER_UNKNOWN);
}

/* Nobody knows to which direction it speaks: what others heard of the water only grows older, as without it. */
static void sweep_ahead(double range_m)
{
    for (double az_deg = -18; az_deg <= 18; az_deg += 0.9)
        ping(az_deg, range_m, 8);
}

TEST(a_ping_of_no_certain_place_takes_nothing_back)
{
    static const double slack[][2] = {{0.15, 0}, {0, 1.1 * GEO_PI / 180}};
    for (size_t i = 0; i < sizeof slack / sizeof slack[0]; i++) {
        start(&usual);
        sweep_ahead(0);
        now.now_ns += SECOND;
        now.pose.uncertain_m = slack[i][0];
        now.pose.uncertain_rad = slack[i][1];
        sweep_ahead(0);
        now.pose.uncertain_m = now.pose.uncertain_rad = 0;
        CHECK_INT(ask(0, 5).state, ANSWER_CLEAR);
        CHECK_NEAR(ask(0, 5).age_s, 1, 1e-9, 0);
        now.pose.uncertain_m = slack[i][0];
        sweep_ahead(4);
        now.pose.uncertain_m = 0;
        CHECK_INT(ask(0, 5).state, ANSWER_BLOCKED);
        CHECK_NEAR(ask(0, 5).free_to_m, 4 - 0.02 - slack[i][0], 0, 0.02);
    }
}

TEST(a_lost_sonar_makes_its_clear_water_unknown_at_once)
{
    start(&usual);
    turn_of(5, 0);
    now.lost = 1;
    CHECK_INT(ask(0, 4).reason, ANSWER_SILENT);
    CHECK_INT(ask(0, 6).state, ANSWER_BLOCKED);
    now.lost = 2; /* another one */
    CHECK_INT(ask(0, 4).state, ANSWER_CLEAR);
}

TEST(a_head_that_hangs_low_does_not_see_the_water_before_the_bow)
{
    start(&usual);
    mount.position_m[2] = 0.5;
    turn_of(0, 8);
    CHECK_INT(ask(0, 2).state, ANSWER_UNKNOWN);
    struct answer a = ask(0, 6);
    CHECK(a.state == ANSWER_UNKNOWN && a.reason == ANSWER_BLIND);
    CHECK(a.blind_to_m > 0.5 / tan(geo_rad(12.5)) && a.free_to_m > 5.9);
}

/* As it is on a vehicle: the head sits forward and low, and its ring-down ends a little elsewhere in every beam. */
TEST(a_head_off_the_centre_clears_all_round_whatever_its_ring_down)
{
    uint64_t seed = test_seed();
    static const double places[][3] = {{0.2, 0, 0.1}, {0.2, 0, 0}, {-0.3, 0.15, 0}, {0, 0.25, -0.1}};
    for (size_t i = 0; i < sizeof places / sizeof places[0]; i++) {
        start(&usual);
        memcpy(mount.position_m, places[i], sizeof places[i]);
        for (int turns = 0; turns < 2; turns++)
            for (int u = 0; u < 400; u++) {
                now.now_ns += SECOND / 50;
                ring_down_m = 0.43 + 0.34 * test_uniform(&seed);
                ping(u * 0.9, 5, 0);
            }
        int clear = 0;
        for (int az = 0; az < 360; az += 10)
            clear +=
                rig_line(&(struct answer_query){
                             .az_rad = geo_rad(az), .distance_m = 3, .half_angle_rad = geo_rad(5), .near_m = 2})
                    .state == ANSWER_CLEAR;
        CHECK_INT(clear, 36);
    }
}

/* What lies ahead is what a turning head's vehicle asks for most,
 * and the head may look there again seconds later only. */
TEST(what_was_free_ahead_stays_so_on_the_way_there)
{
    start(&usual);
    now.pose.has = POSE_ATTITUDE | POSE_POSITION;
    now.pose_fresh = true;
    for (int u = 0; u < 400; u++) {
        now.now_ns += SECOND / 50;
        ping(u * 0.9, 5, 0);
    }
    for (int step = 1; step <= 45; step++) {
        now.now_ns += SECOND / 50;
        now.pose.position_m[0] += 0.01;
        now.pose.path_m += 0.01;
        ping(180, 5, 0);
        const struct answer ahead = ask(0, 4);
        CHECK_INT(ahead.state, ANSWER_CLEAR);
        CHECK(ahead.blind_to_m <= 1 && ahead.free_to_m < 5);
        if (test_case_failed)
            return;
    }
    CHECK_INT(ask(0, 4.7).state, ANSWER_BLOCKED);
}

/* To starboard, in steps of 5 cm. */
static void go_without_pings(double to_m, bool follows)
{
    while (now.pose.position_m[1] < to_m) {
        now.now_ns += SECOND / 10;
        now.pose.t_ns = now.now_ns;
        now.pose.position_m[1] += 0.05;
        now.pose.path_m += 0.05;
        if (follows)
            rig_follow(&now.pose);
    }
}

static void look_around(void)
{
    start(&usual);
    now.pose.has = POSE_ATTITUDE | POSE_POSITION;
    now.pose_fresh = true;
    for (int u = 0; u < 420; u++)
        ping(u * 0.9, u >= 50 && u < 150 ? 5 : 0, 10); /* a wall on that side */
}

/* As ask(), however far the vehicle has gone. */
static struct answer ask_far_on(double az_deg, double distance_m)
{
    const struct answer_conf any_way = {.clear_for_s = 30, .move_limit_m = INFINITY};
    return rig_line_by(&any_way, &(struct answer_query){.az_rad = geo_rad(az_deg),
                                                        .distance_m = distance_m,
                                                        .half_angle_rad = geo_rad(5),
                                                        .near_m = RIG_NEAR_M});
}

TEST(the_centre_follows_while_no_ping_comes)
{
    look_around();
    go_without_pings(1.6, false);
    CHECK_INT(ask_far_on(0, 6).reason, ANSWER_MOVED);
    look_around();
    go_without_pings(1.6, true);
    CHECK_INT(ask_far_on(0, 6).state, ANSWER_CLEAR);
    CHECK_INT(ask_far_on(180, 6).state, ANSWER_CLEAR);
    CHECK_INT(ask_far_on(90, 2).state, ANSWER_CLEAR);
    CHECK_INT(ask_far_on(90, 3.5).state, ANSWER_BLOCKED);
    CHECK_NEAR(ask_far_on(90, 3.5).range_m, 5 - 1.6, 0, 0.2);
    CHECK_INT(ask_far_on(0, 9.9).state, ANSWER_UNKNOWN);
    now.now_ns += 31 * SECOND;
    CHECK_INT(ask_far_on(0, 6).reason, ANSWER_STALE); /* to follow makes nothing new */
}

TEST(the_centre_does_not_follow_what_the_next_ping_must_judge)
{
    struct sphere_stats stats;
    start(&usual);
    now.pose.has = POSE_ATTITUDE | POSE_POSITION;
    go_without_pings(0.5, true); /* before the first ping */
    look_around();
    now.pose.discontinuities = 1;
    go_without_pings(0.5, true);
    now.pose.discontinuities = 0;
    now.pose.withdrawn = 1;
    go_without_pings(1, true);
    sphere_stats(sphere, &stats);
    CHECK_INT(stats.recentred, 0);
}

/* Of the way since the ping the vehicle may have gone a part to the side, by the drift of its heading since. */
TEST(obstacles_come_nearer_by_a_way_in_a_wrong_direction)
{
    double near_m[2];
    for (int drifts = 0; drifts < 2; drifts++) {
        start(&usual);
        now.pose.has = POSE_ATTITUDE | POSE_POSITION;
        now.pose.heading_radps = drifts ? 0.01 : 0;
        now.pose_fresh = true;
        turn_of(5, 0);
        for (int step = 1; step <= 50; step++) {
            now.now_ns += SECOND / 50;
            now.pose.position_m[0] = now.pose.path_m = 0.02 * step;
            ping(180, 6, 0);
        }
        near_m[drifts] = edge_m(0);
    }
    /* 1 m and 0.01 rad, step by step */
    CHECK(near_m[0] - near_m[1] > 0.003 && near_m[0] - near_m[1] < 0.01);
}

/* It has waited behind a job of seconds: pings went on meanwhile, and so did the vehicle. */
TEST(the_centre_does_not_go_back_to_a_pose_from_before_the_last_ping)
{
    struct sphere_stats before, after;
    look_around();
    struct pose waited = now.pose;
    waited.t_ns = now.now_ns;
    go_without_pings(1.6, true);
    now.now_ns += SECOND;
    ping(0, 0, 10);
    sphere_stats(sphere, &before);
    rig_follow(&waited);
    sphere_stats(sphere, &after);
    CHECK_INT(after.recentred, before.recentred);
    CHECK_INT(ask_far_on(180, 6).state, ANSWER_CLEAR);
}

TEST(a_place_far_off_for_a_moment_is_not_followed)
{
    look_around();
    for (int far = 1; far >= 0; far--) {
        now.now_ns += SECOND / 10;
        now.pose.t_ns = now.now_ns;
        now.pose.position_m[1] = 3 * far;
        now.pose.path_m += 3;
        rig_follow(&now.pose);
        CHECK(far ? ask_far_on(0, 6).state != ANSWER_CLEAR : ask_far_on(0, 6).state == ANSWER_CLEAR);
    }
    CHECK_INT(ask_far_on(90, 6).state, ANSWER_BLOCKED);
}

/* ---- along lines ---- */

static enum answer_state along(double az_deg, double distance_m)
{
    const struct answer_query q = {
        .az_rad = geo_rad(az_deg), .distance_m = distance_m, .half_angle_rad = 1e-4, .near_m = RIG_NEAR_M};
    return rig_line(&q).state;
}

/* A beam of 25 degrees in height around az, after a second. */
static void look_again(double az_deg, double width_deg, double range_m, double free_m)
{
    now.now_ns += SECOND;
    ping_el(az_deg, 0, range_m, free_m, width_deg, 25);
}

TEST(beside_a_sector_that_was_wider_long_ago_nothing_is_free)
{
    start(&usual);
    turn_of(0, 5);
    now.now_ns += 3600 * SECOND;
    for (double az = 0; az <= 90.25; az += 0.5)
        ping(az, 0, 5);
    CHECK_INT(along(89.5, 4), ANSWER_CLEAR);
    CHECK_INT(along(91.9, 4), ANSWER_UNKNOWN); /* in the cell whose middle is at 91 */
}

TEST(what_a_deaf_sonar_takes_back_stays_so_however_well_its_bearing_was_known)
{
    for (int i = 0; i < 4; i++) {
        start(&usual);
        now.pose.has = POSE_ATTITUDE | POSE_POSITION;
        now.pose_fresh = true;
        look_again(1, 12, 0, 5);
        CHECK_INT(along(1, 4), ANSWER_CLEAR);
        now.pose.uncertain_rad = 0.03 * i;
        look_again(1, 12, 0, 0);
        look_again(1, 12, 0, 0);
        now.pose.uncertain_rad = 0;
        CHECK_INT(along(1, 4), ANSWER_UNKNOWN);
        now.pose.position_m[0] += 0.3;
        now.pose.path_m += 0.3;
        now.pose.t_ns = now.now_ns;
        rig_follow(&now.pose);
        CHECK_INT(along(1, 4), ANSWER_UNKNOWN);
    }
}

TEST(a_sonar_that_stays_deaf_takes_back_what_it_points_at)
{
    start(&usual);
    turn_of(0, 5);
    for (int k = 0; k < 4; k++)
        look_again(20 + 10 * k, 2.4, 0, 0);
    for (int k = 0; k < 4; k++)
        CHECK_INT(along(20 + 10 * k, 4), ANSWER_UNKNOWN);
    CHECK_INT(along(60, 4), ANSWER_CLEAR);
    look_again(100, 2.4, 0, 5);
    look_again(120, 2.4, 0, 0);
    CHECK_INT(along(120, 4), ANSWER_CLEAR); /* one ping may be noisy */
}

/* Its neighbours' beams end just beyond the middles of two cells: what stands between them was in no beam. */
TEST(the_gap_that_a_lost_ping_leaves_is_not_free)
{
    for (int lost = 0; lost < 2; lost++) {
        start(&usual);
        for (int k = -6; k <= 6; k++)
            if (k || !lost)
                ping_el(10 + k * 2.45, 0, 0, 5, 3, 25);
        CHECK_INT(along(9.5, 4), lost ? ANSWER_UNKNOWN : ANSWER_CLEAR);
        CHECK_INT(along(10.5, 4), lost ? ANSWER_UNKNOWN : ANSWER_CLEAR);
        CHECK_INT(along(7, 4), ANSWER_CLEAR);
        CHECK_INT(along(13, 4), ANSWER_CLEAR);
    }
}

/* ---- against a known room ---- */

/* First wall of the box |x| < a, |y| < b met from p along azimuth az. */
static double wall(const double p[2], double az, double a, double b)
{
    double dx = cos(az), dy = sin(az);
    double tx = dx > 0 ? (a - p[0]) / dx : dx < 0 ? (-a - p[0]) / dx : INFINITY;
    double ty = dy > 0 ? (b - p[1]) / dy : dy < 0 ? (-b - p[1]) / dy : INFINITY;
    return fmin(tx, ty);
}

/* Nearest wall that a beam of 2 degrees hears. */
static double heard_wall(const double p[2], double az)
{
    double nearest = INFINITY;
    for (int k = -10; k <= 10; k++)
        nearest = fmin(nearest, wall(p, az + k * geo_rad(0.1), 4, 2.5));
    return nearest;
}

TEST(in_a_room_sectors_are_its_walls_and_never_clear_beyond)
{
    for (int trial = 0; trial < 8; trial++) {
        start(&usual);
        now.pose.has = POSE_ATTITUDE | POSE_POSITION;
        now.pose_fresh = true;
        double yaw = 0.7 * trial, p[2] = {0.3 * trial - 1, 0.5};
        mount.position_m[0] = trial % 2 ? 0.3 : 0;
        mount.position_m[1] = trial % 4 > 1 ? -0.2 : 0;
        quat_from_rpy(0, 0, yaw, now.pose.attitude);
        now.pose.position_m[0] = p[0];
        now.pose.position_m[1] = p[1];
        double lever[3], sensor[2];
        quat_rotate(now.pose.attitude, mount.position_m, lever);
        sensor[0] = p[0] + lever[0];
        sensor[1] = p[1] + lever[1];
        for (int turns = 0; turns < 3; turns++)
            for (int u = 0; u < 400; u++) {
                now.now_ns += SECOND / 50;
                ping(u * 0.9, heard_wall(sensor, geo_rad(u * 0.9) + yaw), 0);
            }
        struct answer sector[72];
        rig_band(
            &(struct answer_band){
                .lo_rad = geo_rad(-5), .hi_rad = geo_rad(5), .reach_m = 20, .near_m = RIG_NEAR_M, .count = 72},
            sector);
        for (int k = 0; k < 72; k++) {
            double nearest = INFINITY, farthest = 0;
            for (double off = -6.5; off <= 6.5;
                 off += 0.25) { /* half a sector, two cells and a beam to each side */
                double w = wall(p, geo_rad(k * 5 + off) + yaw, 4, 2.5);
                nearest = fmin(nearest, w);
                farthest = fmax(farthest, w);
            }
            CHECK_INT(sector[k].state, ANSWER_BLOCKED);
            CHECK(sector[k].range_m >= nearest - 0.1 && sector[k].range_m <= farthest + 0.05);
            struct answer a = ask(k * 5, farthest + 0.1);
            CHECK_INT(a.state, ANSWER_BLOCKED);
            CHECK(ask(k * 5, nearest * 0.8).state == ANSWER_CLEAR);
        }
    }
}

TEST(asking_for_more_never_turns_blocked_or_unknown_into_clear)
{
    uint64_t seed = test_seed();
    for (int scene = 0; scene < 3; scene++) {
        start(&usual);
        for (int i = 0; i < 600; i++)
            ping_el(360 * test_uniform(&seed), 20 * test_uniform(&seed) - 10,
                    test_uniform(&seed) < 0.3 ? 1 + 8 * test_uniform(&seed) : 0, 10 * test_uniform(&seed), 4, 25);
        for (int i = 0; i < 8; i++) {
            struct answer_query q = {.az_rad = GEO_TURN * test_uniform(&seed),
                                     .el_rad = 0.2 * test_uniform(&seed),
                                     .distance_m = 0.5,
                                     .near_m = RIG_NEAR_M,
                                     .corridor = i % 2,
                                     .radius_m = 0.3,
                                     .half_angle_rad = geo_rad(8 * test_uniform(&seed))};
            enum answer_state before = ANSWER_CLEAR;
            for (; q.distance_m < 12; q.distance_m += 0.5) {
                struct answer a = rig_line(&q);
                CHECK(!(before != ANSWER_CLEAR && a.state == ANSWER_CLEAR));
                CHECK(!(before == ANSWER_BLOCKED && a.state != ANSWER_BLOCKED));
                before = a.state;
            }
            struct answer narrow, wide;
            q.distance_m = 5;
            narrow = rig_line(&q);
            q.half_angle_rad *= 2;
            q.radius_m *= 2;
            wide = rig_line(&q);
            CHECK(!(narrow.state != ANSWER_CLEAR && wide.state == ANSWER_CLEAR));
            CHECK(!(narrow.state == ANSWER_BLOCKED && wide.state != ANSWER_BLOCKED));
        }
    }
}

TEST(a_level_grid_gives_the_same_ring)
{
    struct sphere_conf level = usual;
    level.level = true;
    level.level_half_rad = geo_rad(10);
    start(&level);
    turn_of(5, 0);
    CHECK_NEAR(ask(33, 6).range_m, 5, 0, 0.02);
    CHECK_INT(ask(33, 4).state, ANSWER_CLEAR);
    /* and does not know what is above and below it */
    static const struct answer_query beyond[] = {
        {.el_rad = 0.8, .distance_m = 4, .half_angle_rad = 0.1},
        {.distance_m = 4, .half_angle_rad = 0.2},
        {.el_rad = 0.1, .distance_m = 4, .half_angle_rad = 0.1},
        {.distance_m = 4, .corridor = true, .radius_m = 0.5},
    };
    for (size_t i = 0; i < sizeof beyond / sizeof beyond[0]; i++) {
        struct answer a;
        a = rig_line(&beyond[i]);
        CHECK_INT(a.reason, ANSWER_OUTSIDE);
    }
    struct answer sector[4];
    rig_band(&(struct answer_band){.lo_rad = -1, .hi_rad = 1, .reach_m = 4, .near_m = RIG_NEAR_M, .count = 4},
             sector);
    for (int k = 0; k < 4; k++)
        CHECK(sector[k].state != ANSWER_CLEAR);
}

/* Something 6 m away does not block who asks for 4 m; its range is told all the same. */
TEST(clear_lasts_for_one_and_a_half_turns)
{
    CHECK_NEAR(answer_clear_for_s(0, 160), 30, 0, 0); /* none is over yet */
    CHECK_NEAR(answer_clear_for_s(6, 160), 30, 0, 0);
    CHECK_NEAR(answer_clear_for_s(63, 160), 94.5, 1e-9, 0);
    CHECK_NEAR(answer_clear_for_s(200, 160), 160, 0, 0);
}

static double turn_s(void)
{
    struct picture_frame frame;
    picture_get_frame(sphere_picture(sphere), &frame);
    return frame.turn_s;
}

/* Pings that begin a turn, so far apart, and silent ones between, after a time in which there are none. */
static void turns_after(int n, double apart_s, double away_s)
{
    for (int i = 0; i < n; i++) {
        now.now_ns += (uint64_t)(away_s * 1e9);
        for (int k = 0; k < 20; k++) {
            now.now_ns += (uint64_t)((apart_s - away_s) / 20 * 1e9);
            ping(180, 0, 0);
        }
        new_turn = true;
        ping(180, 0, 0);
        new_turn = false;
    }
}

static void turns(int n, double apart_s)
{
    turns_after(n, apart_s, 0);
}

TEST(the_longest_turn_is_measured)
{
    start(&usual);
    turns(1, 63);
    CHECK_NEAR(turn_s(), 0, 0, 0);
    turns(1, 63);
    CHECK_NEAR(turn_s(), 63, 0.01, 0);
    turns_after(1, 700, 650); /* it was switched off */
    CHECK_NEAR(turn_s(), 63, 0.01, 0);
    turns_after(1, 300, 240);
    CHECK_NEAR(turn_s(), 63, 0.01, 0);
    turns_after(1, 66, 5); /* a ping is late */
    CHECK_NEAR(turn_s(), 66, 0.01, 0);
    turns(1, 20);
    CHECK_NEAR(turn_s(), 20, 0.01, 0);
    struct picture_frame frame;
    picture_get_frame(sphere_picture(sphere), &frame);
    CHECK_NEAR(frame.looks.turn_s[0], 20, 0.01, 0);
    CHECK(frame.looks.t_ns == now.now_ns);
    CHECK_NEAR(frame.looks.back_ds[0], 10 * (57 + 66 + 20), 0, 5);
}

TEST(a_single_echo_blocks_until_the_head_has_passed_again)
{
    for (int echoes = 1; echoes <= 2; echoes++) {
        start(&usual);
        turns(3, 6);
        for (int i = 0; i < echoes; i++)
            ping(0, 5, 0);
        now.now_ns += 8 * SECOND;
        CHECK_INT(ask(0, 6).state, ANSWER_BLOCKED);
        now.now_ns += 4 * SECOND;
        CHECK_INT(ask(0, 6).state, echoes == 1 ? ANSWER_UNKNOWN : ANSWER_BLOCKED);
    }
    start(&usual); /* before a turn is over nobody knows when it will pass again */
    ping(0, 5, 0);
    now.now_ns += 12 * SECOND;
    CHECK_INT(ask(0, 6).state, ANSWER_BLOCKED);
}

TEST(a_sector_is_judged_as_far_as_it_is_asked_about)
{
    static const struct {
        double to_m;
        enum answer_state state;
    } row[] = {{4, ANSWER_CLEAR}, {5.5, ANSWER_CLEAR}, {6.5, ANSWER_BLOCKED}};
    start(&usual);
    turn_of(6, 10);
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct answer sector[8];
        rig_band(
            &(struct answer_band){
                .lo_rad = -0.02, .hi_rad = 0.02, .reach_m = row[i].to_m, .near_m = RIG_NEAR_M, .count = 8},
            sector);
        for (int k = 0; k < 8; k++) {
            CHECK_INT(sector[k].state, row[i].state);
            CHECK_NEAR(sector[k].range_m, 6, 0.2, 0);
        }
    }
}

TEST(a_level_grid_on_a_vehicle_that_pitches_claims_only_what_the_fan_covers)
{
    struct sphere_conf level = usual;
    level.level = true;
    level.level_half_rad = geo_rad(7.5);
    start(&level);
    now.pose.has = POSE_ATTITUDE;
    now.pose_fresh = true;
    turn_of(0, 8);
    CHECK_INT(ask(0, 4).state, ANSWER_CLEAR);
    quat_from_rpy(0, geo_rad(10), 0, now.pose.attitude); /* the fan reaches from -2.5 degrees upward */
    turn_of(0, 8);
    now.now_ns += 31 * SECOND; /* what the level turn had cleared is stale */
    turn_of(0, 8);
    struct answer_query q = {.ned = true, .distance_m = 4, .half_angle_rad = geo_rad(5)};
    struct answer a = rig_line(&q);
    CHECK_INT(a.state, ANSWER_UNKNOWN);
}

/* A direction's picture has room for two obstacles. With weak ones before it a wall blocks for as long as without. */
TEST(a_wall_blocks_for_as_long_as_without_weak_echoes_before_it)
{
    static const double at_m[] = {2, 3, 4, 8};
    for (int before = 0; before <= 3; before++) {
        struct beam_echoes beam = {.blind_m = 0.3f, .state = BEAM_ECHO, .free_to_m = 1.9f, .heard_to_m = 10};
        start(&usual);
        for (int i = 3 - before; i <= 3; i++)
            beam.echo[beam.n++] = (struct echo){.range_m = (float)at_m[i],
                                                .near_m = (float)at_m[i] - 0.02f,
                                                .sd_m = 0.01f,
                                                .confidence = i == 3 ? 0.9f : 0.3f};
        const struct echoes e = {.t_ns = now.now_ns,
                                 .n_beams = 1,
                                 .range_max_m = 20,
                                 .az_aperture_rad = (float)geo_rad(2),
                                 .el_aperture_rad = (float)geo_rad(25),
                                 .pose = now.pose,
                                 .beam = &beam};
        rig_enter(&e, &mount);
        CHECK_NEAR(ask(0, 10).range_m, at_m[3 - before], 0, 0.05);
        now.now_ns += 60 * SECOND; /* the weak ones have faded */
        CHECK_INT(ask(0, 10).state, ANSWER_BLOCKED);
        CHECK(ask(0, 10).range_m <= 8.05);
        now.now_ns += 30 * SECOND; /* and the wall */
        CHECK_INT(ask(0, 10).state, ANSWER_UNKNOWN);
    }
}

int main(void)
{
    RUN(a_wall_blocks_for_as_long_as_without_weak_echoes_before_it);
    RUN(nothing_pinged_is_unknown_everywhere);
    RUN(an_echo_blocks_beyond_it_and_the_water_before_it_is_clear);
    RUN(a_drift_before_a_ping_brings_no_echo_of_it_nearer);
    RUN(silence_is_worth_what_the_beam_claims_and_no_more);
    RUN(a_beam_that_claims_nothing_clears_nothing);
    RUN(clear_grows_stale_and_blocked_fades_but_never_to_clear);
    RUN(fading_is_the_closed_form_however_often_it_is_read);
    RUN(a_removed_obstacle_is_cleared_by_beams_that_pass_it);
    RUN(what_a_beam_may_have_missed_within_its_slack_stays);
    RUN(a_blurred_ping_has_its_echo_wherever_it_may_have_been);
    RUN(a_ping_that_was_dated_back_does_not_bring_the_centre_back);
    RUN(what_a_beam_may_have_missed_for_the_headings_drift_stays);
    RUN(a_marked_echo_blocks_until_the_next_look);
    RUN(an_unconfirmed_echo_blocks_once_a_second_one_shows_it);
    RUN(an_echo_of_the_vehicles_own_ends_free_water_and_never_blocks);
    RUN(what_came_when_another_sonar_was_due_blocks_once_a_third_one_shows_it);
    RUN(an_echo_of_the_vehicles_own_takes_water_back_whatever_its_beam_frees);
    RUN(a_pile_that_one_of_the_beams_over_it_hears_stays);
    RUN(an_old_clear_does_not_outlive_a_pile_that_came);
    RUN(doubtful_echoes_are_neither_blocked_nor_clear_beyond);
    RUN(an_unpinged_gap_is_unknown_though_its_neighbours_are_clear);
    RUN(a_wide_beam_blocks_its_whole_opening);
    RUN(once_given_an_attitude_the_grid_is_north_up);
    RUN(without_an_attitude_north_is_unknown);
    RUN(a_lost_pose_makes_all_unknown_and_pings_without_it_are_counted);
    RUN(after_a_withdrawal_the_axes_are_the_bodys_and_nothing_is_left);
    RUN(obstacles_come_nearer_as_the_vehicle_drives_and_nothing_drifts);
    RUN(a_long_way_moves_obstacles_to_a_new_anchor);
    RUN(cleared_water_is_unknown_once_the_vehicle_has_driven_on);
    RUN(nothing_that_was_clear_is_so_after_the_heading_jumped);
    RUN(a_full_pool_loses_certainty_not_obstacles);
    RUN(counts_and_logodds_saturate);
    RUN(an_obstacle_blocks_for_some_turns_of_a_slow_head);
    RUN(a_clock_that_jumps_back_does_no_harm);
    RUN(senseless_grids_are_refused_with_a_sentence);
    RUN(a_beam_that_hears_nothing_usable_takes_back_what_was_clear);
    RUN(a_ping_of_no_certain_place_takes_nothing_back);
    RUN(a_lost_sonar_makes_its_clear_water_unknown_at_once);
    RUN(a_head_that_hangs_low_does_not_see_the_water_before_the_bow);
    RUN(a_head_off_the_centre_clears_all_round_whatever_its_ring_down);
    RUN(what_was_free_ahead_stays_so_on_the_way_there);
    RUN(obstacles_come_nearer_by_a_way_in_a_wrong_direction);
    RUN(the_centre_follows_while_no_ping_comes);
    RUN(the_centre_does_not_follow_what_the_next_ping_must_judge);
    RUN(the_centre_does_not_go_back_to_a_pose_from_before_the_last_ping);
    RUN(a_place_far_off_for_a_moment_is_not_followed);
    RUN(beside_a_sector_that_was_wider_long_ago_nothing_is_free);
    RUN(what_a_deaf_sonar_takes_back_stays_so_however_well_its_bearing_was_known);
    RUN(a_sonar_that_stays_deaf_takes_back_what_it_points_at);
    RUN(the_gap_that_a_lost_ping_leaves_is_not_free);
    RUN(in_a_room_sectors_are_its_walls_and_never_clear_beyond);
    RUN(asking_for_more_never_turns_blocked_or_unknown_into_clear);
    RUN(a_level_grid_gives_the_same_ring);
    RUN(clear_lasts_for_one_and_a_half_turns);
    RUN(the_longest_turn_is_measured);
    RUN(a_single_echo_blocks_until_the_head_has_passed_again);
    RUN(a_sector_is_judged_as_far_as_it_is_asked_about);
    RUN(a_level_grid_on_a_vehicle_that_pitches_claims_only_what_the_fan_covers);
    return test_end();
}
