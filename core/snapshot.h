/* SPDX-License-Identifier: MIT */
/*
 * snapshot - how anything is published between threads: two sides and the number of publications, whose parity says
 * which side is in front. One writer works on the side behind and then turns them round. Neither side ever waits:
 *   - the writer writes whatever readers do;
 *   - a reader copies the side in front, and the copy is good unless a publication came meanwhile. A reader that put
 *     the writer aside, at whatever point, therefore has a consistent record at its first try: the one before.
 * Tries are counted. A reader that SNAPSHOT_TRIES whole publications overtook in a row has the older record that it
 * had last.
 *
 * All words are atomics, loaded with acquire and stored with release, so the order that the scheme needs lies in the
 * accesses themselves: whoever sees a word of the next record sees the number of the publication before it, too.
 * tests/model/snapshot.pml is the model. Functions of this header touch nothing but their arguments: grid/, which is
 * pure, publishes by it as well.
 */
#ifndef SONARD_SNAPSHOT_H
#define SONARD_SNAPSHOT_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define SNAPSHOT_TRIES 8

typedef _Atomic uint64_t snapshot_word;

struct snapshot {
    _Atomic uint64_t number; /* of publications */
};

/* ---- for what is published in parts: the sides are the caller's ---- */

/** snapshot_now - readers: what is loaded from the side of this number's parity until
 * snapshot_still belongs together. */
static inline uint64_t snapshot_now(const struct snapshot *s)
{
    return atomic_load_explicit(&s->number, memory_order_acquire);
}

static inline bool snapshot_still(const struct snapshot *s, uint64_t number)
{
    return atomic_load_explicit(&s->number, memory_order_relaxed) == number;
}

/** snapshot_behind - the side that the writer may write; snapshot_turn - puts it in front: all of it is published. */
static inline unsigned snapshot_behind(const struct snapshot *s)
{
    return (atomic_load_explicit(&s->number, memory_order_relaxed) + 1) & 1;
}

static inline void snapshot_turn(struct snapshot *s)
{
    const uint64_t number = atomic_load_explicit(&s->number, memory_order_relaxed);
    atomic_store_explicit(&s->number, number + 1, memory_order_release);
}

/** snapshot_store - n words from a plain object; snapshot_load - to one. */
static inline void snapshot_store(snapshot_word *to, const void *from, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        uint64_t w;
        memcpy(&w, (const char *)from + 8 * i, 8);
        atomic_store_explicit(&to[i], w, memory_order_release);
    }
}

static inline void snapshot_load(void *to, const snapshot_word *from, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        const uint64_t w = atomic_load_explicit(&from[i], memory_order_acquire);
        memcpy((char *)to + 8 * i, &w, 8);
    }
}

/** snapshot_copy - a consistent copy of n words of the side in front; false, to undefined: overtaken every time. */
static inline bool snapshot_copy(const struct snapshot *s, void *to, const snapshot_word *const side[2], size_t n)
{
    for (int i = 0; i < SNAPSHOT_TRIES; i++) {
        const uint64_t number = snapshot_now(s);
        snapshot_load(to, side[number & 1], n);
        if (snapshot_still(s, number))
            return true;
    }
    return false;
}

/* ---- a record, published whole; all zeros until then ---- */

/**
 * SNAPSHOT_OF - a record of this type, of whole words, with one writer and one reader. All zeros is a valid one, so an
 * array of them is made by memset.
 */
#define SNAPSHOT_OF(type)                                                                                         \
    struct {                                                                                                      \
        struct snapshot turn;                                                                                     \
        snapshot_word side[2][sizeof(type) / 8];                                                                  \
        type had; /* by the reader, the last time */                                                              \
        _Static_assert(sizeof(type) % 8 == 0, "a record is whole words");                                         \
    }

/* A pointer to a record of the snapshot's type: the compiler complains of any other. */
#define SNAPSHOT_RECORD(snapshot, record) (1 ? (record) : &(snapshot)->had)

/** snapshot_publish(SNAPSHOT_OF(type) *snapshot, const type *record) - by the writer. */
#define snapshot_publish(snapshot, record)                                                                        \
    snapshot_publish_words(&(snapshot)->turn, (snapshot)->side[0], SNAPSHOT_RECORD(snapshot, record),             \
                           sizeof(snapshot)->had / 8)

/** snapshot_read(SNAPSHOT_OF(type) *snapshot, type *record) - by the reader: the newest, or the one it had last. */
#define snapshot_read(snapshot, record)                                                                           \
    snapshot_read_words(&(snapshot)->turn, (snapshot)->side[0], &(snapshot)->had,                                 \
                        SNAPSHOT_RECORD(snapshot, record), sizeof(snapshot)->had / 8)

/* sides: [2][n]. Every record replaces all of the one before, so what is behind need not follow. */
static inline void snapshot_publish_words(struct snapshot *s, snapshot_word *sides, const void *record, size_t n)
{
    snapshot_store(sides + snapshot_behind(s) * n, record, n);
    snapshot_turn(s);
}

static inline void snapshot_read_words(const struct snapshot *s, const snapshot_word *sides, void *had,
                                       void *record, size_t n)
{
    const snapshot_word *const side[2] = {sides, sides + n};
    if (snapshot_copy(s, record, side, n))
        memcpy(had, record, 8 * n);
    else
        memcpy(record, had, 8 * n);
}

#endif
