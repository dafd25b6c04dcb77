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

#include "bench.h"
#include "bench_swath.h"
#include "core/fault.h"

#define PINGS    200
#define PATTERNS 8 /* different pings, so that branches are not learnt by heart */

static uint8_t samples[PATTERNS][BEAMS][BINS];

static void make_pings(void)
{
    for (int k = 0; k < PATTERNS; k++)
        for (int b = 0; b < BEAMS; b++) {
            double bottom_m = 8.0 / cos(geo_rad(swath_deg(b)));
            double wall_m = swath_deg(b) > 0 ? 9.0 / sin(geo_rad(swath_deg(b))) : 1e9;
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
    struct fault fault;
    swath_conf(&conf, threads);
    conf.sonar[0].rotation_rad[1] = geo_rad(-90);
    swath_pipeline(&conf, &plan, &p);
    struct pipeline *pipeline = pipeline_new(&p, &fault);
    if (!pipeline) {
        fprintf(stderr, "%s\n", fault.text);
        exit(1);
    }
    return pipeline;
}

static void submit(struct pipeline *pipeline, uint32_t number)
{
    struct ping *ping = pipeline_begin(pipeline);
    swath_ping(ping, number + 1, samples[number % PATTERNS]);
    ping->pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    ping->pose.position_m[0] = 0.01 * number; /* 0.4 m/s */
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
        double started_s = 1e-9 * cpu_ns();
        uint64_t started_ns = loop_clock(), next_ns = started_ns;
        for (uint32_t i = 0; i < PINGS; i++) {
            wait_until(next_ns += 1000000000u / RATE_HZ);
            submit(pipeline, i);
        }
        pipeline_drain(pipeline);
        double used_s = 1e-9 * cpu_ns() - started_s, wall_s = 1e-9 * (double)(loop_clock() - started_ns);
        struct latency *l = pipeline_latency(pipeline, PIPELINE_WHOLE);
        pipeline_stats(pipeline, &stats);
        printf("%7d  %10.2f  %9.1f  %8.1f  %8.1f  %8llu   %10.0f\n", threads, used_s / wall_s,
               1e-6 * (double)latency_quantile(l, 0.5), 1e-6 * (double)latency_quantile(l, 0.99),
               1e-6 * (double)l->max_ns, (unsigned long long)stats.dropped[0], PINGS / used_s);
        pipeline_free(pipeline);
    }
    return 0;
}
