/* SPDX-License-Identifier: MIT */
/* test_drift_log - how far a vehicle may have gone that sends bounds of its speed, now and then, or late. */
#include "daemon/input/drift_log.h"
#include "tests/lib/test.h"

#define MS 1000000ull

static struct drift_log unseen;
static uint64_t seed;

static void start(double mps, double water_mps)
{
    memset(&unseen, 0, sizeof unseen);
    drift_log_set(&unseen, 1000 * MS,
                  &(struct pose_drift){.mps = mps, .bounded = water_mps >= 0, .water_mps = fmax(water_mps, 0)});
}

static double level_m(uint64_t ms)
{
    double m[DRIFT_WAYS];
    drift_log_at(&unseen, ms * MS, m);
    return m[DRIFT_LEVEL];
}

static bool bound(uint64_t ms, double mps)
{
    return drift_log_bound(&unseen, ms * MS, (const double[]){mps, 2 * mps});
}

TEST(what_a_bound_says_counts_with_the_water)
{
    double m[DRIFT_WAYS];
    start(2, 0.05);
    CHECK(bound(2000, 0.1)); /* the first says nothing of the time before */
    CHECK_NEAR(level_m(2000), 2, 1e-9, 0);
    for (uint64_t ms = 2050; ms <= 12000; ms += 50)
        CHECK(bound(ms, 0.1));
    CHECK_NEAR(level_m(12000), 2 + 10 * 0.15, 1e-9, 0);
    drift_log_at(&unseen, 12000 * MS, m);
    CHECK_NEAR(m[DRIFT_VERTICAL], 2 + 10 * 0.25, 1e-9, 0);
    CHECK(drift_log_in_use(&unseen, 12100 * MS));
    CHECK(!drift_log_in_use(&unseen, 12400 * MS));
    /* and no more than the vehicle ever does */
    CHECK(bound(12050, 9) && bound(12100, 9));
    CHECK_NEAR(level_m(12100) - level_m(12050), 0.1, 1e-9, 0);
}

TEST(where_none_comes_the_configuration_counts)
{
    start(2, 0);
    CHECK(bound(2000, 0.1) && bound(2050, 0.1));
    CHECK_NEAR(level_m(2350) - level_m(2050), 0.03, 1e-9, 0);
    CHECK_NEAR(level_m(3350) - level_m(2050), 2.03, 1e-9, 0);
    const double before_m = level_m(2050);
    CHECK(bound(3050, 0.1)); /* it says nothing of longer ago than DRIFT_LOG_LATE_NS */
    CHECK_NEAR(level_m(3050) - before_m, 0.03 + 2 * 0.7, 1e-9, 0);
    CHECK(!bound(3050, 0) && !bound(3000, 0));
    start(2, -1); /* nobody says how fast the water goes */
    CHECK(bound(2000, 0.1) && bound(2050, 0.1));
    CHECK_NEAR(level_m(3000), 4, 1e-9, 0);
    CHECK(!drift_log_in_use(&unseen, 2050 * MS));
}

/* What a ping was told before the bound came that covers it is never more than what it says. */
TEST(a_ping_that_came_first_is_not_newer_than_it_is)
{
    start(2, 0);
    CHECK(bound(2000, 0.5) && bound(2050, 0.5));
    const double ping_m = level_m(2090);
    CHECK(bound(2100, 0.1)); /* slower, all of a sudden */
    CHECK(level_m(2100) >= ping_m + 0.1 * 0.010 - 1e-12 && level_m(2090) >= ping_m - 1e-12);
    CHECK(bound(2150, 0.9));
    CHECK_NEAR(level_m(2150) - level_m(2100), 0.045, 1e-9, 0);
    CHECK(drift_log_uncertain_m(&unseen, 2150 * MS) == 0 && drift_log_uncertain_m(&unseen, 2200 * MS) > 0.01);
}

