/* SPDX-License-Identifier: MIT */
/* The methods about directions: what a client may ask of the picture; sonard-protocol(7) has every shape. */
#include "../grid/answer/nearest.h"
#include "grid_methods.h"
#include "methods.h"
#include "moment.h"
#include "say.h"

static const char *const frame_words[] = {"body", "ned", NULL};

json_t *direction_answer(const struct answer *a)
{
    bool blocked = a->state == ANSWER_BLOCKED;
    return json_pack("{s:s, s:o, s:o, s:o, s:o, s:o, s:o, s:s}", "state", answer_state_name(a->state), "range_m",
                     blocked ? say_metres(a->range_m) : json_null(), "range_sd_m",
                     blocked ? say_metres(a->range_sd_m) : json_null(), "confidence", say_real(a->confidence, 1e3),
                     "free_to_m", say_metres(a->free_to_m), "blind_to_m", say_metres(a->blind_to_m), "age_s",
                     say_age(a->age_s), "reason", answer_reason_text(a->reason));
}

/* Half the opening of a cone that the caller did not state: wider than what a level sonar's fan leaves uncertain,
 * narrow enough to lie within the 25 degrees of a Ping360 on a vehicle that pitches a little. */
#define DEFAULT_HALF_ANGLE_DEG 7.5

bool direction_query(json_t *params, struct answer_query *query, struct rpc_error *error)
{
    double az = 0, el = 0, distance = 0, half = DEFAULT_HALF_ANGLE_DEG, radius = 0;
    int frame = 0;
    if (!rpc_number(params, "azimuth_deg", true, -360, 720, &az, error) ||
        !rpc_number(params, "elevation_deg", false, -90, 90, &el, error) ||
        !rpc_number(params, "distance_m", true, 0, 1e4, &distance, error) ||
        !rpc_number(params, "half_angle_deg", false, 0, 180, &half, error) ||
        !rpc_number(params, "radius_m", false, 0, 1e3, &radius, error) ||
        !rpc_word(params, "frame", frame_words, &frame, error))
        return false;
    const bool corridor = json_object_get(params, "radius_m");
    if (corridor && json_object_get(params, "half_angle_deg"))
        return rpc_refuse(error, RPC_INVALID_PARAMS,
                          "half_angle_deg (a cone) and radius_m (a corridor) exclude each other: give one");
    *query = (struct answer_query){.az_rad = geo_rad(az),
                                   .el_rad = geo_rad(el),
                                   .ned = frame == 1,
                                   .distance_m = distance,
                                   .corridor = corridor,
                                   .half_angle_rad = geo_rad(half),
                                   .radius_m = radius};
    return true;
}

json_t *direction_method_blocked(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"azimuth_deg", "elevation_deg", "distance_m", "half_angle_deg",
                                       "radius_m",    "frame",         "grid",       NULL};
    struct daemon *d = call->daemon;
    struct answer_query q;
    struct grid *grid;
    struct answer a;
    if (!rpc_only(params, keys, error) || !direction_query(params, &q, error) ||
        !(grid = grid_asked(d, params, error)))
        return NULL;
    const struct answer_now now = moment_now(d);
    q.near_m = moment_near_m(d);
    answer_direction(grid_picture(grid), &grid->setting.limits, &now, &q, &a);
    return direction_answer(&a);
}

#define DEFAULT_BAND_DEG 5.0

static bool band_of(json_t *params, double band_deg[2], struct rpc_error *error)
{
    bool given;
    if (!rpc_numbers(params, "elevation_deg", -90, 90, 2, band_deg, &given, error))
        return false;
    return band_deg[0] < band_deg[1] ||
           rpc_refuse(error, RPC_INVALID_PARAMS, "elevation_deg is [%g, %g]: the first must be below the second",
                      band_deg[0], band_deg[1]);
}

