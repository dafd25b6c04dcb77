/* SPDX-License-Identifier: MIT */
#include "drift_log.h"

#include <math.h>
#include <string.h>

static const struct drift_log_mark *at(const struct drift_log *log, uint32_t i)
{
    static const struct drift_log_mark start = {0};
    return log->n ? &log->mark[(log->first + i) % DRIFT_LOG_BOUNDS] : &start;
}

static const struct drift_log_mark *newest(const struct drift_log *log)
{
    return at(log, log->n - 1);
}

static double seconds(uint64_t from_ns, uint64_t to_ns)
{
    return to_ns > from_ns ? (double)(to_ns - from_ns) * 1e-9 : 0;
}

static uint64_t later(uint64_t a_ns, uint64_t b_ns)
{
    return a_ns > b_ns ? a_ns : b_ns;
}

/* Behind the newest mark: as fast as `mps` while that holds, and then as the configuration says. */
static void go_on(const struct drift_log *log, uint64_t t_ns, const double mps[DRIFT_WAYS], double m[DRIFT_WAYS])
{
    const struct drift_log_mark *from = newest(log);
    const uint64_t from_ns = log->set.from_pose ? later(from->t_ns, log->t_first_ns) : from->t_ns;
    const double gone_s = log->set.from_pose && !log->t_first_ns ? 0 : seconds(from_ns, t_ns);
    const double bounded_s = mps ? fmin(gone_s, DRIFT_LOG_LATE_NS * 1e-9) : 0;
    for (int k = 0; k < DRIFT_WAYS; k++)
        m[k] = from->m[k] + (mps ? mps[k] : 0) * bounded_s + log->set.mps * (gone_s - bounded_s);
}

static void put(struct drift_log *log, uint64_t t_ns, const double m[DRIFT_WAYS])
{
    if (log->n == DRIFT_LOG_BOUNDS) {
        log->first = (log->first + 1) % DRIFT_LOG_BOUNDS;
        log->n--;
    }
    struct drift_log_mark *mark = &log->mark[(log->first + log->n++) % DRIFT_LOG_BOUNDS];
    mark->t_ns = t_ns;
    memcpy(mark->m, m, sizeof mark->m);
}

void drift_log_at(const struct drift_log *log, uint64_t t_ns, double m[DRIFT_WAYS])
{
    const uint64_t then_ns = log->set.from_pose ? later(t_ns, log->t_first_ns) : t_ns;
    const struct drift_log_mark *first = at(log, 0);
    if ((log->set.from_pose && !log->t_first_ns) || then_ns >= newest(log)->t_ns) {
        go_on(log, then_ns, log->goes_on ? log->mps : NULL, m);
        return;
    }
    if (then_ns < first->t_ns) {
        for (int k = 0; k < DRIFT_WAYS; k++)
            m[k] = first->m[k] - fmax(log->set.mps, log->mps_before) * seconds(then_ns, first->t_ns);
        return;
    }
    uint32_t lo = 0, hi = log->n - 1; /* mark lo is not after it, hi is */
    while (hi - lo > 1) {
        const uint32_t mid = lo + (hi - lo) / 2;
        if (at(log, mid)->t_ns <= then_ns)
            lo = mid;
        else
            hi = mid;
    }
    const struct drift_log_mark *a = at(log, lo), *b = at(log, hi);
    const double share = seconds(a->t_ns, then_ns) / seconds(a->t_ns, b->t_ns);
    for (int k = 0; k < DRIFT_WAYS; k++)
        m[k] = a->m[k] + (b->m[k] - a->m[k]) * share;
}

static void restart(struct drift_log *log, uint64_t now_ns, const double m[DRIFT_WAYS])
{
    log->n = 0;
    log->goes_on = false;
    put(log, now_ns, m);
}

/*
 * A ping that is dated back may be from before the drift was set, by a start or a reload under way: by then the vehicle
 * had drifted as much less, below 0 even, for it has moved since. So the marks of before are left.
 */
