/* SPDX-License-Identifier: MIT */
/* test_drift - what wedges are worth after a drift: fans, sweeps, gaps, turns, tilts, wide beams. */
#include "tests/lib/test.h"

#include <math.h>
#include <stdlib.h>

#include "grid/geometry.h"
#include "grid/sphere/drift.h"

#define STEP_RAD geo_rad(2)

static struct wedges wedges;
static struct drift drift;
static double place_m[3], deeper_m; /* of the next pings: where they are sent, and the drift in depth by then */

static void begin(void)
{
    memset(place_m, 0, sizeof place_m);
    deeper_m = 0;
    free(wedges.ping);
    free(drift.look);
    wedges_init(&wedges, malloc(wedges_bytes()));
    drift_init(&drift, malloc(drift_bytes()));
}

/* A ping of `n` beams so wide from az on, which find the water free from 0.5 m to to_m, after a drift of drift_m. */
static void ping(double az_deg, int n, double wide_deg, double to_m, double drift_m, double roll_deg)
{
    static uint64_t t_ns;
    struct wedge_ping p = {
        .t_ns = ++t_ns, .drift_m = {drift_m, deeper_m}, .place_m = {place_m[0], place_m[1], place_m[2]}};
    quat_from_rpy(geo_rad(roll_deg), 0, 0, p.attitude);
    wedges_begin(&wedges, &p);
    for (int i = 0; i < n; i++)
        wedges_add(&wedges, &(struct wedge){.az_rad = (float)geo_rad(az_deg + i * wide_deg),
                                            .half_az_rad = (float)geo_rad(wide_deg / 2),
                                            .from_m = 0.5F,
                                            .to_m = (float)to_m,
                                            .side_to_m = (float)to_m,
                                            .edge_from_m = 0.5F,
                                            .edge_to_m = (float)to_m,
                                            .kind = WEDGE_FREE});
    wedges_end(&wedges, 0);
}

/* Of the look at this azimuth; the last such. */
static bool judge(double az_deg, double drift_m, struct drift_worth *worth)
{
    const double now_m[2] = {drift_m, 0};
    for (uint32_t i = drift_gather(&drift, &wedges, now_m, 100, STEP_RAD); i > 0; i--)
        if (fabs(geo_deg((double)drift.look[i - 1].az_rad) - az_deg) < 0.01)
            return drift_judge(&drift, &wedges, now_m, i - 1, worth);
    test_case_failed = true;
    return false;
}

TEST(a_fan_is_shorter_at_both_ends_and_narrower)
{
    struct drift_worth w;
    begin();
    ping(-40, 41, 2, 10, 0, 0);
    CHECK(judge(0, 1, &w));
    CHECK_NEAR(w.water.to_m, 9, 1e-6, 0);
    CHECK_NEAR(w.water.from_m, 1.5, 0.06, 0); /* 40 degrees to each side: enough from 1.56 m on */
    CHECK(judge(30, 1, &w));
    CHECK_NEAR(w.water.from_m, 1 / sin(geo_rad(10)), 1e-3, 0); /* 10 degrees are left to the edge */
    CHECK(!judge(40, 1, &w));
    CHECK(!judge(0, 9.6, &w));
}

TEST(an_echo_beside_ends_what_is_as_near)
{
    struct drift_worth w;
    begin();
    /* a fan whose beams beyond 10 degrees hear something at 2 m */
    struct wedge_ping p = {.t_ns = 1, .attitude = {1, 0, 0, 0}};
    wedges_begin(&wedges, &p);
    for (int i = -20; i <= 20; i++)
        wedges_add(&wedges, &(struct wedge){.az_rad = (float)geo_rad(2 * i),
                                            .half_az_rad = (float)geo_rad(1),
                                            .to_m = i > 5 ? 2 : 10,
                                            .side_to_m = i > 5 ? 2 : 10,
                                            .edge_to_m = i > 5 ? 2 : 10,
                                            .kind = WEDGE_FREE});
    wedges_end(&wedges, 0);
    CHECK(judge(0, 1, &w));
    CHECK_NEAR(w.water.to_m, 9, 1e-6, 0);
    CHECK(w.water.from_m >= 1 / sin(geo_rad(12))); /* nearer, what is at 2 m beside may be here */
}