static void write_sector(struct text *out, const struct answer *a, double azimuth_deg, double width_deg)
{
    text_open(out, '{');
    write_real(out, "azimuth_deg", azimuth_deg, SAY_DEGREES);
    write_real(out, "width_deg", width_deg, SAY_DEGREES);
    write_word(out, "state", answer_state_name(a->state));
    write_known(out, "range_m", a->state == ANSWER_BLOCKED, a->range_m, SAY_METRES);
    write_metres(out, "free_to_m", a->free_to_m);
    write_metres(out, "blind_to_m", a->blind_to_m);
    write_age(out, "age_s", a->age_s);
    text_close(out, '}');
}

bool direction_method_sectors(const struct rpc_call *call, json_t *params, struct text *out,
                              struct rpc_error *error)
{
    static const char *const keys[] = {"count", "frame", "elevation_deg", "distance_m", "grid", NULL};
    struct daemon *d = call->daemon;
    int64_t count = 72;
    int frame = 0;
    double band[2] = {-DEFAULT_BAND_DEG, DEFAULT_BAND_DEG}, distance = 0;
    if (!rpc_only(params, keys, error) ||
        !rpc_integer(params, "count", false, 1, ANSWER_SECTORS_MAX, &count, error) ||
        !rpc_word(params, "frame", frame_words, &frame, error) || !band_of(params, band, error) ||
        !rpc_number(params, "distance_m", false, 0, 1e4, &distance, error))
        return false;
    struct grid *grid = grid_asked(d, params, error);
    if (!grid)
        return false;
    struct answer sector[ANSWER_SECTORS_MAX];
    struct answer_now now = moment_now(d);
    answer_sectors(grid_picture(grid), &grid->setting.limits, &now, frame == 1, geo_rad(band[0]), geo_rad(band[1]),
                   distance, (size_t)count, sector);
    const double width_deg = 360.0 / (double)count;
    text_open(out, '{');
    write_word(out, "frame", frame_words[frame]);
    write_real(out, "t_unix", moment_unix_s(d), 1e6);
    write_age(out, "pose_age_s", moment_pose_age_s(d));
    write_metres(out, "near_m", moment_near_m(d));
    text_name(out, "sectors");
    text_open(out, '[');
    for (int64_t k = 0; k < count; k++)
        write_sector(out, &sector[k], (double)k * width_deg, width_deg);
    text_put(out, "]}");
    return true;
}

json_t *direction_method_nearest(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"frame", "elevation_deg", "distance_m", "grid", NULL};
    struct daemon *d = call->daemon;
    double band[2] = {-90, 90}, distance = 0;
    int frame = 0;
    if (!rpc_only(params, keys, error) || !rpc_word(params, "frame", frame_words, &frame, error) ||
        !band_of(params, band, error) || !rpc_number(params, "distance_m", false, 0, 1e4, &distance, error))
        return NULL;
    const struct nearest_query q = {
        .ned = frame == 1, .lo_rad = geo_rad(band[0]), .hi_rad = geo_rad(band[1]), .reach_m = distance};
    struct grid *grid = grid_asked(d, params, error);
    if (!grid)
        return NULL;
    const struct answer_now now = moment_now(d);
    struct nearest n;
    nearest_look(grid_picture(grid), &grid->setting.limits, &now, &q, &n);
    const bool blocked = n.state == ANSWER_BLOCKED;
    return json_pack("{s:s, s:s, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:s}", "frame", frame_words[frame], "state",
                     answer_state_name(n.state), "azimuth_deg", blocked ? say_degrees(n.az_rad) : json_null(),
                     "elevation_deg", blocked ? say_degrees(n.el_rad) : json_null(), "range_m",
                     blocked ? say_metres(n.range_m) : json_null(), "range_sd_m",
                     blocked ? say_metres(n.range_sd_m) : json_null(), "confidence",
                     blocked ? say_real(n.confidence, 1e3) : json_null(), "age_s", say_age(n.age_s),
                     "unknown_share", say_real(n.unknown_share, 1e4), "reason", answer_reason_text(n.reason));
}
