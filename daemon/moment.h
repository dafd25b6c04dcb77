/* SPDX-License-Identifier: MIT */
/*
 * moment - what the methods must know of the moment of asking: time, pose, which sonars are heard, and the limits of
 * the configuration. Knows no JSON.
 */
#ifndef SONARD_MOMENT_H
#define SONARD_MOMENT_H

#include "daemon.h"

/** moment_now - time, the pose as of now with how far off it may be, and lost sonars, as answers take them. */
struct answer_now moment_now(const struct daemon *d);

/** moment_lost_sonars - set of the sonars that are not heard at present. A capture's are heard while it plays. */
uint64_t moment_lost_sonars(const struct daemon *d);

/** moment_pose_age_s - of the oldest of attitude, position and depth, of those that were ever told; negative: none was. */
double moment_pose_age_s(const struct daemon *d);

/** moment_place_age_s, moment_velocity_age_s - of what was told of these; without any, as old as the computer's clock. */
double moment_place_age_s(const struct daemon *d);
double moment_velocity_age_s(const struct daemon *d);

/** moment_near_m - water nearer than this to the vehicle is its own: near in [vehicle], auto worked out. */
double moment_near_m(const struct daemon *d);

/** moment_unix_offset_ns - Unix time less the loop's, as of now: the computer's clock may be set while sonard runs.
 * A replay's is Unix time. */
uint64_t moment_unix_offset_ns(const struct daemon *d);

/** moment_unix_s - Unix time now. */
double moment_unix_s(const struct daemon *d);

#endif
