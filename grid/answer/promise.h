/* SPDX-License-Identifier: MIT */
/*
 * promise - up to where `near` in [vehicle] holds along a direction. It is the user's promise about what no beam shows:
 * where a sonar looks it does not permit passing before the sonar has looked.
 */
#ifndef SONARD_PROMISE_H
#define SONARD_PROMISE_H

#include "sight.h"

#define PROMISE_PARTS    64
#define PROMISE_LEAST    0.1 /* of `near`: nearer nobody needs to look */
#define PROMISE_LOOKED_S 1.0 /* in so long a sonar that does not turn has looked again, whatever pings it loses */

/* To whom it is given: a vehicle in that picture. */
struct promise {
    struct picture *picture;
    const struct picture_frame *frame;
    const struct answer_now *now;
    double loose_m; /* pose uncertainty: how far off the vehicle's place may be */
    uint64_t shown; /* bearings of the body: where heads that are neither offline nor silent show what is there */
    struct bearings_view view;
    bool rowed;                         /* some direction was asked: */
    double row_down;                    /* the third component of the last one, and ... */
    uint64_t still[BEARINGS_FINE / 64]; /* ... azimuths of all these at which sonars look that do not turn */
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

/* What the records say of a part of the horizon. */
struct promise_look {
    bool goes_on;  /* the water is free from near_m on */
    double sure_m; /* it is free so far, at most near_m; 0: nowhere */
    /* A record that counts showed water there, though the vehicle may have drifted out of it since ... */
    bool showed;
    double age_s; /* ... so long ago */
    /* The last ping lies so uncertainly that its edge may be here, though it showed water, or beside such water. 0:
     * it does not, or was long ago. */
    double loose_m, loose_rad;
    /* Beams have looked so far at all of it that is a head's to look at, but for what lies between two of its beams. */
    double looked_m;
};

/**
 * promise_m - how far along a level direction nobody needs to have looked, from 0 to near_m, the same for all
 * directions; ranges are from the grid's centre, as is az_rad, in its axes.
 */
double promise_m(struct promise *p, double az_rad, const struct promise_look *look, double near_m);

/** promise_heeds - may promise_m be less than near_m there, whatever the look? promise_asks - does it depend on what
 * was shown, whatever is uncertain since? */
bool promise_heeds(struct promise *p, double az_rad, double near_m);
bool promise_asks(struct promise *p, double az_rad, double near_m);

/** promise_looks - do sonars look at that place, from the vehicle? Those off the middle look elsewhere near by
 * than far away. promise_passes - do they somewhere from PROMISE_LEAST of near_m up to it? */
bool promise_looks(const struct promise *p, double az_rad, double range_m);
bool promise_passes(const struct promise *p, double az_rad, double near_m);

/**
 * promise_come_m - how near what beams showed in other directions may stand by now, within half_rad of that azimuth of
 * the grid's axes, from its centre; INFINITY: nothing has come there. As it goes from the bottom to the surface its
 * elevation does not matter.
 */
double promise_come_m(const struct promise *p, double az_rad, double half_rad);

#endif
