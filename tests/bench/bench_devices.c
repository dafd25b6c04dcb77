/* SPDX-License-Identifier: MIT */
/*
 * bench_devices - frames per second that each device makes pings of: from the bytes of the wire to a filled ping, one
 * core, nothing behind. The bytes come in pieces of 512, as a serial port gives them; CAN frames one by one.
 *
 *   bench_devices          one row per device
 *   bench_devices DEVICE   FRAMES frames once, for callgrind to count what feed_all takes: prints how many, and how
 *                          large they are, as a share of the largest that there may be
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "core/fault.h"
#include "drivers/devices/device.h"
#include "drivers/devices/dronecan.h"
#include "drivers/devices/imagenex_frame.h"
#include "drivers/devices/micron.h"
#include "drivers/nmea/nmea0183.h"
#include "drivers/devices/ping1d.h"
#include "drivers/devices/ping360.h"
#include "drivers/devices/surveyor.h"
#include "bench.h"

#define FRAMES     256
#define FRAME_MAX  PING_FRAME_LIMIT
#define PIECE      512
#define MEASURED_S 0.5

/* ---- frames: number i of a scan, written to out[FRAME_MAX]; its length ---- */

static const uint8_t *echo(unsigned i)
{
    static uint8_t samples[PING360_SAMPLES_MAX];
    for (size_t k = 0; k < sizeof samples; k++)
        samples[k] = (uint8_t)(k * 31 + i * 17 + (k >> 3));
    return samples;
}

static size_t ping360_frame(unsigned i, uint8_t *out)
{
    const struct ping360_data data = {
        .set = {1, 1, (uint16_t)(i % 400), 107, 888, 750, 1200},
        .automatic = true,
        .sweep = {0, 399, 1, 0},
        .data_length = 1200,
        .n_data = 1200,
        .data = echo(i),
    };
    return ping360_encode_data(out, FRAME_MAX, 2, &data);
}

static size_t ping1d_frame(unsigned i, uint8_t *out)
{
    const struct ping1d_reading reading = {.distance_mm = 7250,
                                           .confidence_percent = 95,
                                           .transmit_us = 100,
                                           .ping_number = i,
                                           .start_mm = 500,
                                           .length_mm = 10000,
                                           .n_samples = PING1D_SAMPLES,
                                           .samples = echo(i)};
    return ping1d_encode_reading(out, FRAME_MAX, 1, &reading);
}

static size_t surveyor_frame(unsigned i, uint8_t *out)
{
    static float point[SURVEYOR_POINTS_MAX][2];
    const struct surveyor_points points = {
        .ping_number = i, .listening_s = 0.02, .pulse_s = 1e-4, .n = SURVEYOR_POINTS_MAX};
    for (unsigned k = 0; k < SURVEYOR_POINTS_MAX; k++) {
        point[k][0] = (float)k * 0.004f - 1.0f;
        point[k][1] = 0.01f;
    }
    return surveyor_encode_atof(out, FRAME_MAX, 1, &points, 1500.0f, (const float(*)[2])point);
}

static size_t micron_frame(unsigned i, uint8_t *out)
{
    uint8_t payload[SEANET_DATA_AT + MICRON_BINS] = {0};
    seanet_put_u16(payload, sizeof payload);
    seanet_put_u16(payload + 5, MICRON_COMMON | MICRON_8_BIT | MICRON_CONTINUOUS);
    seanet_put_u16(payload + 20, 104);
    payload[26] = 16;
    seanet_put_u16(payload + 27, i * 16 % MICRON_TURN);
    seanet_put_u16(payload + 29, MICRON_BINS);
    memcpy(payload + SEANET_DATA_AT, echo(i), MICRON_BINS);
    return seanet_build(out, FRAME_MAX,
                        (struct seanet_head){MICRON_NODE, SEANET_HOST, SEANET_HEAD_DATA, SEANET_LAST_PACKET},
                        payload, sizeof payload);
}

