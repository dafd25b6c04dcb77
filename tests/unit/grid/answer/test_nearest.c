/* SPDX-License-Identifier: MIT */
/* test_nearest - the nearest obstacle of a picture made by hand, against a plain search on random ones. */
#include "tests/lib/picture_rig.h"

#include "grid/answer/nearest.h"

static void start(bool ned)
{
    start_with(rings_full(&rings, geo_rad(4)), ned);
}

static void set(uint32_t d, double free_m, double near_m, double age_s)
{
    struct picture_entry e = {0};
    const uint64_t t_ns = NOW - (uint64_t)(age_s * 1e9);
    e.free[0] = (struct free_interval){.t_ping_ns = t_ns, .from_m = 0.3f, .to_m = (float)free_m};
    if (near_m > 0)
        e.obstacle[0] = (struct picture_obstacle){.t_ref_ns = t_ns,
                                                  .t_echo_ns = t_ns,
                                                  .logodds = 4,
                                                  .near_m = (float)near_m,
                                                  .range_m = (float)near_m + 0.1f,
                                                  .sd_m = 0.05f};
    picture_begin(&picture);
    picture_set(&picture, d, &e);
    picture_end(&picture);
}

static void all_free(double free_m)
{
    for (uint32_t d = 0; d < rings.n; d++)
        set(d, free_m, 0, 1);
}

static uint32_t at(double az_deg, double el_deg)
{
    return rings_index(&rings, geo_rad(az_deg), geo_rad(el_deg));
}

static struct nearest look(bool ned, double lo_deg, double hi_deg, double reach_m)
{
    const struct nearest_query q = {
        .ned = ned, .lo_rad = geo_rad(lo_deg), .hi_rad = geo_rad(hi_deg), .reach_m = reach_m};
    struct nearest n;
    nearest_look(&picture, &limits, &now, &q, &n);
    return n;
}

TEST(open_water_is_clear_and_what_was_never_pinged_is_not)
{
    start(false);
    CHECK_INT(look(false, -90, 90, 0).state, ANSWER_UNKNOWN);
    CHECK_NEAR(look(false, -90, 90, 0).unknown_share, 1, 1e-12, 0);
    all_free(20);
    CHECK_INT(look(false, -90, 90, 0).state, ANSWER_CLEAR);
    CHECK_NEAR(look(false, -90, 90, 0).unknown_share, 0, 1e-12, 0);
    set(at(50, 10), 5, 0, 1);
    CHECK_INT(look(false, -90, 90, 0).state, ANSWER_UNKNOWN);
    CHECK_INT(look(false, -90, 90, 0).reason, ANSWER_BEYOND);
    CHECK_NEAR(look(false, -90, 90, 0).unknown_share, 1.0 / rings.n, 1e-12, 0);
    CHECK_INT(look(false, -90, 90, 4.9).state, ANSWER_CLEAR);
    CHECK_INT(look(false, 20, 90, 0).state, ANSWER_CLEAR); /* it is not in that band */
    set(at(50, 10), 20, 0, 31);
    CHECK_INT(look(false, -90, 90, 0).reason, ANSWER_STALE);
}

TEST(the_nearest_one_with_its_place_and_age)
{
    start(false);
    all_free(20);
    set(at(30, 0), 3.9, 4, 2);
    set(at(200, 40), 2.4, 2.5, 7);
    struct nearest n = look(false, -90, 90, 0);
    CHECK_INT(n.state, ANSWER_BLOCKED);
    CHECK_NEAR(n.range_m, 2.6, 1e-6, 0);
    CHECK_NEAR(n.age_s, 7, 1e-6, 0);
    CHECK_NEAR(geo_deg(n.az_rad), 200, 4, 0);
    CHECK_NEAR(geo_deg(n.el_rad), 40, 4, 0);
    CHECK(n.confidence > 0.9 && n.confidence < 1);
    CHECK_NEAR(n.range_sd_m, 0.05, 1e-6, 0);
    n = look(false, -10, 10, 0);
    CHECK_NEAR(n.range_m, 4.1, 1e-6, 0);
    CHECK_INT(look(false, -10, 10, 3).state, ANSWER_CLEAR);
    CHECK_INT(look(false, -10, 10, 4.5).state, ANSWER_BLOCKED);
}

static struct nearest look_between(double from_deg, double to_deg, double lo_deg, double hi_deg, double reach_m)
{
    const struct nearest_query q = {.lo_rad = geo_rad(lo_deg),
                                    .hi_rad = geo_rad(hi_deg),
                                    .from_rad = geo_rad(from_deg),
                                    .width_rad = geo_wrap(geo_rad(to_deg - from_deg)),
                                    .reach_m = reach_m};
    struct nearest n;
    nearest_look(&picture, &limits, &now, &q, &n);
    return n;
}

