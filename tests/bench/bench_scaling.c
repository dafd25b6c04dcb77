/* SPDX-License-Identifier: MIT */
/*
 * bench_scaling - what one processor takes for a ping, a question: each size doubled by itself until one processor no
 * longer keeps up or the size has reached its limit, and beside it the same machine's memory and a bare socket echo.
 *
 *   bench_scaling [quick]   CSV: what, value, unit, per, ns_median, ns_low, ns_high, asked_per_s, share, keeps_up,
 *                           times
 *   bench_scaling counted   each size once, whether one processor keeps up or not, without threads, for callgrind
 *                           to count `measured`
 *   bench_scaling extract|sphere|voxel N   N times one usual ping through that stage alone, for callgrind
 *
 * share: of one processor, when asked so often a second. low, high: the quarters of all repetitions. times: how often
 * the row's work was done in one `measured`; 0: it was not done there.
 */
#include <math.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/fault.h"
#include "daemon/methods/environment.h"
#include "daemon/wiring.h"
#include "grid/range/extract.h"
#include "grid/sphere/sphere.h"
#include "grid/voxel/submap.h"
#include "bench.h"
#include "bench_answer.h"
#include "bench_socket.h"

#define RANGE_M    20.0
#define REPEATS    31
#define QUICK      5
#define HEAD_HZ    25.0 /* pings of a scanning head */
#define HEAD_BINS  1000
#define SWATH_HZ   40.0 /* ... and of a multibeam */
#define CLIENT_HZ  20.0 /* questions of one client */
#define MEMORY_MIB 64

static unsigned repeats = REPEATS;
static bool counting;
static uint32_t row_times;   /* of the row to be printed next */
static struct methods_env d; /* that is asked; before, nobody knows where it is */

struct figure {
    double median, low, high;
};

static struct figure figure_of(double *ns, unsigned n)
{
    const double m = median(ns, n);
    return (struct figure){m, ns[n / 4], ns[3 * n / 4]};
}

typedef void work_fn(void *ctx, uint32_t times);

/* A function that callgrind sees by its name. */
__attribute__((noinline)) static void measured(work_fn *work, void *ctx, uint32_t times)
{
    work(ctx, times);
    __asm__ volatile(""); /* no tail call */
}

/* Processor's time for one of so many, after as many to warm up. */
static struct figure timed(work_fn *work, void *ctx, uint32_t times)
{
    double ns[REPEATS];
    work(ctx, times);
    for (unsigned r = 0; r < repeats; r++) {
        const double started = cpu_ns();
        measured(work, ctx, times);
        ns[r] = (cpu_ns() - started) / times;
    }
    row_times = times;
    return figure_of(ns, repeats);
}

/* Prints a row; true while one processor keeps up, or nobody looks at the time. */
static bool row(const char *what, double value, const char *unit, const char *per, struct figure f,
                double asked_per_s)
{
    const double share = f.median * 1e-9 * asked_per_s;
    printf("%s,%.10g,%s,%s,%.1f,%.1f,%.1f,%g,%.3g,%d,%u\n", what, value, unit, per, f.median, f.low, f.high,
           asked_per_s, share, share < 1, row_times);
    row_times = 0;
    fflush(stdout);
    return counting || share < 1;
}

/* ---- the whole chain ---- */

static struct pipeline *chain(uint32_t beams, uint32_t bins)
{
    static struct conf conf;
    struct pipeline_conf p;
    struct plan plan;
    struct fault fault;
    conf_defaults(&conf);
    conf.n_sonars = 1;
    snprintf(conf.sonar[0].device, sizeof conf.sonar[0].device, "surveyor");
    conf.sonar[0].range_m = RANGE_M;
    conf.pipeline.threads = 0;
    plan_make(&conf, &plan);
    wiring_pipeline(&conf, &plan, false, &p);
    p.max_beams = beams;
    p.max_bins = bins;
    p.max_samples = beams * bins;
    struct pipeline *pipeline = pipeline_new(&p, &fault);
    if (!pipeline) {
        fprintf(stderr, "%s\n", fault.text);
        exit(1);
    }
    return pipeline;
}

