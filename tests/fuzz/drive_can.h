/* SPDX-License-Identifier: MIT */
/*
 * drive_can - a device that listens to a CAN bus under any frames, while time passes: every ping is sound, nothing is
 * ever sent, and its counters add up. The input is records of 16 or 72 bytes; a byte before each is its kind and how
 * long it was waited for.
 */
#ifndef SONARD_FUZZ_DRIVE_CAN_H
#define SONARD_FUZZ_DRIVE_CAN_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "drivers/devices/device.h"

static volatile double drive_sink;
static uint64_t drive_now_ns, drive_pings;
static struct ping drive_ping;
static struct ping_beam drive_beam;
static uint8_t drive_samples[4];

static void must(bool fact)
{
    if (!fact)
        abort();
}

static struct ping *drive_begin(void *ctx)
{
    (void)ctx;
    drive_ping = (struct ping){.beam = &drive_beam, .samples = drive_samples, .max_beams = 1, .max_samples = 1};
    return &drive_ping;
}

static void drive_done(void *ctx, struct ping *p)
{
    (void)ctx;
    drive_pings++;
    must(p == &drive_ping && p->kind == PING_RANGES && p->n_beams == 1 && p->n_bins == 1);
    must(p->t_ns <= p->t_in_ns && p->t_in_ns <= drive_now_ns);
    must(isfinite(p->beam[0].range_m) && p->beam[0].range_m >= 0.0f && p->beam[0].range_sd_m > 0.0f);
    must(p->az_aperture_rad > 0.0f && (double)p->az_aperture_rad < GEO_PI && p->dr_m > 0.0f);
    drive_sink = drive_sink + (double)p->beam[0].range_m;
}

static void drive_note(void *ctx, enum device_note level, const char *fmt, ...)
{
    (void)ctx, (void)level;
    must(fmt != NULL);
}

static void drive_can(const struct device_ops *ops, const struct device_conf *conf, const uint8_t *data,
                      size_t size)
{
    static _Alignas(max_align_t) uint8_t state[1 << 15];
    const struct device_io io = {.ping_begin = drive_begin, .ping_done = drive_done, .note = drive_note};
    struct device_status status;
    struct fault fault;

    memset(state, 0, sizeof state);
    must(ops->state_size <= sizeof state && ops->init(state, conf, &fault));
    drive_now_ns = drive_pings = 0;
    ops->opened(state, drive_now_ns, &io);
    for (size_t at = 0; at < size;) {
        uint8_t head = data[at++];
        size_t n = head & 1 ? CANFD_MTU : CAN_MTU;
        n = n < size - at ? n : size - at;
        drive_now_ns += (uint64_t)(head >> 1) * 20000000u;
        if (ops->deadline(state) <= drive_now_ns)
            ops->tick(state, drive_now_ns, &io);
        must(ops->deadline(state) > drive_now_ns);
        ops->feed(state, data + at, n, drive_now_ns, &io);
        at += n;
    }
    ops->stop(state, drive_now_ns, &io);
    must(ops->deadline(state) == UINT64_MAX);
    ops->status(state, &status);
    must(status.pings == drive_pings && status.pings <= status.frames);
    must(memchr(status.what, 0, sizeof status.what) != NULL);
}

#endif
