/* SPDX-License-Identifier: MIT */
#include "active_sensing.h"

#include <string.h>

#define HALF_DEG 20.0 /* of that sector: a pass of it takes a ninth of a turn */
#define BAND_DEG 10.0 /* about the horizon, where scanning heads look */

bool active_sensing_sector(struct picture *picture, uint64_t now_ns, double stale_s,
                           const struct active_sensing_head *head, double *from_rad, double *to_rad)
{
    const unsigned wanted = POSE_ATTITUDE | POSE_VELOCITY;
    struct picture_frame frame;
    struct next_look_conf conf = {
        .stale_s = stale_s, .low_rad = -geo_rad(BAND_DEG), .high_rad = geo_rad(BAND_DEG)};
    double v[3], az, el;
    picture_get_frame(picture, &frame);
    if (!frame.ned || (head->pose->has & wanted) != wanted)
        return false;
    memcpy(conf.velocity_mps, head->pose->velocity_mps, sizeof conf.velocity_mps);
    if (!next_look_sector(picture, now_ns, &conf, head->features, 2 * geo_rad(HALF_DEG), &az))
        return false;
    geo_direction(az, 0, v);
    quat_rotate_inverse(head->pose->attitude, v, v);
    quat_rotate_inverse(head->mount->attitude, v, v);
    geo_angles(v, &az, &el);
    *from_rad = geo_wrap(az - geo_rad(HALF_DEG));
    *to_rad = geo_wrap(az + geo_rad(HALF_DEG));
    return true;
}
