/* SPDX-License-Identifier: MIT */
/*
 * cfar_sieve - marks the cells of a profile that a CFAR detector may detect and drops the many that it cannot, with
 * vectors of narrow numbers. It may mark a cell too many, never one too few: the integers of cfar decide about the
 * marked ones, and so its rounding, the width of the vectors and the CPU change the time and nothing else.
 */
#ifndef SONARD_CFAR_SIEVE_H
#define SONARD_CFAR_SIEVE_H

#include <stdbool.h>
#include <stdint.h>

#include "cfar_factor.h"

#define CFAR_SIEVE_BLOCK 32 /* cells are looked at in blocks; stretches that are shorter cost as much or more */

/* Cells with the same windows around them: those of cell i begin at cell i + lead and at cell i + lag. */
struct cfar_stretch {
    uint32_t begin, end; /* cells begin .. end - 1 */
    int32_t lead, lag;   /* equal where there is one window only */
    uint32_t cells;      /* of each window */
    double alpha;        /* > 0, threshold over reference */
    double least;        /* cells are marked above this power only */
};

/** cfar_sieve_powers - power[n]: x[n], below 2^52 each, rounded. */
void cfar_sieve_powers(const uint64_t *x, uint32_t n, float *power);

/**
 * cfar_sieve_sums - the sums of the windows of `cells` cells, 1..n, that begin at each cell from 0 to n - cells,
 * rounded. Returns where they lie: in power, in room or in room + n. room: for 2 n numbers.
 */
const float *cfar_sieve_sums(const float *power, uint32_t n, uint32_t cells, float *room);

/**
 * cfar_sieve_average - mark[i], for the cells of a stretch: 1 where power > least and CA, GOCA or SOCA may detect it,
 * else 0. sum: of the windows.
 */
void cfar_sieve_average(enum cfar_detector detector, const struct cfar_stretch *stretch, const float *power,
                        const float *sum, uint8_t *mark);

/** cfar_sieve_codes - code[n]: the powers in 8 bits, in order of size, in steps of a quarter of an octave or less. */
void cfar_sieve_codes(const float *power, uint32_t n, uint8_t *code);

/**
 * cfar_sieve_rank - the same for OS: 1 where power > least and of the windows at least `rank` cells may be below
 * power / alpha.
 */
void cfar_sieve_rank(const struct cfar_stretch *stretch, uint32_t rank, const float *power, const uint8_t *code,
                     uint8_t *mark);

#endif