/* However they come, the drift of any time is never less than the vehicle went, nor falls. */
TEST(it_never_says_less)
{
    static double went_m[60001], told_m[60001];
    for (int world = 0; world < 20; world++) {
        double mps = 0.3, most = 0, was = 0;
        start(1, 0.05);
        went_m[1000] = 0;
        for (uint64_t ms = 1001; ms <= 60000; ms++) {
            mps = fmin(fmax(mps + (test_uniform(&seed) - 0.5) * 0.02, 0), 1);
            most = fmax(most, mps);
            went_m[ms] = went_m[ms - 1] + (mps + 0.05) / 1.05 * 1e-3;
            if (test_uniform(&seed) < 0.02) {
                bound(ms, most);
                most = mps;
            }
            told_m[ms] = level_m(ms);
            if (told_m[ms] < was)
                CHECK(false);
            was = told_m[ms];
        }
        for (uint64_t a = 1000; a < 60000; a += 97)
            for (uint64_t b = a; b <= 60000; b += 1013)
                CHECK(level_m(b) + drift_log_uncertain_m(&unseen, b * MS) - fmin(told_m[a], level_m(a)) >=
                      went_m[b] - went_m[a] - 1e-9);
    }
}

TEST(what_is_older_than_the_bounds_went_as_fast_as_ever)
{
    start(2, 0);
    for (uint64_t ms = 2000; ms <= 302000; ms += 50)
        bound(ms, 0.1);
    const double oldest_m = level_m(302000 - 50 * (DRIFT_LOG_BOUNDS - 1));
    CHECK_NEAR(level_m(302000) - oldest_m, 0.1 * 0.05 * (DRIFT_LOG_BOUNDS - 1), 1e-6, 0);
    CHECK_NEAR(oldest_m - level_m(302000 - 50 * (DRIFT_LOG_BOUNDS - 1) - 1000), 2, 1e-6, 0);
}

/* Of a time between two bounds it says neither more nor less than evenly: what was seen then would count as newer. */
TEST(between_two_bounds_it_goes_on_evenly)
{
    start(2, 0);
    CHECK(bound(2000, 0.1) && bound(2100, 0.1) && bound(2200, 0.3));
    for (uint64_t ms = 2000; ms <= 2100; ms += 100)
        CHECK_NEAR(level_m(ms + 25), 0.75 * level_m(ms) + 0.25 * level_m(ms + 100), 1e-9, 0);
}

TEST(a_bound_comes_and_holds_for_its_time)
{
    start(2, 0);
    CHECK(!drift_log_comes(&unseen, 500 * MS));
    CHECK(!drift_log_in_use(&unseen, 1100 * MS)); /* none has come */
    CHECK(!bound(900, 0.1));                      /* from before it was set up */
    CHECK(bound(2000, 0.1));
    CHECK(drift_log_comes(&unseen, 3000 * MS) && !drift_log_comes(&unseen, 3001 * MS));
    CHECK(drift_log_in_use(&unseen, 2300 * MS) && !drift_log_in_use(&unseen, 2301 * MS));
    CHECK_NEAR(drift_log_uncertain_m(&unseen, 2100 * MS), 0.1 * 15 * 0.1 / 2, 1e-9, 0);
    CHECK_NEAR(drift_log_uncertain_m(&unseen, 2300 * MS), 0.3 * (2 - 0.1), 1e-9, 0); /* no faster than ever */
    CHECK_NEAR(drift_log_uncertain_m(&unseen, 9000 * MS), 0.3 * (2 - 0.1), 1e-9, 0);
    start(2, -1); /* not believed, but told apart */
    CHECK(bound(2000, 0.1) && !bound(2000, 0.1) && !bound(1900, 0.1) && bound(2001, 0.1));
}

