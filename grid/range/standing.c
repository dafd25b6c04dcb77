/* SPDX-License-Identifier: MIT */
#include "standing.h"

#include <math.h>

#define MOVED_M    0.3
#define TURNED_RAD (5 * GEO_PI / 180)

static double way_between(const struct pose *then, const struct pose *now)
{
    double way_m = fmax(now->drift_m[0] - then->drift_m[0], now->drift_m[1] - then->drift_m[1]);
    for (int k = 0; k < 3; k++)
        way_m += fabs(now->position_m[k] - then->position_m[k]);
    return way_m;
}

static double turn_between(const struct pose *then, const struct pose *now)
{
    double cosine = 0.0;
    for (int k = 0; k < 4; k++)
        cosine += then->attitude[k] * now->attitude[k];
    return 2 * acos(fmin(fabs(cosine), 1));
}

bool standing_at(const struct pose *then, const struct pose *now)
{
    return then->has == now->has && then->discontinuities == now->discontinuities &&
           then->withdrawn == now->withdrawn && !now->heading_adrift && way_between(then, now) <= MOVED_M &&
           turn_between(then, now) <= TURNED_RAD;
}

void standing_follow(struct standing *s, uint64_t t_ns, const struct pose *now)
{
    if (s->since_ns == 0 || !standing_at(&s->pose, now))
        *s = (struct standing){.since_ns = t_ns, .pose = *now};
    s->moved_m = fmax(s->moved_m, way_between(&s->pose, now));
    s->turned_rad = fmax(s->turned_rad, turn_between(&s->pose, now));
}