static void fill(uint8_t *samples, uint32_t beams, uint32_t bins)
{
    for (uint32_t b = 0; b < beams; b++)
        for (uint32_t i = 0; i < bins; i++) {
            const bool echo = i >= bins * 2 / 5 && i < bins * 2 / 5 + 8;
            samples[b * bins + i] = (uint8_t)(i < 15 ? 255 : rand() % 20 + echo * 150);
        }
}

static void submit(struct pipeline *pipeline, const uint8_t *samples, uint32_t beams, uint32_t bins,
                   uint32_t number)
{
    struct ping *p = pipeline_begin(pipeline);
    p->t_ns = p->t_in_ns = loop_clock();
    p->seq = number;
    p->kind = PING_PROFILE;
    p->law = AMPLITUDE_LINEAR;
    p->sample_bytes = 1;
    p->n_beams = (uint16_t)beams;
    p->n_bins = bins;
    p->dr_m = (float)(RANGE_M / bins);
    p->pulse_m = 0.05f;
    p->az_aperture_rad = (float)geo_rad(beams == 1 ? 2 : 1);
    p->el_aperture_rad = (float)geo_rad(beams == 1 ? 25 : 1);
    for (uint32_t b = 0; b < beams; b++) {
        const double az_deg = beams == 1 ? 1.8 * (number % 200) : 120.0 * (b + 0.5) / beams - 60;
        p->beam[b] = (struct ping_beam){.az_rad = (float)geo_wrap(geo_rad(az_deg))};
    }
    pose_log_newest(&d.poses, &p->pose);
    memcpy(p->samples, samples, (size_t)beams * bins);
    pipeline_submit(pipeline, p);
}

struct scan {
    struct pipeline *pipeline;
    uint32_t beams, bins, number;
    uint8_t samples[PING_MAX_BEAMS * 8192];
};

static void submit_some(void *ctx, uint32_t times)
{
    struct scan *scan = ctx;
    while (times-- > 0)
        submit(scan->pipeline, scan->samples, scan->beams, scan->bins, ++scan->number);
}

/* A head makes whole turns, which is what its grid is used to; a fan is the same from ping to ping. */
static struct figure whole(uint32_t beams, uint32_t bins)
{
    static struct scan scan;
    scan.pipeline = chain(beams, bins);
    scan.beams = beams;
    scan.bins = bins;
    scan.number = 0;
    fill(scan.samples, beams, bins);
    const struct figure f = timed(submit_some, &scan, beams == 1 ? 200 : 4);
    pipeline_free(scan.pipeline);
    return f;
}

static void pings_a_second(void)
{
    for (double rate = HEAD_HZ;
         row("pings a second", rate, "pings/s", "ping", whole(1, HEAD_BINS), rate) && !counting;)
        rate *= 2;
}

static void beams(void)
{
    for (uint32_t n = 1; n <= PING_MAX_BEAMS && row("beams", n, "beams", "ping", whole(n, 1000), SWATH_HZ);)
        n *= 2;
}

static void bins(void)
{
    for (uint32_t n = 256; n <= PING_MAX_BINS && row("bins", n, "bins", "ping", whole(64, n), SWATH_HZ);)
        n *= 2;
}

/* ---- one stage ---- */

static void heard(struct echoes *e, struct beam_echoes *beam, uint32_t number)
{
    *beam = (struct beam_echoes){.az_rad = (float)geo_rad(1.8 * (number % 200)),
                                 .blind_m = 0.3f,
                                 .free_to_m = 5,
                                 .state = BEAM_ECHO,
                                 .n = 1,
                                 .echo = {{.range_m = 5.05f, .near_m = 5, .sd_m = 0.02f, .confidence = 0.9f}}};
    *e = (struct echoes){.t_ns = 1000000000u + number * UINT64_C(40000000),
                         .seq = number,
                         .n_beams = 1,
                         .range_max_m = RANGE_M,
                         .az_aperture_rad = (float)geo_rad(2),
                         .el_aperture_rad = (float)geo_rad(25),
                         .pose = pose_identity,
                         .beam = beam};
}

static struct sphere *grid_of(double step_deg)
{
    const struct sphere_conf conf = {.angular_step_rad = geo_rad(step_deg),
                                     .layers = {.r_max_m = 30, .dr_m = 0.05, .n_const = 29, .growth = 1.035},
                                     .max_cells = 1u << 20,
                                     .forget_s = 160,
                                     .blocked_above = 0.6,
                                     .recentre_m = 0.1};
    struct fault fault;
    return sphere_init(need(sphere_bytes(&conf, &fault)), &conf);
}

