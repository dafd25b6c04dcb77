/* SPDX-License-Identifier: MIT */
/*
 * baseline - what a sensor's beams usually return at each range under one setting: the running median of every bin's
 * counts over the last beams (a clutter map, as radar calls it: R. Nitzberg, "Clutter map CFAR analysis", IEEE Trans.
 * Aerospace and Electronic Systems 22, 1986). It holds the ring-down with its ripple, reverberation and the noise that
 * the receiver's gain raises, but no reflector that fewer than half of the beams show. Knows no echo and no free water.
 */
#ifndef SONARD_BASELINE_H
#define SONARD_BASELINE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "grid/ping.h"
#include "profile.h"

#define BASELINE_LEAST 16 /* beams before it is known */

struct baseline {
    int32_t *median; /* [bins] 1/256 counts */
    double *level;   /* [bins] mean power of the resolution cell around each bin, as in struct profile */
    double *calm;    /* [profile_blocks(bins)] least of those in the block */
    uint32_t beams;  /* learnt from */
    uint32_t due;    /* number of beams at which the levels are made anew */
};

/** baseline_bytes - memory for beams of max_bins, a multiple of 8. */
size_t baseline_bytes(uint32_t max_bins);

/** baseline_init - in that memory, 8-byte aligned; nothing is known yet. */
void baseline_init(struct baseline *b, void *memory, uint32_t max_bins);

/** baseline_clear - nothing is known: another setting. */
void baseline_clear(struct baseline *b);

/**
 * baseline_learn - the beams of one more ping with this range axis and amplitude law; at most 16 of them, others in
 * the next ping. A median moves by at most a quarter of a count a beam (of 255), in the first beams by more. O(bins).
 * room: for n_bins numbers.
 */
void baseline_learn(struct baseline *b, const struct ping *ping, const struct profile_axis *axis,
                    const struct amplitude *law, double *room);

/** baseline_usual - power of cell i of p as it usually is: the baseline, or the floor, or the least that there is. */
static inline double baseline_usual(const struct baseline *b, const struct profile *p, uint32_t i)
{
    const double level = b->level[i] / (double)(UINT64_C(1) << p->shift), floor = profile_floor(p);
    return level > floor ? level : floor;
}

static inline bool baseline_known(const struct baseline *b)
{
    return b->beams >= BASELINE_LEAST;
}

#endif
