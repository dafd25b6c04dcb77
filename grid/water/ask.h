/* SPDX-License-Identifier: MIT */
/*
 * ask - how far the water is free in the directions of a question: its tiles, coarse first and finer where the answer
 * hangs on them, each from the newest record to the oldest. The newest that says something of a stretch wins.
 */
#ifndef SONARD_WATER_ASK_H
#define SONARD_WATER_ASK_H

#include "tiles.h"

#define ASK_RECORDS 256

struct ask_question {
    double axis[3];  /* unit vector, NED */
    double half_rad; /* of the cone around it, [0, pi] */
    double near_m;   /* water nearer than this is not asked about */
    double to_m;     /* how far, > near_m; at most 600 */
};

struct ask_answer {
    double free_to_m; /* free from near_m to here; near_m: nothing is */
    int oldest;       /* the oldest record that this rests on; -1: none */
};

/**
 * ask_free - view[n] are the records, n <= ASK_RECORDS, from the newest to the oldest. Cost: some microseconds for
 * each record that a tile meets, where the newest does not decide all of it.
 */
struct ask_answer ask_free(const struct water_view *view, int n, const struct ask_question *question);

#endif
