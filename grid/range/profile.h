/* SPDX-License-Identifier: MIT */
/*
 * profile - the intensities of one beam made ready for detection: sizes in bins, and the power of every resolution
 * cell (the bins within one pulse length). What the stages of extract hand each other; knows no detector.
 */
#ifndef SONARD_PROFILE_H
#define SONARD_PROFILE_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "grid/ping.h"
#include "amplitude.h"

/* The range axis of a ping, and sizes in bins that follow from its bin and pulse length. */
struct profile_axis {
    uint32_t n;      /* bins of a beam */
    double r0, dr;   /* metres */
    uint32_t half;   /* a resolution cell is the bin and so many on either side of it */
    uint32_t window; /* reference cells on each side */
    uint32_t guard;
    double resolution_bins; /* bins per independent cell, >= 1 */
    uint32_t deaf; /* bins that end within the pulse or the lock-out: quiet or not, they show no free water */
};

#define PROFILE_BLOCK 32 /* cells of a block */

static inline uint32_t profile_blocks(uint32_t n)
{
    return (n + PROFILE_BLOCK - 1) / PROFILE_BLOCK;
}

/* Indices of cells are bins from the head. */
struct profile {
    const struct profile_axis *axis;
    const struct amplitude *amplitude;
    const void *samples;  /* [n] counts */
    const uint8_t *blind; /* [n] 1: the cell holds a masked bin; NULL: nothing is masked */
    const uint8_t *own;   /* [n] counts of the vehicle's own echoes at this bearing; NULL: not known */
    const uint8_t *clean; /* [n] counts of the cleaned image; NULL: none */
    int lowest;           /* of `clean`, as in struct extract_aid */
    uint64_t *cell;       /* [n] power summed over the resolution cell around each bin */
    uint64_t *bits;       /* [profile_blocks(n)] all bits of the cells in a block: no cell of it is greater */
    const uint64_t *sum; /* [n + 1] power of the bins before each, times 2^shift; lost when the detector has run */
    unsigned shift;
    uint64_t floor_power; /* of a cell whose bins all have the floor's count */
    uint64_t full_power;  /* of a bin at full scale, in the scale of `cell` */
    uint32_t first;       /* cell behind the ring-down */
};

/**
 * profile_axis_of - the axis of a ping of at most max_bins bins. The guard is at least the pulse, the window at least
 * 8 resolution cells. False when the ping's numbers make no sense.
 */
bool profile_axis_of(struct profile_axis *axis, const struct ping *ping, double window_m, double guard_m,
                     uint32_t max_bins);

/**
 * profile_sum - fill cell, bits, sum, floor_power and full_power from counts[n] under a law (not always those of
 * `samples`). work: room for n + 1 sums, where `sum` lies. Loud beams of 16 bits are scaled down to stay within
 * CFAR_MAX_SUM.
 */
void profile_sum(struct profile *p, const struct amplitude *law, const void *counts, uint32_t floor_counts,
                 uint64_t *work);

/** profile_level - mean power of the cells from begin on, as many as given; before the detector has run. */
static inline uint64_t profile_level(const struct profile *p, uint32_t begin, uint32_t cells)
{
    return (p->sum[begin + cells] - p->sum[begin]) / cells * (2 * (uint64_t)p->axis->half + 1) >> p->shift;
}

static inline double profile_m(const struct profile *p, double bins)
{
    return p->axis->r0 + bins * p->axis->dr;
}

static inline uint32_t profile_count(const struct profile *p, uint32_t i)
{
    return p->amplitude->sample_bytes == 1 ? ((const uint8_t *)p->samples)[i] : ((const uint16_t *)p->samples)[i];
}

static inline bool profile_saturated(const struct profile *p, uint32_t i)
{
    return profile_count(p, i) == p->amplitude->max_count;
}

/** profile_next_saturated - the first saturated bin from `from` on; n: there is none. */
uint32_t profile_next_saturated(const struct profile *p, uint32_t from);

/** profile_next_above - the first of the cells from .. end - 1 that is above a power below 2^63; end: there is none. */
uint32_t profile_next_above(const struct profile *p, uint32_t from, uint32_t end, uint64_t power);

/** profile_floor - power of a cell of the floor; what is quieter counts as so loud. Positive. */
static inline double profile_floor(const struct profile *p)
{
    return p->floor_power ? (double)p->floor_power : 1.0;
}

/** profile_below - the greatest power of a cell, below 2^63, that is less than `power`, unscaled and positive. */
static inline uint64_t profile_below(const struct profile *p, double power)
{
    const double cells = power / (double)(UINT64_C(1) << p->shift);
    const uint64_t whole = cells < 0x1p62 ? (uint64_t)cells : UINT64_C(1) << 62;
    return (double)whole < cells ? whole : whole - 1;
}

static inline bool profile_blind(const struct profile *p, uint32_t i)
{
    return p->blind && p->blind[i];
}

#endif
