/* SPDX-License-Identifier: MIT */
/*
 * fuzz_imagenex - any bytes from the line, cut anywhere, while time passes: every ping is sound, everything sent is
 * switch data, counters add up, and a deadline never stands still. Four bytes of the input choose the configuration
 * and the cuts, the rest is the line.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "drivers/devices/device.h"
#include "drivers/devices/imagenex_frame.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#define MS 1000000ull

static volatile double sink;
static uint64_t now_ns, pings, asked;
static struct ping ping;
static struct ping_beam beam;
static uint8_t samples[500];

static void must(bool fact)
{
    if (!fact)
        abort();
}

static void check_sent(void *ctx, const uint8_t *bytes, size_t n)
{
    struct imagenex_switch s;
    (void)ctx;
    must(n == IMAGENEX_SWITCH_BYTES && imagenex_decode_switch(bytes, &s));
    must(s.range_m > 0 && s.range_m <= 100 && s.train <= 120 && s.sector <= 120 && s.step <= 8);
    must(memchr(bytes, 0xfd, n) == bytes + n - 1);
}

static void check_break(void *ctx, bool on)
{
    (void)ctx, (void)on;
    abort();
}

static struct ping *begin_ping(void *ctx)
{
    (void)ctx;
    if (++asked % 7 == 0)
        return NULL;
    ping = (struct ping){.beam = &beam, .samples = samples, .max_beams = 1, .max_samples = sizeof samples};
    return &ping;
}

static void check_ping(void *ctx, struct ping *p)
{
    (void)ctx;
    pings++;
    must(p == &ping && p->n_beams == 1 && p->n_bins > 0 && ping_bytes(p) <= sizeof samples);
    must(p->t_ns <= p->t_in_ns && p->t_in_ns <= now_ns);
    must(p->head_turn == 0 || p->head_units < p->head_turn);
    must(isfinite(p->dr_m) && p->dr_m > 0.0f && isfinite(p->pulse_m) && p->pulse_m >= 0.0f);
    must(p->beam[0].az_rad >= 0.0f && p->beam[0].az_rad < (float)GEO_TURN);
    must(isfinite(p->beam[0].range_m) && p->beam[0].range_m >= 0.0f);
    for (size_t i = 0; i < ping_bytes(p); i++)
        sink = sink + samples[i];
}

static void take_note(void *ctx, enum device_note level, const char *fmt, ...)
{
    char text[400];
    va_list args;
    (void)ctx, (void)level;
    va_start(args, fmt);
    const int n = vsnprintf(text, sizeof text, fmt, args);
    va_end(args);
    must(n > 0 && n < DEVICE_NOTE_MAX);
}

static struct device_conf choose_conf(const uint8_t *b)
{
    static const unsigned bauds[] = {0, 9600, 115200, 4000000};
    return (struct device_conf){
        .range_m = 1 + b[0] % 50,
        .sound_speed_mps = 1500.0,
        .gain = -1,
        .sector_start_rad = (b[1] & 15) - 8,
        .sector_end_rad = (b[1] >> 4) - 8,
        .step_rad = (b[2] >> 4) / 400.0,
        .listen_only = (b[2] & 6) == 6,
        .baud = bauds[b[3] & 3],
    };
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const struct device_io io = {NULL, check_sent, check_break, begin_ping, check_ping, take_note};
    struct device_status status;
    struct fault fault;
    if (size < 4)
        return 0;
    const struct device_ops *ops = data[2] & 1 ? &device_imagenex881a : &device_imagenex852;
    const struct device_conf conf = choose_conf(data);
    uint32_t cuts = (uint32_t)data[3] * 2654435761u + data[2];
    void *state = calloc(1, ops->state_size);
    must(state && ops->init(state, &conf, &fault));
    now_ns = 5 * MS;
    pings = asked = 0;
    ops->opened(state, now_ns, &io);
    for (size_t at = 4; at < size;) {
        cuts = cuts * 1664525u + 1013904223u;
        size_t n = 1 + (cuts >> 16) % 97;
        n = n < size - at ? n : size - at;
        now_ns += (cuts >> 8) % 64 == 0 ? 5000 * MS : (cuts >> 24) * MS / 8;
        if (ops->deadline(state) <= now_ns) {
            ops->tick(state, now_ns, &io);
            must(ops->deadline(state) > now_ns);
        }
        ops->feed(state, data + at, n, now_ns, &io);
        at += n;
        if ((cuts >> 12) % 128 == 0) {
            ops->closed(state, now_ns);
            ops->opened(state, now_ns, &io);
        }
    }
    ops->stop(state, now_ns, &io);
    must(ops->deadline(state) == UINT64_MAX);
    ops->closed(state, now_ns);
    ops->status(state, &status);
    must(status.pings >= pings && status.garbage_bytes + IMAGENEX_OVERHEAD * status.frames <= size - 4);
    free(state);
    return 0;
}
