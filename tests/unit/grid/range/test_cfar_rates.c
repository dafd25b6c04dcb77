/* SPDX-License-Identifier: MIT */
/*
 * test_cfar_rates - what the detectors do in noise, counted: false alarms under every amplitude law, at edges of
 * clutter, without the conversion to power; detections of a fluctuating target alone and beside another one. The
 * tables of the exact laws stand beside what is counted. tests/bench/bench_false_alarm counts down to 1e-6.
 */
#include "tests/lib/detectors.h"
#include "tests/lib/test.h"

#include "tests/lib/clutter.h"

#include "grid/range/cfar.h"

#define BEAM   8192
#define SIGMAS 5.0 /* neighbouring cells share references: somewhat wider than for independent ones */

static uint64_t work[3 * (BEAM + 1)];
static uint8_t mask[BEAM];

static const char *const name_of[] = {"ca", "goca", "soca", "os"};

static struct cfar detector(enum cfar_detector kind, uint32_t side, uint32_t rank, double alpha)
{
    const uint64_t q16 = (uint64_t)(alpha * 65536.0 + 0.5);
    return (struct cfar){.detector = kind,
                         .edge = CFAR_BOTH,
                         .n_side = side,
                         .guard = 0,
                         .rank = rank,
                         .alpha_q16 = q16,
                         .alpha_one_q16 = q16};
}

/* Detections among the cells that have both sides, and how many those cells are. */
static double detections(const struct cfar *cfar, const uint64_t *x, uint32_t n)
{
    const struct cfar_profile profile = {.x = x, .n = n, .work = work};
    double hits = 0;
    cfar_run(cfar, &profile, mask);
    for (uint32_t i = 0; i < n; i++)
        hits += mask[i];
    return hits;
}

static bool within(double hits, double n, double want, double bias)
{
    double lo, hi;
    wilson(hits, n, SIGMAS, &lo, &hi);
    return want >= lo * (1.0 - bias) && want <= hi * (1.0 + bias);
}

/* ---- false alarms under the laws ---- */

TEST(rates_are_the_design_rates_under_every_law)
{
    static uint64_t x[128][BEAM];
    static const double design[] = {1e-2, 1e-3, 1e-4};
    uint64_t seed = test_seed();
    for (int law = 0; law < CLUTTER_LAWS; law++) {
        struct amplitude table;
        CHECK(amplitude_init(&table, clutter[law].law, clutter[law].sample_bytes, clutter[law].db_per_count));
        for (int b = 0; b < 128; b++)
            clutter_fill(&clutter[law], &table, &seed, BEAM, x[b]);
        for (int d = CFAR_CA; d <= CFAR_OS; d++)
            for (int k = 0; k < 3; k++) {
                double alpha = 0, hits = 0;
                CHECK(cfar_alpha((enum cfar_detector)d, 16, 16, 24, design[k], &alpha));
                const struct cfar cfar = detector((enum cfar_detector)d, 16, 24, alpha);
                for (int b = 0; b < 128; b++)
                    hits += detections(&cfar, x[b], BEAM);
                const double cells = 128.0 * (BEAM - 32);
                /* OS compares two counts: among decibels of 8 bits its factor is a whole number of 0.31 dB */
                const double coarse = d == CFAR_OS && clutter[law].law == AMPLITUDE_LOG ? 0.3 : 0.03;
                if (!within(hits, cells, design[k], coarse)) {
                    printf("%s, %s: %.3g false alarms per cell, expected %g\n", clutter[law].name, name_of[d],
                           hits / cells, design[k]);
                    CHECK(false);
                }
            }
    }
}

/* Noise that is told to be power but is not: the detectors fall silent, whatever was asked of them. */
TEST(counts_taken_for_power_give_no_false_alarms_at_all)
{
    static uint64_t x[BEAM];
    uint64_t seed = test_seed();
    for (int law = 0; law < CLUTTER_LAWS; law++) {
        if (clutter[law].law != AMPLITUDE_LOG && clutter[law].law != AMPLITUDE_SQRT)
            continue;
        for (uint32_t i = 0; i < BEAM; i++)
            x[i] = clutter_count(&clutter[law], -log(clutter_uniform(&seed)));
        for (int d = CFAR_CA; d <= CFAR_OS; d++) {
            double alpha = 0;
            CHECK(cfar_alpha((enum cfar_detector)d, 16, 16, 24, 1e-2, &alpha));
            const struct cfar cfar = detector((enum cfar_detector)d, 16, 24, alpha);
            CHECK(detections(&cfar, x, BEAM) < 2.0);
        }
    }
}

