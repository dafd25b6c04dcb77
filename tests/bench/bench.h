/* SPDX-License-Identifier: MIT */
/* bench.h - what measurements share: clocks, memory that is there, the middle of repetitions. */
#ifndef SONARD_BENCH_H
#define SONARD_BENCH_H

#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static inline double bench_clock_ns(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec * 1e9 + (double)t.tv_nsec;
}

/* Time that passes. */
static inline double now_ns(void)
{
    return bench_clock_ns(CLOCK_MONOTONIC);
}

/* Time that this process has run: what others do on the machine does not count. */
static inline double cpu_ns(void)
{
    return bench_clock_ns(CLOCK_PROCESS_CPUTIME_ID);
}

static inline void *need(size_t bytes)
{
    void *p = bytes ? calloc(1, bytes) : NULL;
    if (!p) {
        fprintf(stderr, "no memory\n");
        exit(1);
    }
    return p;
}

static inline int bench_by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Sorts v. */
static inline double median(double *v, size_t n)
{
    qsort(v, n, sizeof *v, bench_by_size);
    return v[n / 2];
}

#endif
