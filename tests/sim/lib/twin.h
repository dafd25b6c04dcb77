/* SPDX-License-Identifier: MIT */
/*
 * twin - the program around a small virtual sonar on a pseudo-terminal: command line, scene and water, line with its
 * faults, commands on standard input, the monotonic clock. Knows no protocol; that is in struct twin_ops.
 */
#ifndef SONARD_SIM_TWIN_H
#define SONARD_SIM_TWIN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "line.h"
#include "tests/water/scene.h"
#include "tests/sound/water.h"

#define TWIN_NEVER UINT64_MAX

struct twin_ops {
    const char *name, *what, *options;                   /* for --help; options: lines of the twin's own, or "" */
    bool (*option)(const char *name, const char *value); /* false: unknown or senseless */
    void (*feed)(const uint8_t *bytes, size_t n, uint64_t now_ns); /* from the host */
    uint64_t (*tick)(uint64_t now_ns);                             /* do what is due; returns when to call again */
};

/* The one there is. */
struct twin {
    struct place scene;
    struct water water;
    struct line line;
    double position_m[3], yaw_deg; /* of the vehicle, NED; the sonar looks ahead */
    uint64_t start_ns, pings;
};

extern struct twin twin;

/** twin_send - a frame, or a line, to the host. */
void twin_send(const void *bytes, size_t n, uint64_t now_ns);

/**
 * twin_listen - counts[n] of one transmission, n <= WATER_MAX_SAMPLES: pressure from 0 to full scale as 0 to
 * `full_scale`, linear. az_deg from the bow, clockwise. Bins cover 0 .. range_m at 1500 m/s.
 */
void twin_listen(double az_deg, double range_m, double pulse_s, uint32_t n, unsigned full_scale, uint64_t now_ns,
                 uint8_t *counts);

/** twin_main - what main returns. */
int twin_main(int argc, char **argv, const struct twin_ops *ops);

#endif
