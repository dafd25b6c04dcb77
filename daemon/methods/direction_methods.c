/* SPDX-License-Identifier: MIT */
/* The methods about directions: what a client may ask of the picture; sonard-protocol(7) has every shape. */
#include "drift_words.h"
#include "grid_methods.h"
#include "hidden.h"
#include "methods.h"
#include "query_context.h"
#include "reason.h"
#include "reference.h"
#include "verdict_job.h"
#include "json_units.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

_Static_assert(PROTOCOL_SECTORS_MAX <= ANSWER_SECTORS_MAX, "more sectors may be asked for than there are");

void direction_answer(const struct methods_env *d, struct json_out *out, const struct answer_now *now,
                      const struct answer_conf *limits, const struct answer_query *query, const struct answer *a)
{
    char text[REASON_SIZE], hidden[HIDDEN_SIZE];
    const struct reason why = {.state = a->state,
                               .why = a->reason,
                               .range_m = a->range_m,
                               .near_m = a->near_m,
                               .free_to_m = a->free_to_m,
                               .asked_m = query->distance_m,
                               .blind_to_m = a->blind_to_m,
                               .age_s = a->age_s,
                               .clear_for_s = limits->clear_for_s,
                               .hidden = hidden_cause(d, now, query, a, hidden)};
    const bool blocked = a->state == ANSWER_BLOCKED;
    json_out_open(out, '{');
    json_member_word(out, "state", answer_state_name(a->state));
    json_member_known(out, "range_m", blocked, a->range_m, PER_METRES);
    json_member_known(out, "range_sd_m", blocked, a->range_sd_m, PER_METRES);
    json_member_real(out, "confidence", a->confidence, 1e3);
    json_member_metres(out, "free_to_m", a->free_to_m);
    json_member_metres(out, "blind_to_m", a->blind_to_m);
    json_member_age(out, "age_s", a->age_s);
    json_member_text(out, "reason", reason_sentence(d, now, &why, text));
    reference_write_target(out, d);
    json_out_close(out, '}');
}

void direction_query(const json_t *params, struct answer_query *query)
{
    *query = (struct answer_query){.az_rad = geo_rad(params_number(params, "azimuth_deg")),
                                   .el_rad = geo_rad(params_number(params, "elevation_deg")),
                                   .ned = params_is(params, "frame", "ned"),
                                   .distance_m = params_number(params, "distance_m"),
                                   .corridor = params_has(params, "radius_m"),
                                   .half_angle_rad = geo_rad(params_number(params, "half_angle_deg")),
                                   .radius_m = params_number(params, "radius_m")};
}

static void drop_job(void *state)
{
    verdict_job_end(state);
    free(state);
}

/* Kept with the request; NULL: there is no such grid, or no memory. To begin it takes a look at the whole picture: what
 * the records say is another part of the answer. */
static struct verdict_job *new_job(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    struct grid *grid = grid_asked(d, params, error);
    struct verdict_job *job = grid ? calloc(1, sizeof *job) : NULL;
    if (grid && !job)
        rpc_refuse(error, RPC_INTERNAL_ERROR, "no memory for the question");
    if (!job)
        return NULL;
    job->d = d;
    job->grid = grid;
    rpc_work_keep(call->work, job, drop_job);
    return job;
}

static bool write_blocked(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    struct verdict_job *job = call->work->state;
    (void)error;
    if (verdict_job_step(job))
        return rpc_continue(call, write_blocked);
    direction_answer(job->d, out, &job->now, &job->limits, &job->query.line, verdict_of(&job->verdict, 0));
    return true;
}

bool method_blocked(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    (void)out;
    struct verdict_job *job = new_job(call, params, error);
    if (!job)
        return false;
    direction_query(params, &job->query.line);
    verdict_job_begin(job);
    return rpc_continue(call, write_blocked);
}

