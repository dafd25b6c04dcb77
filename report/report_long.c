/* SPDX-License-Identifier: MIT */
/*
 * report_long - what runs for ever: every quantity that the next update is made from the last one of, update by update,
 * against what it should be; a naive method beside it, given the same.
 *
 *   report_long [quick | long] [QUANTITY]   CSV: quantity, updates, input, naive_method, naive, measure,
 *                                           bound, measured, verdict
 *
 * A million updates of each, quick: 1e5, long: 1e9; of steps of the centre, which take a millisecond each, a hundredth
 * and at most a million. QUANTITY: that one only.
 * Ends with status 1 when one exceeds its bound.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "core/latency.h"
#include "daemon/input/pose_log.h"
#include "drivers/devices/clock_map.h"
#include "grid/range/usual.h"
#include "grid/sphere/view.h"
#include "grid/voxel/submap.h"
#include "tests/water/dice.h"
#include "report/lib/stable.h"
#include "report/lib/stable_sphere.h"

/* As usual, with little room: what an update costs here is not what is asked for. */
static struct sphere_conf small_grid(double forget_s)
{
    struct sphere_conf conf = stable_sphere_usual;
    conf.max_cells = 64;
    conf.forget_s = forget_s;
    return conf;
}

/*
 * Hits and misses 0.02 to 0.08 s apart, fading between them, in long double beside it. Every event rounds a float below
 * 8 by up to 2.4e-7; all that fading over 3.7 s has not forgotten of them is 4.4e-5 at most. Naive:
 * time in seconds, in float.
 */
static void evidence(uint64_t n, struct stable_found *f)
{
    const struct sphere_conf conf = small_grid(10);
    const long double hit = log1pl(0.9f * 4.0L), miss = logl(0.5L / 0.9L),
                      fade_s = 10 / logl(6 / logl(0.6L / 0.4L));
    struct stable_sphere s = stable_sphere(&conf);
    struct dice dice = dice_of(1, 31);
    const uint64_t started = s.t_ns;
    long double want = 0;
    double plain = 0;
    float last_s = 0;

    f->naive = f->ours = 0;
    for (uint64_t i = 0; i < n; i++) {
        const uint64_t bits = dice_bits(&dice), dt_ns = 20000000 + bits % 60000000;
        const bool hears = (bits >> 40) % 10 < 3;
        const float now_s = (float)((double)(s.t_ns + dt_ns - started) * 1e-9);
        s.t_ns += dt_ns;
        stable_ping(&s, 1, hears ? 5 : 0, 10);
        want *= expl(-(long double)dt_ns * 1e-9L / fade_s);
        plain *= exp(-(double)(now_s - last_s) / (double)fade_s);
        last_s = now_s;
        if (hears || want > 0)
            want = fminl(want + (hears ? hit : miss), 6);
        if (want < 1e-6L)
            want = 0;
        plain = fmax(0, fmin(plain + (double)(hears ? hit : miss), 6));
        f->ours = stable_worse(f->ours, fabs((double)(stable_cell(&s, 1).logodds - want)));
        f->naive = stable_worse(f->naive, fabs(plain - (double)want));
    }
    free(s.sphere);
}

/* How far the nearest cell of the grid is from a place in the world. */
static double cell_off(struct stable_sphere *s, const double place_m[3])
{
    double centre_m[3], nearest = INFINITY;
    struct sphere_stats stats;
    struct sphere_cell c;
    sphere_centre(s->sphere, centre_m);
    sphere_stats(s->sphere, &stats);
    for (uint32_t d = 0; d < stats.directions; d++)
        for (uint32_t k = 0; sphere_cell(s->sphere, d, k, s->t_ns, &c); k++) {
            double off2 = 0;
            for (int a = 0; a < 3; a++)
                off2 += pow(centre_m[a] + c.point_m[a] - place_m[a], 2);
            nearest = fmin(nearest, sqrt(off2));
        }
    return nearest;
}

/* A post that is heard again whenever the vehicle is back where it first heard it, 15 steps out of 16 of up to 0.3 m at
 * other places. Naive: every step is taken off the echo, in float. */
static void steps_of_the_centre(uint64_t n, struct stable_found *f)
{
    const struct sphere_conf conf = small_grid(160);
    const double az_rad = geo_rad(1), post_m[3] = {5 * cos(az_rad), 5 * sin(az_rad), 0};
    struct stable_sphere s = stable_sphere(&conf);
    struct dice dice = dice_of(2, 31);
    double *north_m = s.pose.position_m;
    float kept = (float)post_m[0];
    s.pose.has = POSE_ATTITUDE | POSE_POSITION;
    f->ours = 0;
    for (uint64_t i = 0; i < n; i++) {
        const bool home = i % 16 == 0;
        const double last_m = *north_m;
        *north_m = home ? 0 : copysign(0.11 + 0.04 * dice_uniform(&dice), i % 2 ? 1 : -1);
        kept -= (float)(*north_m - last_m);
        s.t_ns += STABLE_SECOND / 25;
        if (home)
            stable_ping(&s, 1, 5, 0);
        else
            stable_ping(&s, 200, 0, 0.4);
        if (i % 1000 == 0 || i + 1 == n)
            f->ours = stable_worse(f->ours, cell_off(&s, post_m));
    }
    f->naive = fabs((double)kept - (post_m[0] - *north_m));
    free(s.sphere);
}

