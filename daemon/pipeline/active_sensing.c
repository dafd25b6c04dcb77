/* SPDX-License-Identifier: MIT */
#include "active_sensing.h"

#include <string.h>

#define HALF_DEG 20.0 /* of that sector: a pass of it takes a ninth of a turn */
#define BAND_DEG 10.0 /* about the horizon, where scanning heads look */

/*
 * Of a pass over the water ahead of a vehicle that drifts only its middle is free: what stood beside it may have come
 * in (grid/sphere/drift.h). So it is wider than what is wanted, by about the drift in a pass at the range that
 * matters. A wider one takes longer, and what was scanned drifts meanwhile.
 */
#define DRIFT_HALF_DEG 40.0

static void sector_about(const struct active_sensing_head *head, double body[3], double half_rad,
                         struct active_sensing_look *look)
{
    double az, el;
    quat_rotate_inverse(head->mount->attitude, body, body);
    geo_angles(body, &az, &el);
    look->from_rad = geo_wrap(az - half_rad);
    look->to_rad = geo_wrap(az + half_rad);
}

static bool look_ahead(const struct active_sensing_head *head, struct active_sensing_look *look)
{
    double body[3];
    if (!head->push)
        return false;
    memcpy(body, head->push, sizeof body);
    look->only = true;
    sector_about(head, body, geo_rad(DRIFT_HALF_DEG), look);
    return true;
}

bool active_sensing_sector(struct picture *picture, uint64_t now_ns, double stale_s,
                           const struct active_sensing_head *head, struct active_sensing_look *look)
{
    const unsigned wanted = POSE_ATTITUDE | POSE_VELOCITY;
    struct picture_frame frame;
    struct next_look_conf conf = {
        .stale_s = stale_s, .low_rad = -geo_rad(BAND_DEG), .high_rad = geo_rad(BAND_DEG)};
    double v[3], az;
    picture_get_frame(picture, &frame);
    if (head->pose->drift_mps > 0 && !(head->pose->has & POSE_VELOCITY))
        return look_ahead(head, look);
    if (!frame.ned || (head->pose->has & wanted) != wanted)
        return false;
    memcpy(conf.velocity_mps, head->pose->velocity_mps, sizeof conf.velocity_mps);
    if (!next_look_sector(picture, now_ns, &conf, head->features, 2 * geo_rad(HALF_DEG), &az))
        return false;
    geo_direction(az, 0, v);
    quat_rotate_inverse(head->pose->attitude, v, v);
    look->only = false;
    sector_about(head, v, geo_rad(HALF_DEG), look);
    return true;
}
