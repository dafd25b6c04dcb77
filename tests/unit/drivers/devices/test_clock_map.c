/* SPDX-License-Identifier: MIT */
/*
 * The clock map against reference fits (tests/oracles/clock_*.csv), and on counters that wrap, repeat, jump, drift
 * and lie.
 */
#include "drivers/devices/clock_map.h"
#include "tests/lib/table.h"
#include "tests/lib/test.h"

#define MS     1000000ull
#define SECOND 1000000000ull
#define DAY_MS 86400000ull
#define SHIFT  10000000000000ll /* reference times begin before 0 */

static struct clock_map map;

static void begin(uint64_t wrap)
{
    clock_map_init(&map, wrap, MS);
}

/* Feed the samples of one case; the last one's place. */
static uint64_t feed_case(long wanted)
{
    struct table t = table_open("tests/oracles/clock_samples.csv");
    uint64_t placed_ns = 0;
    while (table_next(&t)) {
        if (table_int(&t, 0) != wanted)
            continue;
        if (table_int(&t, 2) == 0)
            begin(strtoull(t.field[1], NULL, 10));
        placed_ns =
            clock_map_put(&map, strtoull(t.field[3], NULL, 10), (uint64_t)(strtoll(t.field[4], NULL, 10) + SHIFT));
    }
    return placed_ns;
}

TEST(reference_fits)
{
    struct table t = table_open("tests/oracles/clock_fit.csv");
    int cases = 0;
    while (table_next(&t)) {
        const int64_t placed_ns = (int64_t)feed_case(table_int(&t, 0)) - SHIFT;
        const double at_first = (double)((int64_t)map.first_host_ns - SHIFT) + (double)map.line.late_ns -
                                map.drift * (double)map.line.device_ns;
        CHECK_INT(map.n, table_int(&t, 1));
        CHECK_INT(map.restarts, 0);
        CHECK_NEAR(map.drift, table_real(&t, 4) - 1.0, 0, 1e-12);
        CHECK_NEAR(at_first, table_real(&t, 5), 0, 1000);
        CHECK_NEAR(placed_ns, table_real(&t, 6), 0, 1000);
        cases++;
    }
    CHECK_INT(cases, 6);
}

/* Ticks of 100 ms across the end of the counter, for each of the counters that devices have. */
TEST(counters_wrap)
{
    static const uint64_t wrap[] = {1ull << 32, DAY_MS, 65536};
    for (size_t k = 0; k < sizeof wrap / sizeof wrap[0]; k++) {
        begin(wrap[k]);
        for (uint64_t i = 0; i < 100; i++) {
            const uint64_t t_ns = 50 * SECOND + i * 100 * MS;
            CHECK_INT(clock_map_put(&map, (wrap[k] - 5000 + i * 100) % wrap[k], t_ns), t_ns);
        }
        CHECK_INT(map.restarts + map.out_of_order, 0);
        CHECK_INT(map.last_ns, 9900 * MS);
    }
}

TEST(steps_that_are_no_steps)
{
    static const struct {
        const char *name;
        int64_t device_ms, host_ms; /* from the sample before */
        uint64_t restarts, out_of_order;
    } row[] = {
        {"on time", 100, 100, 0, 0},
        {"repeated", 0, 3, 0, 1},
        {"5 ms back", -5, 100, 0, 1},
        {"0.9 s back", -900, 90, 0, 1},
        {"1 h back", -3600000, 100, 1, 0},
        {"a day ahead", (int64_t)DAY_MS, 100, 1, 0},
        {"late by 0.9 s", 100, 1000, 0, 0},
        {"late by 1.1 s", 100, 1200, 1, 0},
        {"a pause of a minute", 60000, 60000, 0, 0},
        {"4 % off over 5 s", 4800, 5000, 0, 0},
        {"4 % off over a minute", 57600, 60000, 1, 0},
        {"6 % off over a minute", 56000, 60000, 1, 0},
        {"host 50 ms back", 100, -50, 0, 0},
        {"host 2 s back", 100, -2000, 1, 0},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        begin(1ull << 32);
        for (uint64_t k = 0; k < 10; k++)
            clock_map_put(&map, 10000000 + k * 100, 100 * SECOND + k * 100 * MS);
        const uint64_t host_ns = (uint64_t)((int64_t)(100 * SECOND + 900 * MS) + row[i].host_ms * (int64_t)MS);
        const uint64_t t_ns = clock_map_put(&map, (uint64_t)(10000900 + row[i].device_ms), host_ns);
        if (map.restarts != row[i].restarts || map.out_of_order != row[i].out_of_order || t_ns > host_ns ||
            (row[i].restarts && (map.n != 1 || t_ns != host_ns))) {
            printf("%s: %" PRIu64 " restarts, %" PRIu64 " out of order, at %" PRIu64 "\n", row[i].name,
                   map.restarts, map.out_of_order, t_ns);
            CHECK(false);
        }
    }
}

