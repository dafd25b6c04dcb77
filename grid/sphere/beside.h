/* SPDX-License-Identifier: MIT */
/*
 * beside - where the neighbours of a beam are: those of the same ping, or of a head the ping before. Knows no cell and
 * no direction of the grid.
 */
#ifndef SONARD_BESIDE_H
#define SONARD_BESIDE_H

#include "beam.h"

/* The last ping of a sensor, if it had a single beam. */
struct beside_last {
    uint64_t t_ns;             /* 0: none */
    float axis[3];             /* in the grid's axes */
    bool frees;                /* it freed water */
    float left_rad, right_rad; /* of its row */
};

/**
 * beside_row - the row of beam `index` of a ping, placed. On each side it reaches halfway to the beam there, if that
 * one freed water, too; else not at all. A head's next beam is not known yet: the row is there once it has come.
 */
struct beam_row beside_row(const struct beam *b, uint16_t index, const struct beside_last *last);

/** beside_keep - a ping was entered that has this beam alone, placed. */
void beside_keep(struct beside_last *last, const struct beam *b);

#endif
