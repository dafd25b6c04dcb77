/* SPDX-License-Identifier: MIT */
/* stable_grid - cases G of the spherical grid's evidence: saturation, fading, clocks, a million steps, far places. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "tests/water/dice.h"
#include "stable.h"
#include "stable_sphere.h"
#include "grid/sphere/view.h"

#define HIT  log1p(0.9f * 4.0)
#define MISS log(0.5 / 0.9)

/* Noise in all beams: cells beyond the pool; naive: every cell that was ever hit is kept. */
static void noise(bool quick, struct stable_found *f)
{
    struct sphere_conf conf = stable_sphere_usual;
    struct dice dice = dice_of(10, 0);
    struct sphere_stats st;
    conf.max_cells = 512;
    struct stable_sphere s = stable_sphere(&conf);
    const int pings = quick ? 3000 : 100000;
    for (int i = 0; i < pings; i++) {
        s.t_ns += 10000000;
        stable_ping(&s, 360 * dice_uniform(&dice), 1 + 18 * dice_uniform(&dice), 0);
    }
    sphere_stats(s.sphere, &st);
    f->derived = true;
    f->naive = pings - 512;
    f->ours = st.cells > 512 || st.cells_lost == 0 ? 1 : 0;
    uint32_t seen = 0;
    struct sphere_cell c;
    for (uint32_t d = 0; d < st.directions; d++)
        for (uint32_t k = 0; sphere_cell(s.sphere, d, k, s.t_ns, &c); k++, seen++)
            f->ours += !isfinite(c.logodds) || !isfinite(c.ball_m);
    f->ours += seen != st.cells;
    free(s.sphere);
}

/* The stored point after a million equal echoes, against the place that they came from; naive:
 * a running sum in float. */
static void million_echoes(bool quick, struct stable_found *f)
{
    struct stable_sphere s = stable_sphere(&stable_sphere_usual);
    const int n = quick ? 20000 : 1000000;
    float sum = 0;
    for (int i = 0; i < n; i++) {
        s.t_ns += 1000;
        stable_ping(&s, 0.5, 10.1, 0);
        sum += 10.1f;
    }
    const struct sphere_cell c = stable_cell(&s, 0.5);
    const double r = sqrt(c.point_m[0] * c.point_m[0] + c.point_m[1] * c.point_m[1] + c.point_m[2] * c.point_m[2]);
    f->naive = fabs((double)(sum / (float)n) - 10.1);
    f->ours = fabs(r - 10.1);
    if (c.echoes != (n < 65535 ? n : 65535) || fabs(c.logodds - 6) > 1e-6)
        f->ours = INFINITY;
    free(s.sphere);
}

/*
 * A billion hits, then silence: misses until the cell is no obstacle. The clamp makes the state after a hundred hits
 * that after a billion, bit for bit, which is checked after every further hit of those that
 * time allows. Naive: no clamp.
 */
static void billion_hits(bool quick, struct stable_found *f)
{
    struct stable_sphere s = stable_sphere(&stable_sphere_usual);
    const int n = quick ? 20000 : 2000000;
    double after = 0;
    bool moved = false;
    for (int i = 0; i < n; i++) {
        stable_ping(&s, 0.5, 5, 0);
        if (i == 100)
            after = stable_cell(&s, 0.5).logodds;
    }
    moved = stable_cell(&s, 0.5).logodds != after;
    int misses = 0;
    for (; misses < 1000 && stable_cell(&s, 0.5).logodds > 0; misses++)
        for (double az = -4; az <= 4; az++)
            stable_ping(&s, az, 0, 8);
    f->derived = true;
    f->naive = ceil(1e9 * HIT / -MISS);
    f->ours = moved ? (double)INFINITY : (double)misses;
    free(s.sphere);
}