TEST(an_older_counter_is_placed_where_it_belongs)
{
    begin(65536);
    for (uint64_t k = 0; k < 10; k++)
        clock_map_put(&map, 65500 + k * 100, SECOND + k * 100 * MS);
    CHECK_INT(clock_map_put(&map, (65500 + 850) % 65536, SECOND + 950 * MS), SECOND + 850 * MS);
}

TEST(one_two_and_three_samples)
{
    begin(1ull << 32);
    CHECK_INT(clock_map_put(&map, 7, 5 * SECOND), 5 * SECOND);
    CHECK(map.drift == 0.0);
    clock_map_put(&map, 1007, 6 * SECOND + 100000); /* 100 ppm */
    CHECK_NEAR(map.drift, 100e-6, 1e-9, 0);
    clock_map_put(&map, 2007, 7 * SECOND + 900000); /* this frame waited */
    CHECK_NEAR(map.drift, 100e-6, 1e-9, 0);
    CHECK_INT(map.n, 3);
}

/* Far apart in delay and near in time: a drift that no clock has is limited while it may be delays. */
TEST(delays_are_not_taken_for_drift)
{
    begin(1ull << 32);
    clock_map_put(&map, 0, SECOND);
    const uint64_t t_ns = clock_map_put(&map, 100, SECOND + 130 * MS);
    CHECK_NEAR(map.drift, CLOCK_MAP_DRIFT, 1e-12, 0);
    CHECK_NEAR(t_ns, SECOND + 100 * MS, 0, 50001);
    CHECK_INT(map.restarts, 0);
}

TEST(drift_within_and_beyond_the_limit)
{
    static const struct {
        double drift;
        bool restarts;
    } row[] = {{0.0, false}, {500e-6, false}, {-500e-6, false}, {2000e-6, true}, {-2000e-6, true}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        begin(1ull << 32);
        for (uint64_t k = 0; k < 600; k++) {
            const double host_ns = 1e12 + (double)(k * 100 * MS) * (1.0 + row[i].drift);
            clock_map_put(&map, k * 100, (uint64_t)llrint(host_ns));
        }
        CHECK_INT(map.restarts > 0, row[i].restarts);
        if (!row[i].restarts)
            CHECK_NEAR(map.drift, row[i].drift, 0, 1e-9);
    }
}

/* Delays of 2 ms and up to 40 ms more, a crystal 80 ppm off: what remains is the constant part. */
TEST(random_delays_leave_the_constant_one)
{
    uint64_t seed = test_seed();
    double worst_ns = 0.0;
    begin(DAY_MS);
    for (uint64_t k = 0; k < 20000; k++) {
        const uint64_t true_ns = 3 * SECOND + (uint64_t)((double)(k * 50 * MS) * (1.0 + 80e-6));
        const double wait_ms = test_uniform(&seed) < 0.3 ? 0.0 : 40.0 * test_uniform(&seed);
        const uint64_t host_ns = true_ns + 2 * MS + (uint64_t)(wait_ms * 1e6);
        const uint64_t t_ns = clock_map_put(&map, (DAY_MS - 77777 + k * 50) % DAY_MS, host_ns);
        CHECK(t_ns <= host_ns);
        if (k > 200)
            worst_ns = fmax(worst_ns, fabs((double)t_ns - (double)(true_ns + 2 * MS)));
    }
    printf("# worst after 200 samples: %.0f ns\n", worst_ns);
    CHECK(worst_ns < 10000.0);
    CHECK_INT(map.restarts + map.out_of_order, 0);
}

