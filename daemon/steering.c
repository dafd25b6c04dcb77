/* SPDX-License-Identifier: MIT */
#include "steering.h"

static void steer(struct steering *s, int i, const struct active_sensing_head *head, uint64_t now_ns)
{
    struct pipeline *pipeline = s->env.pipeline;
    const double clear_for_s = grid_limits(pipeline_grid(pipeline, 0)).clear_for_s;
    struct active_sensing_look look = {0};
    active_sensing_sector(pipeline_picture(pipeline), now_ns, clear_for_s, head, &look);
    source_steer(s->env.source[i], look.from_rad, look.to_rad, look.only);
}

static void on_tick(void *ctx, uint64_t now_ns)
{
    struct steering *s = ctx;
    struct pose pose;
    double push[3];
    const bool pushed = push_way(s->env.push, now_ns, push);
    pose_log_at(s->env.poses, now_ns, &pose);
    if (!pose_log_fresh(s->env.poses, now_ns))
        pose.has = 0; /* its drift holds all the same */
    for (int i = 0; i < CONF_MAX_SONARS; i++)
        if (s->env.plan->steered >> i & 1)
            steer(s, i,
                  &(struct active_sensing_head){&pose, pushed ? push : NULL, &s->env.mount[i], &s->features[i]},
                  now_ns);
    loop_arm(s->env.loop, &s->timer, now_ns + ACTIVE_SENSING_TICK_NS);
}

void steering_start(struct steering *s, const struct steering_env *env)
{
    *s = (struct steering){.timer = {.fire = on_tick, .ctx = s}, .env = *env};
    if (env->plan->steered)
        loop_arm(env->loop, &s->timer, loop_now(env->loop) + ACTIVE_SENSING_TICK_NS);
}

void steering_stop(struct steering *s)
{
    loop_arm(s->env.loop, &s->timer, LOOP_NEVER);
}