void drift_log_set(struct drift_log *log, uint64_t now_ns, const struct pose_drift *drift)
{
    double m[DRIFT_WAYS];
    drift_log_at(log, now_ns, m);
    log->mps_before = log->set.mps;
    log->set = *drift;
    restart(log, now_ns, m);
}

void drift_log_begin(struct drift_log *log, uint64_t t_ns)
{
    log->t_first_ns = t_ns;
}

void drift_log_withdraw(struct drift_log *log, uint64_t now_ns, const double m[DRIFT_WAYS])
{
    log->t_first_ns = log->t_bound_ns = 0;
    restart(log, now_ns, m);
}

/* Where the newest mark's bound ended before t_ns: what came then, as fast as the configuration says, is not spread
 * over the time that it covered, nor does that make the rest any slower. */
static void put_end(struct drift_log *log, uint64_t t_ns, const double mps[DRIFT_WAYS])
{
    const uint64_t from_ns = log->set.from_pose ? later(newest(log)->t_ns, log->t_first_ns) : newest(log)->t_ns;
    const uint64_t end_ns = from_ns + DRIFT_LOG_LATE_NS;
    double m[DRIFT_WAYS];
    if (!log->goes_on || end_ns >= t_ns)
        return;
    go_on(log, end_ns, mps, m);
    put(log, end_ns, m);
}

bool drift_log_bound(struct drift_log *log, uint64_t t_ns, const double mps[DRIFT_WAYS])
{
    double next[DRIFT_WAYS], counted[DRIFT_WAYS], m[DRIFT_WAYS];
    if (t_ns <= log->t_bound_ns || t_ns <= newest(log)->t_ns)
        return false;
    log->t_bound_ns = t_ns;
    memcpy(log->said_mps, mps, sizeof log->said_mps);
    if (!log->set.bounded)
        return true;
    for (int k = 0; k < DRIFT_WAYS; k++) {
        next[k] = fmin(mps[k] + log->set.water_mps, log->set.mps);
        /* no less than pings since then were told, or what they saw would count as newer than it is */
        counted[k] = log->goes_on ? fmax(next[k], log->mps[k]) : log->set.mps;
    }
    go_on(log, t_ns, counted, m);
    put_end(log, t_ns, counted);
    put(log, t_ns, m);
    memcpy(log->mps, next, sizeof next);
    log->goes_on = true;
    return true;
}

double drift_log_uncertain_m(const struct drift_log *log, uint64_t t_ns)
{
    const double late_s = seconds(newest(log)->t_ns, t_ns);
    if (!log->goes_on)
        return 0;
    const double bounded_s = fmin(late_s, DRIFT_LOG_LATE_NS * 1e-9);
    const double slower_mps = fmin(log->mps[DRIFT_LEVEL], log->mps[DRIFT_VERTICAL]);
    return fmin(DRIFT_LOG_MPS2 * bounded_s / 2, fmax(log->set.mps - slower_mps, 0)) * bounded_s;
}

/* Drift does not count what the vehicle did before it had a pose: of then nothing is known. */
void drift_log_gone(const struct drift_log *log, uint64_t from_ns, uint64_t to_ns, double m[DRIFT_WAYS])
{
    const bool known = log->goes_on && (!log->set.from_pose || from_ns >= log->t_first_ns);
    const double uncertain_m = drift_log_uncertain_m(log, to_ns);
    double from_m[DRIFT_WAYS], to_m[DRIFT_WAYS];
    drift_log_at(log, from_ns, from_m);
    drift_log_at(log, to_ns, to_m);
    for (int k = 0; k < DRIFT_WAYS; k++)
        m[k] = known ? to_m[k] - from_m[k] + uncertain_m : INFINITY;
}

bool drift_log_comes(const struct drift_log *log, uint64_t now_ns)
{
    return log->t_bound_ns && seconds(log->t_bound_ns, now_ns) <= DRIFT_LOG_COMES_S;
}

bool drift_log_in_use(const struct drift_log *log, uint64_t now_ns)
{
    return log->goes_on && seconds(newest(log)->t_ns, now_ns) <= DRIFT_LOG_LATE_NS * 1e-9;
}
