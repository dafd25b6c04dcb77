/* SPDX-License-Identifier: MIT */
#include "picture.h"

#include <math.h>

size_t picture_bytes(uint32_t n)
{
    return (size_t)n * PICTURE_WORDS * sizeof(seqlock_word);
}

void picture_init(struct picture *p, const struct rings *rings, const double (*axis)[3], double fade_s,
                  double blocked_logodds, void *word)
{
    p->n = rings->n;
    p->rings = rings;
    p->axis = axis;
    p->fade_s = fade_s;
    p->blocked_logodds = (float)blocked_logodds;
    p->word = word;
    atomic_init(&p->lock.sequence, 0);
    for (size_t i = 0; i < PICTURE_FRAME_WORDS; i++)
        atomic_init(&p->frame[i], 0);
    for (size_t i = 0; i < (size_t)p->n * PICTURE_WORDS; i++)
        atomic_init(&p->word[i], 0);
}

void picture_begin(struct picture *p)
{
    seqlock_begin(&p->lock);
}

void picture_end(struct picture *p)
{
    seqlock_end(&p->lock);
}

void picture_set(struct picture *p, uint32_t direction, const struct picture_entry *entry)
{
    seqlock_store(p->word + (size_t)direction * PICTURE_WORDS, entry, PICTURE_WORDS);
}

void picture_set_frame(struct picture *p, const struct picture_frame *frame)
{
    seqlock_store(p->frame, frame, PICTURE_FRAME_WORDS);
}

void picture_get(struct picture *p, uint32_t direction, struct picture_entry *entry)
{
    seqlock_load(&p->lock, entry, p->word + (size_t)direction * PICTURE_WORDS, PICTURE_WORDS);
}

void picture_get_frame(struct picture *p, struct picture_frame *frame)
{
    seqlock_load(&p->lock, frame, p->frame, PICTURE_FRAME_WORDS);
}

double picture_logodds(const struct picture *p, const struct picture_obstacle *o, uint64_t now_ns)
{
    double dt_s = now_ns > o->t_ref_ns ? (double)(now_ns - o->t_ref_ns) * 1e-9 : 0;
    return o->logodds * exp(-dt_s / p->fade_s);
}
