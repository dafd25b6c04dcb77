/* SPDX-License-Identifier: MIT */
#include "pose_input.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define TEXT_MAX 200

uint64_t pose_input_told(uint64_t t_ns, uint64_t unix_offset_ns, double *t_unix)
{
    *t_unix = (double)(t_ns + unix_offset_ns) * 1e-9;
    const uint64_t told_ns = (uint64_t)(*t_unix * 1e9);
    return told_ns > unix_offset_ns ? told_ns - unix_offset_ns : 0;
}

/* As it came: a replay dates it back. 17 digits read back to the same bits. */
static void record_pose(struct pose_input *in, const struct pose *p, double t_unix)
{
    char text[TEXT_MAX];
    int n;
    if (!in->record)
        return;
    if (p->has & POSE_ALTITUDE)
        n = snprintf(text, sizeof text, "{\"t_unix\":%.17g,\"altitude_m\":%.17g}", t_unix, p->altitude_m);
    else if (p->has & POSE_DEPTH)
        n = snprintf(text, sizeof text, "{\"t_unix\":%.17g,\"depth_m\":%.17g}", t_unix, p->position_m[2]);
    else
        n = snprintf(text, sizeof text, "{\"t_unix\":%.17g,\"quaternion\":[%.17g,%.17g,%.17g,%.17g]}", t_unix,
                     p->attitude[0], p->attitude[1], p->attitude[2], p->attitude[3]);
    record_message(in->record, in->channel, loop_now(in->loop), text, (size_t)n);
}

static bool take_pose(struct pose_input *in, const char *sender, const struct pose *came)
{
    struct pose p = *came;
    double t_unix;
    p.t_ns = pose_log_dated(in->poses, pose_input_told(came->t_ns, in->unix_offset_ns, &t_unix));
    if (p.has & POSE_ATTITUDE)
        quat_normalise(p.attitude); /* as whoever reads it in a capture does: to the bit */
    if (!pose_log_put(in->poses, &p))
        return false;
    pose_log_sent_by(in->poses, p.has, sender);
    in->taken(in->ctx, &p);
    record_pose(in, came, t_unix);
    return true;
}

bool pose_input_depth(struct pose_input *in, uint64_t t_ns, double depth_m)
{
    struct pose p = pose_identity;
    p.t_ns = t_ns;
    p.has = POSE_DEPTH;
    p.position_m[2] = depth_m;
    return take_pose(in, "the depth sensor", &p);
}

bool pose_input_altitude(struct pose_input *in, uint64_t t_ns, double altitude_m)
{
    struct pose p = pose_identity;
    p.t_ns = t_ns;
    p.has = POSE_ALTITUDE;
    p.altitude_m = altitude_m;
    return take_pose(in, "the NMEA source", &p);
}

bool pose_input_heading(struct pose_input *in, uint64_t t_ns, double heading_rad)
{
    struct pose p = pose_identity;
    if (in->t_attitude_ns && t_ns < in->t_attitude_ns + pose_log_max_age_ns(in->poses, POSE_ATTITUDE)) {
        in->heading_not_used++;
        return false;
    }
    p.t_ns = t_ns;
    p.has = POSE_ATTITUDE;
    p.attitude[0] = cos(heading_rad / 2); /* and no -0, which JSON does not keep */
    p.attitude[3] = sin(heading_rad / 2);
    return take_pose(in, "the NMEA source", &p);
}
