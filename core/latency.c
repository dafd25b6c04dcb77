/* SPDX-License-Identifier: MIT */
#include "latency.h"

#include <math.h>

static unsigned bucket_of(uint64_t ns)
{
    if (ns < LATENCY_PER_OCTAVE)
        return (unsigned)ns;
    unsigned octave = 63 - (unsigned)__builtin_clzll(ns); /* >= 3 */
    unsigned part = (unsigned)(ns >> (octave - 3)) & (LATENCY_PER_OCTAVE - 1);
    unsigned b = (octave - 2) * LATENCY_PER_OCTAVE + part;
    return b < LATENCY_BUCKETS ? b : LATENCY_BUCKETS - 1;
}

static uint64_t upper_edge(unsigned bucket)
{
    if (bucket < LATENCY_PER_OCTAVE)
        return bucket;
    unsigned octave = bucket / LATENCY_PER_OCTAVE + 2, part = bucket % LATENCY_PER_OCTAVE;
    return ((uint64_t)(LATENCY_PER_OCTAVE + part + 1) << (octave - 3)) - 1;
}

void latency_add(struct latency *l, uint64_t ns)
{
    atomic_fetch_add_explicit(&l->bucket[bucket_of(ns)], 1, memory_order_relaxed);
    atomic_fetch_add_explicit(&l->count, 1, memory_order_relaxed);
    atomic_fetch_add_explicit(&l->sum_ns, ns, memory_order_relaxed);
    if (ns > atomic_load_explicit(&l->max_ns, memory_order_relaxed))
        atomic_store_explicit(&l->max_ns, ns, memory_order_relaxed);
}

uint64_t latency_quantile(struct latency *l, double q)
{
    uint64_t count = atomic_load_explicit(&l->count, memory_order_relaxed);
    uint64_t most = atomic_load_explicit(&l->max_ns, memory_order_relaxed);
    uint64_t want = (uint64_t)ceil(q * (double)count), seen = 0;
    for (unsigned b = 0; count && b < LATENCY_BUCKETS; b++) {
        seen += atomic_load_explicit(&l->bucket[b], memory_order_relaxed);
        if (seen && seen >= want)
            return upper_edge(b) < most ? upper_edge(b) : most;
    }
    return most;
}

uint64_t latency_below(struct latency *l, unsigned power)
{
    uint64_t seen = 0;
    for (unsigned b = 0; b < (power - 2) * LATENCY_PER_OCTAVE; b++)
        seen += atomic_load_explicit(&l->bucket[b], memory_order_relaxed);
    return seen;
}
