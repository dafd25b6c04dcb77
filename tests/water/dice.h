/* SPDX-License-Identifier: MIT */
/*
 * dice - random numbers of made-up waters, the same everywhere for the same seed and stream.
 * REPORT_SEED=N in the environment draws other ones, to try on worlds that were not used before what was found on the
 * report's own.
 */
#ifndef SONARD_WATER_DICE_H
#define SONARD_WATER_DICE_H

#include <complex.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>

#include "tests/lib/random.h"

struct dice {
    uint64_t state;
};

static inline uint64_t dice_bits(struct dice *dice)
{
    return test_random(&dice->state);
}

/** dice_of - the numbers of one stream of a seed. */
static inline struct dice dice_of(uint64_t seed, uint64_t stream)
{
    const char *anew = getenv("REPORT_SEED");
    struct dice dice = {seed + ((anew ? strtoull(anew, NULL, 10) : 0) << 32)};
    dice.state = dice_bits(&dice) + stream;
    dice.state = dice_bits(&dice);
    return dice;
}

/** dice_uniform - in (0, 1). */
static inline double dice_uniform(struct dice *dice)
{
    return test_uniform(&dice->state) + 0x1p-54;
}

/** dice_between - every value as likely as any other; dice_scaled: every factor. */
static inline double dice_between(struct dice *dice, double low, double high)
{
    return low + (high - low) * dice_uniform(dice);
}
static inline double dice_scaled(struct dice *dice, double low, double high)
{
    return low * pow(high / low, dice_uniform(dice));
}

/** dice_chance - true, in so large a share. */
static inline bool dice_chance(struct dice *dice, double share)
{
    return dice_uniform(dice) < share;
}

/** dice_normal - circular complex normal, mean power 1: its power is exponential. */
static inline double complex dice_normal(struct dice *dice)
{
    const double radius = sqrt(-log(dice_uniform(dice))), turn = 6.283185307179586 * dice_uniform(dice);
    return radius * (cos(turn) + sin(turn) * (double complex)I);
}

/** dice_gauss - normal, variance 1. */
static inline double dice_gauss(struct dice *dice)
{
    return sqrt(2.0) * creal(dice_normal(dice));
}

#endif
