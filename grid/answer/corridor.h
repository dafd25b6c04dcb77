/* SPDX-License-Identifier: MIT */
/*
 * corridor - a body that moves along a line: what is asked of its way, and what is known of it.
 *
 * The body is an upright cylinder around the reference point. It sweeps a straight tunnel with flat ends: half_width_m
 * to each side, half_height_m up and down, from the reference point to `distance + front_m`; farther to the side that
 * it drifts to, by what it drifts. Nothing that the picture holds lies in the tunnel up to blocked_m, and by the
 * records it is free up to known_m, but for the water nearer than near_m, as far as that holds (promise.h).
 */
#ifndef SONARD_CORRIDOR_H
#define SONARD_CORRIDOR_H

#include "answer.h"

struct corridor_body {
    double radius_m;      /* of the cylinder, >= 0 */
    double half_height_m; /* >= 0 */
    double margin_m;      /* of water on every side, >= 0 */
};

struct corridor_query {
    struct corridor_body body;
    double direction[3]; /* of any length but 0 */
    /* the body may be carried off by as much; what of it is along the direction does not count */
    double drift_m[3];
    bool ned;      /* both are NED; otherwise the body's */
    double most_m; /* how far to look from the reference point, > near_m */
    /* water nearer than this to the reference point is not asked for, > 0. What counts there: echoes, weak ones too,
     * and at a level bearing at which a sonar looks (grid/picture/bearings.h) that it has looked */
    double near_m;
};

struct corridor {
    double front_m;       /* the body with its margin reaches so far ahead */
    double blocked_m;     /* an obstacle begins here, along the line from the reference point; INFINITY: none */
    double blocked_sd_m;  /* of it; 0 without */
    double confidence;    /* that it is there; 0 without */
    double blocked_age_s; /* of its last echo; negative without */
    double blocked_at[3]; /* its direction, in the axes asked about; 0 0 0 without */
    double known_m;       /* known to be free up to here, what blocks aside; <= most_m, 0: not even at the body */
    enum answer_reason reason; /* why not farther; ANSWER_HEARD: known as far as asked */
    double known_at[3];        /* in which direction: in the axes asked about; 0 0 0: in none of its own */
    double age_s;              /* of the oldest ping that counts; negative: none */
    double uncertain_m;        /* pose uncertainty; already subtracted from every distance here */
};

#endif