static void write_sector(struct json_out *out, const struct answer *a, double azimuth_deg, double width_deg)
{
    json_out_open(out, '{');
    json_member_real(out, "azimuth_deg", azimuth_deg, PER_DEGREES);
    json_member_real(out, "width_deg", width_deg, PER_DEGREES);
    json_member_word(out, "state", answer_state_name(a->state));
    json_member_known(out, "range_m", a->range_m > 0 || a->state == ANSWER_BLOCKED, a->range_m, PER_METRES);
    json_member_metres(out, "free_to_m", a->free_to_m);
    json_member_metres(out, "blind_to_m", a->blind_to_m);
    json_member_age(out, "age_s", a->age_s);
    json_out_close(out, '}');
}

/* Water that a sonar hears as far as it can, or as the grid keeps obstacles, is known to the vehicle's middle from
 * where the sonar sits, and to the next of the ranges at which water is divided. */
static double heard_m(const struct methods_env *d, struct grid *grid)
{
    struct picture_frame frame;
    double lever_m = 0;
    picture_get_frame(grid_picture(grid), &frame);
    for (int i = 0; i < d->conf.n_sonars; i++)
        lever_m = fmax(lever_m, geo_length(d->mount[i].position_m));
    const double sensor_m = fmin(frame.range_max_m, frame.reach_m - lever_m); /* from the sonar */
    return frame.pings ? fmax(sensor_m - lever_m - 4 * WATER_GRID_M, WATER_GRID_M) : INFINITY;
}

/* How far the sectors are judged: as asked, as far as the sonars hear, or as far as it matters. */
static double sectors_reach_m(const struct methods_env *d, struct grid *grid, const json_t *params)
{
    const double most_m = heard_m(d, grid), look_m = query_look_ahead_m(d);
    if (!params_has(params, "distance_m"))
        return fmin(look_m, most_m);
    const double asked_m = params_number(params, "distance_m");
    return asked_m > 0 ? asked_m : isfinite(most_m) ? most_m : look_m;
}

/* Why not one of them is clear; null: one is, or all are as they are for reasons of their own. */
static void write_why_not_clear(struct json_out *out, const struct verdict_job *job)
{
    const struct answer_band *band = &job->query.band;
    char text[QUERY_REASON_SIZE] = "";
    struct picture_frame frame;
    size_t clear = 0;
    for (size_t k = 0; k < band->count; k++)
        clear += verdict_of(&job->verdict, k)->state == ANSWER_CLEAR;
    picture_get_frame(grid_picture(job->grid), &frame);
    if (clear == 0 && drift_why_not_clear(job->d, &frame, band->ned, text)[0])
        json_member_text(out, "why_none_clear", text);
    else
        json_member_null(out, "why_none_clear");
}

#define SECTORS_PER_PART 180

/* What takes long to write are many of them. */
static bool write_sectors(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    struct verdict_job *job = call->work->state;
    const size_t count = job->query.band.count;
    const double width_deg = 360.0 / (double)count;
    (void)error;
    for (int i = 0; i < SECTORS_PER_PART && job->written < count; i++, job->written++)
        write_sector(out, verdict_of(&job->verdict, job->written), (double)job->written * width_deg, width_deg);
    if (job->written < count)
        return rpc_continue(call, write_sectors);
    json_out_put(out, "]}");
    return true;
}

/* As of the question. */
static bool judge_sectors(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    struct verdict_job *job = call->work->state;
    const struct methods_env *d = job->d;
    const struct answer_band *band = &job->query.band;
    if (verdict_job_step(job))
        return rpc_continue(call, judge_sectors);
    json_out_open(out, '{');
    json_member_word(out, "frame", band->ned ? "ned" : "body");
    json_member_real(out, "t_unix", (double)(job->now.now_ns + query_unix_offset_ns(d)) * 1e-9, 1e6);
    json_member_age(out, "pose_age_s", query_pose_age_s(d));
    json_member_metres(out, "near_m", band->near_m);
    json_member_metres(out, "distance_m", band->reach_m);
    reference_write_target(out, d);
    write_why_not_clear(out, job);
    json_out_name(out, "sectors");
    json_out_open(out, '[');
    return band->count <= SECTORS_PER_PART ? write_sectors(call, out, error) : rpc_continue(call, write_sectors);
}

