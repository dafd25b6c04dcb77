/* SPDX-License-Identifier: MIT */
#include "discontinuity.h"

#include <math.h>

/* Where nobody says how fast the vehicle goes and turns. */
#define MOST_MPS   10.0
#define MOST_RADPS GEO_TURN

void discontinuity_init(struct discontinuities *j, double least_rad)
{
    *j = (struct discontinuities){.least_rad = least_rad, .sum.turn = {1, 0, 0, 0}, .can = pose_identity};
}

static double length(const double *v, int n)
{
    double sum = 0;
    for (int i = 0; i < n; i++)
        sum += v[i] * v[i];
    return sqrt(sum);
}

/* How a has to be turned, in NED, to be b. */
static void turn_between(const double a[4], const double b[4], double turn[4])
{
    const double back[4] = {a[0], -a[1], -a[2], -a[3]};
    quat_multiply(b, back, turn);
}

static double angle(const double turn[4])
{
    return 2 * atan2(length(turn + 1, 3), fabs(turn[0]));
}

/*
 * How the vehicle can follow a pose that is far off by doing no more than `reach` since the one before. Returns the
 * share of the way that it does; all of it where it jumps.
 */
static double follow_part(struct discontinuities *j, enum discontinuity_part part, double far, double reach,
                          double least, struct jump *jump)
{
    if (far <= reach) {
        j->chased[part] = 0;
        return 1;
    }
    j->chased[part] += reach;
    if (far - reach <= least)
        return reach / far;
    j->sum.own[part] += j->chased[part];
    j->chased[part] = 0;
    jump->by[part] = far;
    return 1;
}

/* The axes of that part. */
static void move(struct discontinuities *j, const struct pose *pose, enum discontinuity_part part, double reach_m,
                 struct jump *jump)
{
    const int at = part == DISCONTINUITY_DEPTH ? 2 : 0, n = part == DISCONTINUITY_DEPTH ? 1 : 2;
    double *can_m = j->can.position_m + at, shift_m[3];
    for (int i = 0; i < n; i++)
        shift_m[i] = pose->position_m[at + i] - can_m[i];
    const double share = follow_part(j, part, length(shift_m, n), reach_m, DISCONTINUITY_M, jump);
    for (int i = 0; i < n; i++) {
        j->sum.shift_m[at + i] += jump->by[part] > 0 ? shift_m[i] : 0;
        can_m[i] = share < 1 ? can_m[i] + share * shift_m[i] : pose->position_m[at + i];
    }
}

static void follow_turn(struct discontinuities *j, const struct pose *pose, double reach_rad, struct jump *jump)
{
    double by[4];
    turn_between(j->can.attitude, pose->attitude, by);
    const double share = follow_part(j, DISCONTINUITY_TURN, angle(by), reach_rad, j->least_rad, jump);
    quat_slerp(j->can.attitude, pose->attitude, share, j->can.attitude);
    if (jump->by[DISCONTINUITY_TURN] > 0) {
        quat_multiply(by, j->sum.turn, j->sum.turn);
        quat_normalise(j->sum.turn);
    }
}

/* Is this part of the pose news? *since_s: how long after it was said before; the first time it may be anywhere. */
static bool news(struct discontinuities *j, const struct pose *pose, enum discontinuity_part part, double *since_s)
{
    static const unsigned has[] = {POSE_POSITION, POSE_DEPTH, POSE_ATTITUDE};
    const bool said = j->can.has & has[part];
    if (!(pose->has & has[part]) || (said && pose->t_ns <= j->said_ns[part]))
        return false;
    *since_s = said ? (double)(pose->t_ns - j->said_ns[part]) * 1e-9 : INFINITY;
    j->can.has |= has[part];
    j->said_ns[part] = pose->t_ns;
    return true;
}

bool discontinuity_take(struct discontinuities *j, const struct pose *pose, double most_mps, double most_radps,
                        struct jump *jump)
{
    const double mps = most_mps > 0 ? most_mps : MOST_MPS, radps = most_radps > 0 ? most_radps : MOST_RADPS;
    double since_s;
    *jump = (struct jump){0};
    if (news(j, pose, DISCONTINUITY_LEVEL, &since_s))
        move(j, pose, DISCONTINUITY_LEVEL, mps * since_s, jump);
    if (news(j, pose, DISCONTINUITY_DEPTH, &since_s))
        move(j, pose, DISCONTINUITY_DEPTH, mps * since_s, jump);
    if (news(j, pose, DISCONTINUITY_TURN, &since_s))
        follow_turn(j, pose, radps * since_s, jump);
    return jump->by[DISCONTINUITY_LEVEL] > 0 || jump->by[DISCONTINUITY_DEPTH] > 0 ||
           jump->by[DISCONTINUITY_TURN] > 0;
}

bool discontinuity_same(const struct discontinuity_sum *then, const struct discontinuity_sum *now)
{
    double by[4], shift_m[3], own[DISCONTINUITY_PARTS];
    for (int i = 0; i < 3; i++)
        shift_m[i] = now->shift_m[i] - then->shift_m[i];
    for (int i = 0; i < DISCONTINUITY_PARTS; i++)
        own[i] = now->own[i] - then->own[i];
    turn_between(then->turn, now->turn, by);
    return length(shift_m, 2) + own[DISCONTINUITY_LEVEL] <= DISCONTINUITY_M &&
           fabs(shift_m[2]) + own[DISCONTINUITY_DEPTH] <= DISCONTINUITY_M &&
           angle(by) + own[DISCONTINUITY_TURN] <= geo_rad(DISCONTINUITY_DEG);
}
