/* SPDX-License-Identifier: MIT */
/*
 * latency - a histogram of durations that one thread fills and others read: eight buckets per octave from 1 ns up, so
 * a quantile is known to 9 %. Fixed size, no lock.
 */
#ifndef SONARD_LATENCY_H
#define SONARD_LATENCY_H

#include <stdatomic.h>
#include <stdint.h>

#define LATENCY_PER_OCTAVE 8
#define LATENCY_BUCKETS    (40 * LATENCY_PER_OCTAVE)

struct latency {
    _Atomic uint64_t bucket[LATENCY_BUCKETS];
    _Atomic uint64_t count, max_ns, sum_ns;
};

/** latency_add - one writer. */
void latency_add(struct latency *l, uint64_t ns);

/** latency_quantile - upper edge in ns of the bucket that holds the share q in [0, 1], at most the maximum; 0
 * when empty. */
uint64_t latency_quantile(struct latency *l, double q);

/** latency_below - how many were shorter than 2^power ns, power in [3, 42]. */
uint64_t latency_below(struct latency *l, unsigned power);

#endif
