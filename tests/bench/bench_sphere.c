/* SPDX-License-Identifier: MIT */
/*
 * bench_sphere - the grid alone: echoes per second through registration and updating, transformation as the vehicle
 * moves, and connected components, against the number of cells; bytes; what each sensor model costs; and with the
 * records of free water, as the daemon has both. Rates to compare
 * with are assumptions: a WesMar SS150 that pings once per 400 m of range (1.9 echoes/s),
 * an EM 1000 of 60 beams at 10 pings/s (600).
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "core/fault.h"
#include "grid/sphere/clusters.h"
#include "grid/water/store.h"
#include "bench.h"

#define SS150_PER_S  1.9
#define EM1000_PER_S 600.0
#define BEAMS        60
#define MATRIX       512 /* beams of a sonar that looks up and down, 32 beside and 16 above each other */
#define ROUNDS       5   /* the median of which is said */

static struct sphere *sphere;
static void *memory;
static size_t bytes;
static uint64_t t_ns;
static uint32_t seq;
static struct beam_echoes beams[MATRIX];
static struct store *store; /* each ping is entered there, too; NULL: in the sphere alone */

/* With records of one sonar, as the daemon has them; store_stop: without. */
static void store_start(uint32_t n_beams)
{
    const struct store_conf conf = {.beams = {n_beams}};
    store = store_init(need(store_bytes(&conf)), &conf);
}

static void store_stop(void)
{
    free(store);
    store = NULL;
}

static void start(double step_deg, uint32_t max_cells, enum sphere_model model)
{
    struct sphere_conf conf = {.angular_step_rad = geo_rad(step_deg),
                               .layers = {.r_max_m = 100, .dr_m = 0.05, .n_const = 29, .growth = 1.035},
                               .max_cells = max_cells,
                               .forget_s = 1e6,
                               .blocked_above = 0.6,
                               .recentre_m = 0.1,
                               .model = model,
                               .range_error = 0.003};
    struct fault fault;
    bytes = sphere_bytes(&conf, &fault);
    free(memory);
    memory = bytes ? aligned_alloc(64, (bytes + 63) / 64 * 64) : NULL;
    if (!memory) {
        fprintf(stderr, "no memory for a grid\n");
        exit(1);
    }
    sphere = sphere_init(memory, &conf);
    t_ns = 1;
    seq = 0;
}

static struct beam_echoes heard(double az_rad, double el_rad, double range_m)
{
    const float r = (float)range_m;
    return (struct beam_echoes){.az_rad = (float)az_rad,
                                .el_rad = (float)el_rad,
                                .blind_m = 0.3f,
                                .free_to_m = r - 0.1f,
                                .state = BEAM_ECHO,
                                .n = 1,
                                .echo = {{.range_m = r, .near_m = r - 0.1f, .sd_m = 0.02f, .confidence = 0.9f}}};
}

/* The first n beams are a ping, so long after the last one. */
static void enter(uint16_t n, uint64_t after_ns, double wide_deg, double high_deg, double north_m)
{
    struct echoes e = {.t_ns = t_ns += after_ns,
                       .seq = ++seq,
                       .n_beams = n,
                       .range_max_m = 100,
                       .az_aperture_rad = (float)geo_rad(wide_deg),
                       .el_aperture_rad = (float)geo_rad(high_deg),
                       .pose = pose_identity,
                       .beam = beams};
    e.pose.has = POSE_ATTITUDE | POSE_POSITION;
    e.pose.position_m[0] = north_m;
    sphere_enter(sphere, &e, &mount_identity);
    if (store)
        store_enter(store, &e, &mount_identity);
}

/* A fan of narrow beams across, swept about the vertical: every beam hears the bottom at a range of its own. */
static void fan(double az_rad, double range_m, double opening_deg, double north_m)
{
    for (int i = 0; i < BEAMS; i++)
        beams[i] = heard(az_rad, geo_rad(2.5 * i - 75), range_m * (1 + 0.002 * i));
    enter(BEAMS, 1000000, opening_deg, opening_deg, north_m);
}

/* A level beam that is high, as of a turning head, ten times a second. */
static void look(double az_rad, double range_m, double north_m)
{
    beams[0] = heard(az_rad, 0, range_m);
    enter(1, 100000000, 2.5, 25, north_m);
}

#define TURN 360 /* looks of a head per turn */

/* Microseconds per look of a head while the vehicle goes way_m between one and the next, after a turn of it. */
static double look_us(double way_m)
{
    double north_m = 0, began_ns = 0;
    start(2.5, 65536, SPHERE_OPENING);
    for (int i = 0; i < 2 * TURN; i++) {
        if (i == TURN)
            began_ns = cpu_ns();
        look(i * GEO_TURN / TURN, 20 * (1 + 0.01 * (i % 7)), north_m += way_m);
    }
    return (cpu_ns() - began_ns) * 1e-3 / TURN;
}

#define LOOK_FANS 10 /* clusters are asked for once per second of an EM 1000's pings */

static struct clusters *clusters;

/* Echoes per second while the vehicle goes way_m between one fan and the next; with clusters when there are any. */
static double rate(int fans, double opening_deg, double way_m, double r0_m)
{
    const struct cluster *list;
    uint32_t all;
    static double north_m;
    double s[ROUNDS];
    north_m = 0;
    for (int round = 0; round < ROUNDS; round++) {
        double began_ns = cpu_ns();
        for (int i = 0; i < fans; i++) {
            fan(i * geo_rad(2.5), r0_m * (1 + 0.01 * (i % 7)), opening_deg, north_m += way_m);
            if (clusters && i % LOOK_FANS == 0)
                clusters_look(clusters, sphere, t_ns, &list, &all);
        }
        s[round] = (cpu_ns() - began_ns) * 1e-9;
    }
    return fans * BEAMS / median(s, ROUNDS);
}

