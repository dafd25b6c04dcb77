/* SPDX-License-Identifier: MIT */
#include "pose_doubt.h"

#include <math.h>

bool pose_doubt_attitude(struct pose_doubt *doubt, const double rpy_deg[3], uint64_t now_ns)
{
    for (int i = 0; i < 3; i++)
        if (!(fabs(rpy_deg[i]) < POSE_DOUBT_ANGLE_DEG)) {
            *doubt = (struct pose_doubt){.told_above = doubt->told_above, .told_angles = true};
            return false; /* these are degrees, and so will be those that follow */
        }
    if (!doubt->small_since_ns)
        doubt->small_since_ns = now_ns ? now_ns : 1;
    if (doubt->told_angles || now_ns - doubt->small_since_ns < POSE_DOUBT_NS)
        return false;
    doubt->told_angles = true;
    return true;
}

bool pose_doubt_depth(struct pose_doubt *doubt, double depth_m)
{
    const bool above = depth_m < -POSE_DOUBT_ABOVE_M, tell = above && !doubt->told_above;
    doubt->told_above = above;
    return tell;
}
