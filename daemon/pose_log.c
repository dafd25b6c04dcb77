/* SPDX-License-Identifier: MIT */
#include "pose_log.h"

#include <math.h>
#include <string.h>

void pose_log_init(struct pose_log *log, uint64_t max_age_ns)
{
    memset(log, 0, sizeof *log);
    log->max_age_ns = max_age_ns;
}

static const struct pose *at(const struct pose_log *log, uint32_t i)
{
    return &log->sample[(log->first + i) % POSE_LOG_SAMPLES];
}

const struct pose *pose_log_newest(const struct pose_log *log)
{
    return log->n ? at(log, log->n - 1) : NULL;
}

static unsigned fresh_parts(const struct pose_log *log, uint64_t t_ns)
{
    unsigned parts = 0;
    for (unsigned i = 0; i < 4; i++)
        if (log->t_part_ns[i] && t_ns - log->t_part_ns[i] <= log->max_age_ns)
            parts |= 1u << i;
    return parts;
}

/* The place goes on from where it was: by what is given, else by the velocity. */
static void move(struct pose *p, const struct pose *before, const struct pose *given)
{
    double dt_s = (double)(given->t_ns - before->t_ns) * 1e-9, way = 0;
    for (int i = 0; i < 3; i++) {
        bool placed = given->has & (i == 2 ? POSE_DEPTH : POSE_POSITION);
        p->position_m[i] =
            placed ? given->position_m[i]
                   : before->position_m[i] + ((p->has & POSE_VELOCITY) ? p->velocity_mps[i] * dt_s : 0);
        way += (p->position_m[i] - before->position_m[i]) * (p->position_m[i] - before->position_m[i]);
    }
    p->path_m = before->path_m + sqrt(way);
}

bool pose_log_put(struct pose_log *log, const struct pose *given)
{
    const struct pose *before = pose_log_newest(log);
    if (before && given->t_ns <= before->t_ns) {
        log->refused++;
        return false;
    }
    for (unsigned i = 0; i < 4; i++)
        if (given->has & (1u << i))
            log->t_part_ns[i] = given->t_ns;
    struct pose p = pose_identity;
    p.t_ns = given->t_ns;
    p.has = fresh_parts(log, given->t_ns);
    const struct pose *attitude = (given->has & POSE_ATTITUDE) || !before ? given : before;
    const struct pose *velocity = (given->has & POSE_VELOCITY) || !before ? given : before;
    memcpy(p.attitude, attitude->attitude, sizeof p.attitude);
    memcpy(p.velocity_mps, velocity->velocity_mps, sizeof p.velocity_mps);
    if (before)
        move(&p, before, given);
    else
        memcpy(p.position_m, given->position_m, sizeof p.position_m);
    if (log->n == POSE_LOG_SAMPLES) {
        log->first = (log->first + 1) % POSE_LOG_SAMPLES;
        log->n--;
    }
    log->sample[(log->first + log->n) % POSE_LOG_SAMPLES] = p;
    log->n++;
    log->taken++;
    return true;
}

bool pose_log_at(const struct pose_log *log, uint64_t t_ns, struct pose *out)
{
    *out = pose_identity;
    out->t_ns = t_ns;
    uint32_t lo = 0, hi = log->n; /* samples before lo are at or before t_ns */
    while (lo < hi) {
        uint32_t mid = lo + (hi - lo) / 2;
        if (at(log, mid)->t_ns <= t_ns)
            lo = mid + 1;
        else
            hi = mid;
    }
    if (lo == 0)
        return false;
    const struct pose *a = at(log, lo - 1);
    if (lo < log->n && at(log, lo)->t_ns - a->t_ns <= log->max_age_ns) {
        pose_between(a, at(log, lo), t_ns, out);
        return true;
    }
    if (t_ns - a->t_ns > log->max_age_ns)
        return false;
    *out = *a;
    return true;
}

bool pose_log_fresh(const struct pose_log *log, uint64_t now_ns)
{
    const struct pose *p = pose_log_newest(log);
    return p && (p->has & POSE_ATTITUDE) && log->t_part_ns[0] &&
           (now_ns <= log->t_part_ns[0] || now_ns - log->t_part_ns[0] <= log->max_age_ns);
}
