/* SPDX-License-Identifier: MIT */
#include "limit.h"

#include <math.h>

/* The root of v^2 / (2 a) + v t = s in the form that loses no digits where t is large. */
double limit_speed(double braking_mps2, double t_s, double way_m)
{
    if (!(way_m > 0))
        return 0;
    const double at = braking_mps2 * t_s;
    return 2 * braking_mps2 * way_m / (at + sqrt(at * at + 2 * braking_mps2 * way_m));
}

static double way_to_stand(const struct limit_conf *conf, double speed_mps, double stale_s)
{
    return speed_mps * (conf->latency_s + stale_s) + speed_mps * speed_mps / (2 * conf->braking_mps2);
}

void limit_of(const struct limit_conf *conf, const struct corridor *corridor, double asked_mps, double stale_s,
              struct limit *out)
{
    const double t_s = conf->latency_s + stale_s, front_m = corridor->front_m;
    const bool open = !isfinite(corridor->blocked_m);
    const double blocked =
        open ? asked_mps : fmin(asked_mps, limit_speed(conf->braking_mps2, t_s, corridor->blocked_m - front_m));
    double known = blocked;
    if (corridor->reason != ANSWER_HEARD)
        known = fmin(blocked, limit_speed(conf->braking_mps2, t_s, corridor->known_m - front_m));
    double allowed = conf->unknown == LIMIT_IGNORE ? blocked : known;
    if (conf->unknown == LIMIT_SLOW)
        allowed = fmax(known, fmin(blocked, conf->slow_mps));
    *out = (struct limit){.speed_mps = allowed,
                          .by = allowed >= asked_mps ? LIMIT_BY_NOTHING
                                : allowed < blocked  ? LIMIT_BY_UNKNOWN
                                                     : LIMIT_BY_BLOCKED,
                          .unknown = allowed > known,
                          .stop_m = way_to_stand(conf, allowed, 0),
                          .stale_m = allowed * stale_s};
}

double limit_drift_m(const struct limit_conf *conf, double across_mps, double stale_s)
{
    return way_to_stand(conf, across_mps, stale_s);
}

double limit_reach_m(const struct limit_conf *conf, double front_m, double asked_mps, double stale_s)
{
    return front_m + way_to_stand(conf, asked_mps, stale_s);
}

const char *limit_word(enum limit_by by)
{
    static const char *const words[] = {
        [LIMIT_BY_NOTHING] = "nothing", [LIMIT_BY_BLOCKED] = "blocked", [LIMIT_BY_UNKNOWN] = "unknown"};
    return words[by];
}

const char *limit_remedy(enum limit_by by, enum answer_reason reason, enum limit_pose pose)
{
    static const char *const texts[] = {
        [ANSWER_HEARD] = "a larger distance to ask for",
        [ANSWER_BEYOND] =
            "a scan that shows the water beyond; no_echo and minimum_range say how far silence counts",
        [ANSWER_BOTTOM] = "more height above the bottom, or a way that leads up",
        [ANSWER_BLIND] = "a sonar that covers the water closer by, or a larger near in [vehicle]",
        [ANSWER_MOVED] = "a new scan of that direction, or a larger move_limit",
        [ANSWER_STALE] = "a new scan of that direction, or a longer clear_for",
        [ANSWER_SILENT] = "the sonar that covers that direction, back online",
        [ANSWER_NEVER] = "a scan of that direction; where no sonar looks, a larger near in [vehicle]",
        [ANSWER_OUTSIDE] = "a grid with elevation = full",
        [ANSWER_NO_FRAME] = "a pose with an attitude, or a question in the body's frame",
        [ANSWER_POSE_LOST] = "a fresh pose",
        [ANSWER_NO_DATA] = "pings from the sonar"};
    if (by == LIMIT_BY_NOTHING)
        return "";
    if (by == LIMIT_BY_BLOCKED)
        return pose == LIMIT_POSE_PLACED
                   ? "beams that pass that place without an echo, or another direction"
                   : "beams that pass that place without an echo, another direction, or poses with a position";
    if (pose == LIMIT_POSE_PLACED || (reason != ANSWER_BEYOND && reason != ANSWER_BLIND && reason != ANSWER_NEVER))
        return texts[reason];
    return pose == LIMIT_POSE_ADRIFT ? "a newer scan, a position or velocity in the poses, or station_keeping"
                                     : "a newer scan, or poses with a position";
}
