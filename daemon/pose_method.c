/* SPDX-License-Identifier: MIT */
/* The method by which a client tells where the vehicle is; sonard-protocol(7) has its shape. */
#include <stdlib.h>
#include <string.h>

#include "methods.h"
#include "moment.h"

#define POSE_PAST_S   10.0
#define POSE_FUTURE_S 1.0

static bool pose_time(const struct daemon *d, json_t *params, uint64_t *t_ns, struct rpc_error *error)
{
    double t_unix = moment_unix_s(d), given = t_unix;
    *t_ns = loop_now(d->loop);
    if (!rpc_number(params, "t_unix", false, 0, 1e11, &given, error))
        return false;
    if (!json_object_get(params, "t_unix"))
        return true;
    if (given < t_unix - POSE_PAST_S || given > t_unix + POSE_FUTURE_S) {
        error->code = RPC_INVALID_PARAMS;
        snprintf(error->message, sizeof error->message,
                 "t_unix is %.3f s off this computer's clock: wanted at most %g s in the past, %g s ahead",
                 given - t_unix, POSE_PAST_S, POSE_FUTURE_S);
        return false;
    }
    double ns = given * 1e9 - (double)moment_unix_offset_ns(d);
    *t_ns = ns > 0 ? (uint64_t)ns : 0;
    return true;
}

bool pose_attitude(json_t *params, struct pose *p, struct rpc_error *error)
{
    double rpy[3], q[4];
    bool has_rpy, has_q;
    if (!rpc_numbers(params, "attitude_deg", -360, 360, 3, rpy, &has_rpy, error) ||
        !rpc_numbers(params, "quaternion", -1.1, 1.1, 4, q, &has_q, error))
        return false;
    if (has_rpy && has_q) {
        error->code = RPC_INVALID_PARAMS;
        snprintf(error->message, sizeof error->message,
                 "attitude_deg and quaternion exclude each other: give one");
        return false;
    }
    if (has_q && !quat_normalise(q)) {
        error->code = RPC_INVALID_PARAMS;
        snprintf(error->message, sizeof error->message, "quaternion has not length 1 (w, x, y, z)");
        return false;
    }
    if (has_rpy)
        quat_from_rpy(geo_rad(rpy[0]), geo_rad(rpy[1]), geo_rad(rpy[2]), q);
    if (has_rpy || has_q) {
        memcpy(p->attitude, q, sizeof p->attitude);
        p->has |= POSE_ATTITUDE;
    }
    return true;
}

static bool pose_place(json_t *params, struct pose *p, struct rpc_error *error)
{
    bool placed, moving;
    double depth = 0;
    if (!rpc_numbers(params, "position_m", -1e8, 1e8, 3, p->position_m, &placed, error) ||
        !rpc_number(params, "depth_m", false, -100, 12000, &depth, error) ||
        !rpc_numbers(params, "velocity_mps", -100, 100, 3, p->velocity_mps, &moving, error))
        return false;
    if (placed)
        p->has |= POSE_POSITION | POSE_DEPTH;
    if (json_object_get(params, "depth_m")) {
        p->position_m[2] = depth;
        p->has |= POSE_DEPTH;
    }
    if (moving)
        p->has |= POSE_VELOCITY;
    return true;
}

bool daemon_take_pose(struct daemon *d, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"t_unix",     "position_m",   "depth_m", "attitude_deg",
                                       "quaternion", "velocity_mps", NULL};
    struct pose p = pose_identity;
    if (!rpc_only(params, keys, error) || !pose_time(d, params, &p.t_ns, error) ||
        !pose_attitude(params, &p, error) || !pose_place(params, &p, error)) {
        d->poses.refused++;
        return false;
    }
    if (!p.has) {
        error->code = RPC_INVALID_PARAMS;
        snprintf(error->message, sizeof error->message,
                 "nothing given: wanted attitude_deg, quaternion, position_m, depth_m or velocity_mps");
    } else if (!pose_log_put(&d->poses, &p)) {
        error->code = RPC_INVALID_PARAMS;
        snprintf(error->message, sizeof error->message, "t_unix is not after that of the pose before");
    } else if (json_object_get(params, "t_unix") && !d->replay) {
        /* what is recorded goes by the capture's clock, which does not step when the computer's is set */
        json_object_set_new(params, "t_unix", json_real((double)(p.t_ns + d->unix_offset_ns) * 1e-9));
    }
    if (error->code == 0)
        places_pose(d, &p);
    return error->code == 0;
}

json_t *pose_method(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    struct daemon *d = call->daemon;
    if (d->replay) {
        error->code = RPC_INVALID_REQUEST;
        snprintf(error->message, sizeof error->message, "this is a replay: its poses come from the capture");
        return NULL;
    }
    if (!daemon_take_pose(d, params, error))
        return NULL;
    if (json_object_get(params, "attitude_deg") || json_object_get(params, "quaternion"))
        d->pose_input.t_attitude_ns = loop_now(d->loop);
    if (d->record) {
        char *text = json_dumps(params, JSON_COMPACT | JSON_REAL_PRECISION(17));
        if (text)
            record_message(d->record, d->pose_channel, loop_now(d->loop), text, strlen(text));
        free(text);
    }
    return json_pack("{s:b}", "taken", 1);
}
