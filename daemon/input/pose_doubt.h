/* SPDX-License-Identifier: MIT */
/*
 * pose_doubt - poses that are allowed and hardly meant: an attitude in radians where degrees are wanted, a depth above
 * the surface. Pure.
 */
#ifndef SONARD_POSE_DOUBT_H
#define SONARD_POSE_DOUBT_H

#include <stdbool.h>
#include <stdint.h>

#define POSE_DOUBT_ANGLE_DEG 7.0 /* no angle in radians is greater */
#define POSE_DOUBT_NS        60000000000u
#define POSE_DOUBT_ABOVE_M   1.0 /* waves and a sensor's offset are less */

/* Zeroed at first. */
struct pose_doubt {
    uint64_t small_since_ns; /* all angles have been small since then; 0: not */
    bool told_angles, told_above;
};

/** pose_doubt_attitude - true once: all angles have been below 7 degrees for a minute. */
bool pose_doubt_attitude(struct pose_doubt *doubt, const double rpy_deg[3], uint64_t now_ns);

/** pose_doubt_depth - true once for as long as it stays so: this is more than a metre above the surface. */
bool pose_doubt_depth(struct pose_doubt *doubt, double depth_m);

#endif
