/* SPDX-License-Identifier: MIT */
/*
 * verdict - blocked, clear or unknown: what obstacles and records of free water say together of a cone or a corridor.
 * The one place where evidence becomes the three words, with the range, the reason and how far the water is free.
 *
 * Blocked: an obstacle of the picture lies within the distance asked. Clear: none does, and the water is free so far,
 * as the records have it, from the vehicle on, or from a place up to `near` on: nearer, `near` promises that nothing
 * stands that no beam shows. So where that place is not observed, the promise does not hold: nobody has looked.
 * Unknown: the rest.
 *
 * Clear to a distance is clear to every shorter one: each stretch that is asked for the shorter one is a part of what
 * was asked for the longer, divided at the same ranges (decide.h), and so are the directions with their obstacles.
 */
#ifndef SONARD_VERDICT_H
#define SONARD_VERDICT_H

#include "answer.h"
#include "scope.h"
#include "grid/water/store.h"

/* What is known, when and by which limits. All of it stays until the verdict is given. */
struct verdict_evidence {
    struct picture *picture;
    const struct store *store;
    const struct store_list *list; /* of records */
    const struct answer_conf *conf;
    const struct answer_now *now;
};

#define VERDICT_STARTS 8

/* A question on its way. */
struct verdict {
    struct verdict_evidence by;
    struct answer_query query;
    double own_m; /* the vehicle with its margin is within */
    struct picture_frame frame;
    struct sight_place place;
    struct scope scope;
    struct answer answer;
    enum answer_reason against; /* the gravest that stands against clear, whatever is free */
    double bottom_m;            /* in the question's measure */
    double start_m;             /* the water is asked from here on, ... */
    int starts;                 /* ... for the so manieth time */
    bool found;                 /* some of it is free: */
    double from_m, free_m;
    uint64_t oldest_ns; /* the record that this rests on; 0: on none */
    double end_at[3];   /* where it was free no farther */
    double end_m;
    int n;
    struct water_view view[ASK_RECORDS], aside[ASK_RECORDS];
    struct ask ask;
};

/** verdict_begin - anew, too. own_m: water nearer than this is the vehicle's own, query->near_m >= own_m. False: the
 * answer is there. */
bool verdict_begin(struct verdict *v, const struct verdict_evidence *by, const struct answer_query *query,
                   double own_m);

/** verdict_step - some of the work, as ask_step; false: the answer is there. */
bool verdict_step(struct verdict *v);

#endif
