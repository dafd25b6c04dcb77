/* SPDX-License-Identifier: MIT */
#include "velocity_doubt.h"

#include <math.h>
#include <string.h>

static bool zero(const double v[3])
{
    return v[0] == 0 && v[1] == 0 && v[2] == 0;
}

static double turned_rad(const double a[4], const double b[4])
{
    const double dot = fabs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]);
    return 2 * acos(fmin(1, dot));
}

/* A position has its depth in it; a depth alone has no position. */
static bool differs(const struct pose *from, const struct pose *now)
{
    const unsigned both = from->has & now->has;
    const double *a = from->position_m, *b = now->position_m;
    return ((both & POSE_ATTITUDE) && turned_rad(from->attitude, now->attitude) > VELOCITY_DOUBT_TURN_RAD) ||
           ((both & POSE_DEPTH) && fabs(b[2] - a[2]) > VELOCITY_DOUBT_SINK_M) ||
           ((both & POSE_POSITION) && hypot(b[0] - a[0], b[1] - a[1]) > VELOCITY_DOUBT_MOVE_M);
}

/* The first of every part that came since the zeros began. */
static void remember(struct pose *since, const struct pose *now)
{
    const unsigned news = now->has & ~since->has;
    if (news & POSE_ATTITUDE)
        memcpy(since->attitude, now->attitude, sizeof since->attitude);
    if (news & POSE_DEPTH)
        since->position_m[2] = now->position_m[2];
    if (news & POSE_POSITION)
        memcpy(since->position_m, now->position_m, 2 * sizeof since->position_m[0]);
    since->has |= now->has;
}

bool velocity_doubt_take(struct velocity_doubt *doubt, struct pose *pose)
{
    const bool velocity = pose->has & POSE_VELOCITY, was = doubt->doubted;
    const bool over = !velocity && pose->t_ns > doubt->t_zero_ns + VELOCITY_DOUBT_OVER_NS;
    if (over || (velocity && !zero(pose->velocity_mps)))
        *doubt = (struct velocity_doubt){.left_out = doubt->left_out};
    else if (velocity && doubt->zeros < VELOCITY_DOUBT_ZEROS)
        doubt->zeros++;
    if (doubt->zeros == 0)
        return false;
    if (velocity)
        doubt->t_zero_ns = pose->t_ns;
    doubt->moved = doubt->moved || differs(&doubt->since, pose);
    doubt->doubted = doubt->moved && doubt->zeros >= VELOCITY_DOUBT_ZEROS;
    remember(&doubt->since, pose);
    if (velocity && doubt->doubted) {
        pose->has &= ~(unsigned)POSE_VELOCITY;
        doubt->left_out++;
    }
    return doubt->doubted && !was;
}
