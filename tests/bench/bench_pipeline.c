/* SPDX-License-Identifier: MIT */
/*
 * bench_pipeline - from the last byte of a Ping360 frame to the published picture: the device, extract and the grid as
 * the daemon runs them, with 0, 1 and 2 threads. Frames come every 2 ms, ten times faster than a real head, so that
 * threads sleep between them as they do aboard. And what the same pings cost back to back, in pings per second.
 *
 *   bench_pipeline [PINGS MM]   with these: so many without threads, each sent from MM mm farther ahead than the last
 *                               one, and nothing is measured: something else counts the instructions
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "config/conf.h"
#include "core/fault.h"
#include "core/loop.h"
#include "daemon/wiring.h"
#include "drivers/devices/device.h"
#include "drivers/devices/ping_frame.h"
#include "bench.h"

#define BINS        1200
#define PERIOD_NS   2000000
#define PACED_PINGS 3000
#define FAST_PINGS  8000

static struct pipeline *pipeline;
static uint64_t arrived_ns;
static double north_m, way_m; /* the vehicle's, and what it goes between two pings */

static void io_send(void *ctx, const uint8_t *bytes, size_t n)
{
    (void)ctx;
    (void)bytes;
    (void)n;
}

static void io_break(void *ctx, bool on)
{
    (void)ctx;
    (void)on;
}

static void io_note(void *ctx, enum device_note level, const char *fmt, ...)
{
    (void)ctx;
    (void)level;
    (void)fmt;
}

static struct ping *io_begin(void *ctx)
{
    (void)ctx;
    return pipeline_begin(pipeline);
}

static void io_done(void *ctx, struct ping *ping)
{
    static uint32_t seq;
    (void)ctx;
    ping->seq = ++seq;
    ping->t_in_ns = arrived_ns;
    ping->pose = pose_identity;
    ping->pose.t_ns = ping->t_ns;
    ping->pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    ping->pose.position_m[0] = north_m += way_m;
    pipeline_submit(pipeline, ping);
}

static const struct device_io io = {
    .send = io_send, .hold_break = io_break, .ping_begin = io_begin, .ping_done = io_done, .note = io_note};

/* 20 m of noisy water and a wall that wanders with the angle. */
static size_t frame_of(uint16_t angle, uint8_t *out, size_t size)
{
    static uint8_t samples[BINS];
    unsigned wall = 500 + angle % 200;
    for (unsigned i = 0; i < BINS; i++)
        samples[i] = (uint8_t)(i < 20 ? 255 : rand() % 20 + (i >= wall && i < wall + 12 ? 150 : 0));
    struct ping360_data d = {.set = {.mode = 1,
                                     .gain = 1,
                                     .angle = angle,
                                     .transmit_us = 107,
                                     .sample_period = 888,
                                     .frequency_khz = 750,
                                     .n_samples = BINS},
                             .data_length = BINS,
                             .n_data = BINS,
                             .data = samples};
    return ping360_encode_data(out, size, 2, &d);
}

static void wait_until(uint64_t t_ns)
{
    struct timespec t = {.tv_sec = (time_t)(t_ns / 1000000000u), .tv_nsec = (long)(t_ns % 1000000000u)};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL);
}

static void feed(void *device, uint16_t angle)
{
    uint8_t bytes[BINS + 64];
    size_t n = frame_of(angle, bytes, sizeof bytes);
    arrived_ns = loop_clock();
    device_ping360.feed(device, bytes, n, arrived_ns, &io);
}

static void start(int threads, bool patient, void *device)
{
    struct conf conf;
    struct pipeline_conf p;
    struct plan plan;
    struct fault fault;
    conf_defaults(&conf);
    conf.n_sonars = 1;
    snprintf(conf.sonar[0].device, sizeof conf.sonar[0].device, "ping360");
    conf.sonar[0].range_m = 20;
    conf.sonar[0].ring_down_m = -1;
    conf.pipeline.threads = threads;
    plan_make(&conf, &plan);
    wiring_pipeline(&conf, &plan, patient, &p);
    pipeline = pipeline_new(&p, &fault);
    struct device_conf d = {
        .range_m = 20, .sound_speed_mps = 1500, .gain = -1, .step_rad = geo_rad(0.9), .listen_only = true};
    if (!pipeline || !device_ping360.init(device, &d, &fault)) {
        fprintf(stderr, "%s\n", fault.text);
        exit(1);
    }
    device_ping360.opened(device, 0, &io);
}

/* Ten pings a second, as their device sends them. */
static void run_only(int pings, double mm)
{
    void *device = need(device_ping360.state_size);
    way_m = mm * 1e-3;
    start(0, true, device);
    for (int i = 0; i < pings; i++) {
        uint8_t bytes[BINS + 64];
        const size_t n = frame_of((uint16_t)(i % 400), bytes, sizeof bytes);
        arrived_ns = UINT64_C(1000000000) + (uint64_t)i * 100000000u;
        device_ping360.feed(device, bytes, n, arrived_ns, &io);
    }
    pipeline_free(pipeline);
    free(device);
}

int main(int argc, char **argv)
{
    if (argc == 3) {
        run_only(atoi(argv[1]), atof(argv[2]));
        return 0;
    }
    printf("ping's last byte to published picture, %d pings of %d bins every %g ms\n\n", PACED_PINGS, BINS,
           PERIOD_NS * 1e-6);
    printf("threads  median us   99 %% us  99.9 %% us   most us   pings/s back to back\n");
    for (int threads = 0; threads <= 2; threads++) {
        void *device = calloc(1, device_ping360.state_size);
        start(threads, false, device);
        uint64_t next = loop_clock();
        for (unsigned i = 0; i < PACED_PINGS; i++) {
            wait_until(next += PERIOD_NS);
            feed(device, (uint16_t)(i % 400));
        }
        pipeline_drain(pipeline);
        struct latency *l = pipeline_latency(pipeline, PIPELINE_WHOLE);
        printf("%7d  %9.1f  %8.1f  %9.1f  %8.1f", threads, 1e-3 * (double)latency_quantile(l, 0.5),
               1e-3 * (double)latency_quantile(l, 0.99), 1e-3 * (double)latency_quantile(l, 0.999),
               1e-3 * (double)l->max_ns);
        pipeline_free(pipeline);

        memset(device, 0, device_ping360.state_size);
        start(threads, true, device);
        uint64_t started = loop_clock();
        for (unsigned i = 0; i < FAST_PINGS; i++)
            feed(device, (uint16_t)(i % 400));
        pipeline_drain(pipeline);
        printf("   %20.0f\n", FAST_PINGS / (1e-9 * (double)(loop_clock() - started)));
        pipeline_free(pipeline);
        free(device);
    }
    return 0;
}
