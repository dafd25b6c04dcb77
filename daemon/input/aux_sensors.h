/* SPDX-License-Identifier: MIT */
/*
 * aux_sensors - what is on the vehicle beside the sonars: depth over Modbus, NMEA 0183, and the lines of GPIO chips.
 * Makes and ends those that the configuration names. A replay opens none: the poses and the
 * edges of triggers come from the capture.
 */
#ifndef SONARD_AUX_SENSORS_H
#define SONARD_AUX_SENSORS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "config/conf.h"
#include "core/fault.h"
#include "core/loop.h"
#include "daemon/record/record.h"
#include "depth.h"
#include "leak.h"
#include "nmea.h"
#include "pose_input.h"
#include "power.h"
#include "source.h"
#include "trigger.h"

/* What they need; all of it outlives them. */
struct aux_sensors_env {
    struct loop *loop;
    struct worker *worker; /* looks up names of hosts */
    const struct conf *conf;
    struct pose_log *poses;
    struct record *record;        /* NULL: not recording */
    int pose_channel;             /* of record */
    struct source *const *source; /* [conf->n_sonars] */
    uint64_t unix_offset_ns;
    bool replay;
    void (*pose_taken)(void *ctx, const struct pose *pose); /* one of theirs, by the log */
    void (*leak_changed)(void *ctx);
    void *ctx; /* of both */
};

/* Zeroed at first. */
struct aux_sensors {
    struct aux_sensors_env env;
    struct pose_input pose_input;
    struct depth *depth; /* NULL: none */
    struct nmea *nmea;   /* NULL: none */
    struct leak leak;
    struct power power[CONF_MAX_SONARS];
    struct trigger trigger[CONF_MAX_SONARS];
    int trigger_channel[CONF_MAX_SONARS];
};

/** aux_sensors_make - all that is configured. False with a sentence in fault. */
bool aux_sensors_make(struct aux_sensors *a, const struct aux_sensors_env *env, struct fault *fault);

/** aux_sensors_start - open and ask. False with a sentence in fault. */
bool aux_sensors_start(struct aux_sensors *a, struct fault *fault);

/** aux_sensors_end - also after aux_sensors_make has failed, or was never called. */
void aux_sensors_end(struct aux_sensors *a);

/** aux_sensors_feed - a replay's message that is none of a sonar and no pose; false: not for an auxiliary sensor. */
bool aux_sensors_feed(struct aux_sensors *a, const char *topic, const void *data, size_t size);

#endif
