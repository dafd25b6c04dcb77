/* SPDX-License-Identifier: MIT */
/*
 * horizon - up to where `near` holds at each part of the horizon about a line, by what the records of free water say
 * there. What it is promised to not stand there goes from the bottom to the surface, so the horizon tells of all
 * elevations. In steps, for that takes long.
 */
#ifndef SONARD_HORIZON_H
#define SONARD_HORIZON_H

#include "grid/water/ask.h"
#include "promise.h"

/* What the parts are, and what was found of them. Angles in the axes of the records. */
struct horizon {
    struct promise promise;
    double near_m;
    double axes_rad;      /* azimuth of the grid's azimuth 0 */
    uint32_t first, n;    /* parts, past the last one from the first on; none: near_m holds everywhere */
    bool drifts, nominal; /* of what records showed, whatever is uncertain since */
    double start_m;
    struct promise_look look[ASK_LEVEL];
    double level_m[ASK_LEVEL]; /* the answer */
};

/** horizon_begin - of the parts within 45 degrees of the level course of `along`; promise: begun. False: there is
 * nothing to be asked. */
bool horizon_begin(struct horizon *h, const double along[3], double axes_rad, double near_m);

/* When that is asked, and the records that it is asked of, with all that is uncertain. */
struct horizon_now {
    uint64_t now_ns;
    const struct water_view *view;
};

/** horizon_question - what is to be asked next, of the records with all that is uncertain, or without where h->nominal
 * is set. horizon_take - its answers; false: that was all. */
struct ask_question horizon_question(const struct horizon *h);
bool horizon_take(struct horizon *h, const struct ask *ask, const struct horizon_now *now);

/** horizon_end - level_m is told, by the records that were asked. looks: those whose beams count as looks, the others
 * lost. */
void horizon_end(struct horizon *h, const struct water_view *view, int n, const struct water_view *looks,
                 int n_looks);

#endif
