/* SPDX-License-Identifier: MIT */
/* scans - the made-up sea through the pipeline; see scans.h. */
#include "scans.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "daemon/wiring.h"

struct pipeline *scans_start(const struct conf *conf, uint32_t beams)
{
    struct pipeline_conf p;
    struct plan plan;
    struct fault fault;
    plan_make(conf, &plan);
    wiring_pipeline(conf, &plan, true, &p);
    p.max_beams = p.beams[0] = beams;
    p.max_samples = beams * p.max_bins;
    struct pipeline *pipeline = pipeline_new(&p, &fault);
    if (!pipeline) {
        fprintf(stderr, "scans: %s\n", fault.text);
        exit(1);
    }
    return pipeline;
}

static struct pose pose_at(uint64_t t_ns)
{
    struct pose pose = pose_identity;
    pose.t_ns = t_ns;
    pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    return pose;
}

void scans_submit(struct pipeline *pipeline, const struct sea_ping *sea)
{
    struct ping *ping = pipeline_begin(pipeline);
    struct ping heard = sea->ping;
    heard.max_beams = ping->max_beams;
    heard.max_samples = ping->max_samples;
    heard.beam = ping->beam;
    heard.samples = ping->samples;
    heard.pose = pose_at(sea->ping.t_ns);
    memcpy(heard.samples, sea->samples, sea->ping.n_bins);
    heard.beam[0] = sea->axis;
    *ping = heard;
    pipeline_submit(pipeline, ping);
}

struct answer_now scans_now(uint64_t t_ns)
{
    return (struct answer_now){.now_ns = t_ns, .pose_fresh = true, .pose = pose_at(t_ns)};
}

struct answer_conf scans_limits(const struct conf *conf)
{
    struct grid_setting setting;
    wiring_grid(conf, &conf->grid, &setting);
    if (!(setting.limits.clear_for_s > 0))
        setting.limits.clear_for_s = answer_clear_for_s(0, sphere_forget_s(&setting.sphere, 0));
    return setting.limits;
}
