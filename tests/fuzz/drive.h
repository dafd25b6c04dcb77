/* SPDX-License-Identifier: MIT */
/*
 * drive - a device of the Ping protocol under any bytes, cut anywhere, while time passes: what it sends are whole
 * frames, its pings are sound, its notes printable, its counters add up, and a deadline never stands still.
 */
#ifndef SONARD_FUZZ_DRIVE_H
#define SONARD_FUZZ_DRIVE_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "drivers/devices/device.h"
#include "drivers/devices/ping_frame.h"
#include "grid/range/choice.h"

#define MS 1000000ull

static uint64_t drive_now_ns, drive_pings, drive_asked;
static struct ping drive_ping;
static struct ping_beam drive_beam[PING_MAX_BEAMS];
static uint8_t drive_samples[PING_PAYLOAD_MAX];
static volatile double drive_sink;

static void must(bool fact)
{
    if (!fact)
        abort();
}

static void drive_sent(void *ctx, const uint8_t *bytes, size_t n)
{
    struct ping_parser *parser = ctx;
    struct ping_frame frame;
    ping_parser_init(parser, PING_PAYLOAD_MAX);
    must(ping_parser_next(parser, &bytes, &n, drive_now_ns, &frame) && n == 0);
}

static void drive_break(void *ctx, bool on)
{
    (void)ctx;
    (void)on;
    abort(); /* none of these devices wants one */
}

static struct ping *drive_begin(void *ctx)
{
    (void)ctx;
    if (++drive_asked % 7 == 0)
        return NULL;
    drive_ping = (struct ping){.beam = drive_beam,
                               .max_beams = drive_asked % 5 ? PING_MAX_BEAMS : 1,
                               .samples = drive_samples,
                               .max_samples = drive_asked % 3 ? sizeof drive_samples : 100};
    return &drive_ping;
}

/* A range that was chosen in samples comes with them; ready ones come alone. */
static void drive_judge(const struct ping *p)
{
    const struct choice_ring ring = {.promised_m = -1.0};
    struct choice choice;
    must(p->kind == PING_RANGES || p->kind == PING_CHOICE);
    must(ping_bytes(p) <= p->max_samples && (ping_bytes(p) == 0) == (p->kind == PING_RANGES));
    if (p->kind == PING_RANGES) {
        must(p->n_bins == 1);
        return;
    }
    choice_judge(p, 0, (double)p->beam[0].range_m, &ring, &choice);
    must(choice.to_m >= 0.0 && choice.to_m <= (double)p->r0_m + p->n_bins * (double)p->dr_m);
}

static void drive_done(void *ctx, struct ping *p)
{
    (void)ctx;
    drive_pings++;
    must(p == &drive_ping && p->n_beams >= 1 && p->n_beams <= p->max_beams);
    must(p->t_ns <= p->t_in_ns && p->t_in_ns <= drive_now_ns);
    must(p->r0_m >= 0.0f && p->dr_m > 0.0f && p->r0_m + (float)p->n_bins * p->dr_m < 2000.0f);
    drive_judge(p);
    must(p->pulse_m >= 0.0f && p->az_aperture_rad > 0.0f && p->el_aperture_rad > 0.0f);
    for (uint16_t i = 0; i < p->n_beams; i++) {
        must(p->beam[i].range_m >= 0.0f && p->beam[i].range_m < 2000.0f && p->beam[i].range_sd_m > 0.0f);
        must(fabsf(p->beam[i].az_rad) <= (float)GEO_PI && p->beam[i].el_rad == 0.0f);
        must(p->beam[i].confidence >= 0.0f && p->beam[i].confidence <= 1.0f);
        drive_sink = (double)p->beam[i].range_m;
    }
}

static void drive_note(void *ctx, enum device_note level, const char *fmt, ...)
{
    char text[400];
    va_list args;
    (void)ctx, (void)level;
    va_start(args, fmt);
    int n = vsnprintf(text, sizeof text, fmt, args);
    va_end(args);
    must(n > 0 && n < DEVICE_NOTE_MAX);
    for (int i = 0; i < n; i++)
        must(text[i] >= ' ' && text[i] <= '~');
}

static void drive_tick(const struct device_ops *ops, void *state, const struct device_io *io)
{
    if (ops->deadline(state) <= drive_now_ns)
        ops->tick(state, drive_now_ns, io);
    must(ops->deadline(state) > drive_now_ns);
}

/* size bytes of a line, cut by `cuts`. */
static void drive(const struct device_ops *ops, const struct device_conf *conf, uint32_t cuts, const uint8_t *data,
                  size_t size)
{
    static struct ping_parser sent;
    const struct device_io io = {&sent, drive_sent, drive_break, drive_begin, drive_done, drive_note};
    struct device_status status;
    struct fault fault;
    void *state = calloc(1, ops->state_size);
    must(state && ops->init(state, conf, &fault));
    drive_now_ns = 5 * MS;
    drive_pings = drive_asked = 0;
    ops->opened(state, drive_now_ns, &io);
    for (size_t at = 0, n; at < size; at += n) {
        cuts = cuts * 1664525u + 1013904223u;
        n = 1 + (cuts >> 16) % 997;
        n = n < size - at ? n : size - at;
        drive_now_ns += (cuts >> 8) % 64 == 0 ? 5000 * MS : (cuts >> 24) * MS / 8;
        drive_tick(ops, state, &io);
        ops->feed(state, data + at, n, drive_now_ns, &io);
        if ((cuts >> 12) % 128 == 0) {
            ops->closed(state, drive_now_ns);
            ops->opened(state, drive_now_ns, &io);
        }
    }
    ops->stop(state, drive_now_ns, &io);
    for (int i = 0; i < 10 && ops->deadline(state) != UINT64_MAX; i++) {
        drive_now_ns = ops->deadline(state);
        ops->tick(state, drive_now_ns, &io);
    }
    must(ops->deadline(state) == UINT64_MAX);
    ops->closed(state, drive_now_ns);
    ops->status(state, &status);
    must(status.pings >= drive_pings && status.garbage_bytes + PING_OVERHEAD * status.frames <= size);
    must(memchr(status.what, 0, sizeof status.what) != NULL);
    free(state);
}

#endif
