/* SPDX-License-Identifier: MIT */
/* stable_time - cases P: poses, device clocks and depths as they should not come. */
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "daemon/input/depth.h"
#include "daemon/input/pose_log.h"
#include "drivers/devices/clock_map.h"
#include "grid/geometry.h"
#include "tests/water/dice.h"
#include "stable.h"

#define MS UINT64_C(1000000)

static void attitudes(bool quick, struct stable_found *f)
{
    static const struct {
        double q[4];
        bool good;
    } row[] = {{{NAN, 0, 0, 0}, false},    {{INFINITY, 0, 0, 0}, false}, {{0, 0, 0, 0}, false},
               {{1e-3, 0, 0, 0}, false},   {{1.05, 0, 0, 0}, true},      {{1e200, 1e200, 0, 0}, false},
               {{0.7, 0.7, 0.01, 0}, true}};

    (void)quick;
    f->naive = f->ours = 0;
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        double q[4], n2 = 0;
        memcpy(q, row[i].q, sizeof q);
        const bool good = quat_normalise(q);
        for (int k = 0; k < 4; k++)
            n2 += q[k] * q[k];
        f->ours += good != row[i].good || (good && fabs(n2 - 1) > 1e-15);
        double plain = 0;
        for (int k = 0; k < 4; k++)
            plain += row[i].q[k] * row[i].q[k];
        f->naive += !row[i].good && plain != 1; /* it is divided by its length, whatever that is */
    }
}

/* The shortest way in long double; t in [0, 1]. */
static void slerp_by_hand(const double a[4], const double b[4], double t, long double out[4])
{
    long double dot = 0, n2 = 0;
    for (int k = 0; k < 4; k++)
        dot += (long double)a[k] * b[k];
    const long double sign = dot < 0 ? -1 : 1;
    long double chord = 0;
    for (int k = 0; k < 4; k++)
        chord += (a[k] - sign * b[k]) * (a[k] - sign * b[k]);
    const long double angle = 2 * asinl(fminl(1, sqrtl(chord) / 2)), s = sinl(angle);
    for (int k = 0; k < 4; k++) {
        out[k] = s > 1e-18L ? (sinl((1 - t) * angle) * a[k] + sinl(t * angle) * sign * b[k]) / s
                            : (1 - t) * a[k] + t * sign * b[k];
        n2 += out[k] * out[k];
    }
    for (int k = 0; k < 4; k++)
        out[k] /= sqrtl(n2);
}

/* Turns of 0, denormal, 1e-15 ... half a turn, and their antipodes: worst component, in ulp of 1. */
static void slerps(bool quick, struct stable_found *f)
{
    static const double turn[] = {0, 1e-310, 1e-15, 1e-8, 1e-4, 0.1, 1, 3, GEO_PI - 1e-9};
    (void)quick;
    f->naive = f->ours = 0;
    for (size_t i = 0; i < sizeof turn / sizeof turn[0]; i++)
        for (int sign = -1; sign <= 1; sign += 2)
            for (double t = 0; t <= 1; t += 0.125) {
                const double a[4] = {1, 0, 0, 0}, b[4] = {sign * cos(turn[i] / 2), 0, 0, sign * sin(turn[i] / 2)};
                const double dot = b[0], angle = acos(dot); /* naive: no short way, no small angles */
                long double want[4];
                double got[4];
                slerp_by_hand(a, b, t, want);
                quat_slerp(a, b, t, got);
                for (int k = 0; k < 4; k++) {
                    const double plain = (sin((1 - t) * angle) * a[k] + sin(t * angle) * b[k]) / sin(angle);
                    f->ours = stable_worse(f->ours, fabs((double)(got[k] - want[k])) / 0x1p-52);
                    f->naive = stable_worse(f->naive, fabs((double)(plain - want[k])) / 0x1p-52);
                }
            }
}

static void put(struct pose_log *log, uint64_t t_ms, double north)
{
    struct pose p = pose_identity;
    p.t_ns = t_ms * MS;
    p.has = POSE_POSITION | POSE_DEPTH | POSE_ATTITUDE;
    p.position_m[0] = north;
    pose_log_put(log, &p);
}

/* Pings before, between, in a gap, after: places that are wrong or given where none is known. */
static void ping_times(bool quick, struct stable_found *f)
{
    static struct pose_log log;
    static const struct {
        uint64_t at_ms;
        double north; /* NAN: none is known */
        double nearest;
    } row[] = {{500, NAN, 0},  {1000, 0, 0},   {1050, 0.5, 0},   {1100, 1, 1},
               {1150, 1.5, 1}, {2500, NAN, 2}, {5050, 10.5, 10}, {9000, NAN, 11}};

    (void)quick;
    pose_log_init(&log, 500 * MS);
    put(&log, 1000, 0);
    put(&log, 1100, 1);
    put(&log, 1200, 2);
    put(&log, 1200, 99); /* the same time again: refused */
    put(&log, 5000, 10); /* a gap before it */
    put(&log, 5100, 11);
    f->naive = f->ours = 0;
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct pose p;
        pose_log_at(&log, row[i].at_ms * MS, &p);
        const bool known = p.has & POSE_POSITION;
        f->ours += known ? !(fabs(p.position_m[0] - row[i].north) < 1e-9) : !isnan(row[i].north);
        f->naive += !(fabs(row[i].nearest - row[i].north) < 1e-9); /* the sample before */
    }
}

