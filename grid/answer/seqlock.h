/* SPDX-License-Identifier: MIT */
/*
 * seqlock - lets one writer change records of whole words that other threads copy consistently. The writer never
 * waits; a reader that ran into a change copies again.
 *
 * The sequence number is odd while the writer writes. All words are atomics, loaded with acquire and stored with
 * release, so the order that the scheme needs lies in the accesses themselves: whoever sees a new word also sees the
 * odd number stored before it, and then reads again.
 */
#ifndef SONARD_SEQLOCK_H
#define SONARD_SEQLOCK_H

#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

typedef _Atomic uint64_t seqlock_word;

struct seqlock {
    _Atomic uint64_t sequence;
};

static inline void seqlock_begin(struct seqlock *l)
{
    uint64_t s = atomic_load_explicit(&l->sequence, memory_order_relaxed);
    atomic_store_explicit(&l->sequence, s + 1, memory_order_relaxed);
}

static inline void seqlock_end(struct seqlock *l)
{
    uint64_t s = atomic_load_explicit(&l->sequence, memory_order_relaxed);
    atomic_store_explicit(&l->sequence, s + 1, memory_order_release);
}

/** seqlock_store - n words from a plain object; only between begin and end. */
static inline void seqlock_store(seqlock_word *to, const void *from, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        uint64_t w;
        memcpy(&w, (const char *)from + 8 * i, 8);
        atomic_store_explicit(&to[i], w, memory_order_release);
    }
}

/** seqlock_now - a number for seqlock_still: what is loaded in between belongs together when it has not changed. */
static inline uint64_t seqlock_now(struct seqlock *l)
{
    return atomic_load_explicit(&l->sequence, memory_order_acquire);
}

static inline int seqlock_still(struct seqlock *l, uint64_t number)
{
    return !(number & 1) && atomic_load_explicit(&l->sequence, memory_order_relaxed) == number;
}

/** seqlock_load - a consistent copy of n words. */
static inline void seqlock_load(struct seqlock *l, void *to, seqlock_word *from, size_t n)
{
    uint64_t number;
    do {
        number = seqlock_now(l);
        for (size_t i = 0; i < n; i++) {
            uint64_t w = atomic_load_explicit(&from[i], memory_order_acquire);
            memcpy((char *)to + 8 * i, &w, 8);
        }
    } while (!seqlock_still(l, number));
}

#endif
