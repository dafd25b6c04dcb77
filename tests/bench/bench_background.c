/* SPDX-License-Identifier: MIT */
/*
 * bench_background - what the background template costs: nanoseconds per range bin of laying it over a ping (same
 * range, and resampled) and of learning (the last of 15 pings); and once, milliseconds of making a
 * template: medians, clusters, keeping.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "grid/range/background.h"
#include "grid/range/background_keep.h"
#include "grid/range/background_learn.h"
#include "bench.h"

#define MAX_BINS    1500
#define TURN        400
#define LEARNT      15
#define REPETITIONS 21

static uint8_t samples[MAX_BINS], level[MAX_BINS], blind[MAX_BINS];
static struct ping_beam beam;
static volatile unsigned sink;

static struct ping ping_at(uint32_t units, uint32_t bins)
{
    return (struct ping){.kind = PING_PROFILE,
                         .law = AMPLITUDE_SQRT,
                         .sample_bytes = 1,
                         .n_beams = 1,
                         .n_bins = bins,
                         .dr_m = 10.0f / (float)bins,
                         .pulse_m = 0.05f,
                         .az_aperture_rad = 0.035f,
                         .head_units = units,
                         .head_turn = TURN,
                         .pose = pose_identity,
                         .beam = &beam,
                         .samples = samples};
}

/* Noise, the ring to 0.25 m, and a frame of 20 degrees at 0.8 m. */
static void hear(uint32_t units, uint32_t bins, uint64_t *state)
{
    for (uint32_t i = 0; i < bins; i++) {
        const double r_m = 10.0 * i / bins;
        *state = *state * 6364136223846793005u + 1442695040888963407u;
        samples[i] = (uint8_t)(*state >> 59);
        if (r_m < 0.25 || (units < 22 && r_m > 0.8 && r_m < 0.9))
            samples[i] = 220;
    }
}

/* A whole turn per repetition. stretch: the ping's bins against the template's. */
static double time_view(const struct background *b, uint32_t bins, float stretch)
{
    const struct background_view view = {level, blind};
    double ns[REPETITIONS];
    for (int r = 0; r < REPETITIONS; r++) {
        const double begin_ns = now_ns();
        for (uint32_t units = 0; units < TURN; units++) {
            struct ping p = ping_at(units, bins);
            bool any;
            p.dr_m *= stretch;
            sink += background_view(b, &p, &view, &any);
        }
        ns[r] = (now_ns() - begin_ns) / TURN / bins;
    }
    return median(ns, REPETITIONS);
}

int main(void)
{
    static const uint32_t bins[] = {200, 500, 1000, 1500};
    static const struct background_rule rule = {.neighbour_m = 0.15,
                                                .min_points = 6,
                                                .min_level = 80,
                                                .extent_m = 1,
                                                .reach_m = 3,
                                                .share = 0.25,
                                                .ring_m = 0.1};
    uint64_t seed = 1;
    printf("bins   mask ns/bin   resampled ns/bin     learn ns/bin   make ms\n");
    for (int k = 0; k < 4; k++) {
        const uint32_t n = bins[k];
        struct ping p = ping_at(0, n);
        struct background_shape shape;
        const struct background_learn_conf conf = {.pings = LEARNT, .standing = true};
        background_shape_of(&p, &shape);
        void *mem = malloc(background_learn_size(&shape, LEARNT)), *work = malloc(background_keep_size(&shape));
        struct background_learn *learn = background_learn_init(mem, &shape, &conf, &mount_identity);
        struct background *b = background_init(malloc(background_size(&shape)), &shape, 64);
        struct background_kept kept;
        double last_ns = 0;
        for (uint32_t i = 0; i < LEARNT * TURN; i++) {
            p = ping_at(i % TURN, n);
            hear(i % TURN, n, &seed);
            const double begin_ns = now_ns();
            background_learn_take(learn, &p);
            last_ns += i >= (LEARNT - 1) * TURN ? now_ns() - begin_ns : 0;
        }
        const double begin_ns = now_ns();
        background_learn_finish(learn, 1, b);
        background_keep(b, &rule, work, &kept);
        const double make_ms = (now_ns() - begin_ns) * 1e-6;
        const double same = time_view(b, n, 1), other = time_view(b, n, 1.3f);
        printf("%4u %13.3f %18.3f %14.3f %9.1f\n", n, same, other, last_ns / TURN / n, make_ms);
        free(mem);
        free(work);
        free(b);
    }
    return 0;
}
