/* SPDX-License-Identifier: MIT */
/*
 * query_context - what the methods must know when they are called: time, pose, which sonars are online, and the
 * limits of the configuration. Knows no JSON.
 */
#ifndef SONARD_QUERY_CONTEXT_H
#define SONARD_QUERY_CONTEXT_H

#include "daemon/methods/environment.h"

/** query_now - time, the pose as of now with how far off it may be, and lost sonars, as answers take them. */
struct answer_now query_now(const struct methods_env *d);

/** query_lost_sonars - set of the sonars that are offline, in a replay those that were; never one of which the capture
 * does not tell. */
uint64_t query_lost_sonars(const struct methods_env *d);

/** query_whole_pose - the newest pose, if it is fresh and can tell where the body's places are. */
bool query_whole_pose(const struct methods_env *d, struct pose *pose);

/** query_pose_age_s - of the oldest of attitude, position and depth,
 * of those that were ever given; negative: none was. */
double query_pose_age_s(const struct methods_env *d);

/* Names of the parts of a pose: part i is POSE_* 1 << i. */
#define QUERY_POSE_PARTS 5
extern const char *const query_pose_parts[QUERY_POSE_PARTS];

/** query_pose_part - age of the last of part i; false: none was ever given. */
bool query_pose_part(const struct methods_env *d, unsigned i, double *age_s);

/** query_place_age_s, query_velocity_age_s - of the last of these; without any, as old as the computer's clock. */
double query_place_age_s(const struct methods_env *d);
double query_velocity_age_s(const struct methods_env *d);

/** query_near_m - water nearer than this to the vehicle is its own: near in [vehicle], auto worked out. */
double query_near_m(const struct methods_env *d);

/** query_own_m - the vehicle with its margin is within so far of its reference point; no more than query_near_m. */
double query_own_m(const struct methods_env *d);

/** query_look_ahead_m - how far sectors are judged by default: look_ahead in [answers], auto worked out but for
 * the range of the sonars. */
double query_look_ahead_m(const struct methods_env *d);

#define QUERY_REASON_SIZE 300

/**
 * query_pose_missing - whose pose is missing since when: "the attitude from a client is 4.2 s old (limit 1 s)". Empty
 * while the pose is fresh, and while none was ever given. Returns text.
 */
const char *query_pose_missing(const struct methods_env *d, char text[QUERY_REASON_SIZE]);

/** query_unix_offset_ns - Unix time less the loop's, as of now: the computer's clock may be set while sonard runs.
 * A replay's is Unix time. */
uint64_t query_unix_offset_ns(const struct methods_env *d);

/** query_unix_s - Unix time now. */
double query_unix_s(const struct methods_env *d);

#endif