/* Fading at rates over eighteen decades, read a thousand times in between; naive: multiplied on at every read. */
static void fading(bool quick, struct stable_found *f)
{
    struct dice dice = dice_of(13, 0);
    f->naive = f->ours = 0;
    for (int decade = -9; decade <= 9; decade += 3) {
        struct sphere_conf conf = stable_sphere_usual;
        const double fade_s = pow(10, -decade);
        conf.forget_s = fade_s * log(6 / log(0.6 / 0.4));
        struct stable_sphere s = stable_sphere(&conf);
        stable_ping(&s, 0.5, 5, 0);
        const double l0 = stable_cell(&s, 0.5).logodds;
        const uint64_t t0 = s.t_ns;
        for (int i = 0; i < (quick ? 100 : 20000); i++) {
            const uint64_t dt_ns = (uint64_t)pow(10, 16 * dice_uniform(&dice));
            s.t_ns = t0 + dt_ns;
            const long double x = (long double)dt_ns * 1e-9L / fade_s;
            const double want = (double)(l0 * expl(-x)), got = stable_cell(&s, 0.5).logodds;
            /* e^-x cannot be nearer than the rounding of x */
            if (want > 1e-300)
                f->ours = stable_worse(f->ours, fabs(got / want - 1) / (1 + (double)x));
        }
        s.t_ns = t0;
        if (stable_cell(&s, 0.5).logodds != l0)
            f->ours = INFINITY;
        free(s.sphere);
        float kept = (float)l0; /* a hundred million reads of a nanosecond: the factor rounds to 1 */
        const float factor = (float)(1 - 1e-9 / fade_s);
        for (int i = 0; i < 1000000; i++)
            kept *= factor;
        if (fade_s >= 1e-3) {
            const double want = l0 * exp(-1e-3 / fade_s);
            f->naive = stable_worse(f->naive, fabs((double)kept - want) / want);
        }
    }
}

/* A clock that goes back by an hour; naive: e^(-dt) of a negative dt. */
static void backward(bool quick, struct stable_found *f)
{
    struct stable_sphere s = stable_sphere(&stable_sphere_usual);
    (void)quick;
    s.t_ns = 10000 * STABLE_SECOND;
    stable_ping(&s, 0.5, 5, 0);
    const struct sphere_cell a = stable_cell(&s, 0.5);
    s.t_ns -= 3600 * STABLE_SECOND;
    const struct sphere_cell b = stable_cell(&s, 0.5);
    stable_ping(&s, 0.5, 5, 0);
    const struct sphere_cell c = stable_cell(&s, 0.5);
    f->derived = true;
    f->naive = a.logodds * (exp(3600 / 160.0 * log(6 / log(0.6 / 0.4))) - 1);
    f->ours = fabs(b.logodds - a.logodds) + fmax(0, c.logodds - 2 * a.logodds - 1e-6);
    if (c.t_echo_ns != a.t_echo_ns || c.t_first_ns != a.t_first_ns)
        f->ours = INFINITY;
    free(s.sphere);
}

/* A million steps of a micrometre: where the echo is afterwards, against a metre and a bit nearer. */
static void small_steps(bool quick, struct stable_found *f)
{
    struct stable_sphere s = stable_sphere(&stable_sphere_usual);
    float kept = 6;
    const int n = quick ? 100000 : 1000000;
    const double step_m = 1.0 / n;
    s.pose.has = POSE_ATTITUDE | POSE_POSITION;
    stable_ping(&s, 0.5, 6, 0);
    const struct sphere_cell a = stable_cell(&s, 0.5);
    for (int i = 1; i <= n; i++) {
        s.pose.position_m[0] = s.pose.path_m = i * step_m;
        if (i % 10 == 0)
            stable_ping(&s, 180, 0, 0.4);
        kept -= (float)step_m; /* naive: every step taken off the stored echo, in float */
    }
    s.pose.position_m[0] = 1.11; /* the centre comes all the way */
    stable_ping(&s, 180, 0, 0.4);
    double nearest = INFINITY;
    for (double az = -8; az <= 8; az++) {
        const struct sphere_cell c = stable_cell(&s, az);
        if (c.echoes)
            nearest = fmin(nearest, fabs(c.point_m[0] - (a.point_m[0] - 1.11)));
    }
    f->naive = fabs((double)kept - 5);
    f->ours = nearest;
    free(s.sphere);
}