/* Counters that wrap, repeat, jump: stamps after the frame's arrival or off by more than its delay. */
static void device_clocks(bool quick, struct stable_found *f)
{
    static const uint64_t wrap[] = {UINT64_C(1) << 32, 86400000, 65536};
    static struct clock_map map;
    (void)quick;
    f->naive = f->ours = 0;
    for (int w = 0; w < 3; w++) {
        clock_map_init(&map, wrap[w], MS);
        for (uint64_t i = 0; i < 1000; i++) {
            const uint64_t t_ns = (50000 + i * 100) * MS, count = (wrap[w] - 5000 + i * 100) % wrap[w];
            f->ours += clock_map_put(&map, count, t_ns) != t_ns;
            f->naive += i > 0 && count * MS + (50000 - (wrap[w] - 5000)) * MS != t_ns; /* a fixed offset */
        }
        static const int64_t jump_ms[] = {0, -5, -3600000, 86400000, -900};
        for (int j = 0; j < 5; j++) {
            const uint64_t host_ns = 200000 * MS + (uint64_t)j * 1000 * MS;
            const uint64_t got = clock_map_put(
                &map, (wrap[w] + 1000 + (uint64_t)((int64_t)wrap[w] * 1000 + jump_ms[j])) % wrap[w], host_ns);
            f->ours += got > host_ns;
        }
    }
}

/* Drift of 0 to 400 ppm under delays of up to 30 ms, and 2000 ppm, which is no clock: error of the stamps in ms. */
static void drifts(bool quick, struct stable_found *f)
{
    static struct clock_map map;
    static const double ppm[] = {0, 50, -400, 400};
    struct dice dice = dice_of(5, 0);
    (void)quick;
    f->naive = f->ours = 0;
    for (int k = 0; k < 4; k++) {
        clock_map_init(&map, UINT64_C(1) << 32, MS);
        for (uint64_t i = 0; i < 6000; i++) { /* ten minutes */
            const double true_s = 100 + 0.1 * (double)i,
                         delay_s = 0.03 * dice_uniform(&dice) * dice_uniform(&dice);
            const uint64_t count = (uint64_t)(true_s * (1 + ppm[k] * 1e-6) * 1e3);
            const uint64_t got = clock_map_put(&map, count, (uint64_t)((true_s + delay_s) * 1e9));
            if (i < 600)
                continue;
            f->ours = stable_worse(f->ours, fabs((double)got * 1e-9 - true_s) * 1e3);
            f->naive =
                stable_worse(f->naive, fabs(ppm[k] * 1e-6 * (true_s - 100)) * 1e3); /* offset of the first pair */
        }
    }
    clock_map_init(&map, UINT64_C(1) << 32, MS);
    for (uint64_t i = 0; i < 1200; i++)
        clock_map_put(&map, (uint64_t)((double)i * 100 * 1.002), (100000 + i * 100) * MS);
    if (map.restarts == 0)
        f->ours = INFINITY;
}

static void depths(bool quick, struct stable_found *f)
{
    const struct conf_depth conf = {
        .scale = 1, .unit = CONF_UNIT_DBAR, .surface_pa = 101325, .plausible_m = {-1, 300}, .speed_limit_mps = 3};
    static const double bad[] = {-5, -1e9, NAN, INFINITY, -INFINITY, 1e5, 1e300};
    (void)quick;
    f->naive = f->ours = 0;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        const double depth_m = depth_of_value(&conf, 1025, bad[i]);
        f->ours += depth_plausible(&conf, depth_m, 1000 * MS, 0, 0);
        f->naive += !(bad[i] < 0); /* only negative pressures are refused */
    }
    const double one = depth_of_value(&conf, 1025, 20.1325);
    f->ours += !depth_plausible(&conf, one, 1000 * MS, one, 900 * MS);
    f->ours += depth_plausible(&conf, one + 50, 1000 * MS, one, 900 * MS);
}

const struct stable_case stable_time[] = {
    {"P1", "quaternions: NaN, infinite, zero, 1e-3, 1.05, 1e200 long", "wrongly taken or refused",
     "divided by its length", 0, attitudes},
    {"P2", "turns of 0, 1e-310, 1e-15 ... half a turn, antipodes", "error in ulp of 1", "slerp by acos", 8,
     slerps},
    {"P3", "pings before, between, in a gap, after the poses", "wrong or invented places", "the sample before", 0,
     ping_times},
    {"P4", "counters that wrap at 2^32, a day, 2^16; jumps", "stamps wrong or from the future", "a fixed offset",
     0, device_clocks},
    {"P5", "drift of 400 ppm under delays of 30 ms; 2000 ppm", "ms off, worst after a minute", "the first offset",
     2, drifts},
    {"P6", "pressures negative, NaN, infinite, 1e5 dbar; a leap of 50 m", "believed", "negative ones are refused",
     0, depths},
    {0},
};