struct turning {
    struct sphere *sphere;
    uint32_t number;
};

static void enter(void *ctx, uint32_t times)
{
    struct turning *t = ctx;
    struct echoes e;
    struct beam_echoes beam;
    while (times-- > 0) {
        heard(&e, &beam, ++t->number);
        sphere_enter(t->sphere, &e, &mount_identity);
    }
}

static void cells(void)
{
    for (double step_deg = 8; step_deg >= 0.25; step_deg /= 2) {
        struct turning t = {.sphere = grid_of(step_deg)};
        const struct figure f = timed(enter, &t, 200);
        const uint32_t n = sphere_picture(t.sphere)->n;
        free(t.sphere);
        if (!row("cells", n, "directions", "ping", f, HEAD_HZ))
            break;
    }
}

struct water {
    struct tiles tiles;
    struct submap map;
    struct cast_opening opening;
    double voxel_m;
    void *memory[2];
};

static void water_of(struct water *w, double voxel_m)
{
    const struct lattice_place origin = {{0, 0, 0}, {0.5, 0.5, 0.5}};
    const uint32_t side = (uint32_t)(2 * 6 / voxel_m / TILE_SIDE) + 3, height = (uint32_t)(6 / voxel_m) + 8;
    struct fault fault;
    w->voxel_m = voxel_m;
    w->memory[0] = need(tiles_bytes(side * side, height, 1));
    w->memory[1] = need(submap_bytes(side, height));
    tiles_init(&w->tiles, w->memory[0], side * side, height, 1);
    submap_init(&w->map, w->memory[1], side, &w->tiles, &origin);
    cast_opening_init(&w->opening, CAST_WEDGE, geo_rad(1.5), geo_rad(17.5), 0, &fault);
}

static void cast_turn(void *ctx, uint32_t times)
{
    struct water *w = ctx;
    const struct lattice_place origin = {{0, 0, 0}, {0.5, 0.5, 0.5}};
    struct cast_beam beam;
    for (uint32_t i = 0; i < times; i++)
        if (cast_aim(&beam, &w->opening,
                     &(struct cast_look){.apex = &origin,
                                         .attitude = pose_identity.attitude,
                                         .az_rad = geo_rad(1.8 * i),
                                         .far_m = 6,
                                         .voxel_m = w->voxel_m}))
            submap_cast(&w->map, &beam, SUBMAP_VACANCY);
}

static void voxels(void)
{
    for (double voxel_m = 0.4; voxel_m >= 0.025; voxel_m /= 2) {
        struct water w;
        water_of(&w, voxel_m);
        const struct figure f = timed(cast_turn, &w, 200);
        const double n = 4.0 / 3 * geo_rad(1.5) * sin(geo_rad(17.5)) * pow(6 / voxel_m, 3);
        free(w.memory[0]);
        free(w.memory[1]);
        if (!row("voxels", round(n), "voxels/ping", "ping", f, HEAD_HZ))
            break;
    }
}

/* ---- questions ---- */

/* A head, all in the loop's thread; no port, no socket. voxel_m: of its map; 0: none. */
static void daemon_of(double voxel_m)
{
    struct pipeline_conf p;
    struct fault fault = {"no loop"};
    conf_defaults(&d.conf);
    d.conf.n_sonars = 1;
    d.replay = true; /* there is no port whose state answers would go by */
    snprintf(d.conf.sonar[0].device, sizeof d.conf.sonar[0].device, "surveyor");
    d.conf.sonar[0].range_m = RANGE_M;
    d.conf.pipeline.threads = 0;
    d.conf.map.voxel_m = voxel_m;
    d.conf.map.body_m = 0.4;
    d.mount[0] = mount_identity;
    plan_make(&d.conf, &d.plan);
    wiring_pipeline(&d.conf, &d.plan, false, &p);
    p.max_beams = 1;
    p.max_bins = p.max_samples = HEAD_BINS;
    pose_log_init(&d.poses, 1000000000u);
    d.loop = loop_new(false);
    d.pipeline = d.loop ? pipeline_new(&p, &fault) : NULL;
    if (!d.pipeline) {
        fprintf(stderr, "%s\n", fault.text);
        exit(1);
    }
}

