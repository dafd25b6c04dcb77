/* SPDX-License-Identifier: MIT */
/*
 * source - one configured sensor: its port (input_port.h) and its device, tied to the loop. Records the bytes, gives
 * each ping its pose and hands it to the pipeline.
 *
 * In a replay it has no port and no deadline: the capture's bytes are fed to it, and what else its device was told is
 * told again (source_event.h). A capture that keeps none of that, of an earlier version or an import, has the bytes
 * alone: the device listens then, asks nothing, never times out, and its sonar is never offline.
 */
#ifndef SONARD_SOURCE_H
#define SONARD_SOURCE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "config/conf.h"
#include "core/fault.h"
#include "drivers/devices/device.h"
#include "drivers/ports/port.h"
#include "core/log.h"
#include "core/loop.h"
#include "core/worker.h"
#include "daemon/pipeline/pipeline.h"
#include "pose_log.h"
#include "daemon/record/record.h"
#include "serial_mirror.h"
#include "source_event.h"

struct source;

/* Everything that a source needs of the daemon; lives longer than the source. */
struct source_env {
    struct loop *loop;
    struct worker *worker; /* looks up names of hosts */
    struct pipeline *pipeline;
    const struct pose_log *poses;
    struct record *record; /* NULL: nothing is recorded */
    bool replay;           /* no port, see above */
    uint64_t told;         /* sonars of the capture that it keeps the events of */
    uint64_t steered;      /* sonars that source_steer will tell where to look */
    uint64_t no_line;      /* sonars whose bytes did not come over their port's line, whatever its baud rate */
    /* when the ping was transmitted: ping->t_ns, or what somebody knows better */
    uint64_t (*ping_time)(void *ctx, const struct source *source, const struct ping *ping);
    /* called in the loop for each ping before it is submitted */
    void (*on_ping)(void *ctx, struct source *source, const struct ping *ping);
    void *ctx;
};

struct source_stats {
    struct device_status device;
    bool open; /* in a replay as the capture tells; with device.state, of which it may keep nothing: env.told */
    uint64_t bytes_in, bytes_out, bytes_not_sent;
    uint64_t reconnects;
    uint64_t undated_pings; /* received while the process was stalled, at an unknown time */
    struct serial_mirror_status tap;
    uint64_t port_lost, port_refused, port_strangers; /* see struct port */
    struct port_bus bus;
    bool mostly_garbage;     /* on the line lately: wrong baud rate, or another device? */
    struct fault port_error; /* why the port is not open; empty otherwise */
};

/** source_new - NULL with a sentence in fault. Nothing is opened. */
struct source *source_new(const struct source_env *env, const struct conf_sonar *conf,
                          const struct conf_water *water, uint16_t index, struct fault *fault);

/** source_delay - of a sonar's readings: as configured, or as its device says. */
struct device_delay source_delay(const struct conf_sonar *conf, const struct device_ops *ops);

/** source_check - would source_new make one of it? Else false with a sentence in fault that begins with a key. */
bool source_check(const struct conf_sonar *conf, const struct conf_water *water, struct fault *fault);

void source_start(struct source *s); /* first try to open */
/** source_steer - look there more often, or there alone (as device_ops.steer); for sonars that are steered. */
void source_steer(struct source *s, double from_rad, double to_rad, bool only);

/** source_retune - tell it range, gain and mode of *conf, which source_check approves; of a device that can be told
 * (device_ops.retune). */
void source_retune(struct source *s, const struct conf_sonar *conf, const struct conf_water *water);

/** source_feed - replay: bytes as they were read, and when they had come. */
void source_feed(struct source *s, const uint8_t *bytes, size_t n, const struct record_time *came);
/** source_befell - replay: what happened at t_ns. Of a capture that keeps events. */
void source_befell(struct source *s, const struct source_event *event, uint64_t t_ns);
void source_stop(struct source *s);          /* ask the hardware to be quiet */
bool source_stopped(const struct source *s); /* it is, or cannot be asked */
void source_free(struct source *s);

const char *source_name(const struct source *s);
uint16_t source_index(const struct source *s);
void source_stats(const struct source *s, struct source_stats *out);

#endif
