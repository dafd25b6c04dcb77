/* SPDX-License-Identifier: MIT */
/*
 * pose_log - where the vehicle was, for the last seconds: takes pose samples in order of time, gives each ping the
 * pose at its own time, and says how old the newest is. Fixed size; one owner (the loop).
 *
 * A sample may carry only some parts (a depth sensor knows no attitude). Parts not given go on from the sample before
 * while that one is fresh; a position that nobody gives is carried along by the velocity.
 */
#ifndef SONARD_POSE_LOG_H
#define SONARD_POSE_LOG_H

#include <stdbool.h>
#include <stdint.h>

#include "../grid/geometry.h"

#define POSE_LOG_SAMPLES 256

struct pose_log {
    uint64_t max_age_ns;
    struct pose sample[POSE_LOG_SAMPLES]; /* a ring in order of time */
    uint32_t first, n;
    uint64_t t_part_ns[4]; /* when each part (bit of enum pose_part) was last given */
    uint64_t taken, refused;
};

void pose_log_init(struct pose_log *log, uint64_t max_age_ns);

/**
 * pose_log_put - a sample; `given` holds the parts in given->has (attitude normalised by the caller).
 * False, counted: not newer than the newest sample.
 */
bool pose_log_put(struct pose_log *log, const struct pose *given);

/**
 * pose_log_at - the pose at t_ns: between the two samples around it when they are at most max_age apart, or the last
 * one before it while that is fresh. False with *out the identity (has = 0) when there is none.
 */
bool pose_log_at(const struct pose_log *log, uint64_t t_ns, struct pose *out);

/** pose_log_newest - NULL when there is none. */
const struct pose *pose_log_newest(const struct pose_log *log);

/** pose_log_fresh - is the newest attitude at most max_age old at now_ns? */
bool pose_log_fresh(const struct pose_log *log, uint64_t now_ns);

#endif
