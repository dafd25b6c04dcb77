/* SPDX-License-Identifier: MIT */
/* test_u128 - arithmetic in 128 bits: against the compiler's own where it has one, and against itself everywhere. */
#include "grid/range/u128.h"
#include "tests/lib/test.h"

/* Of any length, often with runs of ones or zeros: that is where carries go far. */
static uint64_t some(uint64_t *random)
{
    const unsigned bits = (unsigned)(test_random(random) % 65);
    const uint64_t kept = bits ? UINT64_MAX >> (64 - bits) : 0;
    switch (test_random(random) % 4) {
    case 0:
        return kept;
    case 1:
        return kept + 1;
    default:
        return test_random(random) & kept;
    }
}

static bool same(struct u128 a, struct u128 b)
{
    return a.hi == b.hi && a.lo == b.lo;
}

TEST(known_numbers)
{
    struct u128 rest;
    CHECK(same(u128_product(UINT64_MAX, UINT64_MAX), (struct u128){UINT64_MAX - 1, 1}));
    CHECK(same(u128_product(UINT64_C(1) << 40, UINT64_C(1) << 30), (struct u128){1 << 6, 0}));
    CHECK(same(u128_sum((struct u128){0, UINT64_MAX}, (struct u128){0, 1}), (struct u128){1, 0}));
    CHECK(same(u128_difference((struct u128){1, 0}, (struct u128){0, 1}), (struct u128){0, UINT64_MAX}));
    CHECK(same(u128_times((struct u128){3, UINT64_MAX}, 2), (struct u128){7, UINT64_MAX - 1}));
    CHECK(u128_less((struct u128){1, 0}, (struct u128){1, 1}) &&
          u128_less((struct u128){0, 9}, (struct u128){1, 0}));
    CHECK(!u128_less((struct u128){1, 1}, (struct u128){1, 1}));
    /* 10^38 / 10^19 */
    const struct u128 all = u128_product(UINT64_C(10000000000000000000), UINT64_C(10000000000000000000));
    CHECK(same(u128_divide(all, (struct u128){0, UINT64_C(10000000000000000000)}, &rest),
               (struct u128){0, UINT64_C(10000000000000000000)}));
    CHECK(same(rest, (struct u128){0, 0}));
}

TEST(quotient_times_divisor_and_rest_are_the_number)
{
    uint64_t random = test_seed();
    for (int round = 0; round < 100000; round++) {
        const struct u128 a = {some(&random), some(&random)};
        struct u128 b = {some(&random), some(&random)}, rest;
        if (round % 2)
            b.hi = 0;
        if (b.hi == 0 && b.lo == 0)
            continue;
        const struct u128 q = u128_divide(a, b, &rest);
        CHECK(u128_less(rest, b));
        /* The two together have at most 129 bits: one of them is short. */
        const struct u128 product = q.hi == 0 ? u128_times(b, q.lo) : u128_times(q, b.lo);
        CHECK(q.hi == 0 || b.hi == 0);
        CHECK(same(u128_sum(product, rest), a));
    }
}

#ifdef __SIZEOF_INT128__
__extension__ typedef unsigned __int128 native;

static native native_of(struct u128 a)
{
    return (native)a.hi << 64 | a.lo;
}

TEST(as_the_compiler_has_it)
{
    uint64_t random = test_seed();
    for (int round = 0; round < 100000; round++) {
        const struct u128 a = {some(&random), some(&random)}, b = {some(&random), some(&random)};
        struct u128 rest;
        CHECK(native_of(u128_product(a.lo, b.lo)) == (native)a.lo * b.lo);
        CHECK(native_of(u128_sum(a, b)) == native_of(a) + native_of(b));
        CHECK(native_of(u128_difference(a, b)) == native_of(a) - native_of(b));
        CHECK(native_of(u128_times(a, b.lo)) == native_of(a) * b.lo);
        CHECK(u128_less(a, b) == (native_of(a) < native_of(b)));
        if (native_of(b) == 0)
            continue;
        CHECK(native_of(u128_divide(a, b, &rest)) == native_of(a) / native_of(b));
        CHECK(native_of(rest) == native_of(a) % native_of(b));
    }
}
#endif

int main(void)
{
    RUN(known_numbers);
    RUN(quotient_times_divisor_and_rest_are_the_number);
#ifdef __SIZEOF_INT128__
    RUN(as_the_compiler_has_it);
#endif
    return test_end();
}
