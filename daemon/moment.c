/* SPDX-License-Identifier: MIT */
#include "moment.h"

#include <math.h>
#include <time.h>

uint64_t moment_lost_sonars(const struct daemon *d)
{
    uint64_t lost = 0;
    for (int i = 0; i < d->conf.n_sonars && !d->replay; i++) {
        struct source_stats s;
        source_stats(d->source[i], &s);
        if (!s.open || s.device.state != DEVICE_RUNNING)
            lost |= 1ull << i;
    }
    return lost;
}

struct answer_now moment_now(const struct daemon *d)
{
    struct answer_now now = {.now_ns = loop_now(d->loop), .pose = pose_identity, .lost = moment_lost_sonars(d)};
    pose_log_at(&d->poses, now.now_ns, &now.pose);
    now.pose.path_m = d->poses.path_m;
    now.pose_fresh = pose_log_fresh(&d->poses, now.now_ns);
    return now;
}

static double age_s(const struct daemon *d, uint64_t t_ns)
{
    const uint64_t now_ns = loop_now(d->loop);
    return now_ns > t_ns ? (double)(now_ns - t_ns) * 1e-9 : 0;
}

double moment_pose_age_s(const struct daemon *d)
{
    static const unsigned parts[] = {POSE_ATTITUDE, POSE_POSITION, POSE_DEPTH};
    double oldest_s = -1;
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
        const uint64_t t_ns = pose_log_last_ns(&d->poses, parts[i]);
        if (t_ns)
            oldest_s = fmax(oldest_s, age_s(d, t_ns));
    }
    return oldest_s;
}

double moment_place_age_s(const struct daemon *d)
{
    return age_s(d, pose_log_last_ns(&d->poses, POSE_POSITION | POSE_DEPTH));
}

double moment_velocity_age_s(const struct daemon *d)
{
    return age_s(d, pose_log_last_ns(&d->poses, POSE_VELOCITY));
}

double moment_near_m(const struct daemon *d)
{
    const struct conf_vehicle *c = &d->conf.vehicle;
    const double wide = c->radius_m + c->margin_m, high = c->height_m / 2 + c->margin_m;
    return c->near_m > 0 ? c->near_m : hypot(hypot(wide, wide), high);
}

uint64_t moment_unix_offset_ns(const struct daemon *d)
{
    struct timespec t;
    if (d->replay)
        return 0;
    clock_gettime(CLOCK_REALTIME, &t);
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec - loop_clock();
}

double moment_unix_s(const struct daemon *d)
{
    return (double)(loop_now(d->loop) + moment_unix_offset_ns(d)) * 1e-9;
}
