/* SPDX-License-Identifier: MIT */
/*
 * test.h - what every unit test shares. A test program has one main with TEST(name) cases run through RUN(name);
 * it prints one line per case and ends with test_end(), whose value main returns.
 *
 *   ok NAME          or          FAIL NAME  (after a line with file:line, expression, got and want)
 *   skip NAME: why
 *
 * tests/run.sh adds these lines up over all programs.
 */
#ifndef SONARD_TEST_H
#define SONARD_TEST_H

#include <inttypes.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "random.h"

static int test_failed_cases;
static bool test_case_failed;

#define CHECK(cond)                                                                                               \
    do {                                                                                                          \
        if (!(cond)) {                                                                                            \
            printf("%s:%d: %s is false\n", __FILE__, __LINE__, #cond);                                            \
            test_case_failed = true;                                                                              \
        }                                                                                                         \
    } while (0)

#define CHECK_INT(got, want)                                                                                      \
    do {                                                                                                          \
        long long got_ = (long long)(got), want_ = (long long)(want);                                             \
        if (got_ != want_) {                                                                                      \
            printf("%s:%d: %s is %lld, want %lld\n", __FILE__, __LINE__, #got, got_, want_);                      \
            test_case_failed = true;                                                                              \
        }                                                                                                         \
    } while (0)

/* |got - want| <= rtol*|want| + atol; NaN fails */
#define CHECK_NEAR(got, want, rtol, atol)                                                                         \
    do {                                                                                                          \
        double got_ = (double)(got), want_ = (double)(want);                                                      \
        if (!(fabs(got_ - want_) <= (rtol)*fabs(want_) + (atol)) && !(isinf(want_) && got_ == want_)) {           \
            printf("%s:%d: %s is %.17g, want %.17g\n", __FILE__, __LINE__, #got, got_, want_);                    \
            test_case_failed = true;                                                                              \
        }                                                                                                         \
    } while (0)

#define CHECK_STR(got, want)                                                                                      \
    do {                                                                                                          \
        const char *got_ = (got), *want_ = (want);                                                                \
        if (strcmp(got_, want_) != 0) {                                                                           \
            printf("%s:%d: %s is \"%s\", want \"%s\"\n", __FILE__, __LINE__, #got, got_, want_);                  \
            test_case_failed = true;                                                                              \
        }                                                                                                         \
    } while (0)

#define TEST(name) static void test_##name(void)
#define RUN(name)                                                                                                 \
    do {                                                                                                          \
        test_case_failed = false;                                                                                 \
        test_##name();                                                                                            \
        printf("%s %s\n", test_case_failed ? "FAIL" : "ok", #name);                                               \
        fflush(stdout);                                                                                           \
        test_failed_cases += test_case_failed;                                                                    \
    } while (0)

/* A case that needs a recording which may not be redistributed: skipped in one line where it is missing. */
#define RUN_WITH(file, name)                                                                                      \
    do {                                                                                                          \
        FILE *file_ = fopen(file, "r");                                                                           \
        if (file_) {                                                                                              \
            fclose(file_);                                                                                        \
            RUN(name);                                                                                            \
        } else {                                                                                                  \
            printf("skip " #name ": " file " is not there\n");                                                    \
        }                                                                                                         \
    } while (0)

static inline int test_end(void)
{
    return test_failed_cases ? 1 : 0;
}

/* The seed of a property test: SONARD_SEED, or a fixed one; printed, so that a failure can be repeated. */
static inline uint64_t test_seed(void)
{
    const char *s = getenv("SONARD_SEED");
    uint64_t seed = s ? strtoull(s, NULL, 0) : 20260101u;
    printf("# SONARD_SEED=%" PRIu64 "\n", seed);
    return seed;
}

#endif