/* Each beam a little later than the one before. */
static void sweep(double from_deg, double to_deg, double wide_deg, double step_deg, double drift_each_m)
{
    double drift_m = 0;
    for (double az = from_deg; step_deg > 0 ? az <= to_deg : az >= to_deg; az += step_deg, drift_m += drift_each_m)
        ping(az, 1, wide_deg, 10, drift_m, 0);
}

TEST(a_sweep_frees_what_it_has_passed_on_both_sides)
{
    struct drift_worth w;
    begin();
    sweep(-40, 40, 2, 1, 0.01);
    CHECK(judge(0, 0.8, &w));
    /* the run from 12 degrees before: 0.52 m ago */
    CHECK(w.water.to_m < 9.61 && w.water.to_m > 9.5);
    CHECK(w.water.from_m > 1.2 && w.water.from_m < 3);
    CHECK(!judge(40, 0.8, &w)); /* behind the newest beam nobody has looked */
}

TEST(a_gap_ends_a_run)
{
    struct drift_worth whole, torn;
    begin();
    sweep(-40, 40, 2, 1, 0.01);
    CHECK(judge(-6, 0.8, &whole));
    begin();
    sweep(-40, 0, 2, 1, 0.01);
    ping(3, 1, 2, 10, 0.44, 0);
    for (double az = 4; az <= 40; az++)
        ping(az, 1, 2, 10, 0.4 + 0.01 * az, 0);
    CHECK(judge(-6, 0.8, &torn));
    CHECK(torn.water.from_m > whole.water.from_m + 1);
}

TEST(beams_that_just_touch_let_something_slip_through)
{
    struct drift_worth w;
    begin();
    sweep(-40, 40, 1, 1, 0.01);
    CHECK(!judge(0, 0.8, &w));
    begin();
    sweep(-40, 40, 1.25, 1, 0.01);
    CHECK(judge(0, 0.8, &w));
    CHECK(w.water.from_m >= 0.01 / sin(geo_rad(0.25)));
}

/* The sensor goes so far between two pings, along each axis and by drift in depth: from where on what beams free that
 * overlap by a quarter of a degree is free. */
static double free_from_m(double roll_deg, double ahead_m, double aside_m, double down_m, double adrift_m)
{
    struct drift_worth w;
    begin();
    for (int i = 0; i <= 80; i++) {
        place_m[0] = i % 2 ? ahead_m : 0;
        place_m[1] = i % 2 ? aside_m : 0;
        place_m[2] = i % 2 ? down_m : 0;
        deeper_m = i * adrift_m;
        ping(i - 40, 1, 1.25, 10, 0.01 * i, roll_deg);
    }
    return judge(0, 0.8, &w) ? w.water.from_m : INFINITY;
}

/* Nothing gets past the edge between two beams by what the sensor does along it: a level head's is upright. */
TEST(only_what_goes_across_the_edge_lets_something_slip_through)
{
    const double still_m = free_from_m(0, 0, 0, 0, 0), slips_m = 0.01 / sin(geo_rad(0.25));
    CHECK(still_m > 0.01 / sin(geo_rad(0.25)) && still_m < slips_m + 1);
    CHECK_NEAR(free_from_m(0, 0, 0, 0.003, 0), still_m, 0.01, 0); /* a depth sensor's noise */
    CHECK_NEAR(free_from_m(0, 0, 0, 0, 0.003), still_m, 0.01, 0); /* nor drift in depth */
    CHECK(free_from_m(0, 0.003, 0, 0, 0) < still_m + 0.2);        /* other beams of the run point a little aside */
    const double more_m = 0.9 * 0.003 / sin(geo_rad(0.25));
    CHECK(free_from_m(0, 0, 0.003, 0, 0) > still_m + more_m);
    /* a head on its side: its edges lie level */
    CHECK(free_from_m(90, 0, 0, 0.003, 0) > still_m + more_m);
    CHECK(free_from_m(90, 0, 0, 0, 0.003) > still_m + more_m);
    CHECK_NEAR(free_from_m(90, 0, 0.003, 0, 0), still_m, 0.01, 0);
}

