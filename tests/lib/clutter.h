/* SPDX-License-Identifier: MIT */
/*
 * clutter.h - noise as a sonar's receiver delivers it: independent exponential power, turned into counts under one of
 * the amplitude laws and back into power by the product's own tables. And limits for a rate counted in it.
 */
#ifndef SONARD_CLUTTER_H
#define SONARD_CLUTTER_H

#include <math.h>
#include <stdint.h>

#include "grid/range/amplitude.h"
#include "random.h"

#define CLUTTER_LAWS 4

/* name, law, bytes of a sample, mean power in units of the counts' power, decibels per count */
static const struct clutter {
    const char *name;
    enum amplitude_law law;
    unsigned sample_bytes;
    double mean, db_per_count;
} clutter[CLUTTER_LAWS] = {
    {"power, 16 bit", AMPLITUDE_POWER, 2, 2000.0, 0.0},
    {"amplitude, 16 bit", AMPLITUDE_LINEAR, 2, 4e6, 0.0},
    {"square root, 16 bit", AMPLITUDE_SQRT, 2, 1e8, 0.0},
    {"decibels, 8 bit", AMPLITUDE_LOG, 1, 256e4, 80.0 / 255.0},
};

/* uniform in (0, 1] */
static inline double clutter_uniform(uint64_t *state)
{
    return test_uniform(state) + 0x1p-53;
}

/* The count that a device of this law gives for a power. */
static inline uint32_t clutter_count(const struct clutter *c, double power)
{
    switch (c->law) {
    case AMPLITUDE_LINEAR:
        return (uint32_t)(sqrt(power) + 0.5);
    case AMPLITUDE_POWER:
        return (uint32_t)(power + 0.5);
    case AMPLITUDE_SQRT:
        return (uint32_t)(sqrt(sqrt(power * 65536.0)) + 0.5);
    case AMPLITUDE_LOG:
        return (uint32_t)fmax(10.0 * log10(power / 256.0) / c->db_per_count + 0.5, 0.0);
    }
    return 0;
}

/* x[n]: power of noise as the product sees it. */
static inline void clutter_fill(const struct clutter *c, const struct amplitude *table, uint64_t *seed, uint32_t n,
                                uint64_t *x)
{
    for (uint32_t i = 0; i < n; i++)
        x[i] = amplitude_of(table, clutter_count(c, -c->mean * log(clutter_uniform(seed))));
}

/* Wilson's limits of a probability of which `hits` of n were seen, z standard deviations wide. */
static inline void wilson(double hits, double n, double z, double *lo, double *hi)
{
    const double p = hits / n, scale = 1.0 + z * z / n;
    const double centre = (p + z * z / (2.0 * n)) / scale;
    const double half = z * sqrt(p * (1.0 - p) / n + z * z / (4.0 * n * n)) / scale;
    *lo = centre - half;
    *hi = centre + half;
}

#endif
