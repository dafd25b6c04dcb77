/* SPDX-License-Identifier: MIT */
#include "head.h"

#include <stdlib.h>

void pilot_head_start(struct pilot_head *h, double step_rad)
{
    *h = (struct pilot_head){.angle = PING360_AHEAD};
    ping360_scan_init(&h->scan, 0, 0, step_rad);
}

int pilot_head_ping(struct pilot_head *h, uint64_t t_ns, uint32_t *gradians, bool *new_turn)
{
    const uint16_t angle = ping360_scan_angle(&h->scan);
    const int turn = ping360_angle_to(h->angle, angle);
    const bool turned_back = turn != 0 && (turn < 0) != h->backward;
    *gradians = (angle + (uint32_t)PING360_TURN - PING360_AHEAD) % PING360_TURN;
    *new_turn = turned_back || (angle < h->angle && turn > 0);
    h->backward = turn != 0 ? turn < 0 : h->backward;
    h->angle = angle;
    ping360_scan_advance(&h->scan, t_ns);
    return abs(ping360_angle_to(angle, ping360_scan_angle(&h->scan)));
}

void pilot_head_steer(struct pilot_head *h, struct methods_env *d, uint64_t t_ns)
{
    double push[3];
    struct pose pose = pose_identity;
    struct active_sensing_look look = {0};
    const bool pushed = push_way(&d->push, t_ns, push);
    const struct active_sensing_head head = {&pose, pushed ? push : NULL, &d->mount[0], &h->features};
    pose_log_at(&d->poses, t_ns, &pose);
    if (!(d->plan.steered & 1))
        return;
    active_sensing_sector(pipeline_picture(d->pipeline), t_ns,
                          grid_limits(pipeline_grid(d->pipeline, 0)).clear_for_s, &head, &look);
    ping360_scan_steer(&h->scan, look.from_rad, look.to_rad, look.only);
}
