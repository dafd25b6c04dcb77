/* SPDX-License-Identifier: MIT */
/*
 * sonard_answers - libsonard's typed questions: what an autopilot asks, as structs instead of JSON. Knows methods, no
 * socket. An answer that lacks a state, or has one that is not known here, is no answer.
 */
#include "sonard_json.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- reading ---- */

static json_t *parse(const char *json)
{
    return json_loads(json, JSON_REJECT_DUPLICATES, NULL);
}

/* NaN where there is none. */
static double number(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);
    return json_is_number(value) ? json_number_value(value) : NAN;
}

static void copy_reason(char reason[SONARD_REASON_SIZE], const json_t *object)
{
    const char *text = json_string_value(json_object_get(object, "reason"));
    snprintf(reason, SONARD_REASON_SIZE, "%s", text ? text : "");
}

static void copy_target(struct sonard_target *target, const json_t *object)
{
    const char *text = json_string_value(json_object_get(object, "target"));
    snprintf(target->name, sizeof target->name, "%s", text ? text : "");
    target->bottom_db = number(object, "bottom_db");
}

static bool read_state(const json_t *object, const char *key, const char *clear, enum sonard_state *state)
{
    const char *text = json_string_value(json_object_get(object, key));
    *state = SONARD_UNKNOWN;
    if (text && strcmp(text, "blocked") == 0)
        *state = SONARD_BLOCKED;
    else if (text && strcmp(text, clear) == 0)
        *state = SONARD_CLEAR;
    return text && (*state != SONARD_UNKNOWN || strcmp(text, "unknown") == 0);
}

static bool read_frame(const json_t *object, enum sonard_frame *frame)
{
    const char *text = json_string_value(json_object_get(object, "frame"));
    *frame = text && strcmp(text, "ned") == 0 ? SONARD_NED : SONARD_BODY;
    return text && (*frame == SONARD_NED || strcmp(text, "body") == 0);
}

static bool read_blocked(const json_t *result, struct sonard_blocked *out)
{
    struct sonard_blocked read = {.range_m = number(result, "range_m"),
                                  .range_sd_m = number(result, "range_sd_m"),
                                  .confidence = number(result, "confidence"),
                                  .free_to_m = number(result, "free_to_m"),
                                  .blind_to_m = number(result, "blind_to_m"),
                                  .age_s = number(result, "age_s")};
    const bool good = read_state(result, "state", "clear", &read.state);
    copy_reason(read.reason, result);
    copy_target(&read.target, result);
    *out = good ? read : (struct sonard_blocked){0};
    return good;
}

bool sonard_read_blocked(const char *json, struct sonard_blocked *out)
{
    json_t *result = parse(json);
    const bool good = read_blocked(result, out);
    json_decref(result);
    return good;
}

static bool read_sector(const json_t *object, struct sonard_sector *sector)
{
    *sector = (struct sonard_sector){.azimuth_deg = number(object, "azimuth_deg"),
                                     .width_deg = number(object, "width_deg"),
                                     .range_m = number(object, "range_m"),
                                     .free_to_m = number(object, "free_to_m"),
                                     .blind_to_m = number(object, "blind_to_m"),
                                     .age_s = number(object, "age_s")};
    return read_state(object, "state", "clear", &sector->state) && !isnan(sector->azimuth_deg);
}

static bool read_sectors(const json_t *result, struct sonard_sectors *out)
{
    const json_t *list = json_object_get(result, "sectors");
    const size_t n = json_array_size(list);
    bool good = n > 0 && n <= SONARD_SECTORS_MAX && read_frame(result, &out->frame);
    out->t_unix = number(result, "t_unix");
    out->pose_age_s = number(result, "pose_age_s");
    out->near_m = number(result, "near_m");
    copy_target(&out->target, result);
    for (size_t i = 0; good && i < n; i++)
        good = read_sector(json_array_get(list, i), &out->sector[i]);
    if (!good)
        *out = (struct sonard_sectors){0};
    else
        out->count = (int)n;
    return good;
}

