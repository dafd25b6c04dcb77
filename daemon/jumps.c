/* SPDX-License-Identifier: MIT */
#include "jumps.h"

#include <math.h>

/* Where nobody says how fast the vehicle goes and turns. */
#define MOST_MPS   10.0
#define MOST_RADPS GEO_TURN

void jumps_init(struct jumps *j, double least_rad)
{
    *j = (struct jumps){.least_rad = least_rad, .sum.turn = {1, 0, 0, 0}, .can = pose_identity};
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
 * How the vehicle can follow a pose that is far off by doing no more than `reach` since the one before. Returns the share of
 * the way that it does; all of it where it jumps.
 */
static double follow(struct jumps *j, enum jumps_part part, double far, double reach, double least, struct jump *jump)
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

/* n of the axes, from `at` on. */
static void move(struct jumps *j, const struct pose *pose, enum jumps_part part, int at, int n, double reach_m,
                 struct jump *jump)
{
    double *can_m = j->can.position_m + at, way_m[3];
    for (int i = 0; i < n; i++)
        way_m[i] = pose->position_m[at + i] - can_m[i];
    const double share = follow(j, part, length(way_m, n), reach_m, JUMPS_M, jump);
    for (int i = 0; i < n; i++) {
        j->sum.way_m[at + i] += jump->by[part] > 0 ? way_m[i] : 0;
        can_m[i] = share < 1 ? can_m[i] + share * way_m[i] : pose->position_m[at + i];
    }
}

static void turn(struct jumps *j, const struct pose *pose, double reach_rad, struct jump *jump)
{
    double by[4];
    turn_between(j->can.attitude, pose->attitude, by);
    const double share = follow(j, JUMPS_TURN, angle(by), reach_rad, j->least_rad, jump);
    quat_slerp(j->can.attitude, pose->attitude, share, j->can.attitude);
    if (jump->by[JUMPS_TURN] > 0) {
        quat_multiply(by, j->sum.turn, j->sum.turn);
        quat_normalise(j->sum.turn);
    }
}

/* Is this part of the pose news? *since_s: how long after it was said before; the first time it may be anywhere. */
static bool news(struct jumps *j, const struct pose *pose, enum jumps_part part, double *since_s)
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

bool jumps_take(struct jumps *j, const struct pose *pose, double most_mps, double most_radps, struct jump *jump)
{
    const double mps = most_mps > 0 ? most_mps : MOST_MPS, radps = most_radps > 0 ? most_radps : MOST_RADPS;
    double since_s;
    *jump = (struct jump){0};
    if (news(j, pose, JUMPS_LEVEL, &since_s))
        move(j, pose, JUMPS_LEVEL, 0, 2, mps * since_s, jump);
    if (news(j, pose, JUMPS_DEPTH, &since_s))
        move(j, pose, JUMPS_DEPTH, 2, 1, mps * since_s, jump);
    if (news(j, pose, JUMPS_TURN, &since_s))
        turn(j, pose, radps * since_s, jump);
    return jump->by[JUMPS_LEVEL] > 0 || jump->by[JUMPS_DEPTH] > 0 || jump->by[JUMPS_TURN] > 0;
}

bool jumps_same(const struct jumps_sum *then, const struct jumps_sum *now)
{
    double by[4], way_m[3], own[JUMPS_PARTS];
    for (int i = 0; i < 3; i++)
        way_m[i] = now->way_m[i] - then->way_m[i];
    for (int i = 0; i < JUMPS_PARTS; i++)
        own[i] = now->own[i] - then->own[i];
    turn_between(then->turn, now->turn, by);
    return length(way_m, 2) + own[JUMPS_LEVEL] <= JUMPS_M && fabs(way_m[2]) + own[JUMPS_DEPTH] <= JUMPS_M &&
           angle(by) + own[JUMPS_TURN] <= geo_rad(JUMPS_DEG);
}
