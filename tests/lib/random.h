/* SPDX-License-Identifier: MIT */
/* random.h - inputs of tests, drawn from a seed. */
#ifndef SONARD_TEST_RANDOM_H
#define SONARD_TEST_RANDOM_H

#include <stdint.h>

/* splitmix64: small, good enough for inputs of tests, the same everywhere */
static inline uint64_t test_random(uint64_t *state)
{
    uint64_t z = (*state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

/* uniform in [0, 1) */
static inline double test_uniform(uint64_t *state)
{
    return (double)(test_random(state) >> 11) * 0x1p-53;
}

#endif
