/* SPDX-License-Identifier: MIT */
/*
 * fuzz_echolist - any bytes from the line, cut anywhere: every ping is sound, nothing is sent, counters add up. Two
 * bytes of the input choose the configuration and the cuts, the rest is the line.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "drivers/devices/device.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#define MS        1000000ull
#define BEAMS_MAX 16

static uint64_t now_ns, pings, asked;
static struct ping ping;
static struct ping_beam beams[BEAMS_MAX];
static uint16_t room;

static void must(bool fact)
{
    if (!fact)
        abort();
}

static void no_send(void *ctx, const uint8_t *bytes, size_t n)
{
    (void)ctx, (void)bytes, (void)n;
    abort();
}

static void no_break(void *ctx, bool on)
{
    (void)ctx, (void)on;
    abort();
}

static struct ping *begin_ping(void *ctx)
{
    (void)ctx;
    if (++asked % 7 == 0)
        return NULL;
    ping = (struct ping){.beam = beams, .max_beams = room};
    return &ping;
}

static void check_ping(void *ctx, struct ping *p)
{
    (void)ctx;
    pings++;
    must(p == &ping && p->n_beams >= 1 && p->n_beams <= room && ping_bytes(p) == 0);
    must(p->t_ns <= p->t_in_ns && p->t_in_ns <= now_ns && p->head_units < p->head_turn);
    for (uint16_t b = 0; b < p->n_beams; b++) {
        const struct ping_beam *beam = &p->beam[b];
        must(beam->az_rad >= 0.0f && beam->az_rad <= (float)GEO_TURN && fabsf(beam->el_rad) <= (float)GEO_PI);
        must(beam->az_rad == p->beam[0].az_rad && beam->el_rad == p->beam[0].el_rad);
        must(beam->range_m >= 0.0f && beam->range_m <= p->dr_m && beam->confidence >= 0.0f);
        must(beam->confidence <= 1.0f && (b == 0 || beam->range_m >= p->beam[b - 1].range_m));
    }
}

static void take_note(void *ctx, enum device_note level, const char *fmt, ...)
{
    (void)ctx, (void)level;
    must(strlen(fmt) < 200);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const struct device_ops *ops = &device_echolist;
    const struct device_io io = {NULL, no_send, no_break, begin_ping, check_ping, take_note};
    struct device_status status;
    struct fault fault;
    if (size < 2)
        return 0;
    const struct device_conf conf = {.range_m = 1 + data[0] % 200,
                                     .sound_speed_mps = 1500.0,
                                     .listen_only = data[1] & 1,
                                     .baud = data[1] & 2 ? 9600 : 0};
    uint32_t cuts = (uint32_t)data[1] * 2654435761u + data[0];
    void *state = calloc(1, ops->state_size);
    must(state && ops->init(state, &conf, &fault));
    room = (uint16_t)(1 + data[1] % BEAMS_MAX);
    now_ns = 5 * MS;
    pings = asked = 0;
    ops->opened(state, now_ns, &io);
    for (size_t at = 2; at < size;) {
        cuts = cuts * 1664525u + 1013904223u;
        size_t n = 1 + (cuts >> 16) % 97;
        n = n < size - at ? n : size - at;
        now_ns += (cuts >> 8) % 64 == 0 ? 6000 * MS : (cuts >> 24) * MS / 8;
        if (ops->deadline(state) <= now_ns) {
            ops->tick(state, now_ns, &io);
            must(ops->deadline(state) > now_ns);
        }
        ops->feed(state, data + at, n, now_ns, &io);
        at += n;
    }
    ops->stop(state, now_ns, &io);
    ops->closed(state, now_ns);
    must(ops->deadline(state) == UINT64_MAX);
    ops->status(state, &status);
    must(status.pings >= pings && status.frames >= status.pings);
    must(status.garbage_bytes + 6 * status.frames <= size - 2);
    free(state);
    return 0;
}
