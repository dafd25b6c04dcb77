/* SPDX-License-Identifier: MIT */
/* The methods about moving: when the vehicle meets something, and how fast it may go; sonard-protocol(7) has every
 * shape. */
#include <math.h>
#include <string.h>

#include "../grid/answer/limit.h"
#include "grid_methods.h"
#include "methods.h"
#include "moment.h"
#include "say.h"

#define AT_REST_MPS     1e-3 /* slower is no direction */
#define SPEED_MAX_MPS   100
#define DEFAULT_AHEAD_S 60.0
#define LONGEST_AHEAD_S 3600.0

static const char *const frame_words[] = {"body", "ned", NULL};

/* A movement that is asked about, and what is known of how old the picture is for it. */
struct movement {
    double velocity_mps[3], speed_mps;
    bool ned;
    struct answer_now now;
    struct grid *grid;
    struct corridor_body body;
    struct corridor corridor;
    bool follows;     /* the picture follows the vehicle, up to the newest position */
    bool told;        /* the pose tells a velocity: */
    double across[3]; /* what of it goes across the line, in the axes of the question */
    double stale_s;   /* the vehicle may have moved for so long without the picture's and the pose's knowledge */
};

static void take_body(const struct daemon *d, struct corridor_body *body)
{
    const struct conf_vehicle *c = &d->conf.vehicle;
    *body = (struct corridor_body){.radius_m = c->radius_m,
                                   .half_height_m = c->height_m / 2,
                                   .margin_m = c->margin_m,
                                   .near_m = moment_near_m(d)};
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* What the vehicle does now, against what it is asked to do. */
static void take_own_velocity(const struct daemon *d, struct movement *m)
{
    const struct pose *pose = &m->now.pose;
    const unsigned needed = POSE_VELOCITY | (m->ned ? 0 : POSE_ATTITUDE);
    m->told =
        m->now.pose_fresh && (pose->has & needed) == needed && moment_velocity_age_s(d) <= d->conf.pose.max_age_s;
    if (!m->told || m->speed_mps < AT_REST_MPS)
        return;
    memcpy(m->across, pose->velocity_mps, sizeof m->across);
    if (!m->ned)
        quat_rotate_inverse(pose->attitude, m->across, m->across);
    const double along_mps = dot(m->across, m->velocity_mps) / m->speed_mps;
    for (int i = 0; i < 3; i++)
        m->across[i] -= along_mps * m->velocity_mps[i] / m->speed_mps;
}

static void take_velocity(const struct daemon *d, struct movement *m, const double velocity_mps[3], bool ned)
{
    struct picture_frame frame;
    memcpy(m->velocity_mps, velocity_mps, sizeof m->velocity_mps);
    m->speed_mps = sqrt(dot(velocity_mps, velocity_mps));
    m->ned = ned;
    picture_get_frame(grid_picture(m->grid), &frame);
    m->follows = frame.ned && m->now.pose_fresh && (m->now.pose.has & POSE_POSITION);
    take_own_velocity(d, m);
}

/* How long the vehicle may have moved without the picture's knowledge, before anything was looked at. */
static double longest_stale_s(const struct daemon *d, const struct movement *m)
{
    if (!m->follows)
        return m->grid->setting.limits.clear_for_s;
    return m->told ? 0 : moment_place_age_s(d);
}

/*
 * With a position the picture follows the vehicle, and with a velocity the slack of its pose holds how far it may have gone
 * on since. Without one the picture is as old as its pings, or as its place, and the vehicle is taken to have gone no
 * faster than it now may.
 */
static void judge_age(const struct daemon *d, struct movement *m)
{
    const double oldest_s = fmax(0, fmax(m->corridor.age_s, m->corridor.blocked_age_s));
    m->stale_s = m->follows ? longest_stale_s(d, m) : oldest_s;
}

/* drift_m: what the vehicle's own velocity across the line carries it off by. */
static void look_ahead(const struct daemon *d, struct movement *m, double most_m, double drift_m)
{
    const double across_mps = sqrt(dot(m->across, m->across));
    struct corridor_query q = {.ned = m->ned, .most_m = most_m};
    memcpy(q.direction, m->velocity_mps, sizeof q.direction);
    for (int i = 0; i < 3 && across_mps >= AT_REST_MPS; i++)
        q.drift_m[i] = m->across[i] / across_mps * drift_m;
    corridor_look(grid_picture(m->grid), &m->grid->setting.limits, &m->now, &m->body, &q, &m->corridor);
    judge_age(d, m);
}

/* False: there is no such grid. */
static bool begin(struct daemon *d, json_t *params, struct movement *m, struct rpc_error *error)
{
    *m = (struct movement){.now = moment_now(d), .grid = grid_asked(d, params, error)};
    take_body(d, &m->body);
    return m->grid != NULL;
}

static json_t *distance(double m)
{
    return isfinite(m) ? say_metres(m) : json_null();
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

static json_t *limit_json(const struct movement *m, const struct limit *l, const char *reason)
{
    const struct corridor *c = &m->corridor;
    const double factor = m->speed_mps < AT_REST_MPS ? 0 : l->speed_mps / m->speed_mps;
    double v[3];
    /* downwards: what is told must not be more than what was found, nor than what was asked for */
    for (int i = 0; i < 3; i++)
        v[i] = trunc(m->velocity_mps[i] * factor * 1e6) / 1e6;
    return json_pack("{s:[f, f, f], s:o, s:o, s:s, s:o, s:o, s:o, s:o, s:s}", "velocity_mps", v[0], v[1], v[2],
                     "speed_mps", say_real(l->speed_mps, 1e6), "asked_mps", say_real(m->speed_mps, 1e6),
                     "limited_by", limit_word(l->by), "stop_m", say_metres(l->stop_m), "blocked_m",
                     distance(c->blocked_m - c->front_m), "free_m",
                     say_metres(fmax(0, fmin(c->known_m, c->blocked_m) - c->front_m)), "age_s", say_age(c->age_s),
                     "reason", reason);
}

json_t *motion_method_limit(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"velocity_mps", "frame", "grid", NULL};
    struct daemon *d = call->daemon;
    struct limit_conf conf;
    struct movement m;
    struct limit l = {.by = LIMIT_BY_NOTHING};
    double velocity[3];
    bool given;
    int frame = 0;
    if (!rpc_only(params, keys, error) ||
        !rpc_numbers(params, "velocity_mps", -SPEED_MAX_MPS, SPEED_MAX_MPS, 3, velocity, &given, error) ||
        !rpc_word(params, "frame", frame_words, &frame, error))
        return NULL;
    if (!given) {
        rpc_refuse(error, RPC_INVALID_PARAMS, "parameter 'velocity_mps' is missing");
        return NULL;
    }
    if (!begin(d, params, &m, error))
        return NULL;
    take_velocity(d, &m, velocity, frame == 1);
    limit_conf(&d->conf.vehicle, &conf);
    if (m.speed_mps < AT_REST_MPS) {
        m.corridor = (struct corridor){.blocked_m = INFINITY, .age_s = -1};
        return limit_json(&m, &l, "nothing was asked for");
    }
    /* as far as it would be for the oldest picture that may count: farther than needed changes nothing */
    look_ahead(d, &m,
               limit_reach_m(&conf, m.body.radius_m + m.body.half_height_m + m.body.margin_m, m.speed_mps,
                             m.grid->setting.limits.clear_for_s),
               limit_drift_m(&conf, sqrt(dot(m.across, m.across)), longest_stale_s(d, &m)));
    limit_of(&conf, &m.corridor, m.speed_mps, m.stale_s, &l);
    return limit_json(&m, &l, answer_reason_text(m.corridor.reason));
}

/* ---- time to collision ---- */

/* The velocity asked about, or that of the pose. */
static bool velocity_of(const struct daemon *d, json_t *params, struct movement *m, struct rpc_error *error)
{
    double velocity[3];
    bool given;
    int frame = 0;
    if (!rpc_numbers(params, "velocity_mps", -SPEED_MAX_MPS, SPEED_MAX_MPS, 3, velocity, &given, error) ||
        !rpc_word(params, "frame", frame_words, &frame, error))
        return false;
    if (!given && (!m->now.pose_fresh || !(m->now.pose.has & POSE_VELOCITY)))
        return rpc_refuse(error, RPC_INVALID_REQUEST,
                          "no fresh pose tells attitude and velocity: give velocity_mps");
    if (!given && json_object_get(params, "frame"))
        return rpc_refuse(error, RPC_INVALID_PARAMS, "frame goes together with velocity_mps only");
    take_velocity(d, m, given ? velocity : m->now.pose.velocity_mps, given ? frame == 1 : true);
    return true;
}

/* Seconds until the body gets there; the vehicle may be there earlier by what it moved since the picture. */
static double seconds_to(const struct movement *m, double at_m)
{
    return fmax(0, (at_m - m->corridor.front_m) / m->speed_mps - m->stale_s);
}

static json_t *collision_json(const struct movement *m, double ahead_s)
{
    const struct corridor *c = &m->corridor;
    const bool moves = m->speed_mps >= AT_REST_MPS;
    const double blocked_s = moves && isfinite(c->blocked_m) ? seconds_to(m, c->blocked_m) : INFINITY;
    const double known_s = !moves || c->reason == ANSWER_HEARD ? INFINITY : seconds_to(m, c->known_m);
    const bool hits = blocked_s <= ahead_s, blind = known_s < fmin(ahead_s, blocked_s);
    const enum answer_state state = hits ? ANSWER_BLOCKED : blind || !moves ? ANSWER_UNKNOWN : ANSWER_CLEAR;
    const double sd_s = hits ? c->blocked_sd_m / m->speed_mps : 0;
    return json_pack(
        "{s:s, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:s}", "state", answer_state_name(state), "time_s",
        hits ? say_real(blocked_s, 1e3) : json_null(), "time_sd_s", hits ? say_real(sd_s, 1e3) : json_null(),
        "distance_m", hits ? say_metres(fmax(0, c->blocked_m - c->front_m)) : json_null(), "confidence",
        hits ? say_real(c->confidence, 1e3) : json_null(), "unknown_after_s",
        blind ? say_real(known_s, 1e3) : json_null(), "speed_mps", say_real(m->speed_mps, 1e4), "ahead_s",
        say_real(ahead_s, 1e3), "age_s", say_age(hits ? c->blocked_age_s : c->age_s), "reason",
        moves ? answer_reason_text(blind ? c->reason : ANSWER_HEARD) : "the vehicle is at rest");
}

json_t *motion_method_collision(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"velocity_mps", "frame", "ahead_s", "grid", NULL};
    struct daemon *d = call->daemon;
    double ahead_s = DEFAULT_AHEAD_S;
    struct movement m;
    if (!rpc_only(params, keys, error) || !begin(d, params, &m, error) ||
        !rpc_number(params, "ahead_s", false, 0.1, LONGEST_AHEAD_S, &ahead_s, error) ||
        !velocity_of(d, params, &m, error))
        return NULL;
    m.body.margin_m = 0; /* touching is meant */
    m.corridor = (struct corridor){.blocked_m = INFINITY, .blocked_age_s = -1, .age_s = -1};
    if (m.speed_mps >= AT_REST_MPS)
        look_ahead(d, &m,
                   m.body.radius_m + m.body.half_height_m +
                       m.speed_mps * (ahead_s + m.grid->setting.limits.clear_for_s),
                   sqrt(dot(m.across, m.across)) * longest_stale_s(d, &m));
    return collision_json(&m, ahead_s);
}
