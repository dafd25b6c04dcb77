/* SPDX-License-Identifier: MIT */
/*
 * can_rig.h - a device that listens to CAN frames, on a simulated clock: frames are given as candump writes them,
 * pings and notes are kept.
 */
#ifndef SONARD_CAN_RIG_H
#define SONARD_CAN_RIG_H

#include "core/fault.h"
#include "drivers/capture/candump.h"
#include "drivers/devices/device.h"
#include "test.h"

#define RIG_MS 1000000ull

static struct can_rig {
    const struct device_ops *ops;
    _Alignas(max_align_t) uint8_t state[1 << 15];
    struct device_io io;
    struct device_conf conf;
    uint64_t now_ns;
    unsigned pings, unheard, warnings; /* unheard: pings that cannot tell, not counted as pings */
    struct ping ping;
    struct ping_beam beam;
    uint8_t samples[16];
    char note[256];
    double range_m[4096]; /* of every ping */
    struct fault fault;
} rig;

static struct ping *rig_begin(void *ctx)
{
    (void)ctx;
    rig.ping = (struct ping){.beam = &rig.beam, .samples = rig.samples, .max_beams = 1, .max_samples = 1};
    return &rig.ping;
}

static void rig_done(void *ctx, struct ping *ping)
{
    (void)ctx;
    if (ping->flags & PING_UNHEARD)
        rig.unheard++;
    else
        rig.range_m[rig.pings++ % 4096] = (double)ping->beam[0].range_m;
}

static __attribute__((format(printf, 3, 4))) void rig_note(void *ctx, enum device_note level, const char *fmt, ...)
{
    va_list args;
    (void)ctx;
    va_start(args, fmt);
    vsnprintf(rig.note, sizeof rig.note, fmt, args);
    va_end(args);
    rig.warnings += level == NOTE_WARNING;
}

/* false with rig.fault: the configuration is refused */
static bool rig_open(const struct device_ops *ops, int node, int sensor_id)
{
    memset(&rig, 0, sizeof rig);
    rig.ops = ops;
    rig.now_ns = 10000 * RIG_MS;
    rig.io = (struct device_io){.ping_begin = rig_begin, .ping_done = rig_done, .note = rig_note};
    rig.conf = (struct device_conf){
        .range_m = 50, .sound_speed_mps = 1500, .gain = -1, .node = node, .sensor_id = sensor_id};
    CHECK(ops->state_size <= sizeof rig.state);
    if (!ops->init(rig.state, &rig.conf, &rig.fault))
        return false;
    ops->opened(rig.state, rig.now_ns, &rig.io);
    return true;
}

/* "10041A2A#0102", 1 ms after what came before */
static inline void rig_hear(const char *frame)
{
    char line[256];
    struct candump_frame f;
    int n = snprintf(line, sizeof line, "(1.000000) can0 %s", frame);
    CHECK(candump_line(line, (size_t)n, &f));
    rig.now_ns += RIG_MS;
    rig.ops->feed(rig.state, (const uint8_t *)&f.frame, f.n, rig.now_ns, &rig.io);
}

static inline void rig_wait(uint64_t ms)
{
    rig.now_ns += ms * RIG_MS;
    if (rig.ops->deadline(rig.state) <= rig.now_ns)
        rig.ops->tick(rig.state, rig.now_ns, &rig.io);
}

static struct device_status rig_status(void)
{
    struct device_status status;
    rig.ops->status(rig.state, &status);
    return status;
}

#endif