bool sonard_read_sectors(const char *json, struct sonard_sectors *out)
{
    json_t *result = parse(json);
    const bool good = read_sectors(result, out);
    json_decref(result);
    return good;
}

static bool read_limit(const json_t *result, struct sonard_limit *out)
{
    const json_t *velocity = json_object_get(result, "velocity_mps");
    struct sonard_limit read = {.speed_mps = number(result, "speed_mps"),
                                .stop_m = number(result, "stop_m"),
                                .blocked_m = number(result, "blocked_m"),
                                .free_m = number(result, "free_m"),
                                .age_s = number(result, "age_s")};
    bool good = read_state(result, "limited_by", "nothing", &read.limited_by) && json_array_size(velocity) == 3 &&
                !isnan(read.speed_mps);
    for (size_t i = 0; good && i < 3; i++) {
        const json_t *part = json_array_get(velocity, i);
        good = json_is_number(part);
        read.velocity_mps[i] = json_number_value(part);
    }
    copy_reason(read.reason, result);
    copy_target(&read.target, result);
    *out = good ? read : (struct sonard_limit){0};
    return good;
}

bool sonard_read_limit(const char *json, struct sonard_limit *out)
{
    json_t *result = parse(json);
    const bool good = read_limit(result, out);
    json_decref(result);
    return good;
}

static bool read_collision(const json_t *result, struct sonard_collision *out)
{
    struct sonard_collision read = {.time_s = number(result, "time_s"),
                                    .time_sd_s = number(result, "time_sd_s"),
                                    .distance_m = number(result, "distance_m"),
                                    .confidence = number(result, "confidence"),
                                    .unknown_after_s = number(result, "unknown_after_s"),
                                    .age_s = number(result, "age_s")};
    const bool good = read_state(result, "state", "clear", &read.state);
    copy_reason(read.reason, result);
    copy_target(&read.target, result);
    *out = good ? read : (struct sonard_collision){0};
    return good;
}

bool sonard_read_collision(const char *json, struct sonard_collision *out)
{
    json_t *result = parse(json);
    const bool good = read_collision(result, out);
    json_decref(result);
    return good;
}

/* ---- asking ---- */

static bool fail(struct sonard_error *error, enum sonard_status status, const char *method, const char *what)
{
    *error = (struct sonard_error){.status = status};
    snprintf(error->message, sizeof error->message, "%s: %s", method, what);
    return false;
}

/* The parameters are used up; the result is a new reference. NULL with *error set: also when a number is none. */
static json_t *call_method(struct sonard_client *client, const char *method, json_t *params,
                           struct sonard_error *error)
{
    json_t *result = NULL;
    if (params)
        result = sonard_json_call(client, method, params, error);
    else
        fail(error, SONARD_INVALID, method, "every number must be finite");
    json_decref(params);
    return result;
}

static bool not_understood(const char *method, struct sonard_error *error)
{
    return fail(error, SONARD_LOST, method, "the answer is not one that this library knows");
}

static const char *name_of(enum sonard_frame frame)
{
    return frame == SONARD_NED ? "ned" : "body";
}

static json_t *triple(const double v[3])
{
    return json_pack("[f, f, f]", v[0], v[1], v[2]);
}

bool sonard_blocked(struct sonard_client *client, enum sonard_frame frame, const struct sonard_cone *cone,
                    struct sonard_blocked *out, struct sonard_error *error)
{
    json_t *params = json_pack("{s:s, s:f, s:f, s:f, s:f}", "frame", name_of(frame), "azimuth_deg",
                               cone->azimuth_deg, "elevation_deg", cone->elevation_deg, "half_angle_deg",
                               cone->half_angle_deg, "distance_m", cone->distance_m);
    json_t *result = call_method(client, "blocked", params, error);
    *out = (struct sonard_blocked){0};

    const bool good = result && (read_blocked(result, out) || not_understood("blocked", error));

    json_decref(result);
    return good;
}