TEST(a_head_that_turns_back_begins_another_run)
{
    struct drift_worth w;
    begin();
    sweep(-40, 0, 2, 1, 0);
    sweep(-1, -40, 2, -1, 0);
    CHECK(!judge(0, 1, &w));
    CHECK(judge(-20, 1, &w));
    CHECK_NEAR(w.water.from_m, 1 / sin(geo_rad(20)), 0.1, 0);
}

TEST(a_wide_beam_frees_its_middle)
{
    struct drift_worth w;
    begin();
    ping(0, 1, 30, 10, 0, 0);
    CHECK(judge(0, 0.5, &w));
    CHECK_NEAR(w.water.from_m, 0.5 / sin(geo_rad(14)), 1e-3, 0);
    CHECK_NEAR(w.water.to_m, 9.5, 1e-6, 0);
}

TEST(a_sweep_of_wide_beams_frees_as_one_of_narrow_ones)
{
    struct drift_worth w;
    begin();
    sweep(-40, 40, 6, 2.5, 0.01);
    CHECK(judge(0, 0.4, &w));
    CHECK(w.water.from_m < 2 && w.water.to_m > 9.7);
}

TEST(beams_tilted_against_each_other_are_less_high_together)
{
    struct drift_worth w;
    begin();
    for (int i = -20; i <= 20; i++)
        ping(i, 1, 2, 10, 0, 0.2 * i);
    CHECK(judge(0, 0.5, &w));
    CHECK(w.tilt_rad > 0 && w.tilt_rad <= geo_rad(0.2 * 20) + 1e-6);
}

TEST(no_usable_signal_ends_a_run)
{
    struct drift_worth w;
    begin();
    sweep(-10, -1, 2, 1, 0);
    struct wedge_ping p = {.t_ns = 1000, .attitude = {1, 0, 0, 0}};
    wedges_begin(&wedges, &p);
    wedges_add(&wedges, &(struct wedge){.half_az_rad = (float)geo_rad(1), .to_m = 10, .kind = WEDGE_UNKNOWN});
    wedges_end(&wedges, 0);
    sweep(1, 10, 2, 1, 0);
    CHECK(!judge(1, 0.5, &w));
}

TEST(of_more_looks_than_there_is_room_for_the_newest_count)
{
    const double now_m[2] = {0.1, 0};
    begin();
    for (int i = 0; i < 300; i++)
        ping(0, 1, 30, 10, 0, 0); /* 16 looks each */
    CHECK_INT(drift_gather(&drift, &wedges, now_m, 100, STEP_RAD), DRIFT_LOOKS / 16 * 16);
    CHECK_INT(drift.look[drift.n - 1].ping, 299);
    CHECK_INT(drift_gather(&drift, &wedges, now_m, 0.05, STEP_RAD), 0);
}

int main(void)
{
    RUN(a_fan_is_shorter_at_both_ends_and_narrower);
    RUN(an_echo_beside_ends_what_is_as_near);
    RUN(a_sweep_frees_what_it_has_passed_on_both_sides);
    RUN(a_gap_ends_a_run);
    RUN(beams_that_just_touch_let_something_slip_through);
    RUN(only_what_goes_across_the_edge_lets_something_slip_through);
    RUN(a_head_that_turns_back_begins_another_run);
    RUN(a_wide_beam_frees_its_middle);
    RUN(a_sweep_of_wide_beams_frees_as_one_of_narrow_ones);
    RUN(beams_tilted_against_each_other_are_less_high_together);
    RUN(no_usable_signal_ends_a_run);
    RUN(of_more_looks_than_there_is_room_for_the_newest_count);
    return test_end();
}
