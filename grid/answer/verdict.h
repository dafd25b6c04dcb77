/* SPDX-License-Identifier: MIT */
/*
 * verdict - blocked, clear or unknown: what obstacles and records of free water say together of a cone, a corridor or
 * the sectors of a band. The one place where evidence becomes the three words, with the range, the reason and how far
 * the water is free.
 *
 * Blocked: an obstacle of the picture lies within the distance asked. Clear: none does, and the water is free so far,
 * as the records have it, from the vehicle on, or from a place up to `near` on: nearer, `near` promises that nothing
 * stands that no beam shows. So where that place is not observed, the promise does not hold: nobody has looked. Nor
 * does it hold farther than to where something may have come that was shown elsewhere (promise.h).
 * Unknown: the rest. In any case the range is that of the nearest obstacle, which of a sector may be beyond the
 * distance.
 *
 * Clear to a distance is clear to every shorter one: each stretch that is asked for the shorter one is a part of what
 * was asked for the longer, divided at the same ranges (decide.h), and so are the directions with their obstacles.
 */
#ifndef SONARD_VERDICT_H
#define SONARD_VERDICT_H

#include "horizon.h"
#include "obstacles.h"
#include "grid/water/store.h"

/* What is known, when and by which limits. All of it stays until the verdict is given. */
struct verdict_evidence {
    struct picture *picture;
    const struct store *store;
    const struct store_list *list; /* of records */
    const struct answer_conf *conf;
    const struct answer_now *now;
};

#define VERDICT_STARTS 30

/* Where the water is asked about next: from where it begins, within `near`; from `near` on; beyond the distance. */
enum verdict_stage { VERDICT_WITHIN, VERDICT_NEAR, VERDICT_BEYOND };

/* Of the cone or corridor, or of a sector. */
struct verdict_part {
    struct answer answer;
    enum answer_reason against; /* the gravest that stands against clear, whatever is free */
    double hint_m;       /* an echo nearer than `near` that is too little to block; INFINITY: there is none */
    double obstacle_m;   /* the nearest may begin here; INFINITY: there is none */
    double bottom_m;     /* it begins here, in the question's measure; INFINITY: nowhere, ... */
    double bottom_at[3]; /* ... in that direction */
    double promised_m;   /* `near` holds up to here */
    enum verdict_stage stage;
    int starts;     /* so often the water was asked, ... */
    double start_m; /* ... the last time from here on */
    bool found;     /* some of it is free: */
    double from_m, free_m;
    uint64_t oldest_ns;         /* the record that this rests on; 0: on none */
    bool ends;                  /* the last time it was not free as far as asked ... */
    struct tile_index tile;     /* ... in this tile */
    double line_at[3];          /* in which direction it was free no farther the last time, ... */
    double end_at[3], end_m;    /* ... and in which one, and where, when it was asked first, or found */
    struct obstacles_found met; /* by a body that moves */
};

/* A question on its way. */
struct verdict {
    struct verdict_evidence by;
    struct obstacles_query query;
    double own_m; /* the vehicle with its margin is within */
    struct picture_frame frame;
    struct sight_place place;
    size_t parts, next; /* of the parts the next one that is settled; at first all are asked together */
    bool beyond;        /* obstacles beyond the distance were looked for, where they count */
    bool begun, all, asking;
    bool seeking;             /* where the tile in which the next part ended begins to be free, ... */
    double sought_m;          /* ... from here on */
    bool looking;             /* how far `near` holds for a body that moves is being asked */
    struct horizon horizon;   /* with the promise, of the picture in which the obstacles were found */
    struct corridor corridor; /* the answer about it */
    struct verdict_part part[ANSWER_SECTORS_MAX];
    int n, n_aside; /* negative: not looked at yet */
    struct water_view view[ASK_RECORDS], aside[ASK_RECORDS];
    struct ask ask;
};

/** verdict_begin - anew, too. own_m: water nearer than this is the vehicle's own; at most the query's near_m. False:
 * the answers are there. */
bool verdict_begin(struct verdict *v, const struct verdict_evidence *by, const struct obstacles_query *query,
                   double own_m);

/** verdict_step - some of the work, as ask_step; false: the answers are there. */
bool verdict_step(struct verdict *v);

static inline const struct answer *verdict_of(const struct verdict *v, size_t part)
{
    return &v->part[part].answer;
}

/** verdict_corridor - the answer about a body that moves. */
static inline const struct corridor *verdict_corridor(const struct verdict *v)
{
    return &v->corridor;
}

#endif
