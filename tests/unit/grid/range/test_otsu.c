/* SPDX-License-Identifier: MIT */
/*
 * test_otsu - thresholds against the reference tables, against every partition tried by hand, and on histograms that
 * are hard: empty, symmetric, huge.
 */
#include "tests/lib/table.h"
#include "tests/lib/test.h"

#include "grid/range/otsu.h"
#include "grid/range/u128.h"

#define CASES 32

static uint64_t histogram[CASES][256];
static char name[CASES][32];
static int n_cases;

static void read_histograms(void)
{
    struct table t = table_open("tests/oracles/otsu_hist.csv");
    while (table_next(&t)) {
        const long k = table_int(&t, 0);
        if (t.field[2][0])
            histogram[k][table_int(&t, 2)] = strtoull(t.field[3], NULL, 10);
    }
}

TEST(two_classes_equal_the_table)
{
    struct table t = table_open("tests/oracles/otsu.csv");
    while (table_next(&t)) {
        const long k = table_int(&t, 0);
        uint8_t got = 0;
        snprintf(name[k], sizeof name[k], "%s", t.field[1]);
        n_cases++;
        const bool found = otsu_two(histogram[k], &got);
        if (found == (table_int(&t, 4) == 1) || (found && got != table_int(&t, 5))) {
            printf("two classes of %s: %d %d, expected %s\n", name[k], found, got, t.field[5]);
            test_case_failed = true;
        }
    }
    CHECK_INT(n_cases, 24);
}

TEST(three_classes_equal_the_table)
{
    struct table t = table_open("tests/oracles/multiotsu3.csv");
    while (table_next(&t)) {
        const long k = table_int(&t, 0);
        uint8_t got[2] = {0, 0};
        const bool found = otsu_three(histogram[k], got);
        if (found == (table_int(&t, 4) == 1) ||
            (found && (got[0] != table_int(&t, 5) || got[1] != table_int(&t, 7)))) {
            printf("three classes of %s: %d %d %d, expected %s %s\n", name[k], found, got[0], got[1], t.field[5],
                   t.field[7]);
            test_case_failed = true;
        }
    }
}

/* I3 */
TEST(counts_times_2_to_the_22_have_the_same_thresholds)
{
    for (int k = 0; k < n_cases; k++) {
        uint64_t big[256], total = 0;
        uint8_t a[3] = {0}, b[3] = {0};
        for (int v = 0; v < 256; v++) {
            big[v] = histogram[k][v] << 22;
            total += big[v];
        }
        if (total > OTSU_MAX_TOTAL)
            continue;
        CHECK_INT(otsu_two(big, &b[0]), otsu_two(histogram[k], &a[0]));
        CHECK_INT(otsu_three(big, b + 1), otsu_three(histogram[k], a + 1));
        CHECK(memcmp(a, b, 3) == 0);
    }
}

/* ---- every partition, exactly: J * product of the class sizes, in integers that the small counts allow ---- */

struct sums {
    uint64_t w, s;
};

static struct sums sums_of(const uint64_t h[256], int from, int to)
{
    struct sums x = {0, 0};
    for (int v = from; v < to; v++) {
        x.w += h[v];
        x.s += h[v] * (uint64_t)v;
    }
    return x;
}

/* a[0] / a[1] > b[0] / b[1]? */
static bool more(const uint64_t a[2], const uint64_t b[2])
{
    return u128_less(u128_product(b[0], a[1]), u128_product(a[0], b[1]));
}