static void daemon_end(void)
{
    pipeline_free(d.pipeline);
    loop_free(d.loop);
    memset(&d, 0, sizeof d);
}

static void answer(void *ctx, uint32_t times)
{
    while (times-- > 0)
        bench_answer(&d, ctx);
}

#define QUESTION(method, params)                                                                                  \
    {                                                                                                             \
        "question: " method, "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"" method "\",\"params\":{" params "}}"   \
    }

/* A head has turned three times in the middle of a tank. */
static void questions_answered(void)
{
    static const struct {
        const char *what, *line;
    } kinds[] = {QUESTION("blocked", "\"azimuth_deg\":10,\"distance_m\":5"), QUESTION("sectors", ""),
                 QUESTION("nearest", ""), QUESTION("limit", "\"velocity_mps\":[1,0,0]"),
                 QUESTION("path", "\"points_m\":[[0,0,5],[3,0,5],[3,3,5]],\"radius_m\":0.3")};
    static uint8_t samples[HEAD_BINS];
    struct pose pose = pose_identity;

    daemon_of(0.2);
    fill(samples, 1, sizeof samples);
    pose.t_ns = loop_clock();
    pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH | POSE_VELOCITY;
    pose.position_m[2] = 5;
    pose_log_init(&d.poses, UINT64_C(1000000000000)); /* under callgrind, too, it is fresh */
    pose_log_put(&d.poses, &pose);
    for (uint32_t i = 1; i <= 600; i++)
        submit(d.pipeline, samples, 1, sizeof samples, i);
    loop_turn(d.loop, 1); /* what time it is now */
    for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; k++)
        row(kinds[k].what, 1, "clients", "question", timed(answer, (void *)(uintptr_t)kinds[k].line, 100),
            CLIENT_HZ);
    daemon_end();
}

/* ---- clients ---- */

static atomic_bool stop;

static void *serve(void *arg)
{
    (void)arg;
    while (!stop)
        loop_turn(d.loop, 100000000u);
    return NULL;
}

static void ask(int fd)
{
    static const char line[] =
        "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"blocked\",\"params\":{\"azimuth_deg\":10,\"distance_m\":5}}\n";

    if (send(fd, line, sizeof line - 1, MSG_NOSIGNAL) < 0)
        exit(1);
}

static void hear(int fd)
{
    char answer[8192];
    ssize_t n = 0;
    for (ssize_t more; n == 0 || answer[n - 1] != '\n'; n += more)
        if ((more = recv(fd, answer + n, sizeof answer - (size_t)n, 0)) <= 0)
            exit(1);
}

/* All ask, then all listen: time that passes per question. */
static struct figure questions(const int *fd, unsigned n)
{
    double ns[REPEATS];
    for (unsigned r = 0; r <= repeats; r++) {
        const double started = now_ns();
        for (int round = 0; round < 20; round++) {
            for (unsigned i = 0; i < n; i++)
                ask(fd[i]);
            for (unsigned i = 0; i < n; i++)
                hear(fd[i]);
        }
        if (r > 0) /* the first one warms up */
            ns[r - 1] = (now_ns() - started) / (20.0 * n);
    }
    return figure_of(ns, repeats);
}

#define CLIENTS_MOST 512

static void clients(void)
{
    static int fd[CLIENTS_MOST];
    char folder[] = "/tmp/bench_scaling.XXXXXX", path[64];
    struct fault fault;
    pthread_t server, echoer;
    int pair[2];
    if (!mkdtemp(folder) || socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) != 0)
        exit(1);
    snprintf(path, sizeof path, "%s/socket", folder);
    const struct server_conf conf = {.path = path,
                                     .mode = 0600,
                                     .change = "all",
                                     .max_clients = CLIENTS_MOST,
                                     .client_timeout_ns = 10000000000u,
                                     .no_rate_limit = true};
    daemon_of(0);
    d.server = server_start(d.loop, &conf, daemon_methods, &d, &fault);
    if (!d.server) {
        fprintf(stderr, "%s\n", fault.text);
        exit(1);
    }
    pthread_create(&echoer, NULL, echo, &pair[1]);
    pthread_create(&server, NULL, serve, NULL);
    row("a bare echo over a socket", 1, "clients", "question", questions(pair, 1), CLIENT_HZ);
    for (unsigned n = 1, open = 0; n <= CLIENTS_MOST; n *= 2) {
        while (open < n)
            fd[open++] = connect_to(path);
        if (!row("clients", n, "clients", "question", questions(fd, n), CLIENT_HZ * n))
            break;
    }
    stop = true;
    shutdown(pair[0], SHUT_RDWR);
    pthread_join(server, NULL);
    pthread_join(echoer, NULL);
    server_stop(d.server);
    daemon_end();
    rmdir(folder);
}

