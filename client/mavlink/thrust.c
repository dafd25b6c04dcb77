/* SPDX-License-Identifier: MIT */
#include "thrust.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>

#define S 0.70710678118654752 /* sine of 45 degrees */

/* The four level thrusters of a vectored frame, at 45 degrees. */
#define VECTORED                                                                                                  \
    {{-S, S, 0}, 0, true}, {{-S, -S, 0}, 0, true}, {{S, S, 0}, 0, true},                                          \
    {                                                                                                             \
        {S, -S, 0}, 0, true                                                                                       \
    }

#define AHEAD                                                                                                     \
    {                                                                                                             \
        {1, 0, 0}, 0, false                                                                                       \
    }
#define SIDEWARDS                                                                                                 \
    {                                                                                                             \
        {0, 1, 0}, 0, false                                                                                       \
    }
#define UP                                                                                                        \
    {                                                                                                             \
        {0, 0, -1}, 0, false                                                                                      \
    }
#define DOWN                                                                                                      \
    {                                                                                                             \
        {0, 0, 1}, 0, false                                                                                       \
    }

#define SPLAYED_UP                                                                                                \
    {                                                                                                             \
        {0, 0, -1}, 0.5, false                                                                                    \
    }

/* By the signs of throttle (up), forward and lateral (right) in the mix. */
static const struct thrust_frame frames[] = {
    [0] = {6, {AHEAD, AHEAD, SPLAYED_UP, SPLAYED_UP, UP, SIDEWARDS}}, /* BlueROV1 */
    [1] = {6, {VECTORED, DOWN, DOWN}},                                /* vectored: the BlueROV2 */
    [2] = {8, {VECTORED, DOWN, DOWN, DOWN, DOWN}},                    /* vectored, six axes: BlueROV2 Heavy */
    [3] = {8, {UP, AHEAD, UP, SIDEWARDS, SIDEWARDS, UP, AHEAD, UP}},  /* six axes at right angles */
    [4] = {5, {AHEAD, AHEAD, DOWN, DOWN, SIDEWARDS}},                 /* SimpleROV of three, ... */
    [5] = {5, {AHEAD, AHEAD, DOWN, DOWN, SIDEWARDS}},                 /* ... of four, ... */
    [6] = {5, {AHEAD, AHEAD, DOWN, DOWN, SIDEWARDS}},                 /* ... and of five */
};

const struct thrust_frame *thrust_frame(int frame_config)
{
    return frame_config >= 0 && (size_t)frame_config < sizeof frames / sizeof *frames ? &frames[frame_config]
                                                                                      : NULL;
}

/* ---- the curve ---- */

/* Share of the greatest thrust at 12 V, by microseconds from the middle. */
static const struct {
    double us, strong, weak;
} curve[] = {{36, 0, 0},           {40, 0.0108, 0.0108}, {60, 0.035, 0.0297}, {80, 0.0674, 0.0566},
             {100, 0.105, 0.0863}, {148, 0.21, 0.165},   {200, 0.345, 0.275}, {252, 0.50, 0.40},
             {300, 0.663, 0.526},  {348, 0.83, 0.655},   {400, 1, 0.785}};

/* By volts: where the dead band ends, and the greatest thrust. */
static const struct {
    double volts, dead_us, most_n;
} battery[] = {{10, 36, 31.0}, {12, 36, 36.4}, {14, 32, 44.4}, {16, 28, 51.4},
               {18, 28, 59.0}, {20, 24, 65.9}, {25, 24, 85.0}};

static double between(double x, double x0, double x1, double y0, double y1)
{
    return y0 + (y1 - y0) * (x - x0) / (x1 - x0);
}

/* What the curve of 12 V has, stretched to another dead band. */
static double share_of(double us, double dead_us, bool strong)
{
    const double at_us = between(us, dead_us, 400, curve[0].us, 400);
    size_t c = 1;
    if (at_us <= curve[0].us)
        return 0;
    while (c + 1 < sizeof curve / sizeof *curve && curve[c].us < at_us)
        c++;
    return strong ? between(at_us, curve[c - 1].us, curve[c].us, curve[c - 1].strong, curve[c].strong)
                  : between(at_us, curve[c - 1].us, curve[c].us, curve[c - 1].weak, curve[c].weak);
}

/* The row of `battery` at or above so many volts, and one below it. */
static size_t battery_at(double volts)
{
    size_t b = 1;
    while (b + 1 < sizeof battery / sizeof *battery && battery[b].volts < volts)
        b++;
    return b;
}

double thrust_newtons(double us, double volts, bool strong)
{
    const size_t b = battery_at(volts);
    return between(volts, battery[b - 1].volts, battery[b].volts, battery[b - 1].most_n, battery[b].most_n) *
           share_of(us, battery[b].dead_us, strong);
}

struct thrust_range thrust_range(const struct thrust_motor *motor, int pulse_us, int direction, double volts)
{
    const int off_us = direction * (pulse_us - THRUST_PULSE_MID);
    const double most_n = THRUST_MOST * thrust_newtons(abs(off_us), volts, off_us >= 0 || !motor->strong),
                 least_n = THRUST_LEAST * thrust_newtons(abs(off_us), volts, off_us >= 0 && motor->strong);
    return off_us >= 0 ? (struct thrust_range){least_n, most_n} : (struct thrust_range){-most_n, -least_n};
}
