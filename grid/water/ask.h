/* SPDX-License-Identifier: MIT */
/*
 * ask - how far the water is free in the directions of a question: its tiles, coarse first and finer where the answer
 * hangs on them, each from the newest record to the oldest. The newest that says something of a stretch wins. A few of
 * the smallest tiles come before all others: what is not free there need not be asked farther anywhere else.
 */
#ifndef SONARD_WATER_ASK_H
#define SONARD_WATER_ASK_H

#include "question.h"

#define ASK_RECORDS 512

struct ask_answer {
    double free_to_m;       /* free to here, in the question's measure; of a cone or a part near_m: nothing is */
    double at[3];           /* in which direction, NED, it is free no farther; 0 0 0: it is so far as was asked */
    double at_m;            /* and there it is free to that range ... */
    struct tile_index tile; /* ... in this tile */
    int records;            /* it rests on so many ... */
    int oldest;             /* ... of which this is the oldest; -1: none */
};

/* A root tile whose parts are to be asked, by what its first pass found. */
struct ask_root {
    double measure_m;
    struct tile_index tile;
};

#define ASK_MIXED 16
#define ASK_OPEN  24 /* stretches of a tile of which nobody has said anything */
#define ASK_WORDS (ASK_RECORDS / 64)

/* What is known of a tile before record `next`, and how far it is free by all of them. */
struct ask_tile {
    struct tile_index tile;
    uint64_t out[ASK_WORDS];  /* set of the records that it does not touch; nor do its parts */
    uint64_t used[ASK_WORDS]; /* set of those that found it free ... */
    uint64_t all[ASK_WORDS];  /* ... and that do so with record `next` and those behind it */
    int next, n;
    double limit_m; /* nothing is free from there on */
    struct ask_stretch open[ASK_OPEN];
    struct question_run run;
    double goal_m;            /* it is asked for the question so far, in its measure ... */
    struct ask_stretch asked; /* ... and that is this stretch */
    double free_to_m, measure_m;
    bool mixed; /* its parts may be free farther */
};

/* Stretches of which a part of the tile may be told more; of too many the last ones are one. */
struct ask_mixed {
    struct ask_stretch of[ASK_MIXED];
    int n;
};

/* A tile while one record after the other is asked about it. */
struct ask_pass {
    struct ask_tile tile, now; /* up to where its parts go on, up to `record` */
    struct ask_mixed mixed;
    int record;
    bool parted;
    enum { ASK_NO_TILE, ASK_PROBE, ASK_ROOT, ASK_ROOT_AGAIN, ASK_PART } of;
};

/* A tile whose parts are being asked. */
struct ask_level {
    struct ask_tile whole;
    struct ask_tile part[4]; /* the worst first */
    int tried;               /* of its four */
    int n, next;             /* parts that the question touches; the next one to be asked about its own parts */
};

/* A part of the question, by the tiles that are settled. */
struct ask_part {
    double best_m, at[3], at_m;
    struct tile_index tile;
    uint64_t used[ASK_WORDS]; /* set of the records that they rest on */
};

/* A question on its way. */
struct ask {
    const struct water_view *view;
    int n;
    struct question_shape question;
    struct ask_part part[ASK_PARTS];
    bool over;                          /* nothing that is left can change what was asked */
    size_t probe;                       /* the next one */
    uint32_t row, column, columns_left; /* of the roots: the next one */
    bool sorted;
    struct ask_root root[TILES_ROOTS]; /* not settled yet, the worst first once they are sorted */
    int roots, next;
    struct ask_level level[TILES_LEVELS - 1]; /* of the root at work ... */
    int levels;                               /* ... so many */
    struct ask_pass pass;
    int judged; /* stretches in this step */
};

/** ask_begin - view[n] are the records, n <= ASK_RECORDS, from the newest to the oldest; they stay until the end. */
void ask_begin(struct ask *a, const struct water_view *view, int n, const struct ask_question *question);

/** ask_step - some of the work; false: all is done. Cost: below a millisecond, as a rule; that of one record and tile
 * at the most. */
bool ask_step(struct ask *a);

/** ask_begins_m - where from from_m on the tile begins to be free by those records, before to_m; INFINITY: nowhere.
 * *ends_m: there it ends; INFINITY: it does not. Farther on it may be free again: a sensor off the vehicle's middle
 * sees that in another beam. What was asked before is over. Cost: that of one tile. */
double ask_begins_m(struct ask *a, const struct water_view *view, int n, const struct tile_index *tile,
                    const struct ask_stretch *within, double *ends_m);

/** ask_end - the answer about a part, once ask_step has nothing left. */
struct ask_answer ask_end(const struct ask *a, size_t part);

#endif