static size_t imagenex_frame(unsigned i, uint8_t *out)
{
    const struct imagenex_frame f = {
        .head = 0x11, .status = 0x45, .range_m = 20, .n_points = 500, .n_data = 500, .data = echo(i)};
    return imagenex_encode_reply(out, FRAME_MAX, &f);
}

static size_t echolist_line(unsigned i, uint8_t *out)
{
    return (size_t)snprintf((char *)out, FRAME_MAX, "$ECHO,%u.5,-10,4,4012.5,80,9377,44,12000.5,12,20000,3\r\n",
                            i % 360);
}

/* A transfer of three frames. */
static size_t dronecan_transfer(unsigned i, uint8_t *out)
{
    uint8_t stream[17] = {0, 0, 0x87, 0xD6, 0x12, 0, 0, 0, 0, 3, 6, 0x85, 0xFB, 0x36, 9, 0x40, 0x47};
    const uint8_t signature[8] = {0x52, 0x19, 0x77, 0xFC, 0x70, 0xFE, 0xFF, 0x68};
    const uint16_t crc = dronecan_crc(dronecan_crc(0xFFFF, signature, 8), stream + 2, 15);
    static const uint8_t tails[3] = {0x80, 0x20, 0x40};
    stream[0] = (uint8_t)crc;
    stream[1] = (uint8_t)(crc >> 8);
    for (unsigned k = 0; k < 3; k++) {
        struct can_frame frame = {.can_id = 0x90041A2A, .len = k < 2 ? 8 : 4};
        memcpy(frame.data, stream + k * 7, frame.len - 1u);
        frame.data[frame.len - 1] = (uint8_t)(tails[k] | i % 32);
        memcpy(out + k * CAN_MTU, &frame, CAN_MTU);
    }
    return 3 * CAN_MTU;
}

static size_t nmea2000_frame(unsigned i, uint8_t *out)
{
    const struct can_frame frame = {
        .can_id = 0x8DF50B23, .len = 8, .data = {(uint8_t)i, 0xD5, 0x02, 0, 0, 0xFF, 0x7F, 10}};
    memcpy(out, &frame, CAN_MTU);
    return CAN_MTU;
}

static const struct row {
    const struct device_ops *ops;
    const char *what;
    size_t (*frame)(unsigned i, uint8_t *out);
} rows[] = {
    {&device_ping360, "1200 bins", ping360_frame},         {&device_ping1d, "a profile of 200", ping1d_frame},
    {&device_surveyor, "512 points", surveyor_frame},      {&device_micron, "400 bins, 8 bit", micron_frame},
    {&device_imagenex852, "500 bins", imagenex_frame},     {&device_echolist, "4 echoes", echolist_line},
    {&device_dronecan, "3 CAN frames", dronecan_transfer}, {&device_nmea2000, "1 CAN frame", nmea2000_frame},
};

/* ---- surroundings ---- */

static uint64_t pings;
static volatile uint64_t sink;

static struct ping *begin_ping(void *ctx)
{
    static struct ping_beam beam[PING_MAX_BEAMS];
    static uint16_t samples[PING_MAX_BINS];
    struct ping *ping = ctx;
    *ping =
        (struct ping){.beam = beam, .samples = samples, .max_beams = PING_MAX_BEAMS, .max_samples = PING_MAX_BINS};
    return ping;
}

static void done_ping(void *ctx, struct ping *ping)
{
    (void)ctx;
    pings++;
    sink = sink + ((const uint8_t *)ping->samples)[ping->n_bins / 2];
}

static void nothing_sent(void *ctx, const uint8_t *bytes, size_t n)
{
    (void)ctx, (void)bytes, (void)n;
}

static void no_break(void *ctx, bool on)
{
    (void)ctx, (void)on;
}

static void no_note(void *ctx, enum device_note level, const char *fmt, ...)
{
    (void)ctx, (void)level, (void)fmt;
}

