/* SPDX-License-Identifier: MIT */
#include "pose_doubt.h"

#include <math.h>

#include "grid/geometry.h"

/* As radians. False: a heading that stands alone, the first or one too far from the last. */
static bool turn(struct pose_doubt *doubt, double heading, uint64_t now_ns)
{
    const double step = remainder(heading - doubt->last, GEO_TURN);
    const bool follows =
        doubt->is_turning && now_ns - doubt->t_last_ns <= POSE_DOUBT_STEP_NS && fabs(step) <= POSE_DOUBT_STEP_RAD;
    doubt->last = heading;
    doubt->t_last_ns = now_ns;
    doubt->turned += step;
    return follows;
}

bool pose_doubt_attitude(struct pose_doubt *doubt, const double rpy_deg[3], uint64_t now_ns)
{
    for (int i = 0; i < 3; i++)
        if (!(fabs(rpy_deg[i]) <= GEO_TURN))
            doubt->told_angles = true; /* these are degrees, and so will be those that follow */
    if (doubt->told_angles)
        return false;
    if (!turn(doubt, rpy_deg[2], now_ns)) {
        doubt->from = rpy_deg[2];
        doubt->turned = 0;
        doubt->is_turning = true;
    }
    const double jumped = doubt->turned - (rpy_deg[2] - doubt->from);
    doubt->told_angles = fabs(doubt->turned) >= GEO_TURN && fabs(jumped) > GEO_TURN / 2;
    return doubt->told_angles;
}

bool pose_doubt_depth(struct pose_doubt *doubt, double depth_m)
{
    const bool above = depth_m < -POSE_DOUBT_SURFACE_M;
    doubt->was_below |= depth_m > POSE_DOUBT_SURFACE_M;
    const bool tell = above && !doubt->was_below && !doubt->told_above;
    doubt->told_above = above;
    return tell;
}
