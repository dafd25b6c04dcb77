/* SPDX-License-Identifier: MIT */
/* test_depth_regions - regions of constant depth on stated scans, and against all windows tried one by one. */
#include "tests/lib/test.h"

#include "grid/sphere/depth_regions.h"

#define ROOM 64

static struct depth_region region[ROOM];
static double range_m[DEPTH_REGIONS_MAX];

static void fill(uint32_t n, double value)
{
    for (uint32_t i = 0; i < n; i++)
        range_m[i] = value;
}

TEST(a_circular_tank_is_one_region_all_around)
{
    fill(400, 3);
    CHECK_INT(depth_regions(range_m, 400, 0, 3, region, ROOM), 1);
    CHECK_INT(region[0].first, 0);
    CHECK_INT(region[0].n, 400);
    CHECK_NEAR(region[0].most_m - region[0].least_m, 0, 0, 0);
}

TEST(a_staircase_breaks_by_the_window_not_by_the_step)
{
    for (int i = 0; i < 100; i++)
        range_m[i] = 1 + 0.25 * i; /* exact in binary */
    /* one step of 0.25 fits into 0.25: two beams, which are too few */
    CHECK_INT(depth_regions(range_m, 100, 0.25, 3, region, ROOM), 0);
    /* four beams span 0.75 */
    CHECK_INT(depth_regions(range_m, 100, 0.75, 3, region, ROOM), 25);
    for (int k = 0; k < 25; k++) {
        CHECK_INT(region[k].first, 4 * k);
        CHECK_INT(region[k].n, 4);
    }
}

TEST(one_missing_beam_splits)
{
    fill(100, 3);
    range_m[40] = NAN;
    CHECK_INT(depth_regions(range_m, 100, 0.1, 3, region, ROOM), 1);
    CHECK_INT(region[0].first, 41); /* around the turn to 39 */
    CHECK_INT(region[0].n, 99);
    range_m[60] = INFINITY;
    CHECK_INT(depth_regions(range_m, 100, 0.1, 3, region, ROOM), 2);
    CHECK_INT(region[0].first, 61);
    CHECK_INT(region[0].n, 79);
    CHECK_INT(region[1].first, 41);
    CHECK_INT(region[1].n, 19);
    fill(100, NAN);
    CHECK_INT(depth_regions(range_m, 100, 0.1, 1, region, ROOM), 0);
}

/* Longest first and disjoint, from all windows of all places. */
static uint32_t slowly(uint32_t n, double window_m, uint32_t least_n, struct depth_region *out)
{
    bool taken[64] = {false};
    uint32_t found = 0;
    for (uint32_t length = n; length >= least_n; length--) {
        for (uint32_t first = 0; first < n; first++) {
            double lo = INFINITY, hi = -INFINITY;
            bool ok = true;
            for (uint32_t k = 0; k < length; k++) {
                const double r = range_m[(first + k) % n];
                ok &= isfinite(r) && !taken[(first + k) % n];
                lo = fmin(lo, r);
                hi = fmax(hi, r);
            }
            /* one more beam would still fit: no run of its own */
            const double next = range_m[(first + length) % n];
            const bool longer = length < n && isfinite(next) && fmax(hi, next) - fmin(lo, next) <= window_m;
            if (!ok || hi - lo > window_m || longer)
                continue;
            for (uint32_t k = 0; k < length; k++)
                taken[(first + k) % n] = true;
            out[found++] = (struct depth_region){first, length, lo, hi};
        }
    }
    return found;
}

TEST(random_scans_equal_all_windows_tried)
{
    uint64_t seed = test_seed();
    for (int round = 0; round < 3000; round++) {
        static struct depth_region want[64];
        const uint32_t n = 3 + (uint32_t)(test_random(&seed) % 40);
        double r = 5;
        for (uint32_t i = 0; i < n; i++) {
            r += 0.3 * (test_uniform(&seed) - 0.5);
            range_m[i] = test_random(&seed) % 16 ? r : NAN;
        }
        const uint32_t found = depth_regions(range_m, n, 0.3, 2, region, ROOM), wanted = slowly(n, 0.3, 2, want);
        CHECK_INT(found, wanted);
        for (uint32_t k = 0; k < found && k < wanted; k++) {
            CHECK_INT(region[k].first, want[k].first);
            CHECK_INT(region[k].n, want[k].n);
            CHECK_NEAR(region[k].least_m, want[k].least_m, 0, 0);
            CHECK_NEAR(region[k].most_m, want[k].most_m, 0, 0);
        }
    }
}

int main(void)
{
    RUN(a_circular_tank_is_one_region_all_around);
    RUN(a_staircase_breaks_by_the_window_not_by_the_step);
    RUN(one_missing_beam_splits);
    RUN(random_scans_equal_all_windows_tried);
    return test_end();
}
