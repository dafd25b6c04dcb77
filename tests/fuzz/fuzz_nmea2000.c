/* SPDX-License-Identifier: MIT */
/*
 * fuzz_nmea2000 - any frames for the NMEA 2000 device, while time passes: every ping is sound, and nothing is ever sent.
 * The input is records of 16 or 72 bytes; the first byte chooses the configuration, one before each record its kind
 * and how long it was waited for.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "../../drivers/device.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static volatile double sink;
static uint64_t now_ns, pings;
static struct ping ping;
static struct ping_beam beam;
static uint8_t samples[4];

static void must(bool fact)
{
    if (!fact)
        abort();
}

static struct ping *begin_ping(void *ctx)
{
    (void)ctx;
    ping = (struct ping){.beam = &beam, .samples = samples, .max_beams = 1, .max_samples = 1};
    return &ping;
}

static void check_ping(void *ctx, struct ping *p)
{
    (void)ctx;
    pings++;
    must(p == &ping && p->kind == PING_RANGES && p->n_beams == 1 && p->n_bins == 1);
    must(p->t_ns <= p->t_in_ns && p->t_in_ns <= now_ns);
    must(isfinite(p->beam[0].range_m) && p->beam[0].range_m >= 0.0f && p->beam[0].range_sd_m > 0.0f);
    must(p->az_aperture_rad > 0.0f && (double)p->az_aperture_rad < GEO_PI && p->dr_m > 0.0f);
    sink = sink + (double)p->beam[0].range_m;
}

static void take_note(void *ctx, enum device_note level, const char *fmt, ...)
{
    (void)ctx, (void)level;
    must(fmt != NULL);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static _Alignas(max_align_t) uint8_t state[1 << 15];
    struct device_io io = {.ping_begin = begin_ping, .ping_done = check_ping, .note = take_note};
    struct device_status status;
    char err[200];

    if (size < 1)
        return 0;
    struct device_conf conf = {.range_m = 50,
                               .sound_speed_mps = 1500,
                               .gain = -1,
                               .node = data[0] & 1 ? 42 : -1,
                               .sensor_id = data[0] & 2 ? 3 : -1,
                               .listen_only = data[0] & 4};
    memset(state, 0, sizeof(state));
    must(device_nmea2000.state_size <= sizeof(state) && device_nmea2000.init(state, &conf, err, sizeof(err)));
    now_ns = 0;
    pings = 0;
    device_nmea2000.opened(state, now_ns, &io);
    for (size_t at = 1; at < size;) {
        uint8_t head = data[at++];
        size_t n = head & 1 ? CANFD_MTU : CAN_MTU;
        n = n < size - at ? n : size - at;
        now_ns += (uint64_t)(head >> 1) * 20000000u;
        if (device_nmea2000.deadline(state) <= now_ns)
            device_nmea2000.tick(state, now_ns, &io);
        must(device_nmea2000.deadline(state) > now_ns);
        device_nmea2000.feed(state, data + at, n, now_ns, &io);
        at += n;
    }
    device_nmea2000.stop(state, now_ns, &io);
    must(device_nmea2000.deadline(state) == UINT64_MAX);
    device_nmea2000.status(state, &status);
    must(status.pings == pings && status.pings <= status.frames);
    must(memchr(status.what, 0, sizeof(status.what)) != NULL);
    return 0;
}
