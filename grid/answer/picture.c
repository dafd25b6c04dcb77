/* SPDX-License-Identifier: MIT */
#include "picture.h"

#include <math.h>
#include <string.h>

size_t picture_bytes(uint32_t n)
{
    return 2 * (size_t)n * PICTURE_WORDS * sizeof(seqlock_word) + (size_t)n * sizeof(uint32_t);
}

void picture_init(struct picture *p, const struct rings *rings, const double (*axis)[3], double fade_s,
                  double blocked_logodds, void *memory)
{
    const size_t words = (size_t)rings->n * PICTURE_WORDS;
    seqlock_word *word = memory;
    p->n = rings->n;
    p->rings = rings;
    p->axis = axis;
    p->fade_s = fade_s;
    p->blocked_logodds = (float)blocked_logodds;
    p->side[0].word = word;
    p->side[1].word = word + words;
    p->changed = (uint32_t *)(word + 2 * words);
    p->n_changed = 0;
    atomic_init(&p->number, 0);
    for (size_t i = 0; i < 2 * words; i++)
        atomic_init(&word[i], 0);
    for (size_t i = 0; i < PICTURE_FRAME_WORDS; i++) {
        atomic_init(&p->side[0].frame[i], 0);
        atomic_init(&p->side[1].frame[i], 0);
    }
}

/* ---- the writer ---- */

static struct picture_side *behind(struct picture *p)
{
    return &p->side[(atomic_load_explicit(&p->number, memory_order_relaxed) + 1) & 1];
}

void picture_begin(struct picture *p)
{
    p->n_changed = 0;
}

void picture_set(struct picture *p, uint32_t direction, const struct picture_entry *entry)
{
    seqlock_store(behind(p)->word + (size_t)direction * PICTURE_WORDS, entry, PICTURE_WORDS);
    if (p->n_changed < p->n)
        p->changed[p->n_changed++] = direction;
}

void picture_set_frame(struct picture *p, const struct picture_frame *frame)
{
    seqlock_store(behind(p)->frame, frame, PICTURE_FRAME_WORDS);
}

/* By the writer, whom nobody changes anything under: no copy is torn. */
static void follow(seqlock_word *to, seqlock_word *from, size_t n)
{
    for (size_t i = 0; i < n; i++)
        atomic_store_explicit(&to[i], atomic_load_explicit(&from[i], memory_order_relaxed), memory_order_release);
}

/* The words written behind are released with the number; whoever reads one that comes later sees the number changed. */
void picture_end(struct picture *p)
{
    const uint64_t number = atomic_load_explicit(&p->number, memory_order_relaxed) + 1;
    struct picture_side *front = &p->side[number & 1], *back = &p->side[(number + 1) & 1];
    const bool all = p->n_changed == p->n;
    atomic_store_explicit(&p->number, number, memory_order_release);
    follow(back->frame, front->frame, PICTURE_FRAME_WORDS);
    if (all)
        follow(back->word, front->word, (size_t)p->n * PICTURE_WORDS);
    for (uint32_t i = 0; i < p->n_changed && !all; i++) {
        const size_t at = (size_t)p->changed[i] * PICTURE_WORDS;
        follow(back->word + at, front->word + at, PICTURE_WORDS);
    }
}

/* ---- readers ---- */

static void load(void *to, seqlock_word *from, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        const uint64_t w = atomic_load_explicit(&from[i], memory_order_acquire);
        memcpy((char *)to + 8 * i, &w, 8);
    }
}

void picture_get(struct picture *p, uint32_t direction, struct picture_entry *entry)
{
    uint64_t number;
    do {
        number = picture_now(p);
        load(entry, p->side[number & 1].word + (size_t)direction * PICTURE_WORDS, PICTURE_WORDS);
    } while (!picture_still(p, number));
}

void picture_get_frame(struct picture *p, struct picture_frame *frame)
{
    uint64_t number;
    do {
        number = picture_now(p);
        load(frame, p->side[number & 1].frame, PICTURE_FRAME_WORDS);
    } while (!picture_still(p, number));
}

double picture_edge_m(struct picture *p, uint32_t direction)
{
    uint64_t number;
    double edge_m;
    do {
        number = picture_now(p);
        edge_m = INFINITY;
        for (size_t k = 0; k < PICTURE_OBSTACLES; k++) {
            float at[2]; /* log-odds, near edge */
            const uint64_t w = picture_word(&p->side[number & 1], direction, PICTURE_ODDS(k));
            memcpy(at, &w, sizeof at);
            if (at[0] <= 0)
                break;
            edge_m = (double)at[1] < edge_m ? (double)at[1] : edge_m;
        }
    } while (!picture_still(p, number));
    return edge_m;
}

double picture_logodds(const struct picture *p, const struct picture_obstacle *o, uint64_t now_ns)
{
    double dt_s = now_ns > o->t_ref_ns ? (double)(now_ns - o->t_ref_ns) * 1e-9 : 0;
    return o->logodds * exp(-dt_s / p->fade_s);
}
