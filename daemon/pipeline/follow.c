/* SPDX-License-Identifier: MIT */
#include "follow.h"

#include <math.h>
#include <string.h>

#include "pipeline_state.h"

/* Is the vehicle farther from the centre than a recentring step? Then the centre will be there. */
static bool recentres(struct pipeline *p, const struct pose *pose)
{
    double way_m[3], least_m = INFINITY;
    for (int k = 0; k < 3; k++)
        way_m[k] = pose->position_m[k] - p->follow.centre_m[k];
    for (int i = 0; i < p->n_grids; i++)
        least_m = fmin(least_m, p->grid[i]->setting.sphere.recentre_m);
    if (geo_length(way_m) <= least_m)
        return false;
    memcpy(p->follow.centre_m, pose->position_m, sizeof p->follow.centre_m);
    return true;
}

void follow_ping(struct pipeline *p, const struct ping *ping)
{
    /* a ping that was dated back does not bring the centre back */
    const bool newest = ping->t_ns >= p->follow.t_ping_ns && ping->t_ns >= p->follow.pose.t_ns;
    if (ping->t_ns > p->follow.t_ping_ns)
        p->follow.t_ping_ns = ping->t_ns;
    if (newest && (ping->pose.has & POSE_POSITION))
        recentres(p, &ping->pose);
}

static void follow_in_grids(void *ctx, const struct pipeline_owned *owned)
{
    struct owner_job *job = ctx;
    struct pipeline *p = job->pipeline;
    (void)owned;
    for (int i = 0; i < p->n_grids; i++)
        grid_follow(p->grid[i], &p->follow.pose);
    records_follow(p->records, &p->follow.pose);
}

static void done(void *ctx)
{
    (void)ctx;
}

void pipeline_follow(struct pipeline *p, const struct pose *pose)
{
    const unsigned wanted = POSE_ATTITUDE | POSE_POSITION;
    struct owner_job *job = &p->follow.job;
    if ((pose->has & wanted) != wanted || pose->t_ns < p->follow.t_ping_ns + FOLLOW_AFTER_NS ||
        pose->t_ns < p->follow.pose.t_ns || job->state == OWNER_JOB_WAITS || job->state == OWNER_JOB_OUT ||
        !recentres(p, pose))
        return;
    p->follow.pose = *pose;
    owner_call(p, job, follow_in_grids, done);
}