/* Between two times, with what the newest bound leaves uncertain; of before the first pose nothing is known. */
TEST(between_two_times_it_went_as_far_as_bounds_say)
{
    double m[DRIFT_WAYS];
    start(2, 0.05);
    drift_log_gone(&unseen, 2000 * MS, 3000 * MS, m);
    CHECK(isinf(m[DRIFT_LEVEL]) && isinf(m[DRIFT_VERTICAL])); /* none has come */
    for (uint64_t ms = 2000; ms <= 4000; ms += 50)
        CHECK(bound(ms, 0.1));
    drift_log_gone(&unseen, 3000 * MS, 3400 * MS, m);
    CHECK_NEAR(m[DRIFT_LEVEL], 0.4 * 0.15, 1e-9, 0);
    CHECK_NEAR(m[DRIFT_VERTICAL], 0.4 * 0.25, 1e-9, 0);
    drift_log_gone(&unseen, 3700 * MS, 4100 * MS, m);
    CHECK_NEAR(m[DRIFT_VERTICAL], 0.4 * 0.25 + 0.1 * 15 * 0.1 / 2, 1e-9, 0);
    start(2, -1); /* not believed */
    CHECK(bound(2000, 0.1) && bound(2050, 0.1));
    drift_log_gone(&unseen, 2000 * MS, 2050 * MS, m);
    CHECK(isinf(m[DRIFT_LEVEL]));
    drift_log_set(&unseen, 1000 * MS,
                  &(struct pose_drift){.mps = 2, .from_pose = true, .bounded = true, .water_mps = 0});
    drift_log_begin(&unseen, 3000 * MS);
    CHECK(bound(3000, 0.1) && bound(3050, 0.1));
    drift_log_gone(&unseen, 2950 * MS, 3050 * MS, m);
    CHECK(isinf(m[DRIFT_LEVEL]));
    drift_log_gone(&unseen, 3000 * MS, 3050 * MS, m);
    CHECK_NEAR(m[DRIFT_LEVEL], 0.05 * 0.1, 1e-9, 0);
}

/* One that goes level as fast as it ever does may yet speed up upward or downward, and the other way round. */
TEST(what_is_slow_may_speed_up_whatever_is_fast)
{
    for (int slow = 0; slow < DRIFT_WAYS; slow++) {
        double m[DRIFT_WAYS], mps[DRIFT_WAYS] = {2, 2};
        mps[slow] = 0.1;
        start(2, 0);
        CHECK(drift_log_bound(&unseen, 2000 * MS, mps) && drift_log_bound(&unseen, 2050 * MS, mps));
        drift_log_gone(&unseen, 2050 * MS, 2150 * MS, m);
        CHECK_NEAR(m[slow], 0.1 * 0.1 + 0.1 * 15 * 0.1 / 2, 1e-9, 0);
    }
}

/* A bound holds for 0.3 s. What comes then, until the next one, went as fast as ever. */
TEST(a_gap_between_bounds_is_spread_over_nothing_else)
{
    double m[DRIFT_WAYS];
    start(2, 0);
    CHECK(bound(2000, 0.1) && bound(2050, 0.1) && bound(3050, 0.1) && bound(3100, 0.1));
    drift_log_gone(&unseen, 2400 * MS, 2800 * MS, m);
    CHECK_NEAR(m[DRIFT_LEVEL], 0.4 * 2, 1e-9, 0);
    CHECK_NEAR(m[DRIFT_VERTICAL], 0.4 * 2, 1e-9, 0);
    drift_log_gone(&unseen, 2050 * MS, 2350 * MS, m);
    CHECK_NEAR(m[DRIFT_LEVEL], 0.3 * 0.1, 1e-9, 0);
}

int main(void)
{
    seed = test_seed();
    RUN(what_a_bound_says_counts_with_the_water);
    RUN(where_none_comes_the_configuration_counts);
    RUN(a_ping_that_came_first_is_not_newer_than_it_is);
    RUN(between_two_bounds_it_goes_on_evenly);
    RUN(a_bound_comes_and_holds_for_its_time);
    RUN(between_two_times_it_went_as_far_as_bounds_say);
    RUN(what_is_slow_may_speed_up_whatever_is_fast);
    RUN(a_gap_between_bounds_is_spread_over_nothing_else);
    RUN(it_never_says_less);
    RUN(what_is_older_than_the_bounds_went_as_fast_as_ever);
    return test_end();
}
