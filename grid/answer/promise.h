/* SPDX-License-Identifier: MIT */
/*
 * promise - up to where `near` in [vehicle] holds along a direction. It is the user's promise about what no beam shows:
 * where a sonar looks it does not permit passing before the sonar has looked.
 */
#ifndef SONARD_PROMISE_H
#define SONARD_PROMISE_H

#include "sight.h"

#define PROMISE_PARTS 64

/* To whom it is given: a vehicle in that picture. */
struct promise {
    struct picture *picture;
    const struct picture_frame *frame;
    const struct answer_now *now;
    double loose_m; /* pose uncertainty: how far off the vehicle's place may be */
    uint64_t shown; /* bearings of the body: where heads that are neither offline nor silent show what is there */
    /* Of a vehicle that drifts, by parts of the grid's circle: what beams showed at the horizon, wherever that was, may
     * by now stand as near as this. INFINITY: nothing has come there. */
    double come_m[PROMISE_PARTS];
};

/** promise_begin - the promise to a vehicle whose place is known but for loose_m. */
struct promise promise_begin(struct picture *picture, const struct answer_conf *conf,
                             const struct picture_frame *frame, const struct answer_now *now, double loose_m);

/**
 * promise_m - how far along the direction nobody needs to have looked, from 0 to near_m; ranges are from the grid's
 * centre. s: what the direction says; NULL: nothing. slack: sine of how far its rays may lie above or below its middle.
 */
double promise_m(const struct promise *p, uint32_t direction, double slack, const struct sight *s, double near_m);

#endif