static void say(const char *what, double per_s)
{
    printf("%-46s %9.0f echoes/s  %8.0f x SS150  %6.1f x EM 1000\n", what, per_s, per_s / SS150_PER_S,
           per_s / EM1000_PER_S);
}

/* Whole turns of fans, ever nearer, so that none looks through what one before has heard, until n cells are held. */
static uint32_t fill(uint32_t n)
{
    struct sphere_stats st = {0};
    for (double range_m = 85; range_m > 20 && st.cells < n; range_m /= 1.04)
        for (int u = 0; u < 144 && st.cells < n; u++) {
            fan(u * geo_rad(2.5), range_m, 2.5, 0);
            sphere_stats(sphere, &st);
        }
    return st.cells;
}

/* Registration, updating, transformation and components at once: the paper's claim is 60 times the SS150's rate. */
static void all_four(const char *with)
{
    static struct rings rings;
    rings_full(&rings, geo_rad(2.5));
    void *room = malloc(clusters_bytes(&rings, 65536));
    if (!room)
        exit(1);
    static const int ways_mm[] = {0, 1, 10, 100};
    for (int i = 0; i < 4; i++) {
        const int mm = ways_mm[i];
        char what[80];
        start(2.5, 65536, SPHERE_OPENING);
        clusters = clusters_init(room, &rings, 65536, log(0.6 / 0.4));
        snprintf(what, sizeof what, "all four%s, 2.5 deg beams, %d mm per fan", with, mm);
        say(what, rate(40, 2.5, mm * 1e-3, 20));
    }
    clusters = NULL;
    free(room);
}

/* Microseconds per ping of a matrix, with records, while the vehicle goes way_m between one and the next. */
static double matrix_us(double way_m)
{
    double north_m = 0, us[ROUNDS];
    start(2.5, 65536, SPHERE_OPENING);
    for (int round = 0; round < ROUNDS; round++) {
        const double began_ns = cpu_ns();
        for (int i = 0; i < 20; i++) {
            for (int k = 0; k < MATRIX; k++)
                beams[k] =
                    heard(geo_rad(3 * (k % 32) - 46.5), geo_rad(5.5 * (k / 32) - 41.25), 20 + 0.01 * (k % 7));
            enter(MATRIX, 100000000, 4.5, 7.5, north_m += way_m);
        }
        us[round] = (cpu_ns() - began_ns) * 1e-3 / 20;
    }
    return median(us, ROUNDS);
}

static void matrices(void)
{
    static const int mm[] = {0, 10, 100};
    const struct store_conf conf = {.beams = {MATRIX}};
    store_start(MATRIX);
    for (int i = 0; i < 3; i++)
        printf("%-24s %2d mm per ping %20.0f us per ping\n", "matrix, records", mm[i], matrix_us(mm[i] * 1e-3));
    printf("%-24s %36.2f MiB\n", "matrix, its records", (double)store_bytes(&conf) / (1 << 20));
    store_stop();
}

static void heads(const char *what)
{
    for (int i = 0; i < 3; i++) {
        static const int mm[] = {0, 10, 30};
        printf("%-24s %2d mm per ping %20.0f us per ping\n", what, mm[i], look_us(mm[i] * 1e-3));
    }
}

int main(void)
{
    setvbuf(stdout, NULL, _IOLBF, 0);
    static const char *const models[] = {"opening", "gauss", "midpoint"};
    for (int model = SPHERE_OPENING; model <= SPHERE_MIDPOINT; model++) {
        char what[80];
        start(2.5, 65536, (enum sphere_model)model);
        snprintf(what, sizeof what, "%s, 2.5 deg beams, standing still", models[model]);
        say(what, rate(40, 2.5, 0, 20));
    }
    start(2.5, 65536, SPHERE_OPENING);
    say("opening, 2.5 deg beams, 1 mm per fan", rate(40, 2.5, 0.001, 20));
    start(2.5, 65536, SPHERE_OPENING);
    say("opening, 6.5 deg beams, standing still", rate(40, 6.5, 0, 20));

    all_four("");
    heads("head, 2.5 x 25 deg beam");
    store_start(BEAMS);
    all_four(", records");
    store_stop();
    store_start(1);
    heads("head, records");
    store_stop();
    matrices();

    puts("\ndirections of 1 degree");
    printf("%9s %9s %14s %16s %12s\n", "cells", "room", "echoes/s", "recentre ms", "bytes/room");
    for (uint32_t n = 1000; n <= 1000000; n *= 10) {
        start(1, n * 5 / 4, SPHERE_OPENING);
        uint32_t held = fill(n);
        double still = rate(40, 2.5, 0, 18), ms[ROUNDS], north_m = 0;
        for (int round = 0; round < ROUNDS; round++) {
            double began_ns = cpu_ns();
            fan(0, 18, 2.5, north_m += 0.11);
            ms[round] = (cpu_ns() - began_ns) * 1e-6;
        }
        printf("%9u %9u %14.0f %16.3f %12.1f\n", held, n * 5 / 4, still, median(ms, ROUNDS),
               (double)bytes / (n * 5 / 4));
    }
    free(memory);
    return 0;
}
