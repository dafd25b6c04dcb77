/* SPDX-License-Identifier: MIT */
/*
 * ring - a bounded queue of buffer indices from one producer thread to one consumer thread, without locks.
 *
 * Both ends take the oldest entry by the same compare-and-swap on `head`: the consumer to work on it, and the
 * producer, when the ring is full, to get its buffer back for the newer ping. So the sonar never waits, the oldest
 * waiting ping is the one that is lost, and every buffer is at any time in exactly one place (tests/model/ring.pml).
 *
 * Why it is right: a slot is overwritten only by ring_put with tail == head + size, that is after head has passed it;
 * a reader that loaded a stale slot then fails its compare-and-swap. Indices run free (32 bit) and are compared by
 * unsigned difference only, so wrap-around is no special case. The release store of `tail` publishes the slot and all
 * that the producer wrote into the buffer; the acquire-release swap of `head` orders the reuse of a taken buffer, and
 * `head` is loaded with acquire, so that what is then read of `tail` and the slot is not older than the other end's
 * taking that moved it.
 */
#ifndef SONARD_RING_H
#define SONARD_RING_H

#include <assert.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#define RING_MAX        1024
#define RING_CACHE_LINE 64

struct ring {
    _Alignas(RING_CACHE_LINE) _Atomic uint32_t head; /* next to take: both ends */
    _Alignas(RING_CACHE_LINE) _Atomic uint32_t tail; /* next to fill: producer only */
    _Alignas(RING_CACHE_LINE) uint32_t size;         /* a power of two; constant after ring_init */
    _Atomic uint32_t slot[RING_MAX];
};

/** ring_init - size in [2, RING_MAX], rounded up to a power of two; `start` is the first index (tests: near wrap). */
static inline void ring_init(struct ring *r, uint32_t size, uint32_t start)
{
    r->size = 2;
    while (r->size < size && r->size < RING_MAX)
        r->size *= 2;
    atomic_init(&r->head, start);
    atomic_init(&r->tail, start);
    for (uint32_t i = 0; i < RING_MAX; i++)
        atomic_init(&r->slot[i], 0);
}

/** ring_put - producer: append. Wait-free. A ring has room for every buffer there is: a full one is our own bug. */
static inline void ring_put(struct ring *r, uint32_t value)
{
    uint32_t tail = atomic_load_explicit(&r->tail, memory_order_relaxed);
    assert(tail - atomic_load_explicit(&r->head, memory_order_acquire) < r->size);
    atomic_store_explicit(&r->slot[tail & (r->size - 1)], value, memory_order_relaxed);
    atomic_store_explicit(&r->tail, tail + 1, memory_order_release);
}

/** ring_take - either end: remove the oldest; false when empty. Lock-free: a lost race means that the other end got
 * an entry. */
static inline bool ring_take(struct ring *r, uint32_t *value)
{
    uint32_t head = atomic_load_explicit(&r->head, memory_order_acquire);
    for (;;) {
        if (head == atomic_load_explicit(&r->tail, memory_order_acquire))
            return false;
        uint32_t v = atomic_load_explicit(&r->slot[head & (r->size - 1)], memory_order_relaxed);
        if (atomic_compare_exchange_weak_explicit(&r->head, &head, head + 1, memory_order_acq_rel,
                                                  memory_order_acquire)) {
            *value = v;
            return true;
        }
    }
}

/** ring_count - entries waiting; exact only when both ends are at rest. */
static inline uint32_t ring_count(struct ring *r)
{
    uint32_t head = atomic_load_explicit(&r->head, memory_order_acquire);
    return atomic_load_explicit(&r->tail, memory_order_acquire) - head;
}

#endif