bool method_sectors(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    double band[2];
    (void)out;
    struct verdict_job *job = new_job(call, params, error);
    if (!job)
        return false;
    params_numbers(params, "elevation_deg", band);
    job->query = (struct obstacles_query){.around = true,
                                          .band = {.ned = params_is(params, "frame", "ned"),
                                                   .lo_rad = geo_rad(band[0]),
                                                   .hi_rad = geo_rad(band[1]),
                                                   .reach_m = sectors_reach_m(job->d, job->grid, params),
                                                   .count = (size_t)params_integer(params, "count")}};
    verdict_job_begin(job);
    return rpc_continue(call, judge_sectors);
}

/* Of an obstacle, or of what is not known. Before an obstacle that is the gravest cause, whose age is not in *n. */
static const char *nearest_reason(const struct methods_env *d, const struct answer_now *now,
                                  const struct answer_conf *limits, const struct nearest *n,
                                  char text[REASON_SIZE])
{
    char cause[REASON_SIZE], why[2 * REASON_SIZE];
    const struct reason plain = {.state = n->state,
                                 .why = n->reason,
                                 .range_m = n->range_m,
                                 .age_s = n->age_s,
                                 .clear_for_s = limits->clear_for_s};
    if (n->state != ANSWER_BLOCKED || n->reason == ANSWER_HEARD)
        return reason_sentence(d, now, &plain, text);
    snprintf(why, sizeof why, "echo at %.2f m; some of the water before it: %s", n->range_m,
             reason_cause(d, now, n->reason, cause));
    return reason_with_pose(now, why, n->age_s, text);
}

static bool write_nearest(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    struct verdict_job *job = call->work->state;
    const struct nearest *n = &job->look.answer;
    char text[REASON_SIZE];
    (void)error;
    if (verdict_job_step(job))
        return rpc_continue(call, write_nearest);
    const bool blocked = n->state == ANSWER_BLOCKED;
    json_out_open(out, '{');
    json_member_word(out, "frame", job->nearest.ned ? "ned" : "body");
    json_member_word(out, "state", answer_state_name(n->state));
    json_member_known(out, "azimuth_deg", blocked, geo_deg(n->az_rad), PER_DEGREES);
    json_member_known(out, "elevation_deg", blocked, geo_deg(n->el_rad), PER_DEGREES);
    json_member_known(out, "range_m", blocked, n->range_m, PER_METRES);
    json_member_known(out, "range_sd_m", blocked, n->range_sd_m, PER_METRES);
    json_member_known(out, "confidence", blocked, n->confidence, 1e3);
    json_member_age(out, "age_s", n->age_s);
    json_member_real(out, "unknown_share", n->unknown_share, 1e4);
    json_member_text(out, "reason", nearest_reason(job->d, &job->now, &job->limits, n, text));
    reference_write_target(out, job->d);
    json_out_close(out, '}');
    return true;
}

bool method_nearest(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    double band[2], around[2] = {0};
    (void)out;
    struct verdict_job *job = new_job(call, params, error);
    if (!job)
        return false;
    params_numbers(params, "elevation_deg", band);
    params_numbers(params, "azimuth_deg", around);
    const double heard = heard_m(job->d, job->grid);
    job->is_nearest = true;
    job->nearest = (struct nearest_query){.ned = params_is(params, "frame", "ned"),
                                          .lo_rad = geo_rad(band[0]),
                                          .hi_rad = geo_rad(band[1]),
                                          .from_rad = geo_rad(around[0]),
                                          .width_rad = geo_wrap(geo_rad(around[1] - around[0])),
                                          .reach_m = params_number(params, "distance_m"),
                                          .heard_m = isfinite(heard) ? heard : query_look_ahead_m(job->d)};
    verdict_job_begin(job);
    return rpc_continue(call, write_nearest);
}
