/* SPDX-License-Identifier: MIT */
/* The method by which a client tells where the vehicle is; sonard-protocol(7) has its shape. */
#include <stdlib.h>
#include <string.h>

#include "core/log.h"
#include "methods.h"
#include "daemon/pipeline/follow.h"
#include "query_context.h"

#define POSE_PAST_S   10.0
#define POSE_FUTURE_S 1.0

static bool pose_time(const struct methods_env *d, const json_t *params, uint64_t *t_ns, struct rpc_error *error)
{
    const double t_unix = query_unix_s(d), given = params_number(params, "t_unix");
    *t_ns = loop_now(d->loop);
    if (!params_has(params, "t_unix"))
        return true;
    if (given < t_unix - POSE_PAST_S || given > t_unix + POSE_FUTURE_S)
        return rpc_refuse(
            error, RPC_INVALID_PARAMS,
            "t_unix is %.3f s off this computer's clock: wanted at most %g s in the past, %g s ahead",
            given - t_unix, POSE_PAST_S, POSE_FUTURE_S);
    double ns = given * 1e9 - (double)query_unix_offset_ns(d);
    *t_ns = ns > 0 ? (uint64_t)ns : 0;
    return true;
}

bool pose_attitude(const json_t *params, struct pose *p, struct rpc_error *error)
{
    double rpy[3], q[4];
    const bool has_rpy = params_numbers(params, "attitude_deg", rpy),
               has_q = params_numbers(params, "quaternion", q);
    if (has_q && !quat_normalise(q))
        return rpc_refuse(error, RPC_INVALID_PARAMS, "quaternion is not of length 1 (w, x, y, z)");
    if (has_rpy)
        quat_from_rpy(geo_rad(rpy[0]), geo_rad(rpy[1]), geo_rad(rpy[2]), q);
    if (has_rpy || has_q) {
        memcpy(p->attitude, q, sizeof p->attitude);
        p->has |= POSE_ATTITUDE;
    }
    return true;
}

static void pose_place(const json_t *params, struct pose *p)
{
    if (params_numbers(params, "position_m", p->position_m))
        p->has |= POSE_POSITION | POSE_DEPTH;
    if (params_has(params, "depth_m")) {
        p->position_m[2] = params_number(params, "depth_m");
        p->has |= POSE_DEPTH;
    }
    if (params_numbers(params, "velocity_mps", p->velocity_mps))
        p->has |= POSE_VELOCITY;
    if (params_has(params, "altitude_m")) {
        p->altitude_m = params_number(params, "altitude_m");
        p->has |= POSE_ALTITUDE;
    }
}

/* What is taken, but hardly meant. */
static void tell_doubt(struct methods_env *d, const json_t *params)
{
    double rpy_deg[3];
    if (params_numbers(params, "attitude_deg", rpy_deg) &&
        pose_doubt_attitude(&d->pose_doubt, rpy_deg, loop_now(d->loop)))
        log_line(
            LOG_WARNING, "pose_doubt",
            "pose: the heading in attitude_deg has gone round the circle and stayed below 6.3, as one in radians "
            "does: send degrees");
    if (params_has(params, "depth_m") && pose_doubt_depth(&d->pose_doubt, params_number(params, "depth_m")))
        log_line(LOG_WARNING, "pose_doubt",
                 "pose: depth_m = %g is above the surface: if the vehicle is in the water, send metres below the "
                 "surface as a positive number",
                 params_number(params, "depth_m"));
}

/* It may have waited, while the process was held up or behind other requests of its client, and be of any time since.
 * Another will come. */
static bool undated(const struct rpc_call *call, const json_t *params)
{
    return call->waited_ns > LOOP_TIMELY_NS && !params_has(params, "t_unix");
}

void pose_taken(struct methods_env *d, const struct pose *pose)
{
    struct pose whole;
    map_service_pose(&d->map_service, pose);
    if (pose_log_at(&d->poses, pose->t_ns, &whole))
        pipeline_follow(d->pipeline, &whole);
}

static void tell_velocity(bool doubted)
{
    if (doubted)
        log_line(
            LOG_WARNING, "velocity_doubt",
            "pose: velocity_mps is exactly 0 while attitude, depth or position change, as a DVL without bottom "
            "lock sends it: it is not used until one comes that is not 0; leave out what is not measured");
}

void pose_own(struct methods_env *d, const struct pose *pose)
{
    struct pose witness = *pose;
    tell_velocity(velocity_doubt_take(&d->velocity_doubt, &witness));
    pose_taken(d, pose);
}

/* What is recorded goes by the capture's clock, which does not step when the computer's is set; a replay dates it back
 * as its configuration says. */
static uint64_t date_by_capture(const struct methods_env *d, json_t *params, uint64_t given_ns)
{
    double t_unix;
    if (!params_has(params, "t_unix") || d->replay)
        return given_ns;
    const uint64_t told_ns = pose_input_told(given_ns, d->unix_offset_ns, &t_unix);
    json_object_set_new(params, "t_unix", json_real(t_unix));
    return told_ns;
}

/* Number of the word of no_speed_bound, from 1 on; 0: it is not there, or there is no vehicle whose speed could be
 * bounded. */
