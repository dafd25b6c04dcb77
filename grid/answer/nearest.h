/* SPDX-License-Identifier: MIT */
/*
 * nearest - which obstacle around the vehicle is the nearest, and how much of the water nearer than it nobody knows: by
 * parts of the directions asked about, each of which verdict.h judges as it does a sector. Pure.
 */
#ifndef SONARD_NEAREST_H
#define SONARD_NEAREST_H

#include "verdict.h"

struct nearest_query {
    bool ned;              /* angles, of question and answer, are NED; otherwise the body's */
    double lo_rad, hi_rad; /* elevations that count, lo < hi */
    /* azimuths that count, clockwise from the first, and the obstacles that reach between them; width 0 or a turn: all
     * around */
    double from_rad, width_rad;
    double reach_m; /* obstacles farther away do not count; 0: all do, ... */
    double heard_m; /* ... and where there is none, water is asked for as far as this, > 0 */
    double near_m;  /* `near`: up to here it is promised */
};

struct nearest {
    enum answer_state state;   /* blocked: there is one; clear: all that count are free to reach_m; unknown */
    enum answer_reason reason; /* the gravest why water is not known; ANSWER_HEARD: all is */
    double az_rad, el_rad;     /* middle of the direction that it is in; only when blocked, as the next three */
    double range_m, range_sd_m;
    double confidence;    /* probability that it is there */
    double age_s;         /* blocked: of its last echo; clear: of the oldest ping; negative: no evidence */
    double unknown_share; /* of the parts: not known to be free up to it, or to reach_m */
};

/* A question on its way. */
struct nearest_look {
    struct verdict *verdict; /* of the row of parts at work */
    struct verdict_evidence by;
    struct nearest_query query;
    double own_m;
    double to_m; /* water is asked for as far as this */
    size_t row, rows;
    bool row_begun;
    size_t parts, unknown; /* of the rows so far */
    double oldest_s;
    struct nearest answer;
};

/** nearest_begin - anew, too; own_m as of verdict_begin. v is its own until the end. False: the answer is there.
 * Cost: a glance at each direction. */
bool nearest_begin(struct nearest_look *look, struct verdict *v, const struct verdict_evidence *by,
                   const struct nearest_query *query, double own_m);

/** nearest_step - some of the work, as verdict_step; false: the answer is there. */
bool nearest_step(struct nearest_look *look);

#endif
