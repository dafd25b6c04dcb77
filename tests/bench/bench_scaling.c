/* SPDX-License-Identifier: MIT */
/*
 * bench_scaling - what one processor takes for a ping, a question: each size doubled by itself until one processor no
 * longer keeps up or the size has reached its limit, and beside it the same machine's memory and a bare socket echo.
 *
 *   bench_scaling [quick]   CSV: what, value, unit, per, ns_median, ns_low, ns_high, asked_per_s, share, keeps_up
 *   bench_scaling extract|sphere|voxel N   N times one usual ping through that stage alone, for callgrind
 *
 * share: of one processor, when asked so often a second. low, high: the quarters of all repetitions.
 */
#include <math.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "../../daemon/daemon.h"
#include "../../daemon/wiring.h"
#include "../../grid/range/extract.h"
#include "../../grid/sphere/sphere.h"
#include "../../grid/voxel/submap.h"
#include "bench.h"
#include "bench_socket.h"

#define RANGE_M    20.0
#define REPEATS    31
#define QUICK      5
#define HEAD_HZ    25.0 /* pings of a scanning head */
#define SWATH_HZ   40.0 /* ... and of a multibeam */
#define CLIENT_HZ  20.0 /* questions of one client */
#define MEMORY_MIB 64

static unsigned repeats = REPEATS;

struct figure {
    double median, low, high;
};

static struct figure figure_of(double *ns, unsigned n)
{
    const double m = median(ns, n);

    return (struct figure){m, ns[n / 4], ns[3 * n / 4]};
}

/* Prints a row; true while one processor keeps up. */
static bool row(const char *what, double value, const char *unit, const char *per, struct figure f,
                double asked_per_s)
{
    const double share = f.median * 1e-9 * asked_per_s;

    printf("%s,%.10g,%s,%s,%.1f,%.1f,%.1f,%g,%.3g,%d\n", what, value, unit, per, f.median, f.low, f.high,
           asked_per_s, share, share < 1);
    fflush(stdout);
    return share < 1;
}

/* ---- the whole chain ---- */

static struct pipeline *chain(uint32_t beams, uint32_t bins)
{
    static struct conf conf;
    struct pipeline_conf p;
    struct plan plan;
    char err[256];

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
    struct pipeline *pipeline = pipeline_new(&p, err, sizeof err);
    if (!pipeline) {
        fprintf(stderr, "%s\n", err);
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
    memcpy(p->samples, samples, (size_t)beams * bins);
    pipeline_submit(pipeline, p);
}

static struct figure whole(uint32_t beams, uint32_t bins)
{
    static uint8_t samples[PING_MAX_BEAMS * 8192];
    double ns[REPEATS];
    struct pipeline *pipeline = chain(beams, bins);
    const uint32_t each = beams * bins < 20000 ? 200 : 4;
    uint32_t number = 0;

    fill(samples, beams, bins);
    for (uint32_t i = 0; i < each; i++) /* warm-up: a whole turn */
        submit(pipeline, samples, beams, bins, ++number);
    for (unsigned r = 0; r < repeats; r++) {
        const double begun = cpu_ns();
        for (uint32_t i = 0; i < each; i++)
            submit(pipeline, samples, beams, bins, ++number);
        ns[r] = (cpu_ns() - begun) / each;
    }
    pipeline_free(pipeline);
    return figure_of(ns, repeats);
}

static void pings_a_second(void)
{
    for (double rate = HEAD_HZ; row("pings a second", rate, "pings/s", "ping", whole(1, 1000), rate);)
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
    char err[200];

    return sphere_init(need(sphere_bytes(&conf, err, sizeof err)), &conf);
}

static void enter(struct sphere *s, uint32_t *number, uint32_t n)
{
    struct echoes e;
    struct beam_echoes beam;

    for (uint32_t i = 0; i < n; i++) {
        heard(&e, &beam, ++*number);
        sphere_enter(s, &e, &mount_identity);
    }
}

static void cells(void)
{
    for (double step_deg = 8; step_deg >= 0.25; step_deg /= 2) {
        struct sphere *s = grid_of(step_deg);
        double ns[REPEATS];
        uint32_t number = 0;
        enter(s, &number, 200);
        for (unsigned r = 0; r < repeats; r++) {
            const double begun = cpu_ns();
            enter(s, &number, 200);
            ns[r] = (cpu_ns() - begun) / 200;
        }
        const uint32_t n = sphere_picture(s)->n;
        free(s);
        if (!row("cells", n, "directions", "ping", figure_of(ns, repeats), HEAD_HZ))
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
    char err[200];

    w->voxel_m = voxel_m;
    w->memory[0] = need(tiles_bytes(side * side, height, 1));
    w->memory[1] = need(submap_bytes(side));
    tiles_init(&w->tiles, w->memory[0], side * side, height, 1);
    submap_init(&w->map, w->memory[1], side, &w->tiles, &origin);
    cast_opening_init(&w->opening, CAST_WEDGE, geo_rad(1.5), geo_rad(17.5), 0, err, sizeof err);
}

static void cast_turn(struct water *w, uint32_t n)
{
    const struct lattice_place origin = {{0, 0, 0}, {0.5, 0.5, 0.5}};
    struct cast_beam beam;

    for (uint32_t i = 0; i < n; i++)
        if (cast_aim(&beam, &w->opening, &origin, pose_identity.attitude, geo_rad(1.8 * i), 0, 0, 6, w->voxel_m))
            submap_cast(&w->map, &beam, SUBMAP_VACANCY);
}

static void voxels(void)
{
    for (double voxel_m = 0.4; voxel_m >= 0.025; voxel_m /= 2) {
        struct water w;
        double ns[REPEATS];
        water_of(&w, voxel_m);
        cast_turn(&w, 200);
        for (unsigned r = 0; r < repeats; r++) {
            const double begun = cpu_ns();
            cast_turn(&w, 200);
            ns[r] = (cpu_ns() - begun) / 200;
        }
        const double n = 4.0 / 3 * geo_rad(1.5) * sin(geo_rad(17.5)) * pow(6 / voxel_m, 3);
        free(w.memory[0]);
        free(w.memory[1]);
        if (!row("voxels", round(n), "voxels/ping", "ping", figure_of(ns, repeats), HEAD_HZ))
            break;
    }
}

/* ---- clients ---- */

static struct daemon d;
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
        const double begun = now_ns();
        for (int round = 0; round < 20; round++) {
            for (unsigned i = 0; i < n; i++)
                ask(fd[i]);
            for (unsigned i = 0; i < n; i++)
                hear(fd[i]);
        }
        if (r > 0) /* the first one warms up */
            ns[r - 1] = (now_ns() - begun) / (20.0 * n);
    }
    return figure_of(ns, repeats);
}

