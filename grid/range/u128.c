/* SPDX-License-Identifier: MIT */
#include "u128.h"

static unsigned bits(struct u128 a)
{
    unsigned n = a.hi ? 64 : 0;
    for (uint64_t left = a.hi ? a.hi : a.lo; left; left >>= 1)
        n++;
    return n;
}

static struct u128 twice(struct u128 a)
{
    return (struct u128){a.hi << 1 | a.lo >> 63, a.lo << 1};
}

static struct u128 half(struct u128 a)
{
    return (struct u128){a.hi >> 1, a.lo >> 1 | a.hi << 63};
}

/* As on paper, digit by digit from the top. */
struct u128 u128_divide(struct u128 a, struct u128 b, struct u128 *rest)
{
    struct u128 quotient = {0, 0};
    if (a.hi == 0 && b.hi == 0) {
        *rest = (struct u128){0, a.lo % b.lo};
        return (struct u128){0, a.lo / b.lo};
    }
    const unsigned more = bits(a) > bits(b) ? bits(a) - bits(b) : 0;
    for (unsigned i = 0; i < more; i++)
        b = twice(b);
    for (unsigned i = 0; i <= more; i++, b = half(b)) {
        quotient = twice(quotient);
        if (!u128_less(a, b)) {
            a = u128_difference(a, b);
            quotient.lo |= 1;
        }
    }
    *rest = a;
    return quotient;
}
