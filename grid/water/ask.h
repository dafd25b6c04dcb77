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
    int records;      /* it rests on so many ... */
    int oldest;       /* ... of which this is the oldest; -1: none */
};

/* A root tile whose parts are to be asked, by what its first pass found. */
struct ask_root {
    double free_to_m;
    struct tile_index tile;
};

/* A question on its way. */
struct ask {
    const struct water_view *view;
    int n;
    struct ask_question question;
    double best_m;                      /* of the tiles that are settled */
    uint64_t used[ASK_RECORDS / 64];    /* set of the records that these rest on */
    uint32_t row, column, columns_left; /* of the roots: the next one */
    bool sorted;
    struct ask_root root[TILES_ROOTS]; /* not settled yet, the worst first once they are sorted */
    int roots, next;
};

/** ask_begin - view[n] are the records, n <= ASK_RECORDS, from the newest to the oldest; they stay until the end. */
void ask_begin(struct ask *a, const struct water_view *view, int n, const struct ask_question *question);

/** ask_step - some of the work; false: all is done. Cost: some microseconds for each record that a root tile, or in the
 * end each of its parts, meets, where the newest does not decide all of it. */
bool ask_step(struct ask *a);

/** ask_end - the answer, once ask_step has nothing left. */
struct ask_answer ask_end(const struct ask *a);

#endif
