/* SPDX-License-Identifier: MIT */
/*
 * bench_extract - what the range extraction costs: nanoseconds per range bin and bins per second for each detector
 * and several beam lengths, over 20 m of water with a wall at 12 m. Median of repetitions; the detector alone (cfar)
 * and the whole way from counts to echoes. With arguments DETECTOR BINS it runs the whole way over 64 beams once and
 * prints nothing, for callgrind to count the instructions of extract_run.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "core/fault.h"
#include "grid/range/amplitude.h"
#include "grid/range/cfar.h"
#include "grid/range/extract.h"
#include "bench.h"

#define MAX_BINS    1500
#define BEAMS       64 /* different ones, so that branches are not learnt by heart */
#define REPETITIONS 21

static uint8_t samples[BEAMS][MAX_BINS];
static uint64_t power[MAX_BINS], work[3 * (MAX_BINS + 1)];
static uint8_t mask[MAX_BINS];
static _Alignas(16) unsigned char memory[1 << 19];
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
    for (int b = 0; b < BEAMS; b++)
        for (uint32_t i = 0; i < n; i++) {
            const double r_m = 20.0 * i / n;
            double level = 20.0 + 235.0 * exp(-r_m / 0.1);
            if (r_m > 12.0)
                level = 25.0 + 120.0 * exp(-(r_m - 12.0) / 0.5);
            const double code = level * pow(-log(uniform(&seed)), 0.25);
            samples[b][i] = (uint8_t)fmin(255.0, code);
        }
}

static void run_cfar(const struct amplitude *amplitude, enum cfar_detector detector, uint32_t n, int b)
{
    const uint32_t side = n / 50 > 8 ? n / 50 : 8;
    const struct cfar cfar = {.detector = detector,
                              .edge = CFAR_FULL,
                              .n_side = side,
                              .guard = side / 4,
                              .rank = side * 3 / 2,
                              .alpha_q16 = 12 << 16,
                              .alpha_one_q16 = 14 << 16};
    for (uint32_t i = 0; i < n; i++)
        power[i] = amplitude->table[samples[b][i]];
    cfar_run(&cfar, &(struct cfar_profile){.x = power, .n = n, .work = work}, mask);
    sink += mask[n / 2];
}

static void run_extract(struct extract *extract, uint32_t n, int b)
{
    struct ping_beam axis = {.az_rad = 0.0f};
    struct beam_echoes found;
    const struct ping ping = {.kind = PING_PROFILE,
                              .law = AMPLITUDE_SQRT,
                              .sample_bytes = 1,
                              .n_beams = 1,
                              .n_bins = n,
                              .dr_m = 20.0f / (float)n,
                              .pulse_m = 0.08f,
                              .beam = &axis,
                              .samples = samples[b]};
    struct echoes out = {.max_beams = 1, .beam = &found};
    extract_run(extract, &ping, NULL, &out);
    sink += found.n;
}

/* Median nanoseconds per bin. extract NULL: the detector alone. */
static double measure(struct extract *extract, enum cfar_detector detector, uint32_t n)
{
    struct amplitude amplitude;
    double ns[REPETITIONS];
    if (!amplitude_init(&amplitude, AMPLITUDE_SQRT, 1, 0.0))
        return NAN;
    for (int r = 0; r < REPETITIONS; r++) {
        const double begin_ns = now_ns();
        for (int b = 0; b < BEAMS; b++) {
            if (extract)
                run_extract(extract, n, b);
            else
                run_cfar(&amplitude, detector, n, b);
        }
        ns[r] = (now_ns() - begin_ns) / BEAMS / n;
    }
    return median(ns, REPETITIONS);
}

static const char *const name[] = {"ca", "goca", "soca", "os"};

static struct extract *set_up(enum cfar_detector detector)
{
    struct extract_conf conf;
    struct fault fault = {"too much memory"};
    struct extract *extract = NULL;
    extract_defaults(&conf);
    conf.detector = detector;
    if (extract_size(MAX_BINS) <= sizeof memory)
        extract = extract_init(memory, &conf, MAX_BINS, &fault);
    if (!extract) {
        printf("bench_extract: %s\n", fault.text);
        exit(1);
    }
    return extract;
}

static int run_once(const char *detector, uint32_t n)
{
    int d = CFAR_CA;
    while (d <= CFAR_OS && strcmp(name[d], detector) != 0)
        d++;
    if (d > CFAR_OS || n < 1 || n > MAX_BINS) {
        printf("bench_extract: DETECTOR is ca, goca, soca or os, BINS 1 to %d\n", MAX_BINS);
        return 2;
    }
    struct extract *extract = set_up((enum cfar_detector)d);
    make_beams(n);
    for (int b = 0; b < BEAMS; b++)
        run_extract(extract, n, b);
    return 0;
}

int main(int argc, char **argv)
{
    static const uint32_t bins[] = {200, 500, 1000, 1500};
    if (argc == 3)
        return run_once(argv[1], (uint32_t)strtoul(argv[2], NULL, 10));
    printf("detector   bins   cfar ns/bin   extract ns/bin   extract Mbin/s   us per beam\n");
    for (int d = CFAR_CA; d <= CFAR_OS; d++)
        for (int k = 0; k < 4; k++) {
            make_beams(bins[k]);
            const double alone = measure(NULL, (enum cfar_detector)d, bins[k]);
            const double whole = measure(set_up((enum cfar_detector)d), (enum cfar_detector)d, bins[k]);
            printf("%-8s %6u %13.2f %16.2f %16.1f %13.2f\n", name[d], bins[k], alone, whole, 1e3 / whole,
                   whole * bins[k] / 1e3);
        }
    return 0;
}
