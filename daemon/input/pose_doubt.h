/* SPDX-License-Identifier: MIT */
/*
 * pose_doubt - poses that are allowed and hardly meant: an attitude in radians where degrees are wanted, a depth above
 * the surface. Small numbers prove neither: a vehicle that lies level and points north has them, too. Pure.
 */
#ifndef SONARD_POSE_DOUBT_H
#define SONARD_POSE_DOUBT_H

#include <stdbool.h>
#include <stdint.h>

#define POSE_DOUBT_STEP_RAD  0.5         /* a turn from pose to pose is less, */
#define POSE_DOUBT_STEP_NS   2000000000u /* and they come more often */
#define POSE_DOUBT_SURFACE_M 1.0         /* waves and a sensor's offset are less */

/* Zeroed at first. */
struct pose_doubt {
    double from, last, turned; /* headings as they were given, and the way between them if they are radians */
    uint64_t t_last_ns;
    bool is_turning; /* these hold */
    bool told_angles, told_above, was_below;
};

/**
 * pose_doubt_attitude - true once: the heading has gone round the whole circle in small steps if it is in radians, and
 * jumped by 6.28 degrees on the way if it is in degrees. No angle that is greater came before.
 */
bool pose_doubt_attitude(struct pose_doubt *doubt, const double rpy_deg[3], uint64_t now_ns);

/**
 * pose_doubt_depth - true once for as long as it stays so: this is more than a metre above the surface, and no depth
 * has been below it, which would show that the sign is right.
 */
bool pose_doubt_depth(struct pose_doubt *doubt, double depth_m);

#endif