static int no_bound_word(const json_t *params)
{
    const struct protocol_param *p = protocol_methods[PROTOCOL_pose].params;
    while (strcmp(p->name, "no_speed_bound") != 0)
        p++;
    for (int i = 0; p->words[i] && strcmp(p->words[i], "vehicle") != 0; i++)
        if (params_is(params, "no_speed_bound", p->words[i]))
            return i + 1;
    return 0;
}

/* The bound of its speed, or why there is none. False: a bound that is not newer than the last. */
static bool take_bound(struct methods_env *d, const json_t *params, uint64_t t_ns)
{
    double mps[DRIFT_WAYS];
    const bool given = params_numbers(params, "speed_bound_mps", mps);
    d->poses.no_bound = given ? 0 : no_bound_word(params);
    pose_log_moves(&d->poses, t_ns);
    return !given || pose_log_bound(&d->poses, t_ns, mps);
}

/* It guides where heads look, and is no part of the pose. */
static bool take_push(struct methods_env *d, const json_t *params, uint64_t t_ns)
{
    double n[2];
    const bool given = params_numbers(params, "push_n", n);
    if (given)
        push_put(&d->push, t_ns, n);
    return given;
}

/* A pose of a client or of a capture; sender: constant text. */
static bool pose_take(struct methods_env *d, const char *sender, json_t *params, struct rpc_error *error)
{
    struct pose p = pose_identity;
    uint64_t given_ns;
    if (!params_take(protocol_methods[PROTOCOL_pose].params, params, error) ||
        !pose_time(d, params, &given_ns, error) || !pose_attitude(params, &p, error)) {
        d->poses.refused++;
        return false;
    }
    pose_place(params, &p);
    p.t_ns = pose_log_dated(&d->poses, date_by_capture(d, params, given_ns));
    const bool bound = params_has(params, "speed_bound_mps") || params_has(params, "no_speed_bound");
    const bool pushed = take_push(d, params, p.t_ns);
    if (!p.has && !bound && !pushed)
        return rpc_refuse(
            error, RPC_INVALID_PARAMS,
            "empty pose: expected attitude_deg, quaternion, position_m, depth_m, velocity_mps, altitude_m, "
            "speed_bound_mps or push_n");
    if (bound && !take_bound(d, params, p.t_ns) && !p.has)
        return rpc_refuse(error, RPC_INVALID_PARAMS, "t_unix is not after that of the last speed_bound_mps");
    if (!p.has)
        return true;
    struct velocity_doubt doubt = d->velocity_doubt;
    const bool doubted = velocity_doubt_take(&doubt, &p);
    if (!p.has) {
        d->velocity_doubt = doubt;
        d->poses.refused++;
        return rpc_refuse(
            error, RPC_INVALID_PARAMS,
            "velocity_mps is exactly 0 while the vehicle moves: leave it out while it is not measured");
    }
    if (!pose_log_put(&d->poses, &p))
        return rpc_refuse(error, RPC_INVALID_PARAMS, "t_unix is not after that of the last pose");
    d->velocity_doubt = doubt;
    tell_velocity(doubted);
    pose_log_sent_by(&d->poses, p.has, sender);
    tell_doubt(d, params);
    pose_taken(d, &p);
    return true;
}

static void withdraw(struct methods_env *d)
{
    pose_log_withdraw(&d->poses, loop_now(d->loop));
    d->velocity_doubt = (struct velocity_doubt){0};
    d->aux.pose_input.t_attitude_ns = 0;
}

bool pose_replay(struct methods_env *d, json_t *params, struct rpc_error *error)
{
    if (!json_is_true(json_object_get(params, "withdrawn")))
        return pose_take(d, "the capture", params, error);
    withdraw(d);
    return true;
}

static bool refuse_in_replay(const struct methods_env *d, struct rpc_error *error)
{
    return !d->replay ||
           rpc_refuse(error, RPC_INVALID_REQUEST, "this is a replay: its poses come from the capture");
}

/* As a replay is to know it. */
static void record_pose(struct methods_env *d, const json_t *params)
{
    char *text = d->record ? json_dumps(params, JSON_COMPACT | JSON_REAL_PRECISION(17)) : NULL;
    if (text)
        record_message(d->record, d->pose_channel, loop_now(d->loop), text, strlen(text));
    free(text);
}

bool method_pose(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    if (!refuse_in_replay(d, error))
        return false;
    if (undated(call, params)) {
        d->poses.refused++;
        json_out_put(out, "{\"taken\":false}");
        return true;
    }
    if (!pose_take(d, "a client", params, error))
        return false;
    if (json_object_get(params, "attitude_deg") || json_object_get(params, "quaternion"))
        d->aux.pose_input.t_attitude_ns = loop_now(d->loop);
    record_pose(d, params);
    json_out_put(out, "{\"taken\":true}");
    return true;
}

bool method_pose_withdraw(const struct rpc_call *call, json_t *params, struct json_out *out,
                          struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    const bool given = d->poses.t_first_ns || pose_log_last_ns(&d->poses, POSE_ALTITUDE);
    (void)params;
    if (!refuse_in_replay(d, error))
        return false;
    if (given) {
        json_t *message = json_pack("{s:b}", "withdrawn", 1);
        withdraw(d);
        record_pose(d, message);
        json_decref(message);
        log_line(LOG_NOTICE, "pose_withdrawn",
                 "pose: withdrawn by a client; directions are the vehicle's until the next attitude");
    }
    json_out_put(out, given ? "{\"withdrawn\":true}" : "{\"withdrawn\":false}");
    return true;
}
