/* SPDX-License-Identifier: MIT */
/*
 * test_heading - a heading that drifts: every answer counts what was observed beside what is asked about, as far as it
 * may lie there by now, on a picture made by hand.
 */
#include "tests/lib/picture_rig.h"
#include "tests/lib/way_rig.h"

#include "grid/answer/sight.h"

#define AT_M 5.0
#define TO_M 8.0

/* An obstacle in one direction. */
static void start(bool ned, double az_deg, double el_deg)
{
    start_with(rings_full(&rings, geo_rad(3)), ned);
    const struct picture_entry e = {.obstacle[0] = {.t_ref_ns = NOW - SECOND,
                                                    .t_echo_ns = NOW - SECOND,
                                                    .logodds = 4,
                                                    .near_m = (float)AT_M,
                                                    .range_m = (float)AT_M,
                                                    .sd_m = 0.05f}};
    picture_begin(&picture);
    picture_set(&picture, rings_index(&rings, geo_wrap(geo_rad(az_deg)), geo_rad(el_deg)), &e);
    picture_end(&picture);
}

/* Drifts so far within the time that water counts as clear. */
static void drift(double deg)
{
    now.pose.heading_radps = geo_rad(deg) / limits.clear_for_s;
}

enum { CONE, LINE, SECTORS, CORRIDOR, ASKED };
static const char *const names[ASKED] = {"cone", "corridor", "sectors", "limit"};

/* Is nothing ahead, in these axes? */
static bool is_empty(int what, bool ned)
{
    const struct obstacles_query
        line = {.line = {.ned = ned,
                         .distance_m = TO_M,
                         .corridor = what == LINE,
                         .half_angle_rad = geo_rad(3),
                         .radius_m = 0.3}},
        band = {.around = true,
                .band = {.ned = ned, .lo_rad = geo_rad(-3), .hi_rad = geo_rad(3), .reach_m = TO_M, .count = 60}};
    const struct corridor_query way = {.body = {.radius_m = 0.2, .half_height_m = 0.2, .margin_m = 0.1},
                                       .direction = {1, 0, 0},
                                       .ned = ned,
                                       .most_m = TO_M,
                                       .near_m = 0.7};
    static struct obstacles_found found[60];
    if (what == CORRIDOR)
        return isinf(find_in_way(&picture, &limits, &now, &way).near_m);
    find_obstacles(&picture, &limits, &now, what == SECTORS ? &band : &line, found);
    return !found[0].any || found[0].near_m > TO_M;
}

static void check_all(bool ned, double drift_deg, bool empty)
{
    for (int what = 0; what < ASKED; what++) {
        drift(drift_deg);
        if (is_empty(what, ned) != empty) {
            printf("%s, %s, with %g degrees of drift: not %s\n", names[what], ned ? "NED" : "body", drift_deg,
                   empty ? "empty" : "blocked");
            test_case_failed = true;
        }
    }
}

/* From the edge of all that is asked it is some 9 degrees off. */
TEST(what_is_beside_counts_as_far_as_the_heading_may_have_drifted)
{
    for (int ned = 0; ned < 2; ned++)
        for (int side = -1; side <= 1; side += 2) {
            start(true, 15 * side, 0);
            check_all(ned, 0, true);
            check_all(ned, 3, true);
            check_all(ned, 14, false);
        }
}

TEST(a_heading_takes_nothing_up_or_down)
{
    for (int ned = 0; ned < 2; ned++)
        for (int side = -1; side <= 1; side += 2) {
            start(true, 0, 15 * side);
            check_all(ned, 14, true);
        }
}

/* Nobody told an attitude: what is asked and what was observed are in the same axes, whatever becomes of them. */
TEST(without_an_attitude_there_is_no_heading_to_drift)
{
    start(false, 15, 0);
    check_all(false, 14, true);
}

/* Of a body that is tilted the heading's axis lies aslant. */
TEST(a_tilted_body_sees_it_rise)
{
    start(true, 90, 15);
    quat_from_rpy(0, geo_rad(15), 0, now.pose.attitude);
    check_all(false, 0, true);
    start(true, 14, -15);
    quat_from_rpy(0, geo_rad(-15), 0, now.pose.attitude);
    check_all(false, 0, true);
    check_all(false, 14, false);
}

TEST(a_place_is_known_worse_by_the_way_in_a_wrong_direction)
{
    struct picture_frame frame;
    struct sight_place place;
    start(true, 15, 0);
    picture_get_frame(&picture, &frame);
    now.pose.position_m[0] = 0.08;
    sight_locate(&frame, &limits, &now, &place);
    CHECK_NEAR(place.uncertain_m, 0, 1e-12, 0);
    drift(10);
    sight_locate(&frame, &limits, &now, &place);
    CHECK_NEAR(place.adrift_rad, geo_rad(10), 1e-12, 0);
    CHECK_NEAR(place.uncertain_m, 0.08 * geo_rad(10), 1e-12, 0);
    drift(400);
    sight_locate(&frame, &limits, &now, &place);
    CHECK_NEAR(place.adrift_rad, GEO_PI, 1e-12, 0); /* then it may lie anywhere around */
}

TEST(a_direction_swings_towards_what_is_asked_and_no_farther)
{
    const struct sight_place place = {
        .adrift_rad = geo_rad(10), .adrift_cos = cos(geo_rad(10)), .adrift_sin = sin(geo_rad(10))};
    static const double az_deg[][3] = {{30, 0, 20}, {-30, 0, -20}, {6, 0, 0}, {175, -175, -175}, {160, -160, 170}};
    for (size_t i = 0; i < sizeof az_deg / sizeof az_deg[0]; i++) {
        double v[3], to[3], want[3];
        geo_direction(geo_rad(az_deg[i][0]), 0.4, v);
        geo_direction(geo_rad(az_deg[i][1]), -0.2, to);
        geo_direction(geo_rad(az_deg[i][2]), 0.4, want);
        sight_swing(&place, to, v);
        for (int k = 0; k < 3; k++)
            CHECK_NEAR(v[k], want[k], 0, 1e-12);
    }
}

int main(void)
{
    RUN(what_is_beside_counts_as_far_as_the_heading_may_have_drifted);
    RUN(a_heading_takes_nothing_up_or_down);
    RUN(without_an_attitude_there_is_no_heading_to_drift);
    RUN(a_tilted_body_sees_it_rise);
    RUN(a_place_is_known_worse_by_the_way_in_a_wrong_direction);
    RUN(a_direction_swings_towards_what_is_asked_and_no_farther);
    return test_end();
}
