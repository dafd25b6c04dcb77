/* SPDX-License-Identifier: MIT */
/*
 * bench_cfar - nanoseconds per cell of every stage from counts to detections and of every detector, beside the
 * plain loop over windows in C and beside copying the cells, 8 bytes each: in the cache, where a beam lies, and in
 * memory. Noise with a wall in it, 16 training and 4 guard cells on each side. Medians;
 * compare figures of one run only.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "tests/lib/clutter.h"

#include "grid/range/cfar.h"
#include "grid/range/profile.h"
#include "bench.h"

#define SIDE        16
#define GUARD       4
#define RANK        24
#define MAX_CELLS   1500
#define BEAMS       32 /* different ones, so that branches are not learnt by heart */
#define REPETITIONS 25

static uint8_t counts[BEAMS][MAX_CELLS];
static uint64_t power[BEAMS][MAX_CELLS], cells[MAX_CELLS], sums[MAX_CELLS + 1], work[3 * (MAX_CELLS + 1)];
static uint8_t mask[MAX_CELLS];
static struct amplitude law;
static volatile unsigned sink;

static void make_beams(uint32_t n)
{
    uint64_t seed = 1;
    for (int b = 0; b < BEAMS; b++)
        for (uint32_t i = 0; i < n; i++) {
            const double level = i > n / 2 && i < n / 2 + n / 50 ? 1e4 : 1.0;
            counts[b][i] =
                sound_byte(sound_count(AMPLITUDE_SQRT, -level * log(clutter_uniform(&seed)), 16.0, 0.0) + 0.5);
            power[b][i] = amplitude_of(&law, counts[b][i]);
        }
}

/* ---- what is measured: beam b of n cells ---- */

static struct cfar detector(enum cfar_detector kind)
{
    double alpha = 0;
    cfar_alpha(kind, SIDE, SIDE, RANK, 1e-4, &alpha);
    return (struct cfar){.detector = kind,
                         .edge = CFAR_FULL,
                         .n_side = SIDE,
                         .guard = GUARD,
                         .rank = RANK,
                         .alpha_q16 = (uint64_t)(alpha * 65536.0),
                         .alpha_one_q16 = (uint64_t)(alpha * 65536.0)};
}

static void run_copy(enum cfar_detector unused, uint32_t n, int b)
{
    (void)unused;
    memcpy(cells, power[b], n * sizeof cells[0]);
    sink += (unsigned)cells[n / 2];
}

static uint64_t far_from[1 << 23], far_to[1 << 23]; /* 64 MiB each: no cache holds them */

/* Beam after beam of them, so that none is in a cache. */
static void run_far_copy(enum cfar_detector unused, uint32_t n, int b)
{
    static uint32_t at;
    (void)unused;
    (void)b;
    at = at + 2 * n <= sizeof far_to / sizeof far_to[0] ? at + n : 0;
    memcpy(far_to + at, far_from + at, n * sizeof far_to[0]);
    sink += (unsigned)far_to[at];
}

static void run_sums(enum cfar_detector unused, uint32_t n, int b)
{
    (void)unused;
    amplitude_sums(&law, counts[b], n, sums);
    sink += (unsigned)sums[n];
}

static void run_cells(enum cfar_detector unused, uint32_t n, int b)
{
    const struct profile_axis axis = {.n = n, .dr = 0.02, .half = 2};
    static uint64_t bits[MAX_CELLS / PROFILE_BLOCK + 1];
    struct profile profile = {.axis = &axis, .cell = cells, .bits = bits};
    (void)unused;
    profile_sum(&profile, &law, counts[b], 8, sums);
    sink += (unsigned)cells[n / 2];
}

static void run_cfar(enum cfar_detector kind, uint32_t n, int b)
{
    static struct cfar prepared[4];
    if (prepared[kind].n_side == 0)
        prepared[kind] = detector(kind);
    cfar_run(&prepared[kind], &(struct cfar_profile){.x = power[b], .n = n, .work = work}, mask);
    sink += mask[n / 2];
}

