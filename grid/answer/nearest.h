/* SPDX-License-Identifier: MIT */
/*
 * nearest - which obstacle around the vehicle is the nearest, and how much of what is nearer than it nobody knows.
 * Pure; reads the picture and nothing else.
 */
#ifndef SONARD_NEAREST_H
#define SONARD_NEAREST_H

#include "answer.h"

struct nearest_query {
    bool ned;              /* angles, of question and answer, are NED; otherwise the body's */
    double lo_rad, hi_rad; /* elevations of the directions' centres that count, lo < hi */
    /* azimuths that count, clockwise from the first, and the cells on their edges; width 0 or a turn: all around */
    double from_rad, width_rad;
    double reach_m; /* obstacles farther away do not count; 0: all do */
    double near_m;  /* water nearer than this does not make the answer old */
};

struct nearest {
    enum answer_state state; /* blocked: there is one; clear: all that count are free to reach_m; unknown */
    enum answer_reason reason;
    double az_rad, el_rad; /* middle of the direction that it is in; only when blocked, as the next three */
    double range_m, range_sd_m;
    double confidence;    /* probability that it is there */
    double age_s;         /* blocked: of its last echo; clear: of the oldest ping; negative: no evidence */
    double unknown_share; /* of the directions: not known to be free up to it, or to reach_m */
};

/** nearest_look - O(directions). */
void nearest_look(struct picture *p, const struct answer_conf *conf, const struct answer_now *now,
                  const struct nearest_query *query, struct nearest *out);

#endif
