/* SPDX-License-Identifier: MIT */
#include "data_word.h"

#include "daemon/input/garbage.h"
#include "daemon/methods/query_context.h"

/* Whether what is configured suits what was measured. */
static const char *misfit_word(const struct methods_env *d, const struct picture_frame *frame)
{
    if (frame->ned && pose_log_sparse(&d->poses))
        return "poses come less often than max_age: between them every answer is unknown";
    if (frame->turn_s <= grid_limits(pipeline_grid(d->pipeline, 0)).clear_for_s)
        return "ok";
    return d->conf.grid.clear_for_s > 0
               ? "a revolution of the head takes longer than clear_for: much of the circle stays unknown"
               : "a revolution of the head takes longer than forget: much of the circle stays unknown";
}

const char *status_data_word(const struct methods_env *d)
{
    struct picture_frame frame;
    picture_get_frame(pipeline_picture(d->pipeline), &frame);
    uint64_t now = loop_now(d->loop);
    uint64_t lost = query_lost_sonars(d), all = (1ull << d->conf.n_sonars) - 1;
    if (d->conf.n_sonars == 0)
        return "no sonar is configured";
    if (!frame.pings || lost == all)
        return "no data from the sonar";
    if (lost)
        return "no data from one of the sonars";
    /* Before silence: pings without a pose are not used, which looks like it. */
    if (frame.ned && !pose_log_fresh(&d->poses, now))
        return "the pose is too old";
    if (now > frame.t_ping_ns &&
        (double)(now - frame.t_ping_ns) * 1e-9 > grid_limits(pipeline_grid(d->pipeline, 0)).clear_for_s)
        return "the sonar has stopped sending pings";
    struct pipeline_stats pipe;
    pipeline_stats(d->pipeline, &pipe);
    for (int i = 0; i < d->conf.n_sonars; i++) {
        struct source_stats s;
        source_stats(d->source[i], &s);
        if (s.mostly_garbage)
            return garbage_word(d->conf.sonar[i].port);
        if (pipe.hearing[i] != HEARING_HEARS)
            return d->conf.n_sonars > 1 ? "one of the sonars may hear nothing (hearing_doubt)"
                                        : "the sonar may hear nothing (hearing_doubt)";
        if (s.device.other_settings[0])
            return d->conf.n_sonars > 1 ? "one of the sonars has settings that were not sent: another program?"
                                        : "the sonar has settings that were not sent: another program?";
        if (s.device.contested)
            return d->conf.n_sonars > 1 ? "answers of one of the sonars get lost: another program, or a poor line?"
                                        : "answers of the sonar get lost: another program, or a poor line?";
    }
    return misfit_word(d, &frame);
}
