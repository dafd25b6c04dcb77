/* SPDX-License-Identifier: MIT */
/* ranking.h - next_look in all its steps at once, as tests ask it. */
#ifndef SONARD_TEST_RANKING_H
#define SONARD_TEST_RANKING_H

#include <string.h>

#include "grid/answer/next_look.h"

#define RANKING_DIRECTIONS 65536

static struct next_look_ranking ranking;

/* The best first; returns how many were found, at most room. */
static inline uint32_t rank_looks(struct picture *picture, uint64_t now_ns, const struct next_look_conf *conf,
                                  struct next_look *out, uint32_t room)
{
    static struct next_look_score score[RANKING_DIRECTIONS];
    next_look_begin(&ranking, now_ns, conf, score, room);
    while (next_look_step(&ranking, picture)) {
    }
    memcpy(out, ranking.look, ranking.n * sizeof *out);
    return ranking.n;
}

#endif
