/* SPDX-License-Identifier: MIT */
/*
 * bench_answers - how long a client waits for `blocked` and `sectors` while a multibeam of 512 beams x 1000 bins pings 40
 * times a second, beside a bare echo over a UNIX socket in the same run: the three are asked in turns, so that all meet
 * the same load. The loop, the pipeline's two threads and the echo are threads of this process. Aim: 99 % within three times the echo.
 */
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "../../daemon/daemon.h"
#include "../../daemon/wiring.h"
#include "bench.h"
#include "bench_socket.h"

#define BEAMS    512
#define BINS     1000
#define RATE_HZ  40
#define RANGE_M  20.0
#define ASKED    4000 /* times each, 500 a second all together */
#define PAUSE_NS 2000000

static uint8_t samples[BEAMS][BINS];
static struct daemon d;
static atomic_bool stop;

static void make_ping(void)
{
    for (int b = 0; b < BEAMS; b++)
        for (int i = 0; i < BINS; i++)
            samples[b][i] = (uint8_t)(i < 15 ? 255 : rand() % 20 + (i >= 400 && i < 408 ? 150 : 0));
}

static void ping(void)
{
    static uint32_t number;
    struct ping *p = pipeline_begin(d.pipeline);
    p->t_ns = p->t_in_ns = loop_clock();
    p->seq = ++number;
    p->kind = PING_PROFILE;
    p->law = AMPLITUDE_LINEAR;
    p->sample_bytes = 1;
    p->n_beams = BEAMS;
    p->n_bins = BINS;
    p->dr_m = (float)(RANGE_M / BINS);
    p->pulse_m = 0.05f;
    p->az_aperture_rad = p->el_aperture_rad = (float)geo_rad(1.0);
    for (int b = 0; b < BEAMS; b++)
        p->beam[b] = (struct ping_beam){.az_rad = (float)geo_wrap(geo_rad(120.0 * (b + 0.5) / BEAMS - 60))};
    memcpy(p->samples, samples, sizeof samples);
    pipeline_submit(d.pipeline, p);
}

static void on_tick(void *ctx, uint64_t now_ns)
{
    (void)now_ns;
    struct loop_timer *timer = ctx;
    ping();
    loop_arm(d.loop, timer, timer->due_ns + 1000000000u / RATE_HZ);
}

static void *serve(void *arg)
{
    static struct loop_timer tick = {.fire = on_tick, .ctx = &tick};
    (void)arg;
    loop_arm(d.loop, &tick, loop_clock() + 1);
    while (!stop)
        loop_turn(d.loop, 100000000u);
    return NULL;
}

static void start(const char *path)
{
    struct pipeline_conf p;
    const struct server_conf server = {
        .path = path, .mode = 0600, .change = "all", .max_clients = 4, .no_rate_limit = true};
    char err[256];
    conf_defaults(&d.conf);
    d.conf.n_sonars = 1;
    d.replay = true; /* there is no port whose state answers would go by */
    snprintf(d.conf.sonar[0].device, sizeof d.conf.sonar[0].device, "surveyor");
    d.conf.sonar[0].range_m = RANGE_M;
    d.conf.pipeline.threads = 2;
    plan_make(&d.conf, &d.plan);
    wiring_pipeline(&d.conf, &d.plan, false, &p);
    p.max_beams = BEAMS;
    p.max_bins = BINS;
    p.max_samples = BEAMS * BINS;
    pose_log_init(&d.poses, 1000000000u);
    d.loop = loop_new(false);
    d.pipeline = d.loop ? pipeline_new(&p, err, sizeof err) : NULL;
    d.server = d.pipeline ? server_start(d.loop, &server, daemon_methods, &d, err, sizeof err) : NULL;
    if (!d.server) {
        fprintf(stderr, "%s\n", d.loop ? err : "no loop");
        exit(1);
    }
}

/* Microseconds from the question to the end of the answer's line. */
static double ask(int fd, const char *line)
{
    static char answer[1 << 17];
    const uint64_t begun_ns = loop_clock();
    ssize_t n = 0;
    if (send(fd, line, strlen(line), MSG_NOSIGNAL) < 0)
        exit(1);
    for (ssize_t more; n == 0 || answer[n - 1] != '\n'; n += more)
        if ((more = recv(fd, answer + n, sizeof answer - (size_t)n, 0)) <= 0)
            exit(1);
    if (strstr(answer, "\"error\"")) {
        fprintf(stderr, "%.200s\n", answer);
        exit(1);
    }
    return (double)(loop_clock() - begun_ns) * 1e-3;
}

int main(void)
{
    static const char *const lines[] = {
        "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"echo\",\"params\":{\"azimuth_deg\":10,\"distance_m\":5}}\n",
        "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"blocked\",\"params\":{\"azimuth_deg\":10,\"distance_m\":5}}\n",
        "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"sectors\"}\n",
        "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"nearest\"}\n",
        "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"limit\",\"params\":{\"velocity_mps\":[1,0,0]}}\n"};
    static const char *const names[] = {"echo", "blocked", "sectors", "nearest", "limit"};
    enum { KINDS = sizeof lines / sizeof lines[0] };
    static double took_us[KINDS][ASKED];
    char path[] = "/tmp/bench_answers.XXXXXX";
    int pair[2];
    pthread_t server, echoer;
    if (!mkdtemp(path) || socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) != 0)
        return 1;
    char socket_path[64];
    snprintf(socket_path, sizeof socket_path, "%s/socket", path);
    make_ping();
    start(socket_path);
    pthread_create(&echoer, NULL, echo, &pair[1]);
    pthread_create(&server, NULL, serve, NULL);
    const int fd = connect_to(socket_path);
    for (int i = 0; i < ASKED; i++)
        for (int k = 0; k < KINDS; k++) {
            clock_nanosleep(CLOCK_MONOTONIC, 0, &(struct timespec){.tv_nsec = PAUSE_NS}, NULL);
            took_us[k][i] = ask(k ? fd : pair[0], lines[k]);
        }
    printf("%d questions of each kind, under %d pings a second of %d beams x %d bins\n\n", ASKED, RATE_HZ, BEAMS,
           BINS);
    printf("%-8s  %9s  %9s  %9s  %s\n", "", "median us", "99 % us", "most us", "99 % against the echo's");
    for (int k = 0; k < KINDS; k++)
        qsort(took_us[k], ASKED, sizeof(double), bench_by_size);
    const double echo_us = took_us[0][ASKED * 99 / 100];
    for (int k = 0; k < KINDS; k++)
        printf("%-8s  %9.1f  %9.1f  %9.1f  %.2f\n", names[k], took_us[k][ASKED / 2], took_us[k][ASKED * 99 / 100],
               took_us[k][ASKED - 1], took_us[k][ASKED * 99 / 100] / echo_us);
    stop = true;
    shutdown(pair[0], SHUT_RDWR);
    pthread_join(server, NULL);
    pthread_join(echoer, NULL);
    server_stop(d.server);
    pipeline_free(d.pipeline);
    loop_free(d.loop);
    rmdir(path);
    return 0;
}
