/* SPDX-License-Identifier: MIT */
/*
 * survivors - the class step of Oliveira, Ferreira and Cruz 2023 (section III B) in the paper's order: what the
 * detector has left of the cleaned image in the last turn, and its three classes. Knows no detector and no ping.
 */
#ifndef SONARD_SURVIVORS_H
#define SONARD_SURVIVORS_H

#include <stddef.h>
#include <stdint.h>

#include "turn.h"

struct survivors {
    struct turn turn; /* counts where the detector found something, 0 elsewhere */
    uint8_t *bin;     /* [max_bins] room for a row */
    uint32_t row;     /* of the image: that of the ping which is extracted next */
    int lowest;       /* upper end of the lowest class; -1: no class */
};

/** survivors_size - bytes of memory for images up to this size. survivors_init - in that; then survivors_begin. */
size_t survivors_size(uint32_t max_rows, uint32_t max_bins);
void survivors_init(struct survivors *s, void *mem, uint32_t max_rows, uint32_t max_bins);

/** survivors_begin - an empty image of rows x bins. */
void survivors_begin(struct survivors *s, uint32_t rows, uint32_t bins);

/**
 * survivors_lowest - takes in what is found of s->row: clean[n] where found[n] is not 0, n the image's bins. Returns
 * the upper end of the lowest class of all survivors of the last turn: of three, of two with two different counts, -1
 * with fewer. Counts of 0 are no survivors.
 */
int survivors_lowest(struct survivors *s, const uint8_t *clean, const uint8_t *found);

#endif
