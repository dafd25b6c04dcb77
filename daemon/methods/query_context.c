/* SPDX-License-Identifier: MIT */
#include "query_context.h"

#include <math.h>
#include <time.h>

uint64_t query_lost_sonars(const struct methods_env *d)
{
    uint64_t lost = 0;
    for (int i = 0; i < d->conf.n_sonars; i++) {
        struct source_stats s;
        if (d->replay && !(d->told >> i & 1))
            continue;
        source_stats(d->source[i], &s);
        if (!s.open || s.device.state != DEVICE_RUNNING)
            lost |= 1ull << i;
    }
    return lost;
}

/* Bounds of the speed come: what the drift was in the last seconds. */
static void take_drift(const struct methods_env *d, struct answer_now *now)
{
    now->drift_varies = now->pose.drift_mps > 0 && d->poses.unseen.goes_on;
    for (int i = 0; now->drift_varies && i < ANSWER_DRIFTED_S; i++) {
        double then_m[DRIFT_WAYS];
        const uint64_t age_ns = (uint64_t)(i + 1) * 1000000000u;
        pose_log_drift(&d->poses, now->now_ns > age_ns ? now->now_ns - age_ns : 0, then_m);
        now->drifted_m[i] =
            hypot(now->pose.drift_m[0] - then_m[0], now->pose.drift_m[1] - then_m[1]) + now->pose.uncertain_m;
    }
}

struct answer_now query_now(const struct methods_env *d)
{
    struct answer_now now = {.now_ns = loop_now(d->loop), .pose = pose_identity, .lost = query_lost_sonars(d)};
    pose_log_at(&d->poses, now.now_ns, &now.pose);
    now.pose.path_m = d->poses.path_m;
    now.pose_fresh = pose_log_fresh(&d->poses, now.now_ns);
    take_drift(d, &now);
    return now;
}

bool query_whole_pose(const struct methods_env *d, struct pose *pose)
{
    const unsigned all = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    return pose_log_at(&d->poses, loop_now(d->loop), pose) && (pose->has & all) == all &&
           pose_log_fresh(&d->poses, loop_now(d->loop));
}

static double age_s(const struct methods_env *d, uint64_t t_ns)
{
    const uint64_t now_ns = loop_now(d->loop);
    return now_ns > t_ns ? (double)(now_ns - t_ns) * 1e-9 : 0;
}

double query_pose_age_s(const struct methods_env *d)
{
    static const unsigned parts[] = {POSE_ATTITUDE, POSE_POSITION, POSE_DEPTH};
    double oldest_s = -1;
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
        const uint64_t t_ns = pose_log_last_ns(&d->poses, parts[i]);
        if (t_ns)
            oldest_s = fmax(oldest_s, age_s(d, t_ns));
    }
    return oldest_s;
}

const char *const query_pose_parts[QUERY_POSE_PARTS] = {"attitude", "position", "depth", "velocity", "altitude"};

bool query_pose_part(const struct methods_env *d, unsigned i, double *age)
{
    const uint64_t t_ns = pose_log_last_ns(&d->poses, 1u << i);
    *age = age_s(d, t_ns);
    return t_ns > 0;
}

double query_place_age_s(const struct methods_env *d)
{
    return age_s(d, pose_log_last_ns(&d->poses, POSE_POSITION | POSE_DEPTH));
}

double query_velocity_age_s(const struct methods_env *d)
{
    return age_s(d, pose_log_last_ns(&d->poses, POSE_VELOCITY));
}

static double body_m(const struct conf_vehicle *c)
{
    const double wide = c->radius_m + c->margin_m, high = c->height_m / 2 + c->margin_m;
    return hypot(hypot(wide, wide), high);
}

double query_near_m(const struct methods_env *d)
{
    const struct conf_vehicle *c = &d->conf.vehicle;
    return c->near_m > 0 ? c->near_m : body_m(c);
}

double query_own_m(const struct methods_env *d)
{
    return fmin(query_near_m(d), body_m(&d->conf.vehicle));
}

#define UNSAID_MPS     1.0 /* of a vehicle that does not say how fast it goes */
#define LOOK_AHEAD_MIN 3.0

double query_look_ahead_m(const struct methods_env *d)
{
    const struct conf_vehicle *c = &d->conf.vehicle;
    const double mps = c->max_speed_mps > 0 ? c->max_speed_mps : UNSAID_MPS;
    const double stop_m = mps * c->latency_s + mps * mps / (2 * c->braking_mps2);
    return d->conf.answers.look_ahead_m > 0 ? d->conf.answers.look_ahead_m
                                            : fmax(LOOK_AHEAD_MIN, c->radius_m + c->margin_m + stop_m);
}

const char *query_pose_missing(const struct methods_env *d, char text[QUERY_REASON_SIZE])
{
    double age_s;
    const char *sender, *part;
    const unsigned missing = pose_log_missing(&d->poses, loop_now(d->loop), &age_s, &sender);
    text[0] = '\0';
    if (!missing || !d->poses.t_first_ns)
        return text;
    part = missing == POSE_ATTITUDE   ? "attitude"
           : missing == POSE_POSITION ? "position"
           : missing == POSE_DEPTH    ? "depth"
                                      : "velocity";
    if (age_s < 0)
        snprintf(text, QUERY_REASON_SIZE, "no %s was ever given", part);
    else
        snprintf(text, QUERY_REASON_SIZE, "the %s from %s is %.1f s old (limit %g s)", part,
                 sender ? sender : "the capture", age_s, (double)pose_log_max_age_ns(&d->poses, missing) * 1e-9);
    return text;
}

uint64_t query_unix_offset_ns(const struct methods_env *d)
{
    struct timespec t;
    if (d->replay)
        return 0;
    clock_gettime(CLOCK_REALTIME, &t);
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec - loop_clock();
}

double query_unix_s(const struct methods_env *d)
{
    return (double)(loop_now(d->loop) + query_unix_offset_ns(d)) * 1e-9;
}