/* A frequency that changes slowly is followed: old pairs leave the window. */
TEST(old_pairs_are_forgotten)
{
    double host_ns = 1e9;
    begin(1ull << 32);
    for (uint64_t k = 0; k < 4000; k++) {
        const double drift = k < 2000 ? 100e-6 : -100e-6;
        host_ns += 200e6 * (1.0 + drift);
        clock_map_put(&map, k * 200, (uint64_t)host_ns);
    }
    CHECK_NEAR(map.drift, -100e-6, 0, 1e-9);
    CHECK(map.sample[map.n - 1].device_ns - map.sample[0].device_ns <= CLOCK_MAP_WINDOW_NS);
}

/* A capture may say that it is from the year 2262. The sums are held to by the undefined behaviour sanitizer. */
TEST(the_last_times_that_there_are_do_not_overflow)
{
    const uint64_t last_ns = INT64_MAX,
                   starts[] = {last_ns - 2 * SECOND, last_ns, last_ns + SECOND, UINT64_MAX - 2 * SECOND};
    for (size_t i = 0; i < sizeof starts / sizeof starts[0]; i++) {
        begin(1u << 31);
        for (uint64_t k = 0; k < 10; k++) {
            const uint64_t host_ns = starts[i] + k * SECOND / 10;
            const uint64_t placed_ns = clock_map_put(&map, k * 190, host_ns);
            CHECK(placed_ns <= host_ns && placed_ns >= starts[i] - SECOND);
        }
    }
}

/* Steps of the counter as large as can be, for as long as there is time. */
TEST(sums_of_steps_do_not_overflow)
{
    const uint64_t step_ms = (1ull << 41) - 1;
    begin(1ull << 42);
    for (uint64_t k = 0; k < 8; k++) {
        const uint64_t host_ns = k * step_ms * MS;
        CHECK(clock_map_put(&map, k * step_ms, host_ns) <= host_ns);
    }
}

TEST(any_numbers_are_borne)
{
    uint64_t seed = test_seed();
    static const uint64_t wrap[] = {2, 3, 65536, 1ull << 32};
    for (int k = 0; k < 40; k++) {
        uint64_t host_ns = test_random(&seed) >> 3;
        begin(wrap[k % 4]);
        for (int i = 0; i < 500; i++) {
            const uint64_t kind = test_random(&seed) % 8;
            host_ns = kind == 0   ? test_random(&seed) >> 2
                      : kind == 1 ? 0
                                  : host_ns / 2 * 2 + test_random(&seed) % (200 * MS);
            host_ns &= (1ull << 62) - 1;
            CHECK(clock_map_put(&map, test_random(&seed) >> (test_random(&seed) % 64), host_ns) <= host_ns);
            CHECK(map.n >= 1 && map.n <= CLOCK_MAP_SAMPLES && fabs(map.drift) <= CLOCK_MAP_DRIFT);
        }
    }
}

int main(void)
{
    RUN(reference_fits);
    RUN(counters_wrap);
    RUN(steps_that_are_no_steps);
    RUN(an_older_counter_is_placed_where_it_belongs);
    RUN(one_two_and_three_samples);
    RUN(delays_are_not_taken_for_drift);
    RUN(drift_within_and_beyond_the_limit);
    RUN(random_delays_leave_the_constant_one);
    RUN(old_pairs_are_forgotten);
    RUN(the_last_times_that_there_are_do_not_overflow);
    RUN(sums_of_steps_do_not_overflow);
    RUN(any_numbers_are_borne);
    return test_end();
}
