/* SPDX-License-Identifier: MIT */
/*
 * clutter.h - noise as a sonar's receiver delivers it: independent exponential power, turned into counts under one of
 * the amplitude laws and back into power by the product's own tables. And limits for a rate counted in it.
 */
#ifndef SONARD_CLUTTER_H
#define SONARD_CLUTTER_H

#include "grid/range/amplitude.h"
#include "tests/sound/sound.h"

#define CLUTTER_LAWS 4

/* name, law, bytes of a sample, count of mean power, decibels per count */
static const struct clutter {
    const char *name;
    enum amplitude_law law;
    unsigned sample_bytes;
    double mean, db_per_count;
} clutter[CLUTTER_LAWS] = {
    {"power, 16 bit", AMPLITUDE_POWER, 2, 2000.0, 0.0},
    {"amplitude, 16 bit", AMPLITUDE_LINEAR, 2, 2000.0, 0.0},
    {"square root, 16 bit", AMPLITUDE_SQRT, 2, 1600.0, 0.0},
    {"decibels, 8 bit", AMPLITUDE_LOG, 1, 127.5, SOUND_MICRON_DB},
};

/* uniform in (0, 1] */
static inline double clutter_uniform(uint64_t *state)
{
    return test_uniform(state) + 0x1p-53;
}

/* The count that a device of this law gives for a power; 1 is the mean. */
static inline uint32_t clutter_count(const struct clutter *c, double power)
{
    return (uint32_t)fmax(sound_count(c->law, power, c->mean, c->db_per_count) + 0.5, 0.0);
}

/* x[n]: power of noise as the product sees it. */
static inline void clutter_fill(const struct clutter *c, const struct amplitude *table, uint64_t *seed, uint32_t n,
                                uint64_t *x)
{
    for (uint32_t i = 0; i < n; i++)
        x[i] = amplitude_of(table, clutter_count(c, -log(clutter_uniform(seed))));
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
