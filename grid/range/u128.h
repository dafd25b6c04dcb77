/* SPDX-License-Identifier: MIT */
/*
 * u128 - unsigned numbers of 128 bits, exact on every CPU; compilers for 32 bits have none. What does not fit is cut
 * off at the top.
 */
#ifndef SONARD_U128_H
#define SONARD_U128_H

#include <stdbool.h>
#include <stdint.h>

struct u128 {
    uint64_t hi, lo;
};

/** u128_product - a * b. */
static inline struct u128 u128_product(uint64_t a, uint64_t b)
{
    const uint64_t a_lo = (uint32_t)a, a_hi = a >> 32, b_lo = (uint32_t)b, b_hi = b >> 32;
    const uint64_t low = a_lo * b_lo, one = a_hi * b_lo, two = a_lo * b_hi;
    const uint64_t middle = (low >> 32) + (uint32_t)one + (uint32_t)two;
    return (struct u128){a_hi * b_hi + (one >> 32) + (two >> 32) + (middle >> 32), middle << 32 | (uint32_t)low};
}

/** u128_less - a < b. */
static inline bool u128_less(struct u128 a, struct u128 b)
{
    return a.hi != b.hi ? a.hi < b.hi : a.lo < b.lo;
}

/** u128_sum - a + b. */
static inline struct u128 u128_sum(struct u128 a, struct u128 b)
{
    const uint64_t lo = a.lo + b.lo;
    return (struct u128){a.hi + b.hi + (lo < a.lo), lo};
}

/** u128_difference - a - b. */
static inline struct u128 u128_difference(struct u128 a, struct u128 b)
{
    return (struct u128){a.hi - b.hi - (a.lo < b.lo), a.lo - b.lo};
}

/** u128_times - a * b. */
static inline struct u128 u128_times(struct u128 a, uint64_t b)
{
    const struct u128 low = u128_product(a.lo, b);
    return (struct u128){low.hi + a.hi * b, low.lo};
}

/** u128_divide - a / b rounded down, and what is left of a; b > 0. */
struct u128 u128_divide(struct u128 a, struct u128 b, struct u128 *rest);

#endif
