/* SPDX-License-Identifier: MIT */
/* The methods about moving: when the vehicle meets something, and how fast it may go; sonard-protocol(7) has every
 * shape. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "grid/answer/limit.h"
#include "grid_methods.h"
#include "methods.h"
#include "query_context.h"
#include "reason.h"
#include "reference.h"
#include "verdict_job.h"
#include "json_units.h"

#include <stdlib.h>

#define AT_REST_MPS 1e-3 /* slower is no direction */

/* A movement that is asked about, and what is known of how old the picture is for it. */
struct movement {
    struct verdict_job job;
    double velocity_mps[3], speed_mps;
    double ahead_s; /* of time_to_collision */
    bool ned;
    struct corridor_body body;
    struct corridor corridor;
    bool follows;     /* the picture follows the vehicle, up to the newest position; or it allows for its drift */
    bool drifts;      /* the latter */
    bool told;        /* the pose has a velocity: */
    double across[3]; /* what of it goes across the line, in the axes of the question */
    double stale_s;   /* the vehicle may have moved for so long without the picture's and the pose's knowledge */
};

static void take_body(const struct methods_env *d, struct corridor_body *body)
{
    const struct conf_vehicle *c = &d->conf.vehicle;
    *body =
        (struct corridor_body){.radius_m = c->radius_m, .half_height_m = c->height_m / 2, .margin_m = c->margin_m};
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* What the vehicle does now, against what it is asked to do. */
static void take_own_velocity(const struct methods_env *d, struct movement *m)
{
    const struct pose *pose = &m->job.now.pose;
    const unsigned needed = POSE_VELOCITY | (m->ned ? 0 : POSE_ATTITUDE);
    m->told = m->job.now.pose_fresh && (pose->has & needed) == needed &&
              query_velocity_age_s(d) <= (double)pose_log_max_age_ns(&d->poses, POSE_VELOCITY) * 1e-9;
    if (!m->told || m->speed_mps < AT_REST_MPS)
        return;
    memcpy(m->across, pose->velocity_mps, sizeof m->across);
    if (!m->ned)
        quat_rotate_inverse(pose->attitude, m->across, m->across);
    const double along_mps = dot(m->across, m->velocity_mps) / m->speed_mps;
    for (int i = 0; i < 3; i++)
        m->across[i] -= along_mps * m->velocity_mps[i] / m->speed_mps;
}

static void take_velocity(const struct methods_env *d, struct movement *m, const double velocity_mps[3], bool ned)
{
    struct picture_frame frame;
    memcpy(m->velocity_mps, velocity_mps, sizeof m->velocity_mps);
    m->speed_mps = sqrt(dot(velocity_mps, velocity_mps));
    m->ned = ned;
    picture_get_frame(grid_picture(m->job.grid), &frame);
    m->drifts = m->job.now.pose.drift_mps > 0;
    m->follows = m->drifts || (frame.ned && m->job.now.pose_fresh && (m->job.now.pose.has & POSE_POSITION));
    take_own_velocity(d, m);
}

/* How long the vehicle may have moved without the picture's knowledge, before anything was looked at. */
static double longest_stale_s(const struct methods_env *d, const struct movement *m)
{
    if (!m->follows)
        return m->job.limits.clear_for_s;
    return m->told || m->drifts ? 0 : query_place_age_s(d);
}

/*
 * With a position the picture follows the vehicle, and with a velocity the pose uncertainty holds how far it may
 * have gone on since. Without one, for a vehicle that may drift, all of it is less by the drift. For one that keeps
 * its place until it is told to go, the picture is as old as its pings, or as its place, and the vehicle is taken
 * to have gone no faster than it now may.
 */
static void judge_age(const struct methods_env *d, struct movement *m)
{
    const double oldest_s = fmax(0, fmax(m->corridor.age_s, m->corridor.blocked_age_s));
    m->stale_s = m->follows ? longest_stale_s(d, m) : oldest_s;
}

/* drift_m: what the vehicle's own velocity across the line carries it off by. */
static void look_ahead(struct movement *m, double most_m, double drift_m)
{
    const double across_mps = sqrt(dot(m->across, m->across));
    m->job.query =
        (struct obstacles_query){.moves = true, .move = {.body = m->body, .ned = m->ned, .most_m = most_m}};
    struct corridor_query *q = &m->job.query.move;
    memcpy(q->direction, m->velocity_mps, sizeof q->direction);
    for (int i = 0; i < 3 && across_mps >= AT_REST_MPS; i++)
        q->drift_m[i] = m->across[i] / across_mps * drift_m;
    verdict_job_begin(&m->job);
}

/* False: there is more to be looked at. */
static bool has_looked(struct movement *m)
{
    if (m->speed_mps < AT_REST_MPS)
        return true;
    if (verdict_job_step(&m->job))
        return false;
    m->corridor = *verdict_corridor(&m->job.verdict);
    judge_age(m->job.d, m);
    return true;
}

static void drop_movement(void *state)
{
    struct movement *m = state;
    verdict_job_end(&m->job);
    free(m);
}

/* Kept with the request; NULL: there is no such grid, or no memory. */
static struct movement *begin_movement(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    struct grid *grid = grid_asked(d, params, error);
    struct movement *m = grid ? calloc(1, sizeof *m) : NULL;
    if (grid && !m)
        rpc_refuse(error, RPC_INTERNAL_ERROR, "no memory for the question");
    if (!m)
        return NULL;
    m->job = (struct verdict_job){.d = d, .grid = grid, .now = query_now(d), .limits = grid_limits(grid)};
    m->corridor = (struct corridor){.blocked_m = INFINITY, .blocked_age_s = -1, .age_s = -1};
    take_body(d, &m->body);
    rpc_work_keep(call->work, m, drop_movement);
    return m;
}

/* ---- limit ---- */

static void limit_conf(const struct conf_vehicle *c, struct limit_conf *out)
{
    static const enum limit_unknown words[] = {
        [CONF_UNKNOWN_SLOW] = LIMIT_SLOW, [CONF_UNKNOWN_STOP] = LIMIT_STOP, [CONF_UNKNOWN_IGNORE] = LIMIT_IGNORE};
    *out = (struct limit_conf){.braking_mps2 = c->braking_mps2,
                               .latency_s = c->latency_s,
                               .unknown = words[c->unknown],
                               .slow_mps = c->slow_mps};
}

/* Where along the line, and in which direction, is what limits. False: nowhere. */
static bool limit_place(const struct movement *m, const struct limit *l, double *at_m, double *az_rad,
                        double *el_rad)
{
    const struct corridor *c = &m->corridor;
    const double *v = l->by == LIMIT_BY_BLOCKED ? c->blocked_at : c->known_at;
    *at_m = (l->by == LIMIT_BY_BLOCKED ? c->blocked_m : c->known_m) - c->front_m;
    if (l->by == LIMIT_BY_NOTHING || !(dot(v, v) > 0))
        return false;
    geo_angles(v, az_rad, el_rad);
    return true;
}

static const char *limit_reason(const struct methods_env *d, const struct movement *m, const struct limit *l,
                                char text[REASON_SIZE])
{
    const struct corridor *c = &m->corridor;
    double at_m, az_rad, el_rad;
    char place[REASON_SIZE / 4] = "", cause[REASON_SIZE], why[2 * REASON_SIZE];
    const bool placed = limit_place(m, l, &at_m, &az_rad, &el_rad);
    if (placed)
        snprintf(place, sizeof place, ", azimuth %.0f deg, elevation %.0f deg", geo_deg(az_rad), geo_deg(el_rad));
    if (l->by == LIMIT_BY_BLOCKED)
        snprintf(why, sizeof why, "obstacle at %.2f m%s", fmax(0, at_m), place);
    else if (l->by == LIMIT_BY_UNKNOWN)
        snprintf(why, sizeof why, "unknown beyond %.2f m%s: %s", fmax(0, at_m), place,
                 reason_cause(d, &m->job.now, c->reason, cause));
    else if (!l->unknown)
        snprintf(why, sizeof why, "free over the stopping distance of %.2f m", l->stop_m);
    else
        snprintf(why, sizeof why, "%s: %s",
                 d->conf.vehicle.unknown == CONF_UNKNOWN_IGNORE ? "unknown water is ignored"
                                                                : "slow enough for unknown water",
                 reason_cause(d, &m->job.now, c->reason, cause));
    return reason_with_pose(&m->job.now, why, l->by == LIMIT_BY_BLOCKED ? c->blocked_age_s : c->age_s, text);
}

static enum limit_pose pose_of(const struct movement *m)
{
    return m->drifts ? LIMIT_POSE_ADRIFT : m->follows ? LIMIT_POSE_PLACED : LIMIT_POSE_NONE;
}

static void write_limit(const struct methods_env *d, struct json_out *out, const struct movement *m,
                        const struct limit *l, const char *reason)
{
    double at_m, az_rad = 0, el_rad = 0;
    const bool placed = limit_place(m, l, &at_m, &az_rad, &el_rad);
    const struct corridor *c = &m->corridor;
    const double factor = m->speed_mps < AT_REST_MPS ? 0 : l->speed_mps / m->speed_mps;
    json_out_open(out, '{');
    json_member_open(out, "velocity_mps", '[');
    /* downwards: what is reported must not be more than what was found, nor than what was asked for */
    for (int i = 0; i < 3; i++)
        json_out_real(out, trunc(m->velocity_mps[i] * factor * 1e6) / 1e6);
    json_out_close(out, ']');
    json_member_real(out, "speed_mps", l->speed_mps, 1e6);
    json_member_real(out, "asked_mps", m->speed_mps, 1e6);
    json_member_word(out, "limited_by", limit_word(l->by));
    json_member_known(out, "azimuth_deg", placed, geo_deg(az_rad), PER_DEGREES);
    json_member_known(out, "elevation_deg", placed, geo_deg(el_rad), PER_DEGREES);
    json_member_metres(out, "stop_m", l->stop_m);
    json_member_metres(out, "uncertain_m", l->stale_m + c->uncertain_m);
    json_member_known(out, "blocked_m", isfinite(c->blocked_m - c->front_m), c->blocked_m - c->front_m,
                      PER_METRES);
    json_member_metres(out, "free_m", fmax(0, fmin(c->known_m, c->blocked_m) - c->front_m));
    json_member_age(out, "age_s", c->age_s);
    json_member_text(out, "reason", reason);
    json_member_text(out, "remedy", limit_remedy(l->by, c->reason, pose_of(m)));
    reference_write_target(out, d);
    json_out_close(out, '}');
}

static bool judge_limit(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    struct movement *m = call->work->state;
    struct limit_conf conf;
    struct limit l = {.by = LIMIT_BY_NOTHING};
    char text[REASON_SIZE];
    (void)error;
    if (!has_looked(m))
        return rpc_continue(call, judge_limit);
    limit_conf(&m->job.d->conf.vehicle, &conf);
    if (m->speed_mps < AT_REST_MPS) {
        write_limit(m->job.d, out, m, &l, "no speed was asked for");
        return true;
    }
    limit_of(&conf, &m->corridor, m->speed_mps, m->stale_s, &l);
    write_limit(m->job.d, out, m, &l, limit_reason(m->job.d, m, &l, text));
    return true;
}

bool method_limit(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    struct limit_conf conf;
    double velocity[3];
    struct movement *m = begin_movement(call, params, error);
    if (!m)
        return false;
    params_numbers(params, "velocity_mps", velocity);
    take_velocity(d, m, velocity, params_is(params, "frame", "ned"));
    limit_conf(&d->conf.vehicle, &conf);
    /* as far as it would be for the oldest picture that may count: farther than needed changes nothing */
    const double most_m = limit_reach_m(&conf, m->body.radius_m + m->body.half_height_m + m->body.margin_m,
                                        m->speed_mps, m->job.limits.clear_for_s);
    if (m->speed_mps >= AT_REST_MPS)
        look_ahead(m, most_m, limit_drift_m(&conf, sqrt(dot(m->across, m->across)), longest_stale_s(d, m)));
    return judge_limit(call, out, error);
}

/* ---- time to collision ---- */

/* The velocity asked about, or that of the pose. */
static bool velocity_of(const struct methods_env *d, json_t *params, struct movement *m, struct rpc_error *error)
{
    double velocity[3];
    const bool given = params_numbers(params, "velocity_mps", velocity);
    if (!given && (!m->job.now.pose_fresh || !(m->job.now.pose.has & POSE_VELOCITY)))
        return rpc_refuse(error, RPC_INVALID_REQUEST,
                          "no fresh pose with attitude and velocity: give velocity_mps");
    if (!given && params_has(params, "frame"))
        return rpc_refuse(error, RPC_INVALID_PARAMS, "frame needs velocity_mps");
    take_velocity(d, m, given ? velocity : m->job.now.pose.velocity_mps,
                  given ? params_is(params, "frame", "ned") : true);
    return true;
}

/* Seconds until the body gets there; the vehicle may be there earlier by what it moved since the picture. */
static double seconds_to(const struct movement *m, double at_m)
{
    return fmax(0, (at_m - m->corridor.front_m) / m->speed_mps - m->stale_s);
}

static void write_collision(const struct methods_env *d, struct json_out *out, const struct movement *m,
                            double ahead_s)
{
    char cause[REASON_SIZE], text[REASON_SIZE];
    const struct corridor *c = &m->corridor;
    const bool moves = m->speed_mps >= AT_REST_MPS;
    const double blocked_s = moves && isfinite(c->blocked_m) ? seconds_to(m, c->blocked_m) : INFINITY;
    const double known_s = !moves || c->reason == ANSWER_HEARD ? INFINITY : seconds_to(m, c->known_m);
    const bool hits = blocked_s <= ahead_s, blind = known_s < fmin(ahead_s, blocked_s);
    const enum answer_state state = hits ? ANSWER_BLOCKED : blind || !moves ? ANSWER_UNKNOWN : ANSWER_CLEAR;
    const double sd_s = hits ? c->blocked_sd_m / m->speed_mps : 0;
    json_out_open(out, '{');
    json_member_word(out, "state", answer_state_name(state));
    json_member_known(out, "time_s", hits, blocked_s, 1e3);
    json_member_known(out, "time_sd_s", hits, sd_s, 1e3);
    json_member_known(out, "distance_m", hits, fmax(0, c->blocked_m - c->front_m), PER_METRES);
    json_member_known(out, "confidence", hits, c->confidence, 1e3);
    json_member_known(out, "unknown_after_s", blind, known_s, 1e3);
    json_member_real(out, "speed_mps", m->speed_mps, 1e4);
    json_member_real(out, "ahead_s", ahead_s, 1e3);
    json_member_age(out, "age_s", hits ? c->blocked_age_s : c->age_s);
    char why[REASON_SIZE];
    if (hits)
        snprintf(why, sizeof why, "obstacle at %.2f m along the path", fmax(0, c->blocked_m - c->front_m));
    else
        snprintf(why, sizeof why, "%s",
                 !moves  ? "the vehicle is at rest"
                 : blind ? reason_cause(d, &m->job.now, c->reason, cause)
                         : "the path is free");
    json_member_text(out, "reason", reason_with_pose(&m->job.now, why, hits ? c->blocked_age_s : c->age_s, text));
    reference_write_target(out, d);
    json_out_close(out, '}');
}

static bool judge_collision(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    struct movement *m = call->work->state;
    (void)error;
    if (!has_looked(m))
        return rpc_continue(call, judge_collision);
    write_collision(m->job.d, out, m, m->ahead_s);
    return true;
}

bool method_time_to_collision(const struct rpc_call *call, json_t *params, struct json_out *out,
                              struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    struct movement *m = begin_movement(call, params, error);
    if (!m || !velocity_of(d, params, m, error))
        return false;
    m->ahead_s = params_number(params, "ahead_s");
    m->body.margin_m = 0; /* touching is meant */
    if (m->speed_mps >= AT_REST_MPS)
        look_ahead(
            m, m->body.radius_m + m->body.half_height_m + m->speed_mps * (m->ahead_s + m->job.limits.clear_for_s),
            sqrt(dot(m->across, m->across)) * longest_stale_s(d, m));
    return judge_collision(call, out, error);
}
