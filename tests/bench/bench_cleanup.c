/* SPDX-License-Identifier: MIT */
/*
 * bench_cleanup - what each stage of the image clean-up costs: nanoseconds per range bin over several turns of 200
 * beams in 20 m of water with a wall. Median of repetitions. Stages that work on histograms cost the same for every
 * beam length, so their price per bin falls.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "core/fault.h"
#include "grid/range/cleanup.h"
#include "grid/range/median.h"
#include "grid/range/otsu.h"
#include "bench.h"

#define MAX_BINS    1500
#define TURN        200
#define REPETITIONS 11

static uint8_t samples[TURN][MAX_BINS], out[MAX_BINS];
static uint8_t work[5 * (MAX_BINS + 128)];
static volatile unsigned sink;

/* uniform in (0, 1] */
static double uniform(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)((*state >> 11) + 1) * 0x1p-53;
}

static void make_beams(uint32_t n)
{
    uint64_t seed = 1;
    for (int b = 0; b < TURN; b++)
        for (uint32_t i = 0; i < n; i++) {
            const double r_m = 20.0 * i / n, wall_m = 12.0 + 0.01 * b;
            double level = 20.0 + 235.0 * exp(-r_m / 0.1);
            if (r_m > wall_m)
                level = 25.0 + 120.0 * exp(-(r_m - wall_m) / 0.5);
            samples[b][i] = (uint8_t)fmin(255.0, level * pow(-log(uniform(&seed)), 0.25));
        }
}

static double filter_alone(unsigned k, uint32_t n)
{
    double ns[REPETITIONS];
    for (int r = 0; r < REPETITIONS; r++) {
        const double begin = now_ns();
        for (unsigned b = 0; b < TURN; b++) {
            struct median_row row[MEDIAN_MAX_SIZE];
            for (unsigned i = 0; i < k; i++)
                row[i] = (struct median_row){.bin = samples[(b + i) % TURN]};
            median_filter(k, row, n, work, out);
            sink += out[n / 2];
        }
        ns[r] = (now_ns() - begin) / TURN;
    }
    return median(ns, REPETITIONS);
}

static double thresholds_alone(bool three, uint32_t n)
{
    uint64_t count[256] = {0};
    double ns[REPETITIONS];
    for (int b = 0; b < TURN; b++)
        for (uint32_t i = 0; i < n; i++)
            count[samples[b][i]]++;
    for (int r = 0; r < REPETITIONS; r++) {
        const double begin = now_ns();
        for (int b = 0; b < TURN; b++) {
            uint8_t t[2] = {0, 0};
            sink += three ? otsu_three(count, t) : otsu_two(count, t);
            sink += t[0];
        }
        ns[r] = (now_ns() - begin) / TURN;
    }
    return median(ns, REPETITIONS);
}

/* One chain, from a ping to its clean image. */
static double chain(const struct cleanup_conf *conf, uint32_t n)
{
    struct fault fault = {""};
    void *memory = malloc(cleanup_size(conf, MAX_BINS));
    struct cleanup *c = memory ? cleanup_init(memory, conf, &mount_identity, MAX_BINS, &fault) : NULL;
    double ns[REPETITIONS];
    if (!c) {
        printf("bench_cleanup: %s\n", fault.text);
        exit(1);
    }
    for (int r = -1; r < REPETITIONS; r++) { /* the first turn fills the image */
        const double begin = now_ns();
        for (uint32_t b = 0; b < TURN; b++) {
            struct ping_beam axis = {.az_rad = 0.0f};
            struct extract_aid aid;
            const struct ping ping = {.sample_bytes = 1,
                                      .n_beams = 1,
                                      .n_bins = n,
                                      .dr_m = 20.0f / (float)n,
                                      .head_units = b,
                                      .head_turn = TURN,
                                      .pose = pose_identity,
                                      .beam = &axis,
                                      .samples = samples[b]};
            cleanup_put(c, &ping, NULL, NULL, NULL);
            while (cleanup_next(c, &aid))
                sink += aid.clean[n / 2];
        }
        if (r >= 0)
            ns[r] = (now_ns() - begin) / TURN;
    }
    free(memory);
    return median(ns, REPETITIONS);
}

static void print_row(const char *name, const double ns[4], const uint32_t bins[4])
{
    printf("%-34s", name);
    for (int k = 0; k < 4; k++)
        printf(" %6.2f", ns[k] / bins[k]);
    printf(" %10.2f\n", ns[2] / 1e3);
}

int main(void)
{
    static const uint32_t bins[] = {200, 500, 1000, 1500};
    static const struct {
        const char *name;
        struct cleanup_conf conf;
    } chains[] = {
        {"chain: median 3x3", {.median = 3, .clip = 2}},
        {"chain: median 5x5", {.median = 5, .clip = 2}},
        {"chain: otsu", {.otsu = true, .clip = 2}},
        {"chain: clahe", {.clahe = true, .clip = 2}},
        {"chain: classes", {.classes = true, .clip = 2}},
        {"chain: median 3x3, classes", {.median = 3, .classes = true, .clip = 2}},
        {"chain: 3x3, otsu, clahe, classes",
         {.median = 3, .otsu = true, .clahe = true, .classes = true, .clip = 2}},
    };
    enum { FILTERS = 4, CHAINS = sizeof chains / sizeof chains[0] };
    static const char *const filter[FILTERS] = {"3x3 alone", "5x5 alone", "two thresholds, once",
                                                "three thresholds, once"};
    double ns[FILTERS + CHAINS][4];

    for (int k = 0; k < 4; k++) {
        make_beams(bins[k]);
        ns[0][k] = filter_alone(3, bins[k]);
        ns[1][k] = filter_alone(5, bins[k]);
        ns[2][k] = thresholds_alone(false, bins[k]);
        ns[3][k] = thresholds_alone(true, bins[k]);
        for (int i = 0; i < CHAINS; i++)
            ns[FILTERS + i][k] = chain(&chains[i].conf, bins[k]);
    }
    printf("ns per bin, of beams of            200    500   1000   1500   us at 1000\n");
    for (int i = 0; i < FILTERS; i++)
        print_row(filter[i], ns[i], bins);
    for (int i = 0; i < CHAINS; i++)
        print_row(chains[i].name, ns[FILTERS + i], bins);
    return 0;
}