/* What a fan sees ahead; astern nothing was ever pinged. */
TEST(between_two_bearings_only_what_is_there_counts)
{
    start(false);
    for (uint32_t d = 0; d < rings.n; d++)
        if (fabs(geo_deg(atan2(axis[d][1], axis[d][0]))) < 60)
            set(d, 20, 0, 1);
    CHECK_INT(look_between(0, 0, -10, 10, 5).state, ANSWER_UNKNOWN);
    CHECK_INT(look_between(-180, 180, -10, 10, 5).state, ANSWER_UNKNOWN);
    CHECK_INT(look_between(-50, 50, -10, 10, 5).state, ANSWER_CLEAR);
    CHECK_INT(look_between(310, 50, -10, 10, 5).state, ANSWER_CLEAR);
    CHECK_INT(look_between(50, 310, -10, 10, 5).state, ANSWER_UNKNOWN);
    CHECK_INT(look_between(-50, 62, -10, 10, 5).reason, ANSWER_NEVER); /* its edge is beside the fan */
    set(at(100, 0), 3.9, 4, 1);
    set(at(20, 0), 3.9, 4.5, 1);
    CHECK_NEAR(look_between(-180, 180, -10, 10, 0).range_m, 4.1, 1e-6, 0);
    CHECK_NEAR(look_between(-50, 50, -10, 10, 0).range_m, 4.6, 1e-6, 0);
    CHECK_INT(look_between(-50, 0, -10, 10, 5).state, ANSWER_CLEAR);
}

/* By their angles to half planes and to the vertical, not by sines. */
static bool between(const double v[3], double from, double width, double aside)
{
    const double past = geo_wrap(atan2(v[1], v[0]) - from), level = hypot(v[0], v[1]),
                 pole = atan2(level, fabs(v[2]));
    if (past <= width)
        return true;
    const double off = fmin(past - width, GEO_TURN - past);
    return (off < GEO_PI / 2 ? asin(level * sin(off)) : pole) <= aside;
}

TEST(angles_are_told_in_the_axes_asked_about)
{
    start(true);
    all_free(20);
    set(at(100, 0), 3.9, 4, 1);
    quat_from_rpy(0, 0, geo_rad(60), now.pose.attitude);
    CHECK_NEAR(geo_deg(look(true, -90, 90, 0).az_rad), 100, 4, 0);
    CHECK_NEAR(geo_deg(look(false, -90, 90, 0).az_rad), 40, 4, 0);
    now.pose_fresh = false;
    CHECK_INT(look(true, -90, 90, 0).reason, ANSWER_POSE_LOST);
    start(false);
    all_free(20);
    CHECK_INT(look(true, -90, 90, 0).reason, ANSWER_NO_FRAME);
}

static uint64_t state = 5;

static double uniform(double lo, double hi)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return lo + (hi - lo) * (double)(state >> 11) * 0x1p-53;
}

TEST(a_plain_search_finds_the_same)
{
    printf("seed %llu\n", (unsigned long long)state);
    uint32_t blocked = 0;
    for (int round = 0; round < 200; round++) {
        start(false);
        const double lo = uniform(-90, 80), hi = uniform(lo + 5, 90), reach_m = round % 2 ? uniform(1, 15) : 0;
        const double from = uniform(-360, 360), to = round % 4 < 2 ? from : uniform(-360, 360);
        const double width = round % 4 < 2 ? GEO_TURN : geo_wrap(geo_rad(to - from));
        double best_m = INFINITY, sin_lo = sin(geo_rad(lo)), sin_hi = sin(geo_rad(hi));
        for (uint32_t d = 0; d < rings.n; d++) {
            const double near_m = uniform(0, 1) < 0.002 ? (double)(float)uniform(0.5, 19) : 0;
            set(d, near_m > 0 ? near_m : 20, near_m, uniform(0, 20));
            if (near_m > 0 && -axis[d][2] >= sin_lo && -axis[d][2] <= sin_hi &&
                between(axis[d], geo_rad(from), width, geo_rad(4)) && (reach_m <= 0 || near_m <= reach_m))
                best_m = fmin(best_m, near_m);
        }
        const struct nearest n = look_between(from, to, lo, hi, reach_m);
        CHECK((n.state == ANSWER_BLOCKED) == (best_m < INFINITY));
        if (n.state == ANSWER_BLOCKED)
            CHECK_NEAR(n.range_m, best_m + 0.1, 1e-5, 0);
        blocked += n.state == ANSWER_BLOCKED;
    }
    CHECK(blocked > 50 && blocked < 190);
}

int main(void)
{
    RUN(open_water_is_clear_and_what_was_never_pinged_is_not);
    RUN(the_nearest_one_with_its_place_and_age);
    RUN(between_two_bearings_only_what_is_there_counts);
    RUN(angles_are_told_in_the_axes_asked_about);
    RUN(a_plain_search_finds_the_same);
    return test_end();
}