/* ---- the machine ---- */

static void add_one(void *ctx, uint32_t mib)
{
    uint8_t *bytes = ctx;
    for (size_t i = 0; i < (size_t)mib << 20; i++)
        bytes[i]++;
    __asm__ volatile("" : : "r"(bytes) : "memory");
}

/* Adding one to bytes that do not fit the caches: what a map as large must pay at least. */
static void memory(void)
{
    uint8_t *bytes = need((size_t)MEMORY_MIB << 20);
    row("adding one to bytes in memory", MEMORY_MIB, "MiB", "MiB", timed(add_one, bytes, MEMORY_MIB), 0);
    free(bytes);
}

#define PLAIN_BINS 1000

/* The mean of 16 cells on either side, anew for each bin. */
static void detect_plainly(void *ctx, uint32_t times)
{
    const uint8_t *samples = ctx;
    volatile unsigned found = 0;
    while (times-- > 0) {
        unsigned n = 0;
        for (int i = 20; i < PLAIN_BINS - 20; i++) {
            unsigned sum = 0;
            for (int k = 5; k <= 20; k++)
                sum += (unsigned)samples[i - k] * samples[i - k] + (unsigned)samples[i + k] * samples[i + k];
            n += (unsigned)samples[i] * samples[i] * 32 > 8 * sum;
        }
        found = found + n;
    }
}

static void plain_loop(void)
{
    static uint8_t samples[PLAIN_BINS];
    fill(samples, 1, PLAIN_BINS);
    row("a plain detector loop", PLAIN_BINS, "bins", "beam", timed(detect_plainly, samples, 20), HEAD_HZ);
}

/* ---- for counting instructions ---- */

static void count(const char *stage, uint32_t n)
{
    if (strcmp(stage, "extract") == 0) {
        enum { BINS = 1000 };
        static uint8_t samples[BINS];
        struct extract_conf conf;
        struct beam_echoes found;
        struct ping_beam axis = {0};
        struct fault fault;
        extract_defaults(&conf);
        struct extract *x = extract_init(need(extract_size(BINS)), &conf, BINS, &fault);
        fill(samples, 1, BINS);
        const struct ping p = {.sample_bytes = 1,
                               .n_beams = 1,
                               .n_bins = BINS,
                               .dr_m = 0.02f,
                               .pulse_m = 0.05f,
                               .beam = &axis,
                               .samples = samples};
        struct echoes out = {.max_beams = 1, .beam = &found};
        for (uint32_t i = 0; i < n; i++)
            extract_run(x, &p, NULL, &out);
        free(x);
    } else if (strcmp(stage, "sphere") == 0) {
        struct turning t = {.sphere = grid_of(2)};
        enter(&t, n);
        free(t.sphere);
    } else {
        struct water w;
        water_of(&w, 0.1);
        cast_turn(&w, n);
        free(w.memory[0]);
        free(w.memory[1]);
    }
}

int main(int argc, char **argv)
{
    if (argc == 3) {
        count(argv[1], (uint32_t)strtoul(argv[2], NULL, 10));
        return 0;
    }
    counting = argc == 2 && strcmp(argv[1], "counted") == 0;
    if (argc == 2)
        repeats = counting ? 1 : QUICK;
    printf("what,value,unit,per,ns_median,ns_low,ns_high,asked_per_s,share,keeps_up,times\n");
    memory();
    plain_loop();
    pings_a_second();
    beams();
    bins();
    cells();
    voxels();
    questions_answered();
    if (!counting)
        clients();
    return 0;
}