static int by_size(const void *a, const void *b)
{
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

/* The median of the last 64 noise levels, some of them of other sound, sorted anew now and then. Naive: the mean of the
 * same, kept as a sum in float to which the newest is added and the oldest taken off. */
static void usual_levels(uint64_t n, struct stable_found *f)
{
    enum { PINGS = 64 };
    static struct usual u;
    static uint64_t last[PINGS], sorted[PINGS], got;
    struct dice dice = dice_of(3, 31);
    float sum = 0;
    usual_init(&u, PINGS, 4);
    f->ours = 0;
    for (uint64_t i = 0; i < n; i++) {
        const uint64_t bits = dice_bits(&dice), level = bits % 1000 + (bits >> 40 & 15 ? 0 : bits >> 44);
        sum += (float)level - (float)last[i % PINGS];
        last[i % PINGS] = level;
        usual_add(&u, level);
        if (i < PINGS || (i % 1024 && i + 1 < n))
            continue;
        memcpy(sorted, last, sizeof sorted);
        qsort(sorted, PINGS, sizeof sorted[0], by_size);
        f->ours += !usual_get(&u, &got) || got != sorted[(PINGS - 1) / 2];
    }
    double mean = 0;
    for (int k = 0; k < PINGS; k++)
        mean += (double)last[k] / PINGS;
    f->naive = fabs((double)sum / PINGS - mean);
}

/* A clock of milliseconds, 400 ppm slow, a frame a second, every other one up to 30 ms late.
 * Naive: the first offset. */
static void clock_fit(uint64_t n, struct stable_found *f)
{
    static struct clock_map map;
    struct dice dice = dice_of(4, 31);
    const uint64_t wrap = UINT64_C(1) << 32, started = 1000 * STABLE_SECOND;
    clock_map_init(&map, wrap, 1000000);
    f->ours = 0;
    for (uint64_t i = 0; i < n; i++) {
        const uint64_t bits = dice_bits(&dice), since_ns = i * STABLE_SECOND,
                       late_ns = i % 2 ? bits % 30000000 : 0;
        const uint64_t count = (since_ns / 1000000 - 2 * i / 5) % wrap, stamped = started + since_ns;
        const uint64_t got = clock_map_put(&map, count, stamped + late_ns);
        if (i > 60)
            f->ours = stable_worse(f->ours, fabs((double)(int64_t)(got - stamped)) * 1e-6);
    }
    f->naive = (double)n * 400e-6 * 1e3;
    if (map.restarts || map.out_of_order)
        f->ours = INFINITY;
}

/* To and fro at 1 m/s by the velocity alone, ten times a second: the way of what is towed, as a share of it, and m that
 * the place is off, whichever is more. Naive: the way in float. */
static void way_driven(uint64_t n, struct stable_found *f)
{
    enum { LEG = 1000 };
    static struct pose_log log;
    struct pose p = pose_identity, newest;
    float way_m = 0;
    const int64_t line = llround(POSE_LOG_LINE_M * 10);
    int64_t tenths = 0, towed = 0, want = 0; /* tenths of a metre, exact */

    pose_log_init(&log, 2 * STABLE_SECOND);
    p.has = POSE_ATTITUDE | POSE_VELOCITY;
    for (uint64_t i = 0; i < n; i++) {
        const bool back = i / LEG % 2;
        p.t_ns = (i + 1) * (STABLE_SECOND / 10);
        p.velocity_mps[0] = back ? -1 : 1;
        pose_log_put(&log, &p);
        if (i == 0) /* where the way begins */
            continue;
        tenths += back ? -1 : 1;
        if (llabs(tenths - towed) <= line)
            continue;
        towed += back ? -1 : 1;
        want++;
        way_m += 0.1f;
    }
    pose_log_newest(&log, &newest);
    const double want_m = 0.1 * (double)want;
    f->naive = fabs((double)way_m / want_m - 1);
    f->ours = stable_worse(fabs(log.path_m / want_m - 1), fabs(newest.position_m[0] - 0.1 * (double)tenths));
}

/* Looks that find one voxel free: counts that are less than before, or not the looks up to 255. Naive: a count of 8
 * bits that nothing stops: looks after which the voxel is not free. */
static void looks_at_a_voxel(uint64_t n, struct stable_found *f)
{
    struct tiles tiles;
    struct submap map;
    struct cast_opening opening;
    struct cast_beam beam;
    struct fault fault;
    const struct lattice_place origin = {{0, 0, 0}, {0.5, 0.5, 0.5}};
    const int64_t ahead[3] = {2, 0, 0};
    void *memory[] = {stable_memory(tiles_bytes(16, 64, 1)), stable_memory(submap_bytes(4, 64))};
    uint8_t wrapping = 0;
    tiles_init(&tiles, memory[0], 16, 64, 1);
    submap_init(&map, memory[1], 4, &tiles, &origin);
    cast_opening_init(&opening, CAST_WEDGE, geo_rad(1.5), geo_rad(1.5), 0, &fault);
    cast_aim(
        &beam, &opening,
        &(struct cast_look){.apex = &origin, .attitude = pose_identity.attitude, .far_m = 0.35, .voxel_m = 0.1});
    f->naive = f->ours = 0;
    for (uint64_t i = 1; i <= n; i++) {
        submap_cast(&map, &beam, SUBMAP_VACANCY);
        f->ours += submap_count(&map, SUBMAP_VACANCY, ahead) != (i < 255 ? i : 255);
        f->naive += ++wrapping <= 1 && i > 1;
    }
    free(memory[0]);
    free(memory[1]);
}

/* Durations from 1 ns to 4 ms in turns: how many, their sum, their median and 99 % are those of the first turn.
 * Naive: counted in float. */
static void latencies(uint64_t n, struct stable_found *f)
{
    enum { TURN = 4096 };
    static struct latency of_all, of_one;
    float counted = 0;
    uint64_t sum_ns = 0;
    for (uint64_t i = 0; i < n; i++) {
        const uint64_t ns = 1 + i % TURN * 1000;
        latency_add(&of_all, ns);
        if (i < TURN)
            latency_add(&of_one, ns);
        sum_ns += ns;
        counted += 1;
    }
    f->naive = (double)n - (double)counted;
    f->ours = (of_all.count != n) + (of_all.sum_ns != sum_ns) + (of_all.max_ns != of_one.max_ns);
    if (n % TURN == 0)
        for (double q = 0.5; q < 1; q += 0.49)
            f->ours += latency_quantile(&of_all, q) != latency_quantile(&of_one, q);
}

static const struct quantity {
    const char *name, *input, *measure, *naive_method;
    double bound;
    void (*run)(uint64_t n, struct stable_found *f);
    uint64_t dear; /* so many times fewer updates, and then at most a million; 1: as many as asked for */
} quantities[] = {
    {"evidence", "pings that hear or do not, 0.02 to 0.08 s apart", "log-odds off those in long double, worst",
     "time since the start in float", 4.4e-5, evidence, 1},
    {"centre", "steps of the centre of up to 0.3 m, a post heard at every 16th", "m that its cell is off, worst",
     "every step taken off the echo, in float", 1e-6, steps_of_the_centre, 100},
    {"usual level", "noise levels of pings", "wrong medians of the last 64, every 1024th looked at",
     "running sum in float: off its mean", 0, usual_levels, 1},
    {"clock", "a second each of a clock of ms that is 400 ppm slow", "ms that stamps are off, worst",
     "the first offset", 2, clock_fit, 1},
    {"way", "velocities, ten a second, to and fro by 100 m", "share of the way, or m of place, that it is off",
     "the way added up in float", 1e-6, way_driven, 1},
    {"voxel", "looks that find it free", "wrong counts", "a count of 8 bits wraps: times not free", 0,
     looks_at_a_voxel, 1},
    {"latency", "durations of 1 ns to 4 ms", "wrong counts, sums, quantiles", "counts in float: lost", 0,
     latencies, 1},
};

static uint64_t updates_of(const struct quantity *q, uint64_t n)
{
    return q->dear == 1 ? n : n / q->dear < 1000000 ? n / q->dear : 1000000;
}

int main(int argc, char **argv)
{
    const char *size = argc > 1 ? argv[1] : "", *only = argc > 2 ? argv[2] : NULL;
    const uint64_t n = strcmp(size, "quick") == 0 ? 100000 : strcmp(size, "long") == 0 ? 1000000000 : 1000000;
    bool failed = false;
    printf("quantity,updates,input,naive_method,naive,measure,bound,measured,verdict\n");
    for (const struct quantity *q = quantities; q < quantities + sizeof quantities / sizeof quantities[0]; q++) {
        struct stable_found found = {.naive = NAN, .ours = NAN};
        if (only && strcmp(only, q->name) != 0)
            continue;
        const uint64_t updates = updates_of(q, n);
        q->run(updates, &found);
        const bool holds = found.ours <= q->bound;
        printf("%s,%.0e,\"%s\",\"%s\",%.3g,\"%s\",%g,%.3g,%s\n", q->name, (double)updates, q->input,
               q->naive_method, found.naive, q->measure, q->bound, found.ours, holds ? "pass" : "FAIL");
        fflush(stdout);
        failed |= !holds;
    }
    return failed;
}
