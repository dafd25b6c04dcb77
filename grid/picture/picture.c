/* SPDX-License-Identifier: MIT */
#include "picture.h"

#include <math.h>
#include <string.h>

static size_t holds_words(uint32_t n)
{
    return ((size_t)n + 63) / 64;
}

size_t picture_bytes(uint32_t n)
{
    return 2 * ((size_t)n * PICTURE_WORDS + holds_words(n)) * sizeof(snapshot_word) + (size_t)n * sizeof(uint32_t);
}

void picture_set_fade(struct picture *p, double fade_s)
{
    atomic_store_explicit(&p->fade_s, fade_s, memory_order_relaxed);
}

void picture_init(struct picture *p, const struct rings *rings, const double (*axis)[3], double fade_s,
                  double blocked_logodds, void *memory)
{
    const size_t words = (size_t)rings->n * PICTURE_WORDS, holds = holds_words(rings->n);
    snapshot_word *word = memory;
    p->n = rings->n;
    p->rings = rings;
    p->axis = axis;
    picture_set_fade(p, fade_s);
    p->blocked_logodds = (float)blocked_logodds;
    p->side[0].word = word;
    p->side[1].word = word + words;
    p->side[0].holds = word + 2 * words;
    p->side[1].holds = p->side[0].holds + holds;
    p->changed = (uint32_t *)(p->side[1].holds + holds);
    p->n_changed = 0;
    atomic_init(&p->turn.number, 0);
    for (size_t i = 0; i < 2 * (words + holds); i++)
        atomic_init(&word[i], 0);
    for (size_t i = 0; i < PICTURE_FRAME_WORDS; i++) {
        atomic_init(&p->side[0].frame[i], 0);
        atomic_init(&p->side[1].frame[i], 0);
    }
}

/* ---- the writer ---- */

static struct picture_side *behind(struct picture *p)
{
    return &p->side[snapshot_behind(&p->turn)];
}

void picture_begin(struct picture *p)
{
    p->n_changed = 0;
}

static void mark(struct picture_side *side, uint32_t direction, bool holds)
{
    snapshot_word *const at = side->holds + direction / 64;
    const uint64_t bit = UINT64_C(1) << direction % 64, was = atomic_load_explicit(at, memory_order_relaxed),
                   is = holds ? was | bit : was & ~bit;
    snapshot_store(at, &is, 1);
}

void picture_set(struct picture *p, uint32_t direction, const struct picture_entry *entry)
{
    struct picture_side *side = behind(p);
    snapshot_store(side->word + (size_t)direction * PICTURE_WORDS, entry, PICTURE_WORDS);
    mark(side, direction, entry->obstacle[0].logodds > 0);
    if (p->n_changed < p->n)
        p->changed[p->n_changed++] = direction;
}

void picture_set_frame(struct picture *p, const struct picture_frame *frame)
{
    snapshot_store(behind(p)->frame, frame, PICTURE_FRAME_WORDS);
}

/* Writer side: there is no concurrent writer, so no copy can tear. */
static void copy_words(snapshot_word *to, const snapshot_word *from, size_t n)
{
    for (size_t i = 0; i < n; i++)
        atomic_store_explicit(&to[i], atomic_load_explicit(&from[i], memory_order_relaxed), memory_order_release);
}

void picture_end(struct picture *p)
{
    const struct picture_side *front = behind(p);
    const bool all = p->n_changed == p->n;
    snapshot_turn(&p->turn);
    struct picture_side *back = behind(p);
    copy_words(back->frame, front->frame, PICTURE_FRAME_WORDS);
    if (all)
        copy_words(back->word, front->word, (size_t)p->n * PICTURE_WORDS);
    if (all)
        copy_words(back->holds, front->holds, holds_words(p->n));
    for (uint32_t i = 0; i < p->n_changed && !all; i++) {
        const size_t at = (size_t)p->changed[i] * PICTURE_WORDS;
        copy_words(back->word + at, front->word + at, PICTURE_WORDS);
        copy_words(back->holds + p->changed[i] / 64, front->holds + p->changed[i] / 64, 1);
    }
}

/* ---- readers ---- */

void picture_get(struct picture *p, uint32_t direction, struct picture_entry *entry)
{
    const size_t at = (size_t)direction * PICTURE_WORDS;
    const snapshot_word *const side[2] = {p->side[0].word + at, p->side[1].word + at};
    if (!snapshot_copy(&p->turn, entry, side, PICTURE_WORDS))
        *entry = (struct picture_entry){0};
}

void picture_get_frame(struct picture *p, struct picture_frame *frame)
{
    const snapshot_word *const side[2] = {p->side[0].frame, p->side[1].frame};
    if (!snapshot_copy(&p->turn, frame, side, PICTURE_FRAME_WORDS))
        *frame = (struct picture_frame){0};
}

static inline double nearest_edge_m(const struct picture_side *side, uint32_t direction)
{
    double edge_m = INFINITY;
    for (size_t k = 0; k < PICTURE_OBSTACLES; k++) {
        float at[2]; /* log-odds, near edge */
        const uint64_t w = picture_word(side, direction, PICTURE_ODDS(k));
        memcpy(at, &w, sizeof at);
        if (at[0] <= 0)
            break;
        edge_m = (double)at[1] < edge_m ? (double)at[1] : edge_m;
    }
    return edge_m;
}

static double nearest_told_m(const struct picture_side *side, uint32_t direction)
{
    const double edge_m = nearest_edge_m(side, direction);
    const uint64_t w = picture_word(side, direction, offsetof(struct picture_entry, hint_m));
    float hint_m[2];
    memcpy(hint_m, &w, sizeof hint_m);
    return hint_m[0] > 0 && (double)hint_m[0] < edge_m ? (double)hint_m[0] : edge_m;
}

double picture_told_m(struct picture *p, uint32_t direction)
{
    for (int i = 0; i < SNAPSHOT_TRIES; i++) {
        const uint64_t number = picture_now(p);
        const double told_m = nearest_told_m(&p->side[number & 1], direction);
        if (picture_still(p, number))
            return told_m;
    }
    return 0;
}

double picture_logodds(const struct picture *p, const struct picture_obstacle *o, uint64_t now_ns)
{
    double dt_s = now_ns > o->t_ref_ns ? (double)(now_ns - o->t_ref_ns) * 1e-9 : 0;
    return o->logodds * exp(-dt_s / atomic_load_explicit(&p->fade_s, memory_order_relaxed));
}
