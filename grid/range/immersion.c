/* SPDX-License-Identifier: MIT */
#include "immersion.h"

bool immersion_is_out(const struct pose *pose, const struct mount *mount)
{
    double below_m = geo_length(mount->position_m);
    if (!(pose->has & POSE_DEPTH))
        return false;
    if (pose->has & POSE_ATTITUDE) {
        double arm[3];
        quat_rotate(pose->attitude, mount->position_m, arm);
        below_m = arm[2];
    }
    return pose->position_m[2] + below_m + pose->uncertain_m + IMMERSION_DOUBT_M < 0.0;
}
