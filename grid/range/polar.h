/* SPDX-License-Identifier: MIT */
/*
 * polar - the polar image of one head: which row a ping belongs to and which rows are its neighbours. Rows are
 * indexed by head angle, not by arrival: sectors reverse, beams get lost, bearings repeat. Integers only. Knows when
 * and where a row was received, not what is in it.
 */
#ifndef SONARD_POLAR_H
#define SONARD_POLAR_H

#include <stdbool.h>
#include <stdint.h>

#include "grid/ping.h"

#define POLAR_MAX_ROWS   1024
#define POLAR_MAX_AGE_NS UINT64_C(60000000000) /* more than 1.5 turns of the slowest head (35 s) */

struct polar_row {
    uint64_t ping; /* which of the image's pings it is, from 1; 0: the row holds nothing */
    uint64_t t_ns;
    struct pose pose; /* of the body then */
};

struct polar {
    uint32_t turn;   /* head units of a turn; 1: the head does not turn, and there is one row */
    uint32_t step;   /* head units from ping to ping; 0: not known yet, and there are no neighbours */
    uint32_t rows;   /* of a full turn */
    uint32_t n_bins; /* 0: no ping yet */
    float r0_m, dr_m;
    uint32_t units;     /* head angle of the last ping */
    uint64_t t_ns;      /* of the last ping */
    uint32_t odd_steps; /* pings in a row that came by another step */
    uint32_t odd_step;  /* by which one */
    uint64_t pings;     /* placed since the start of the image */
    uint64_t restarts;  /* how often what was there had to be dropped */
    struct polar_row row[POLAR_MAX_ROWS];
};

/** polar_init - no image. */
void polar_init(struct polar *p);

/**
 * polar_fits - can the ping (with one beam) go on with this image? Not when the turn, the bins, the range axis or the
 * step are others, nor after a pause of more than POLAR_MAX_AGE_NS; polar_place starts anew then.
 *
 * The step is the first one seen. One that does not divide into whole steps of it has to come twice in a row to be
 * believed (heads make an odd step where they reverse), and a multiple of it eight times (beams get lost).
 */
bool polar_fits(const struct polar *p, const struct ping *ping);

/** polar_place - the row of the ping, which is from now on the newest there. */
uint32_t polar_place(struct polar *p, const struct ping *ping);

/**
 * polar_neighbour - the row `offset` rows from `row`, on the other side of angle zero if need be; NULL when there is
 * none: beyond the end of the sector, lost, or more than a turn and a half (counted in pings) or POLAR_MAX_AGE_NS older
 * than the newest ping.
 */
const struct polar_row *polar_neighbour(const struct polar *p, uint32_t row, int offset);

/** polar_index - the number of a row that polar_neighbour gave. */
static inline uint32_t polar_index(const struct polar *p, const struct polar_row *row)
{
    return (uint32_t)(row - p->row);
}

#endif
