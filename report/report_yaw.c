/* SPDX-License-Identifier: MIT */
/*
 * report_yaw - a vehicle that yaws fast while the head turns: what the time between two poses costs, with true first
 * ranges, so that nothing but the heading is wrong.
 *
 *   report_yaw [quick]   CSV: world, yaw_degps, pose_hz, method, heading_p95_deg, then of false free water (m3) the
 *                        median and the range over seeds, the deepest of it (m), ns per pose asked for
 *
 * shipped: as the daemon, which knows poses up to the ping; between:
 * it waits for the pose after it; last: the naive one.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "daemon/input/pose_log.h"
#include "report/lib/chart.h"
#include "report/lib/cost.h"
#include "tests/water/dice.h"

#define SEEDS    5
#define PINGS    (2 * DIVE_TURN)
#define PERIOD_S 4.0 /* of the vehicle's yaw to and fro */
#define VOXEL_M  0.1

enum method { SHIPPED, BETWEEN, LAST, METHODS };

static const char *const method_name[METHODS] = {"shipped", "between", "last"};

static double yaw_at(double yaw_degps, double t_s)
{
    return geo_rad(yaw_degps) * PERIOD_S / GEO_TURN * sin(GEO_TURN * t_s / PERIOD_S);
}

static void turn_look(struct dive_look *look, size_t i, double yaw_rad)
{
    static const double unit[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    quat_from_rpy(0, 0, yaw_rad + GEO_TURN * (double)(i % DIVE_TURN) / DIVE_TURN, look->attitude);
    for (int a = 0; a < 3; a++)
        quat_rotate(look->attitude, unit[a], look->axis[a]);
}

static void put(struct pose_log *log, double t_s, double yaw_degps)
{
    struct pose p = pose_identity;
    p.t_ns = (uint64_t)(t_s * 1e9);
    p.has = POSE_ATTITUDE;
    quat_from_rpy(0, 0, yaw_at(yaw_degps, t_s), p.attitude);
    pose_log_put(log, &p);
}

struct outcome {
    double heading_p95_deg, false_m3, behind_m, ns;
};

/* One run: truth[PINGS] has where each beam really looked and what it met first; poses begin `phase` of a step late. */
static struct outcome run(const struct place *world, const struct dive_look *truth, double yaw_degps,
                          double pose_hz, enum method method, double phase)
{
    static struct pose_log log;
    static double off_deg[PINGS];
    const struct chart_setting set = {.voxel_m = VOXEL_M, .rule = {.threshold = 1}};
    struct chart *chart = chart_make(world, &set);
    struct outcome out;
    double next_s = 9 + phase / pose_hz, spent_ns = 0; /* poses have come for a second */
    pose_log_init(&log, 1000000000u);
    for (size_t i = 0; i < PINGS; i++) {
        struct dive_look look = truth[i];
        struct pose pose;
        double roll, pitch, yaw;
        const double known_s = look.t_s + (method == BETWEEN ? 1 / pose_hz : 0);
        for (; next_s <= known_s; next_s += 1 / pose_hz)
            put(&log, next_s, yaw_degps);
        const double started_ns = cost_now_ns();
        if (method == LAST)
            pose_log_newest(&log, &pose);
        else
            pose_log_at(&log, (uint64_t)(look.t_s * 1e9), &pose);
        spent_ns += cost_now_ns() - started_ns;
        quat_to_rpy(pose.attitude, &roll, &pitch, &yaw);
        off_deg[i] = fabs(geo_deg(geo_wrap_pi(yaw - yaw_at(yaw_degps, look.t_s))));
        turn_look(&look, i, yaw);
        chart_enter_truth(chart, &look, 0);
    }
    double free_m3;
    out.false_m3 = chart_false_free(chart, 0, &out.behind_m, &free_m3);
    cost_sort(off_deg, PINGS);
    out.heading_p95_deg = cost_quantile(off_deg, PINGS, 0.95);
    out.ns = spent_ns / PINGS;
    chart_free(chart);
    return out;
}

static void row(const struct place *world, const struct dive_look *truth, double yaw_degps, double pose_hz,
                enum method method, unsigned seeds)
{
    double heading[SEEDS], wrong[SEEDS], behind[SEEDS], ns[SEEDS];
    for (unsigned s = 0; s < seeds; s++) {
        struct dice dice = dice_of(s + 1, (uint64_t)pose_hz);
        const struct outcome o = run(world, truth, yaw_degps, pose_hz, method, dice_uniform(&dice));
        heading[s] = o.heading_p95_deg;
        wrong[s] = o.false_m3;
        behind[s] = o.behind_m;
        ns[s] = o.ns;
    }
    cost_sort(heading, seeds);
    cost_sort(wrong, seeds);
    cost_sort(behind, seeds);
    cost_sort(ns, seeds);
    printf("%s,%g,%g,%s,%.4g,%.4g,%.4g,%.4g,%.3g,%.0f\n", world->name, yaw_degps, pose_hz, method_name[method],
           cost_quantile(heading, seeds, 0.5), cost_quantile(wrong, seeds, 0.5), wrong[0], wrong[seeds - 1],
           behind[seeds - 1], cost_quantile(ns, seeds, 0.5));
}

int main(int argc, char **argv)
{
    static const double yaw_degps[] = {0, 10, 30, 90, 180}, pose_hz[] = {5, 10, 20, 50, 100};
    static struct dive_look truth[PINGS];
    const bool quick = argc > 1 && strcmp(argv[1], "quick") == 0;
    const struct place *world = place_named("box tank");
    printf(
        "world,yaw_degps,pose_hz,method,heading_p95_deg,false_free_m3,false_free_low,false_free_high,behind_max_m,"
        "ns_per_pose\n");
    for (int y = 0; y < 5; y += quick ? 4 : 1) {
        for (size_t i = 0; i < PINGS; i++) {
            truth[i] = (struct dive_look){.t_s = 10 + (double)i / DIVE_RATE_HZ, .at = {-1, 0.4, 3}};
            turn_look(&truth[i], i, yaw_at(yaw_degps[y], truth[i].t_s));
            truth[i].first_m = place_first(world, truth[i].at, truth[i].axis, geo_rad(DIVE_AZ_DEG / 2),
                                           geo_rad(DIVE_EL_DEG / 2), DIVE_RANGE_M, 0);
        }
        for (int p = 0; p < 5; p += quick ? 4 : 1)
            for (int m = 0; m < METHODS; m++)
                row(world, truth, yaw_degps[y], pose_hz[p], (enum method)m, quick ? 2 : SEEDS);
    }
    return 0;
}
