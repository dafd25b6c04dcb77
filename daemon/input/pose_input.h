/* SPDX-License-Identifier: MIT */
/*
 * pose_input - what the daemon's own pose sources (depth, nmea) say, put into the pose log and recorded as the `pose`
 * method would be, so that a replay knows the same. Knows no source.
 */
#ifndef SONARD_POSE_INPUT_H
#define SONARD_POSE_INPUT_H

#include <stdbool.h>
#include <stdint.h>

#include "core/loop.h"
#include "pose_log.h"
#include "daemon/record/record.h"

struct pose_input {
    struct loop *loop;
    struct pose_log *poses;
    struct record *record; /* NULL: nothing is recorded */
    int channel;           /* /pose of record */
    uint64_t unix_offset_ns;
    uint64_t t_attitude_ns;                            /* when a client last gave a whole attitude; 0: never */
    uint64_t heading_not_used;                         /* because of that */
    void (*taken)(void *ctx, const struct pose *pose); /* by the log */
    void *ctx;
};

/**
 * pose_input_told - t_ns, monotonic, as the message of a capture has it: in seconds of Unix time, *t_unix, and so to a
 * fifth of a microsecond. That is the time of the pose live, too, or a replay's would be another.
 */
uint64_t pose_input_told(uint64_t t_ns, uint64_t unix_offset_ns, double *t_unix);

/** pose_input_depth - the vehicle's reference point is depth_m below the surface at t_ns. False: refused by the log. */
bool pose_input_depth(struct pose_input *in, uint64_t t_ns, double depth_m);

/** pose_input_altitude - the bottom is altitude_m, > 0, below the vehicle at t_ns. False: refused by the log. */
bool pose_input_altitude(struct pose_input *in, uint64_t t_ns, double altitude_m);

/**
 * pose_input_heading - true heading at t_ns. It stands for an attitude of no roll and no pitch, so it is used only
 * while no client gives a whole attitude (none for max_age), whose yaw is as good and whose roll and pitch are real.
 * False: not used, counted, or refused by the log.
 */
bool pose_input_heading(struct pose_input *in, uint64_t t_ns, double heading_rad);

#endif
