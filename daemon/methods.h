/* SPDX-License-Identifier: MIT */
/*
 * methods - what clients may ask of directions, pose, status and image: parameters in, answers out. The table is in
 * methods.c; sonard-protocol(7) documents every shape. All run in the loop's thread; ->daemon of a call is a struct daemon.
 */
#ifndef SONARD_METHODS_H
#define SONARD_METHODS_H

#include "rpc.h"

struct answer;
struct pose;
struct answer_query;

/** direction_query - what `blocked` asks for, of its parameters; false with *error set. The grid is one of them. */
bool direction_query(json_t *params, struct answer_query *query, struct rpc_error *error);

/** direction_answer - as `blocked` tells it. */
json_t *direction_answer(const struct answer *a);

json_t *explain_method(const struct rpc_call *call, json_t *params, struct rpc_error *error);
json_t *direction_method_blocked(const struct rpc_call *call, json_t *params, struct rpc_error *error);
bool direction_method_sectors(const struct rpc_call *call, json_t *params, struct text *out,
                              struct rpc_error *error);
json_t *direction_method_nearest(const struct rpc_call *call, json_t *params, struct rpc_error *error);
json_t *motion_method_limit(const struct rpc_call *call, json_t *params, struct rpc_error *error);
json_t *motion_method_collision(const struct rpc_call *call, json_t *params, struct rpc_error *error);
/** pose_attitude - attitude_deg or quaternion, if one of them is given, into the pose; false with *error set. */
bool pose_attitude(json_t *params, struct pose *p, struct rpc_error *error);

json_t *pose_method(const struct rpc_call *call, json_t *params, struct rpc_error *error);
json_t *status_method(const struct rpc_call *call, json_t *params, struct rpc_error *error);
json_t *status_method_sensors(const struct rpc_call *call, json_t *params, struct rpc_error *error);
json_t *stats_method(const struct rpc_call *call, json_t *params, struct rpc_error *error);
json_t *plan_method(const struct rpc_call *call, json_t *params, struct rpc_error *error);
json_t *status_method_version(const struct rpc_call *call, json_t *params, struct rpc_error *error);
json_t *reload_method(const struct rpc_call *call, json_t *params, struct rpc_error *error);
bool image_method(const struct rpc_call *call, json_t *params, struct text *out, struct rpc_error *error);

struct daemon;

/** status_data_word - in a few words whether the answers rest on living sonars: what `status` says as `data`. */
const char *status_data_word(const struct daemon *d);

#endif
