/* SPDX-License-Identifier: MIT */
#include "picture.h"

#include <math.h>
#include <string.h>

size_t picture_bytes(uint32_t n)
{
    return (size_t)n * PICTURE_WORDS * sizeof(_Atomic uint64_t);
}

void picture_init(struct picture *p, const struct rings *rings, double forget_s, double blocked_logodds,
                  void *word)
{
    p->n = rings->n;
    p->rings = rings;
    p->forget_s = forget_s;
    p->blocked_logodds = (float)blocked_logodds;
    p->word = word;
    atomic_init(&p->sequence, 0);
    for (size_t i = 0; i < PICTURE_FRAME_WORDS; i++)
        atomic_init(&p->frame[i], 0);
    for (size_t i = 0; i < (size_t)p->n * PICTURE_WORDS; i++)
        atomic_init(&p->word[i], 0);
}

void picture_begin(struct picture *p)
{
    uint64_t s = atomic_load_explicit(&p->sequence, memory_order_relaxed);
    atomic_store_explicit(&p->sequence, s + 1, memory_order_relaxed);
}

void picture_end(struct picture *p)
{
    uint64_t s = atomic_load_explicit(&p->sequence, memory_order_relaxed);
    atomic_store_explicit(&p->sequence, s + 1, memory_order_release);
}

/* Release on every word: whoever sees a new word also sees the odd sequence number that was stored before it. */
static void store_words(_Atomic uint64_t *to, const void *from, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        uint64_t w;
        memcpy(&w, (const char *)from + 8 * i, 8);
        atomic_store_explicit(&to[i], w, memory_order_release);
    }
}

static void load_words(struct picture *p, void *to, _Atomic uint64_t *from, size_t n)
{
    uint64_t before, after;
    do {
        before = atomic_load_explicit(&p->sequence, memory_order_acquire);
        for (size_t i = 0; i < n; i++) {
            uint64_t w = atomic_load_explicit(&from[i], memory_order_acquire);
            memcpy((char *)to + 8 * i, &w, 8);
        }
        after = atomic_load_explicit(&p->sequence, memory_order_relaxed);
    } while ((before & 1) || before != after);
}

void picture_set(struct picture *p, uint32_t direction, const struct picture_entry *entry)
{
    store_words(p->word + (size_t)direction * PICTURE_WORDS, entry, PICTURE_WORDS);
}

void picture_set_frame(struct picture *p, const struct picture_frame *frame)
{
    store_words(p->frame, frame, PICTURE_FRAME_WORDS);
}

void picture_get(struct picture *p, uint32_t direction, struct picture_entry *entry)
{
    load_words(p, entry, p->word + (size_t)direction * PICTURE_WORDS, PICTURE_WORDS);
}

void picture_get_frame(struct picture *p, struct picture_frame *frame)
{
    load_words(p, frame, p->frame, PICTURE_FRAME_WORDS);
}

double picture_logodds(const struct picture *p, const struct picture_obstacle *o, uint64_t now_ns)
{
    double dt_s = now_ns > o->t_ref_ns ? (double)(now_ns - o->t_ref_ns) * 1e-9 : 0;
    return o->logodds * exp(-dt_s / p->forget_s);
}
