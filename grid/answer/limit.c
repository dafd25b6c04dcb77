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
    if (corridor->reason != ANSWER_HEARD && conf->unknown != LIMIT_IGNORE)
        known = fmin(blocked, limit_speed(conf->braking_mps2, t_s, corridor->known_m - front_m));
    if (conf->unknown == LIMIT_SLOW)
        known = fmax(known, fmin(blocked, conf->slow_mps));
    *out = (struct limit){.speed_mps = known,
                          .by = known >= asked_mps ? LIMIT_BY_NOTHING
                                : known < blocked  ? LIMIT_BY_UNKNOWN
                                                   : LIMIT_BY_BLOCKED,
                          .stop_m = way_to_stand(conf, known, stale_s)};
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
