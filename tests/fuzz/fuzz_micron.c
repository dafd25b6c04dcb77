/* SPDX-License-Identifier: MIT */
/*
 * fuzz_micron - any bytes from a SeaNet head's line, cut anywhere, while time passes: every ping is sound, everything
 * sent is a whole frame, counters add up, and a deadline never stands still. Four bytes of the input choose the
 * configuration and the cuts, the rest is the line.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "drivers/devices/device.h"
#include "drivers/devices/micron.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#define MS 1000000ull

static volatile double sink;
static uint64_t now_ns, pings, asked;
static struct ping ping;
static struct ping_beam beam;
static uint8_t samples[PING_MAX_BINS];

static void must(bool fact)
{
    if (!fact)
        abort();
}

static void check_sent(void *ctx, const uint8_t *bytes, size_t n)
{
    struct seanet_parser *parser = ctx;
    struct seanet_frame frame;
    seanet_parser_init(parser);
    must(seanet_parser_next(parser, &bytes, &n, now_ns, &frame) && n == 0);
    must(frame.sender == SEANET_HOST && frame.receiver == MICRON_NODE && frame.last);
}

static void check_break(void *ctx, bool on)
{
    (void)ctx, (void)on;
    must(false);
}

static struct ping *begin_ping(void *ctx)
{
    (void)ctx;
    if (++asked % 7 == 0)
        return NULL;
    ping = (struct ping){.beam = &beam, .samples = samples, .max_beams = 1, .max_samples = MICRON_BINS_MAX};
    return &ping;
}

static void check_ping(void *ctx, struct ping *p)
{
    (void)ctx;
    pings++;
    must(p == &ping && p->n_beams == 1 && p->n_bins > 0 && p->n_bins <= MICRON_BINS_MAX && p->sample_bytes == 1);
    must(p->t_ns <= p->t_in_ns && p->t_in_ns <= now_ns);
    must(p->head_units < MICRON_TURN && p->head_turn == MICRON_TURN);
    must(isfinite(p->dr_m) && p->dr_m > 0.0f && isfinite(p->pulse_m) && p->pulse_m > 0.0f);
    must(p->law == AMPLITUDE_LOG && p->db_per_count > 0.0f);
    must(p->beam[0].az_rad >= 0.0f && p->beam[0].az_rad < (float)GEO_TURN);
    for (uint32_t i = 0; i < p->n_bins; i++)
        sink = sink + samples[i];
}

static void take_note(void *ctx, enum device_note level, const char *fmt, ...)
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

static struct device_conf choose_conf(const uint8_t *b)
{
    static const unsigned bauds[] = {0, 9600, 115200, 4000000};
    return (struct device_conf){
        .range_m = 0.75 + b[0] % 200,
        .sound_speed_mps = 1500.0,
        .gain = -1,
        .sector_start_rad = (b[1] & 15) - 8,
        .sector_end_rad = (b[1] >> 4) - 8,
        .step_rad = (b[2] >> 4) / 64.0,
        .listen_only = (b[2] & 6) == 6,
        .baud = bauds[b[3] & 3],
    };
}

static void tick_if_due(void *state, const struct device_io *io)
{
    if (device_micron.deadline(state) > now_ns)
        return;
    device_micron.tick(state, now_ns, io);
    must(device_micron.deadline(state) > now_ns);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct seanet_parser sent;
    struct device_io io = {&sent, check_sent, check_break, begin_ping, check_ping, take_note};
    struct device_status status;
    struct fault fault;
    if (size < 4)
        return 0;
    struct device_conf conf = choose_conf(data);
    uint32_t cuts = (uint32_t)data[3] * 2654435761u + data[2];
    void *state = calloc(1, device_micron.state_size);
    must(state && device_micron.init(state, &conf, &fault));
    now_ns = 5 * MS;
    pings = asked = 0;
    device_micron.opened(state, now_ns, &io);
    for (size_t at = 4; at < size;) {
        cuts = cuts * 1664525u + 1013904223u;
        size_t n = 1 + (cuts >> 16) % 97;
        n = n < size - at ? n : size - at;
        now_ns += (cuts >> 8) % 64 == 0 ? 5000 * MS : (cuts >> 24) * MS / 8;
        tick_if_due(state, &io);
        device_micron.feed(state, data + at, n, now_ns, &io);
        at += n;
        if ((cuts >> 12) % 128 == 0) {
            device_micron.closed(state, now_ns);
            device_micron.opened(state, now_ns, &io);
        }
    }
    device_micron.stop(state, now_ns, &io);
    must(conf.listen_only || device_micron.deadline(state) == UINT64_MAX);
    device_micron.closed(state, now_ns);
    device_micron.status(state, &status);
    must(status.pings >= pings && status.garbage_bytes + SEANET_OVERHEAD * status.frames <= size - 4);
    must(memchr(status.what, 0, sizeof status.what) != NULL);
    free(state);
    return 0;
}