bool sonard_sectors(struct sonard_client *client, enum sonard_frame frame, int count, double distance_m,
                    struct sonard_sectors *out, struct sonard_error *error)
{
    json_t *params = distance_m != 0 ? json_pack("{s:s, s:i, s:f}", "frame", name_of(frame), "count", count,
                                                 "distance_m", distance_m)
                                     : json_pack("{s:s, s:i}", "frame", name_of(frame), "count", count);
    json_t *result = call_method(client, "sectors", params, error);
    *out = (struct sonard_sectors){0};

    const bool good = result && (read_sectors(result, out) || not_understood("sectors", error));

    json_decref(result);
    return good;
}

bool sonard_limit(struct sonard_client *client, enum sonard_frame frame, const double velocity_mps[3],
                  struct sonard_limit *out, struct sonard_error *error)
{
    json_t *params = json_pack("{s:s, s:o}", "frame", name_of(frame), "velocity_mps", triple(velocity_mps));
    json_t *result = call_method(client, "limit", params, error);
    *out = (struct sonard_limit){0};

    const bool good = result && (read_limit(result, out) || not_understood("limit", error));

    json_decref(result);
    return good;
}

bool sonard_time_to_collision(struct sonard_client *client, enum sonard_frame frame, const double *velocity_mps,
                              double ahead_s, struct sonard_collision *out, struct sonard_error *error)
{
    json_t *params = velocity_mps ? json_pack("{s:f, s:s, s:o}", "ahead_s", ahead_s, "frame", name_of(frame),
                                              "velocity_mps", triple(velocity_mps))
                                  : json_pack("{s:f}", "ahead_s", ahead_s);
    json_t *result = call_method(client, "time_to_collision", params, error);
    *out = (struct sonard_collision){0};

    const bool good = result && (read_collision(result, out) || not_understood("time_to_collision", error));

    json_decref(result);
    return good;
}

static json_t *pose_params(const struct sonard_pose *pose)
{
    const double *q = pose->quaternion;
    json_t *params = json_object();
    int wrong = 0;
    if (pose->has & SONARD_POSE_QUATERNION)
        wrong |= json_object_set_new(params, "quaternion", json_pack("[f, f, f, f]", q[0], q[1], q[2], q[3]));
    if (pose->has & SONARD_POSE_POSITION)
        wrong |= json_object_set_new(params, "position_m", triple(pose->position_m));
    if (pose->has & SONARD_POSE_DEPTH)
        wrong |= json_object_set_new(params, "depth_m", json_real(pose->depth_m));
    if (pose->has & SONARD_POSE_VELOCITY)
        wrong |= json_object_set_new(params, "velocity_mps", triple(pose->velocity_mps));
    if (pose->has & SONARD_POSE_SPEED_BOUND)
        wrong |= json_object_set_new(params, "speed_bound_mps",
                                     json_pack("[f, f]", pose->speed_bound_mps[0], pose->speed_bound_mps[1]));
    if (pose->has & SONARD_POSE_PUSH)
        wrong |= json_object_set_new(params, "push_n", json_pack("[f, f]", pose->push_n[0], pose->push_n[1]));
    if (pose->has & SONARD_POSE_TIME)
        wrong |= json_object_set_new(params, "t_unix", json_real(pose->t_unix));
    if (pose->has & SONARD_POSE_ALTITUDE)
        wrong |= json_object_set_new(params, "altitude_m", json_real(pose->altitude_m));
    if (wrong) {
        json_decref(params);
        return NULL;
    }
    return params;
}

bool sonard_pose(struct sonard_client *client, const struct sonard_pose *pose, struct sonard_error *error)
{
    json_t *result = call_method(client, "pose", pose_params(pose), error);
    const bool taken = result != NULL;
    json_decref(result);
    return taken;
}

int64_t sonard_send_pose(struct sonard_client *client, const struct sonard_pose *pose, struct sonard_error *error)
{
    json_t *params = pose_params(pose);
    const int64_t id = params ? sonard_json_send(client, "pose", params, error) : 0;
    if (!params)
        fail(error, SONARD_INVALID, "pose", "every number must be finite");
    json_decref(params);
    return id;
}
