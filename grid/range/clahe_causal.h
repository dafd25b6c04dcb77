/* SPDX-License-Identifier: MIT */
/*
 * clahe_causal - CLAHE row by row, without waiting: each tile has the table of its last complete pass, made when the
 * head leaves it from the newest row at every angle. Not the exact filter (clahe_image), which would have to wait for
 * one and a half tiles; the same for every order in which the rows of a tile come.
 */
#ifndef SONARD_CLAHE_CAUSAL_H
#define SONARD_CLAHE_CAUSAL_H

#include "clahe.h"
#include "turn.h"

#define CLAHE_CAUSAL_TILES 8 /* along either axis, where there are as many rows and bins */

struct clahe_causal {
    struct clahe_grid grid;
    struct turn turn;
    uint32_t tile; /* row of tiles that the head is in */
    bool ready[CLAHE_CAUSAL_TILES];
    clahe_table table[CLAHE_CAUSAL_TILES * CLAHE_CAUSAL_TILES];
};

/** clahe_causal_size - bytes of memory (aligned to uint64_t) for images up to this size. */
size_t clahe_causal_size(uint32_t max_rows, uint32_t max_bins);

void clahe_causal_init(struct clahe_causal *c, void *mem, uint32_t max_rows, uint32_t max_bins,
                       uint32_t clip_q100);

/** clahe_causal_begin - an empty image of a full turn. */
void clahe_causal_begin(struct clahe_causal *c, uint32_t rows, uint32_t bins);

/**
 * clahe_causal_row - take a row in and equalise it. new_pass: the head begins a new turn or sweep with it, which
 * completes the tile it was in. in, out: [bins], may be the same.
 */
void clahe_causal_row(struct clahe_causal *c, uint32_t row, bool new_pass, const uint8_t *in, uint8_t *out);

#endif