static bool try_all(const uint64_t h[256], bool three, uint8_t best_t[2])
{
    uint64_t best[2] = {0, 1};
    bool found = false;
    for (int t = 0; t < 255; t++)
        for (int u = three ? t + 1 : t; u < (three ? 255 : t + 1); u++) {
            const struct sums a = sums_of(h, 0, t + 1), c = sums_of(h, u + 1, 256);
            const struct sums b = three ? sums_of(h, t + 1, u + 1) : (struct sums){1, 0};
            if (h[t] == 0 || h[u] == 0 || a.w == 0 || b.w == 0 || c.w == 0)
                continue;
            /* 36 pixels of at most 220: nothing here has more than 50 bits */
            const uint64_t j[2] = {a.s * a.s * b.w * c.w + b.s * b.s * a.w * c.w + c.s * c.s * a.w * b.w,
                                   a.w * b.w * c.w};
            if (!found || more(j, best)) {
                memcpy(best, j, sizeof best);
                best_t[0] = (uint8_t)t;
                best_t[1] = (uint8_t)u;
                found = true;
            }
        }
    return found;
}

TEST(random_histograms_equal_every_partition_tried)
{
    uint64_t random = test_seed();
    for (int round = 0; round < 300; round++) {
        uint64_t h[256] = {0};
        const unsigned kinds = 1 + (unsigned)(test_random(&random) % 12);
        const unsigned gap = 1 + (unsigned)(test_random(&random) % 20);
        for (unsigned i = 0; i < kinds; i++)
            h[(test_random(&random) % 12) * gap] += 1 + test_random(&random) % 3;
        uint8_t got[2] = {0, 0}, want[2] = {0, 0};
        CHECK_INT(otsu_two(h, got), try_all(h, false, want));
        CHECK_INT(got[0], want[0]);
        memset(got, 0, sizeof got);
        memset(want, 0, sizeof want);
        CHECK_INT(otsu_three(h, got), try_all(h, true, want));
        CHECK_INT(got[0], want[0]);
        CHECK_INT(got[1], want[1]);
    }
}

/* I1: nothing to divide by */
TEST(histograms_without_a_threshold)
{
    uint64_t h[256] = {0};
    uint8_t t[2] = {7, 8};
    CHECK(!otsu_two(h, t) && !otsu_three(h, t));
    h[9] = 5;
    CHECK(!otsu_two(h, t) && !otsu_three(h, t));
    h[255] = 1;
    CHECK(!otsu_three(h, t));
    CHECK(t[0] == 7 && t[1] == 8);
    CHECK(otsu_two(h, t));
    CHECK_INT(t[0], 9);
}

/* I1 */
TEST(two_bins_and_adjacent_bins)
{
    uint64_t far[256] = {[0] = 9999, [255] = 1}, near[256] = {[10] = 3, [11] = 7};
    uint8_t t;
    CHECK(otsu_two(far, &t) && t == 0);
    CHECK(otsu_two(near, &t) && t == 10);
}

/* I2: (0, 127.5) and (127.5, 255) are as good */
TEST(of_two_maxima_the_smaller_threshold)
{
    uint64_t h[256] = {[0] = 4, [100] = 4, [200] = 4};
    uint8_t t;
    CHECK(otsu_two(h, &t));
    CHECK_INT(t, 0);
}

/* I4 */
TEST(a_million_zeros_are_weighed_as_zeros)
{
    uint64_t h[256] = {[0] = 1000000, [40] = 300, [42] = 100, [200] = 250, [210] = 50};
    uint8_t t[2], want[2];
    CHECK(otsu_three(h, t) && try_all(h, true, want));
    CHECK_INT(t[0], want[0]);
    CHECK_INT(t[1], want[1]);
    CHECK_INT(t[0], 0);
    CHECK_INT(t[1], 42);
}

int main(void)
{
    read_histograms();
    RUN(two_classes_equal_the_table);
    RUN(three_classes_equal_the_table);
    RUN(counts_times_2_to_the_22_have_the_same_thresholds);
    RUN(random_histograms_equal_every_partition_tried);
    RUN(histograms_without_a_threshold);
    RUN(two_bins_and_adjacent_bins);
    RUN(of_two_maxima_the_smaller_threshold);
    RUN(a_million_zeros_are_weighed_as_zeros);
    return test_end();
}