#define CLIENTS_MOST 512

static void clients(void)
{
    static int fd[CLIENTS_MOST];
    char folder[] = "/tmp/bench_scaling.XXXXXX", path[64], err[256];
    struct pipeline_conf p;
    pthread_t server, echoer;
    int pair[2];

    if (!mkdtemp(folder) || socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) != 0)
        exit(1);
    snprintf(path, sizeof path, "%s/socket", folder);
    const struct server_conf conf = {
        .path = path, .mode = 0600, .change = "all", .max_clients = CLIENTS_MOST, .no_rate_limit = true};
    conf_defaults(&d.conf);
    d.conf.n_sonars = 1;
    d.replay = true; /* there is no port whose state answers would go by */
    snprintf(d.conf.sonar[0].device, sizeof d.conf.sonar[0].device, "surveyor");
    d.conf.sonar[0].range_m = RANGE_M;
    plan_make(&d.conf, &d.plan);
    wiring_pipeline(&d.conf, &d.plan, false, &p);
    pose_log_init(&d.poses, 1000000000u);
    d.loop = loop_new(false);
    d.pipeline = d.loop ? pipeline_new(&p, err, sizeof err) : NULL;
    d.server = d.pipeline ? server_start(d.loop, &conf, daemon_methods, &d, err, sizeof err) : NULL;
    if (!d.server) {
        fprintf(stderr, "%s\n", d.loop ? err : "no loop");
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
    pipeline_free(d.pipeline);
    loop_free(d.loop);
    rmdir(folder);
}

/* ---- the machine ---- */

/* Adding one to bytes that do not fit the caches: what a map as large must pay at least. */
static void memory(void)
{
    const size_t n = (size_t)MEMORY_MIB << 20;
    uint8_t *bytes = need(n);
    double ns[REPEATS];

    for (unsigned r = 0; r <= repeats; r++) {
        const double begun = cpu_ns();
        for (size_t i = 0; i < n; i++)
            bytes[i]++;
        __asm__ volatile("" : : "r"(bytes) : "memory");
        if (r > 0)
            ns[r - 1] = (cpu_ns() - begun) / MEMORY_MIB;
    }
    row("adding one to bytes in memory", MEMORY_MIB, "MiB", "MiB", figure_of(ns, repeats), 0);
    free(bytes);
}

/* The plain loop over the same bins: the mean of 16 cells on either side, anew for each bin. */
static void plain_loop(void)
{
    enum { BINS = 1000 };
    static uint8_t samples[BINS];
    double ns[REPEATS];

    fill(samples, 1, BINS);
    for (unsigned r = 0; r <= repeats; r++) {
        volatile unsigned found = 0;
        const double begun = cpu_ns();
        for (int round = 0; round < 20; round++) {
            unsigned n = 0;
            for (int i = 20; i < BINS - 20; i++) {
                unsigned sum = 0;
                for (int k = 5; k <= 20; k++)
                    sum += (unsigned)samples[i - k] * samples[i - k] + (unsigned)samples[i + k] * samples[i + k];
                n += (unsigned)samples[i] * samples[i] * 32 > 8 * sum;
            }
            found = found + n;
        }
        if (r > 0)
            ns[r - 1] = (cpu_ns() - begun) / 20;
    }
    row("a plain detector loop", BINS, "bins", "beam", figure_of(ns, repeats), HEAD_HZ);
}

/* ---- for counting instructions ---- */

static void count(const char *stage, uint32_t n)
{
    uint32_t number = 0;

    if (strcmp(stage, "extract") == 0) {
        enum { BINS = 1000 };
        static uint8_t samples[BINS];
        struct extract_conf conf;
        struct beam_echoes found;
        struct ping_beam axis = {0};
        char err[200];
        extract_defaults(&conf);
        struct extract *x = extract_init(need(extract_size(BINS)), &conf, BINS, err, sizeof err);
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
        struct sphere *s = grid_of(2);
        enter(s, &number, n);
        free(s);
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
    if (argc == 2 && strcmp(argv[1], "quick") == 0)
        repeats = QUICK;
    printf("what,value,unit,per,ns_median,ns_low,ns_high,asked_per_s,share,keeps_up\n");
    memory();
    plain_loop();
    pings_a_second();
    beams();
    bins();
    cells();
    voxels();
    clients();
    return 0;
}