/* A stream of n bytes, the last of which comes after `bytes` others. */
__attribute__((noinline)) static void feed_all(const struct row *row, void *state, const uint8_t *stream, size_t n,
                                               uint64_t bytes, const struct device_io *io)
{
    const size_t piece = row->ops->can_match ? CAN_MTU : PIECE;
    for (size_t at = 0; at < n; at += piece)
        row->ops->feed(state, stream + at, n - at < piece ? n - at : piece, bytes + at, io);
}

static double largest_share(const struct ping *ping, const struct device_ops *ops)
{
    return ops->max_bins > 1 ? (double)ping->n_bins / ops->max_bins : 1;
}

/* For so many seconds, and once at least. */
static void measure(const struct row *row, double seconds)
{
    static uint8_t stream[FRAMES * FRAME_MAX];
    struct ping buffer;
    const struct device_io io = {&buffer, nothing_sent, no_break, begin_ping, done_ping, no_note};
    const struct device_conf conf = {.range_m = 20,
                                     .sound_speed_mps = 1500,
                                     .gain = -1,
                                     .step_rad = 0.0157,
                                     .min_confidence = 0.5,
                                     .node = -1,
                                     .sensor_id = -1,
                                     .listen_only = true};
    struct fault fault = {""};
    size_t n = 0;
    void *state = calloc(1, row->ops->state_size);
    if (!state || !row->ops->init(state, &conf, &fault)) {
        printf("%s: %s\n", row->ops->name, fault.text);
        exit(1);
    }
    for (unsigned i = 0; i < FRAMES; i++)
        n += row->frame(i, stream + n);
    row->ops->opened(state, 0, &io);
    pings = 0;
    uint64_t bytes = 0;
    double begin_s = 1e-9 * now_ns(), took_s;
    do {
        feed_all(row, state, stream, n, bytes, &io);
        bytes += n;
        took_s = 1e-9 * now_ns() - begin_s;
    } while (took_s < seconds);
    if (pings == 0 || bytes / n * FRAMES != pings) {
        printf("%s: %llu pings of %llu frames\n", row->ops->name, (unsigned long long)pings,
               (unsigned long long)(bytes / n * FRAMES));
        exit(1);
    }
    if (seconds > 0)
        printf("%-12s %-18s %9.0f frames/s %8.1f MB/s\n", row->ops->name, row->what, (double)pings / took_s,
               (double)bytes / took_s * 1e-6);
    else
        printf("%d %g\n", FRAMES, largest_share(&buffer, row->ops));
    free(state);
}

/* No device: it makes poses. */
static void measure_nmea(void)
{
    static const char lines[] = "$GPHDT,274.07,T*03\r\n$INDPT,2.3,0.0*46\r\n$HCHDG,98.3,0.0,E,12.6,W*57\r\n";
    struct nmea_parser parser;
    nmea_parser_init(&parser, true);
    double begin_s = 1e-9 * now_ns(), took_s;
    do {
        for (int i = 0; i < 1000; i++) {
            const uint8_t *bytes = (const uint8_t *)lines;
            size_t n = sizeof lines - 1;
            struct nmea_value value;
            while (nmea_parser_next(&parser, &bytes, &n, &value))
                sink = sink + value.has;
        }
        took_s = 1e-9 * now_ns() - begin_s;
    } while (took_s < MEASURED_S);
    double values = (double)parser.counts.values;
    printf("%-12s %-18s %9.0f frames/s %8.1f MB/s\n", "nmea0183", "DPT, HDT, HDG", values / took_s,
           values / 3 * (double)(sizeof lines - 1) / took_s * 1e-6);
}

int main(int argc, char **argv)
{
    if (argc == 1)
        measure_nmea();
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++)
        if (argc == 1 || strcmp(argv[1], rows[i].ops->name) == 0)
            measure(&rows[i], argc == 1 ? MEASURED_S : 0);
    return 0;
}
