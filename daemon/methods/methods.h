/* SPDX-License-Identifier: MIT */
/*
 * methods - what clients may ask of directions, pose, status and image: parameters in, answers out. The table is in
 * methods.c; sonard-protocol(7) documents every shape. All run in the loop's thread;
 * ->daemon of a call is a struct methods_env.
 */
#ifndef SONARD_METHODS_H
#define SONARD_METHODS_H

#include "daemon/rpc/rpc.h"

/* Every method as a function of its name: method_blocked, ... */
#define METHOD(name, ...) rpc_method_fn method_##name;
#define CHECKING_METHOD   METHOD
#define SERVER_METHOD(...)
#include "protocol/methods.def"

struct answer;
struct answer_now;
struct methods_env;
struct pose;
struct answer_conf;
struct answer_query;

/** pose_replay - a capture's /pose message: what the `pose` method took, or that poses were withdrawn; false with
 * *error set. */
bool pose_replay(struct methods_env *d, json_t *params, struct rpc_error *error);

/** pose_own - the log has taken a pose of the daemon's own sources (depth, NMEA): as pose_taken, and it may contradict
 * the velocity of a client. */
void pose_own(struct methods_env *d, const struct pose *pose);

/** pose_taken - the log has taken a pose: the map hears of it, and the grids follow it while no ping comes. */
void pose_taken(struct methods_env *d, const struct pose *pose);

/** map_asked - is a map kept? False with a refusal in *error. */
bool map_asked(const struct methods_env *d, struct rpc_error *error);

/** direction_query - what `blocked` asks for, of its parameters. The grid is one of them. */
void direction_query(const json_t *params, struct answer_query *query);

/** sensor_asked - the index of the sonar that the parameter `sensor` names, 0 without it; false with *error set. */
bool sensor_asked(const struct methods_env *d, const json_t *params, int *sensor, struct rpc_error *error);

/** direction_answer - the result of `blocked`: an answer under these limits. */
void direction_answer(const struct methods_env *d, struct json_out *out, const struct answer_now *now,
                      const struct answer_conf *limits, const struct answer_query *query, const struct answer *a);

/** pose_attitude - attitude_deg or quaternion, if one of them is given, into the pose; false with *error set. */
bool pose_attitude(const json_t *params, struct pose *p, struct rpc_error *error);

#endif
