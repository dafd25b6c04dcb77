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
    struct bearings_view view;
    uint32_t ring;                      /* of the direction asked last; RINGS_NONE: none was */
    uint64_t still[BEARINGS_FINE / 64]; /* azimuths of that ring at which sonars look that do not turn */
    /* Of a vehicle that drifts, by parts of the grid's circle: what beams showed at the horizon, wherever that was, may
     * by now stand as near as this. INFINITY: nothing has come there. */
    double come_m[PROMISE_PARTS];
};

/**
 * promise_begin - the promise to a vehicle in that place, which is known but for place->moved_m. It does not depend on
 * the body: a larger one is never promised more.
 */
struct promise promise_begin(struct picture *picture, const struct answer_conf *conf,
                             const struct picture_frame *frame, const struct answer_now *now,
                             const struct sight_place *place);

/**
 * promise_m - how far along the direction nobody needs to have looked, from 0 to near_m; ranges are from the grid's
 * centre. s: what the direction says; NULL: nothing. slack: sine of how far its rays may lie above or below its middle.
 * near_m is the same for all directions; those of a ring are asked about one after the other.
 */
double promise_m(struct promise *p, uint32_t direction, double slack, const struct sight *s, double near_m);

/**
 * promise_come_m - how near what beams showed in other directions may stand by now, within half_rad of that azimuth of
 * the grid's axes, from its centre; INFINITY: nothing has come there. As it goes from the bottom to the surface its
 * elevation does not matter.
 */
double promise_come_m(const struct promise *p, double az_rad, double half_rad);

#endif
