/* SPDX-License-Identifier: MIT */
/*
 * bench_multibeam - a synthetic multibeam of 512 beams x 1000 bins at 40 pings a second through the pipeline, with 0, 1
 * and 2 threads: how many processors that takes, the time from ping to picture, and what was dropped.
 * A swath of 120 degrees looks down on a bottom 8 m below with a wall beside, as a survey does; a pose with every ping.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "../../config/conf.h"
#include "../../daemon/loop.h"
#include "../../daemon/wiring.h"
#include "bench.h"

#define BEAMS     512
#define BINS      1000
#define RATE_HZ   40
#define PINGS     200
#define PATTERNS  8 /* different pings, so that branches are not learnt by heart */
#define SWATH_DEG 120.0
#define RANGE_M   20.0

static uint8_t samples[PATTERNS][BEAMS][BINS];

static double beam_deg(int beam)
{
    return SWATH_DEG * (beam + 0.5) / BEAMS - SWATH_DEG / 2;
}

static void make_pings(void)
{
    for (int k = 0; k < PATTERNS; k++)
        for (int b = 0; b < BEAMS; b++) {
            double bottom_m = 8.0 / cos(geo_rad(beam_deg(b)));
            double wall_m = beam_deg(b) > 0 ? 9.0 / sin(geo_rad(beam_deg(b))) : 1e9;
            int echo = (int)(fmin(bottom_m, wall_m) / RANGE_M * BINS);
            for (int i = 0; i < BINS; i++)
                samples[k][b][i] = (uint8_t)(i < 15 ? 255 : rand() % 20 + (i >= echo && i < echo + 8 ? 150 : 0));
        }
}

static struct pipeline *start(int threads)
{
    static struct conf conf;
    struct pipeline_conf p;
    struct plan plan;
    char err[200];

    conf_defaults(&conf);
    conf.n_sonars = 1;
    snprintf(conf.sonar[0].device, sizeof conf.sonar[0].device, "surveyor");
    conf.sonar[0].range_m = RANGE_M;
    conf.sonar[0].rotation_rad[1] = geo_rad(-90);
    conf.pipeline.threads = threads;
    plan_make(&conf, &plan);
    wiring_pipeline(&conf, &plan, false, &p);
    p.max_beams = BEAMS;
    p.max_bins = BINS;
    p.max_samples = BEAMS * BINS;
    struct pipeline *pipeline = pipeline_new(&p, err, sizeof err);
    if (!pipeline) {
        fprintf(stderr, "%s\n", err);
        exit(1);
    }
    return pipeline;
}

static void submit(struct pipeline *pipeline, uint32_t number)
{
    struct ping *ping = pipeline_begin(pipeline);
    ping->t_ns = ping->t_in_ns = loop_clock();
    ping->seq = number + 1;
    ping->kind = PING_PROFILE;
    ping->law = AMPLITUDE_LINEAR;
    ping->sample_bytes = 1;
    ping->n_beams = BEAMS;
    ping->n_bins = BINS;
    ping->dr_m = (float)(RANGE_M / BINS);
    ping->pulse_m = 0.05f;
    ping->az_aperture_rad = (float)geo_rad(1.0);
    ping->el_aperture_rad = (float)geo_rad(1.0);
    ping->pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    ping->pose.position_m[0] = 0.01 * number; /* 0.4 m/s */
    for (int b = 0; b < BEAMS; b++)
        ping->beam[b] = (struct ping_beam){.az_rad = (float)geo_wrap(geo_rad(beam_deg(b)))};
    memcpy(ping->samples, samples[number % PATTERNS], sizeof samples[0]);
    pipeline_submit(pipeline, ping);
}

static void wait_until(uint64_t t_ns)
{
    struct timespec t = {.tv_sec = (time_t)(t_ns / 1000000000u), .tv_nsec = (long)(t_ns % 1000000000u)};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL);
}

int main(void)
{
    make_pings();
    printf("%d pings of %d beams x %d bins, %d a second\n\n", PINGS, BEAMS, BINS, RATE_HZ);
    printf("threads  processors  median ms   99 %% ms   most ms   dropped   pings/s that one processor does\n");
    for (int threads = 0; threads <= 2; threads++) {
        struct pipeline *pipeline = start(threads);
        struct pipeline_stats stats;
        double begun_s = 1e-9 * cpu_ns();
        uint64_t begun_ns = loop_clock(), next_ns = begun_ns;
        for (uint32_t i = 0; i < PINGS; i++) {
            wait_until(next_ns += 1000000000u / RATE_HZ);
            submit(pipeline, i);
        }
        pipeline_drain(pipeline);
        double used_s = 1e-9 * cpu_ns() - begun_s, wall_s = 1e-9 * (double)(loop_clock() - begun_ns);
        struct latency *l = pipeline_latency(pipeline, PIPELINE_WHOLE);
        pipeline_stats(pipeline, &stats);
        printf("%7d  %10.2f  %9.1f  %8.1f  %8.1f  %8llu   %10.0f\n", threads, used_s / wall_s,
               1e-6 * (double)latency_quantile(l, 0.5), 1e-6 * (double)latency_quantile(l, 0.99),
               1e-6 * (double)l->max_ns, (unsigned long long)stats.dropped[0], PINGS / used_s);
        pipeline_free(pipeline);
    }
    return 0;
}
