/* SPDX-License-Identifier: MIT */
/*
 * bench_daemon.h - a daemon to be asked while a multibeam of 512 beams x 1000 bins pings 40 times a second: the loop
 * and the pipeline's threads are threads of this process; no port, no configuration file.
 */
#ifndef SONARD_BENCH_DAEMON_H
#define SONARD_BENCH_DAEMON_H

#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "core/fault.h"
#include "daemon/methods/environment.h"
#include "daemon/request_job.h"
#include "bench.h"
#include "bench_socket.h"
#include "bench_swath.h"

/* A request's line: method and params as they are in it. */
#define QUESTION(method, params)                                                                                  \
    "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"" method "\",\"params\":{" params "}}\n"

static uint8_t samples[BEAMS][BINS];
static struct methods_env d;
static struct request_jobs jobs;
static atomic_bool stop;
static pthread_t server_thread;
static _Atomic uint64_t longest_turn_ns; /* the loop's work between two polls, since it was set to 0 */
static char server_folder[32], server_path_name[64];

static void make_ping(void)
{
    for (int b = 0; b < BEAMS; b++)
        for (int i = 0; i < BINS; i++)
            samples[b][i] = (uint8_t)(i < 15 ? 255 : rand() % 20 + (i >= 400 && i < 408 ? 150 : 0));
}

/* The vehicle goes north at half a metre a second, and turns. */
static void take_pose(struct ping *p)
{
    static double north_m, yaw_rad;
    struct pose pose = {.t_ns = p->t_ns,
                        .position_m = {north_m += 0.5 / RATE_HZ, 0, 5},
                        .has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH};
    quat_from_rpy(0, 0, yaw_rad += 0.2 / RATE_HZ, pose.attitude);
    pose_log_put(&d.poses, &pose);
    pose_log_newest(&d.poses, &p->pose);
}

static void ping(void)
{
    static uint32_t number;
    struct ping *p = pipeline_begin(d.pipeline);
    swath_ping(p, ++number, samples);
    take_pose(p);
    pipeline_submit(d.pipeline, p);
}

static void on_tick(void *ctx, uint64_t now_ns)
{
    (void)now_ns;
    struct loop_timer *timer = ctx;
    ping();
    loop_arm(d.loop, timer, timer->due_ns + 1000000000u / RATE_HZ);
}

/* Work of this thread so far: the machine's noise is not in it. */
static uint64_t worked_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

static void *serve(void *arg)
{
    struct loop_timer tick = {.fire = on_tick, .ctx = &tick};
    (void)arg;
    loop_arm(d.loop, &tick, loop_clock() + 1);
    while (!stop) {
        const uint64_t before_ns = worked_ns();
        loop_turn(d.loop, 100000000u);
        const uint64_t turn_ns = worked_ns() - before_ns;
        if (turn_ns > longest_turn_ns)
            longest_turn_ns = turn_ns;
    }
    return NULL;
}

static inline void must(bool had, const struct fault *fault)
{
    if (had)
        return;
    fprintf(stderr, "%s\n", fault->text);
    exit(1);
}

/* A loop and a pipeline to be asked, with threads of it; voxel_m: of a map of 64 MiB, 0: none is kept. Ends the program
 * when it cannot. */
static inline void daemon_make(int threads, double voxel_m)
{
    struct pipeline_conf p;
    struct fault fault = {"no loop"};
    memset(&d, 0, sizeof d);
    swath_conf(&d.conf, threads);
    d.replay = true; /* there is no port whose state answers would go by */
    d.conf.map.voxel_m = voxel_m;
    d.conf.map.memory_bytes = 64 << 20;
    swath_pipeline(&d.conf, &d.plan, &p);
    p.image = voxel_m > 0;
    d.mount[0] = mount_identity;
    pose_log_init(&d.poses, 1000000000u);
    pose_log_set_drift(&d.poses, 0, &(struct pose_drift){.heading_radps = 0.01 * GEO_PI / 180});
    make_ping();
    d.loop = loop_new(false);
    d.pipeline = d.loop ? pipeline_new(&p, &fault) : NULL;
    must(d.pipeline, &fault);
}

/* The same behind a socket, served by a thread. It may be started anew when it was stopped. */
static inline void daemon_start(int threads, double voxel_m, int max_clients)
{
    struct fault fault = {"no folder"};
    daemon_make(threads, voxel_m);
    snprintf(server_folder, sizeof server_folder, "/tmp/sonard-bench.XXXXXX");
    must(mkdtemp(server_folder), &fault);
    snprintf(server_path_name, sizeof server_path_name, "%s/socket", server_folder);
    const struct server_conf server = {.path = server_path_name,
                                       .mode = 0600,
                                       .change = "all",
                                       .max_clients = max_clients,
                                       .client_timeout_ns = 10000000000u,
                                       .no_rate_limit = true};
    must(request_jobs_start(&jobs, d.loop, d.pipeline, &fault), &fault);
    d.server = server_start(d.loop, &server, daemon_methods, &d, &fault);
    must(d.server, &fault);
    stop = false;
    pthread_create(&server_thread, NULL, serve, NULL);
}

static void daemon_stop(void)
{
    stop = true;
    pthread_join(server_thread, NULL);
    server_stop(d.server);
    request_jobs_end(&jobs);
    pipeline_free(d.pipeline);
    loop_free(d.loop);
    rmdir(server_folder);
}

/* Reads an answer's line to its end; the program ends when there is none, or an error. */
static inline void take_answer(int fd)
{
    static _Thread_local char answer[1 << 17];
    char before = ' ';
    for (bool first = true; before != '\n'; first = false) {
        const ssize_t n = recv(fd, answer, sizeof answer, 0);
        if (n <= 0 || (first && n > 25 && strncmp(answer, "{\"jsonrpc\":\"2.0\",\"error\"", 24) == 0)) {
            fprintf(stderr, "%.200s\n", n > 0 ? answer : "no answer");
            exit(1);
        }
        before = answer[n - 1];
    }
}

static inline void put_question(int fd, const char *line)
{
    if (send(fd, line, strlen(line), MSG_NOSIGNAL) < 0)
        exit(1);
}

/* Microseconds from the question to the end of the answer's line. */
static inline double ask(int fd, const char *line)
{
    const uint64_t started_ns = loop_clock();
    put_question(fd, line);
    take_answer(fd);
    return (double)(loop_clock() - started_ns) * 1e-3;
}

#endif