static void small_turns(bool quick, struct stable_found *f)
{
    struct stable_sphere s = stable_sphere(&stable_sphere_usual);
    const int n = quick ? 10000 : 1000000;
    float x = 6, y = 0;
    s.pose.has = POSE_ATTITUDE | POSE_POSITION;
    stable_ping(&s, 0.5, 6, 0);
    const struct sphere_cell a = stable_cell(&s, 0.5);
    for (int i = 1; i <= n; i++) {
        quat_from_rpy(0, 0, i * 1e-5, s.pose.attitude);
        if (i % 10 == 0)
            stable_ping(&s, 180 - geo_deg(i * 1e-5), 0, 0.4);
        const float c = (float)cos(1e-5), w = (float)sin(1e-5),
                    was = x; /* naive: every step turns what is stored */
        x = c * x + w * y;
        y = c * y - w * was;
    }
    const struct sphere_cell b = stable_cell(&s, 0.5);
    f->naive = hypot((double)x - 6 * cos(n * 1e-5), (double)y + 6 * sin(n * 1e-5));
    f->ours = memcmp(a.point_m, b.point_m, sizeof a.point_m) || a.logodds != b.logodds || a.ball_m != b.ball_m;
    free(s.sphere);
}

/* The same at 1e7 m as at home; naive: world coordinates in float. */
static void far_away(bool quick, struct stable_found *f)
{
    double point[2][8][3];
    (void)quick;
    f->naive = f->ours = 0;
    for (int far = 0; far < 2; far++) {
        struct stable_sphere s = stable_sphere(&stable_sphere_usual);
        const double origin = far ? 1e7 : 0;
        s.pose.has = POSE_ATTITUDE | POSE_POSITION;
        s.pose.position_m[0] = origin;
        for (int u = 0; u < 8; u++)
            stable_ping(&s, u * 45 + 1, 4.02 + 0.5 * u, 0);
        s.pose.position_m[0] = origin + 0.75;
        stable_ping(&s, 22, 0, 0.4);
        for (int u = 0; u < 8; u++)
            memcpy(point[far][u], stable_cell(&s, u * 45 + 1).point_m, sizeof point[0][0]);
        free(s.sphere);
    }
    for (int u = 0; u < 8; u++)
        for (int i = 0; i < 3; i++) {
            const float stored = (float)(1e7 + point[0][u][i]);
            f->naive = stable_worse(f->naive, fabs((double)stored - 1e7 - point[0][u][i]));
            f->ours = stable_worse(f->ours, fabs(point[1][u][i] - point[0][u][i]));
        }
}

/* Stored evidence that is a denormal number or next to one; naive: what is left of it after every fading. */
static void denormals(bool quick, struct stable_found *f)
{
    struct sphere_conf conf = stable_sphere_usual;
    float kept = 0;
    (void)quick;
    conf.forget_s = 1;
    struct stable_sphere s = stable_sphere(&conf);
    f->naive = f->ours = 0;
    for (int i = 0; i < 3000; i++) {
        stable_ping(&s, 0.5, i % 60 ? 0 : 5, i % 60 ? 4 : 0);
        s.t_ns += STABLE_SECOND / 2;
        kept = i % 60 ? kept * 0.2f : 1.5f;
        kept = kept < 0 ? 0 : kept;
        f->naive += fpclassify(kept) == FP_SUBNORMAL;
        struct picture_entry e;
        picture_get(sphere_picture(s.sphere), stable_direction(&s, 0.5), &e);
        for (int k = 0; k < PICTURE_OBSTACLES; k++)
            f->ours += e.obstacle[k].logodds != 0 && fabs((double)e.obstacle[k].logodds) < 1e-6;
    }
    free(s.sphere);
}

const struct stable_case stable_grid[] = {
    {"G10", "1e5 echoes of noise all around, room for 512 cells", "cells beyond the room, senseless cells",
     "all are kept", 0, noise},
    {"G11", "1e6 equal echoes in one cell", "metres off", "running mean in float", 1e-5, million_echoes},
    {"G12", "a billion hits, then silence", "looks until it is gone", "log-odds without a limit", 10,
     billion_hits},
    {"G13", "fading at 1e-9 to 1e9 per second, read often", "relative error over 1 + rate * time",
     "multiplied on at every read, in float", 1e-12, fading},
    {"G14", "a clock that goes back by an hour", "log-odds grown", "exp(-dt)", 0, backward},
    {"G15", "1e6 steps of 1e-6 m", "metres off", "every step taken off the echo, in float", 1e-4, small_steps},
    {"G16", "1e6 turns of 1e-5 rad", "changed in the world", "every step turns the echo, in float (m)", 0,
     small_turns},
    {"G17", "the vehicle at 1e7 m", "metres off the grid at home", "world coordinates in float", 1e-3, far_away},
    {"G18", "evidence that fades to nothing", "values kept below 1e-6", "a factor per look, in float", 0,
     denormals},
    {0},
};