/* The same decisions as they are usually written: every window is added up for every cell. */
static void run_plain(enum cfar_detector kind, uint32_t n, int b)
{
    static struct cfar prepared[4];
    if (prepared[kind].n_side == 0)
        prepared[kind] = detector(kind);
    const uint64_t *x = power[b], alpha = prepared[kind].alpha_q16;
    for (uint32_t i = SIDE + GUARD; i + SIDE + GUARD < n; i++) {
        if (kind == CFAR_OS) {
            uint32_t below = 0;
            const double limit = (double)x[i] * 65536.0 / (double)alpha;
            for (uint32_t d = GUARD + 1; d <= GUARD + SIDE; d++)
                below += (uint32_t)((double)x[i - d] < limit) + (uint32_t)((double)x[i + d] < limit);
            mask[i] = below >= RANK;
            continue;
        }
        uint64_t lead = 0, lag = 0;
        for (uint32_t d = GUARD + 1; d <= GUARD + SIDE; d++) {
            lead += x[i - d];
            lag += x[i + d];
        }
        const uint64_t sum = kind == CFAR_CA     ? (lead + lag) / 2
                             : kind == CFAR_GOCA ? (lead > lag ? lead : lag)
                                                 : (lead < lag ? lead : lag);
        mask[i] = (double)x[i] * SIDE > (double)sum * (double)alpha / 65536.0;
    }
    sink += mask[n / 2];
}

/* ---- measuring ---- */

/* Median nanoseconds per cell. */
static double measure(void (*run)(enum cfar_detector, uint32_t, int), enum cfar_detector kind, uint32_t n)
{
    double ns[REPETITIONS];
    for (int r = 0; r < REPETITIONS; r++) {
        const double begin = now_ns();
        for (int b = 0; b < BEAMS; b++)
            run(kind, n, b);
        ns[r] = (now_ns() - begin) / BEAMS / n;
    }
    return median(ns, REPETITIONS);
}

int main(void)
{
    static const char *const name[] = {"ca", "goca", "soca", "os"};
    static const uint32_t n[] = {200, 500, 1000, 1500};
    char heading[32];
    if (!amplitude_init(&law, AMPLITUDE_SQRT, 1, 0.0))
        return 1;
    printf("%-22s", "ns per cell, cells:");
    for (int k = 0; k < 4; k++)
        printf("%10u", n[k]);
    memset(far_from, 1, sizeof far_from);
    memset(far_to, 1, sizeof far_to);
    printf("\n%-22s", "copy in cache");
    for (int k = 0; k < 4; k++) {
        make_beams(n[k]);
        printf("%10.3f", measure(run_copy, CFAR_CA, n[k]));
    }
    printf("\n%-22s", "copy in memory");
    for (int k = 0; k < 4; k++)
        printf("%10.3f", measure(run_far_copy, CFAR_CA, n[k]));
    printf("\n%-22s", "counts to sums");
    for (int k = 0; k < 4; k++) {
        make_beams(n[k]);
        printf("%10.3f", measure(run_sums, CFAR_CA, n[k]));
    }
    printf("\n%-22s", "... to cells");
    for (int k = 0; k < 4; k++) {
        make_beams(n[k]);
        printf("%10.3f", measure(run_cells, CFAR_CA, n[k]));
    }
    for (int d = CFAR_CA; d <= CFAR_OS; d++) {
        double ns[4], plain[4];
        for (int k = 0; k < 4; k++) {
            make_beams(n[k]);
            ns[k] = measure(run_cfar, (enum cfar_detector)d, n[k]);
            plain[k] = measure(run_plain, (enum cfar_detector)d, n[k]);
        }
        snprintf(heading, sizeof heading, "%s", name[d]);
        printf("\n%-22s", heading);
        for (int k = 0; k < 4; k++)
            printf("%10.3f", ns[k]);
        snprintf(heading, sizeof heading, "%s, plain loop", name[d]);
        printf("\n%-22s", heading);
        for (int k = 0; k < 4; k++)
            printf("%10.3f", plain[k]);
        snprintf(heading, sizeof heading, "%s, ratio", name[d]);
        printf("\n%-22s", heading);
        for (int k = 0; k < 4; k++)
            printf("%9.1fx", plain[k] / ns[k]);
    }
    printf("\n");
    return 0;
}