/* ---- tables ---- */

/*
 * Detectors on Rayleigh amplitudes as they are. sonard converts to power instead; the table's factors are those of
 * the same windows and the same decisions, so cfar_run must give their rates. For OS they are the roots of ours.
 */
TEST(rayleigh_factors_give_their_rates)
{
    enum { BEAMS = 100 };
    static uint64_t x[BEAMS][BEAM];
    uint64_t seed = test_seed();
    struct table t = table_open("tests/oracles/cfar_alpha_rayleigh.csv");
    int rows = 0, counted = 0;
    for (int b = 0; b < BEAMS; b++)
        for (int i = 0; i < BEAM; i++)
            x[b][i] = (uint64_t)(1e6 * sqrt(-log(clutter_uniform(&seed))));
    for (; table_next(&t); rows++) {
        const enum cfar_detector kind = table_detector(&t, 0);
        const uint32_t side = table_count(&t, 1), rank = table_count(&t, 3);
        const double pfa = table_real(&t, 4), factor = table_real(&t, 5);
        double alpha = NAN, hits = 0;
        if (kind == CFAR_OS) {
            CHECK(cfar_alpha(kind, side, side, rank, pfa, &alpha));
            CHECK_NEAR(sqrt(alpha), factor, 1e-12, 0);
        }
        if (pfa < 1e-3)
            continue;
        const struct cfar cfar = detector(kind, side, rank, factor);
        for (int b = 0; b < BEAMS; b++)
            hits += detections(&cfar, x[b], BEAM);
        const double cells = (double)BEAMS * (BEAM - 2 * side);
        if (!within(hits, cells, pfa, 0.001)) {
            printf("%s %u: %.4g of amplitudes, expected %g\n", t.field[0], side, hits / cells, pfa);
            CHECK(false);
        }
        counted++;
    }
    CHECK_INT(rows, 329);
    CHECK(counted > 100);
}

/*
 * A detector on decibels compares with a mean of logarithms. sonard has none, since power costs nothing and needs two
 * thirds less of a window; the table is confirmed here, and for OS its offset is the logarithm of our factor.
 */
TEST(log_offsets_give_their_rates)
{
    enum { CELLS = 400000 };
    static double sum[CELLS + 1], y[CELLS];
    uint64_t seed = test_seed();
    struct table t = table_open("tests/oracles/cfar_offset_log.csv");
    int rows = 0;
    for (int i = 0; i < CELLS; i++) {
        y[i] = log(-log(clutter_uniform(&seed)));
        sum[i + 1] = sum[i] + y[i];
    }
    for (; table_next(&t); rows++) {
        const enum cfar_detector kind = table_detector(&t, 0);
        const int side = (int)table_int(&t, 1);
        const double pfa = table_real(&t, 4), offset = table_real(&t, 5);
        double alpha = NAN, hits = 0;
        CHECK_NEAR(table_real(&t, 6), offset * 10.0 / log(10.0), 1e-9, 0);
        if (kind == CFAR_OS) {
            CHECK(cfar_alpha(kind, table_count(&t, 1), table_count(&t, 2), table_count(&t, 3), pfa, &alpha));
            CHECK_NEAR(log(alpha), offset, 1e-12, 1e-12);
        }
        if (kind == CFAR_OS || pfa < 1e-3)
            continue;
        for (int i = side; i < CELLS - side; i++) {
            const double lead = (sum[i] - sum[i - side]) / side, lag = (sum[i + side + 1] - sum[i + 1]) / side;
            const double mean = kind == CFAR_CA     ? (lead + lag) / 2.0
                                : kind == CFAR_GOCA ? fmax(lead, lag)
                                                    : fmin(lead, lag);
            hits += y[i] > mean + offset;
        }
        if (!within(hits, CELLS - 2.0 * side, pfa, 0.001)) {
            printf("%s %d: %.4g of decibels, expected %g\n", t.field[0], side, hits / (CELLS - 2.0 * side), pfa);
            CHECK(false);
        }
    }
    CHECK_INT(rows, 329);
}

/* The cell under test in the middle of its windows, at a step of the clutter as the table describes it. */
static void step_beam(uint64_t *seed, uint32_t side, uint32_t high_cells, bool cut_high, double ratio, uint64_t *x)
{
    for (uint32_t i = 0; i < 2 * side + 1; i++) {
        const bool high = cut_high ? i + high_cells >= side : i > side && i <= side + high_cells;
        x[i] = (uint64_t)(-1e6 * (high ? ratio : 1.0) * log(clutter_uniform(seed)));
    }
}

TEST(edges_of_clutter_give_the_rates_of_the_table)
{
    enum { TRIALS = 8000 };
    uint64_t seed = test_seed();
    struct table t = table_open("tests/oracles/cfar_edge.csv");
    int rows = 0, counted = 0;
    for (; table_next(&t); rows++) {
        const enum cfar_detector kind = table_detector(&t, 0);
        const uint32_t side = table_count(&t, 1), rank = table_count(&t, 2), high = table_count(&t, 5);
        const double want = table_real(&t, 8), ratio = pow(10.0, table_real(&t, 4) / 10.0);
        double alpha = NAN, hits = 0;
        CHECK(cfar_alpha(kind, side, side, rank, table_real(&t, 3), &alpha));
        CHECK_NEAR(alpha, table_real(&t, 7), 1e-10, 0);
        if (want < 0.004)
            continue;
        const struct cfar cfar = detector(kind, side, rank, alpha);
        for (int trial = 0; trial < TRIALS; trial++) {
            uint64_t x[129];
            step_beam(&seed, side, high, !strcmp(t.field[6], "high"), ratio, x);
            hits += detections(&cfar, x, 2 * side + 1);
        }
        if (!within(hits, TRIALS, want, 1e-4)) {
            printf("%s, %u a side, %s dB, %u high, cut %s: %.4f, expected %.4f\n", t.field[0], side, t.field[4],
                   high, t.field[6], hits / TRIALS, want);
            CHECK(false);
        }
        counted++;
    }
    CHECK_INT(rows, 2592);
    CHECK(counted > 200);
    printf("# %d of %d edges counted\n", counted, rows);
}

/* ---- targets ---- */

/* Share of beams in which a Swerling-1 target (20 dB) is found; `other`: ratio of a second one 8 cells behind. */
static double found_beside(enum cfar_detector kind, double alpha, double other, uint64_t *seed, int trials)
{
    const struct cfar cfar = detector(kind, 16, 24, alpha);
    double hits = 0;
    for (int t = 0; t < trials; t++) {
        uint64_t x[33];
        for (uint32_t i = 0; i < 33; i++)
            x[i] = (uint64_t)(-1e6 * (i == 16 ? 101.0 : i == 24 ? 1.0 + other : 1.0) * log(clutter_uniform(seed)));
        hits += detections(&cfar, x, 33);
    }
    return hits / trials;
}

TEST(a_fluctuating_target_is_found_as_often_as_the_law_says)
{
    enum { TRIALS = 40000 };
    uint64_t seed = test_seed();
    double beside[4];
    for (int d = CFAR_CA; d <= CFAR_OS; d++) {
        double alpha = 0, ln_pd = 0;
        CHECK(cfar_alpha((enum cfar_detector)d, 16, 16, 24, 1e-4, &alpha));
        CHECK(cfar_ln_pfa((enum cfar_detector)d, 16, 16, 24, alpha / 101.0, &ln_pd));
        const double alone = found_beside((enum cfar_detector)d, alpha, 0.0, &seed, TRIALS);
        beside[d] = found_beside((enum cfar_detector)d, alpha, 1e4, &seed, TRIALS);
        printf("# %s: a 20 dB target is found in %.3f (law %.3f), beside one of 40 dB in %.3f\n", name_of[d],
               alone, exp(ln_pd), beside[d]);
        CHECK(within(alone * TRIALS, TRIALS, exp(ln_pd), 0.0));
        if (d == CFAR_SOCA) /* the other target is in one side only: what is left is CA over the other side */
            CHECK(within(beside[d] * TRIALS, TRIALS, pow(1.0 + alpha / (16.0 * 101.0), -16.0), 0.01));
    }
    CHECK(beside[CFAR_CA] < 0.2 && beside[CFAR_GOCA] < 0.1); /* masked: what SOCA and OS are for */
    CHECK(beside[CFAR_OS] > 0.8);
}

int main(void)
{
    RUN(rates_are_the_design_rates_under_every_law);
    RUN(counts_taken_for_power_give_no_false_alarms_at_all);
    RUN(rayleigh_factors_give_their_rates);
    RUN(log_offsets_give_their_rates);
    RUN(edges_of_clutter_give_the_rates_of_the_table);
    RUN(a_fluctuating_target_is_found_as_often_as_the_law_says);
    return test_end();
}
