/* SPDX-License-Identifier: MIT */
/*
 * Where each device's beam points and which side is which, by bytes that were written by hand from the definitions
 * that docs/devices/signs.md names. None are from the encoders that the virtual devices share with the drivers: a wrong
 * sense that both have would never show. The Surveyor's are in test_surveyor.c.
 */
#include <stdarg.h>

#include "drivers/capture/candump.h"
#include "drivers/devices/device.h"
#include "tests/lib/test.h"

static struct rig {
    void *state;
    struct ping ping;
    struct ping_beam beam[16];
    uint8_t samples[PING_MAX_BINS];
    unsigned pings;
} rig;

static void take_sent(void *ctx, const uint8_t *bytes, size_t n)
{
    (void)ctx, (void)bytes, (void)n;
}

static void take_break(void *ctx, bool on)
{
    (void)ctx, (void)on;
}

static struct ping *begin_ping(void *ctx)
{
    (void)ctx;
    rig.ping = (struct ping){
        .beam = rig.beam, .max_beams = 16, .samples = rig.samples, .max_samples = sizeof rig.samples};
    return &rig.ping;
}

static void done_ping(void *ctx, struct ping *ping)
{
    (void)ctx, (void)ping;
    rig.pings++;
}

static void take_note(void *ctx, enum device_note level, const char *fmt, ...)
{
    (void)ctx, (void)level, (void)fmt;
}

static const struct device_io io = {NULL, take_sent, take_break, begin_ping, done_ping, take_note};

enum form { HEX, TEXT, CAN };

struct row {
    const char *name;
    const struct device_ops *ops;
    enum form form;
    const char *bytes; /* HEX: pairs of digits; CAN: frames as candump writes them, a blank between two */
    unsigned zeros;    /* that follow, of samples ... */
    int last;          /* ... and the byte behind them; -1: none */
    double az_deg, el_deg, range_m; /* wanted; range 0: a profile, whose samples say it */
    double from_m;                  /* where listening begins, as far as the message says so */
};

/* A Ping360's frame of four samples: gain 1, head angle, 107 us, period 888, 750 kHz. */
#define PING360(angle, sum) "425212 00 fc08 02 00 01 01" angle "6b00 7803 ee02 b004 0400 ff780300" sum
/* A Micron's line of eight bins: 8 bit, 20 m, interval 104, step 16. */
#define MICRON(control, bearing)                                                                                  \
    "40 30303246 2f00 02ff2a028002 2700 11 10 00" control                                                         \
    "c800 00000000 54 7d00 51 08 0000 6800 0000 ff18 10" bearing "0800 c8280a0509b45a0c 0a"

static const struct row rows[] = {
    {"ping360 ahead", &device_ping360, HEX, PING360("c800", "7e06"), 0, -1, 0, 0, 0, 0},
    {"ping360 to starboard", &device_ping360, HEX, PING360("2c01", "e305"), 0, -1, 90, 0, 0, 0},
    {"ping360 to port", &device_ping360, HEX, PING360("6400", "1a06"), 0, -1, -90, 0, 0, 0},
    {"micron ahead", &device_micron, HEX, MICRON("0523", "800c"), 0, -1, 0, 0, 0, 0},
    {"micron to port", &device_micron, HEX, MICRON("0523", "4006"), 0, -1, -90, 0, 0, 0},
    {"micron to starboard", &device_micron, HEX, MICRON("0523", "c012"), 0, -1, 90, 0, 0, 0},
    {"micron to starboard, inverted", &device_micron, HEX, MICRON("0d23", "c012"), 0, -1, 90, 0, 0, 0},
    {"881a at position 750", &device_imagenex881a, HEX, "494d5810 41 6e45 14 0000 7c01", 252, 0xfc, 45, 0, 0, 0},
    {"881a at position 450", &device_imagenex881a, HEX, "494d5810 41 4243 14 0000 7c01", 252, 0xfc, -45, 0, 0, 0},
    {"852, range only", &device_imagenex852, HEX, "49505811 41 0000 14 5505 0000 fc", 0, -1, 0, 0, 7.25, 0},
    {"echo list to starboard, below", &device_echolist, TEXT, "$ECHO,30.5,-10,1,4000,80\r\n", 0, -1, 30.5, -10, 3,
     0},
    {"echo list to port, above", &device_echolist, TEXT, "$ECHO,-30.5,10,1,4000,80\r\n", 0, -1, -30.5, 10, 3, 0},
    {"ping1d", &device_ping1d, HEX,
     "4252 2200 1405 0100 521c0000 5f00 6400 67120000 f4010000 10270000 03000000 0800 00030928fa781e05 7a05", 0,
     -1, 0, 0, 7.25, 0.5},
    {"dronecan", &device_dronecan, CAN, "10041A2A#859087D612000085 10041A2A#0000030685FB3625 10041A2A#09404745", 0,
     -1, 0, 0, 7.25, 0},
    {"nmea0183", &device_nmea0183, TEXT, "$SDDPT,7.25,0.50,100.0*51\r\n", 0, -1, 0, 0, 7.25, 0.5},
    {"nmea2000", &device_nmea2000, CAN, "0DF50B23#11D502000006FF0A", 0, -1, 0, 0, 7.25, 0},
};

static int digit(char c)
{
    return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

static size_t from_hex(const struct row *row, uint8_t *out)
{
    size_t n = 0;
    int high = -1;
    for (const char *p = row->bytes; *p; p++) {
        if (digit(*p) < 0)
            continue;
        if (high >= 0)
            out[n++] = (uint8_t)(high << 4 | digit(*p));
        high = high < 0 ? digit(*p) : -1;
    }
    CHECK(high < 0);
    memset(out + n, 0, row->zeros);
    n += row->zeros;
    if (row->last >= 0)
        out[n++] = (uint8_t)row->last;
    return n;
}

static void feed_frames(const struct row *row)
{
    char frame[64], line[96];
    int used;
    for (const char *p = row->bytes; sscanf(p, "%63s%n", frame, &used) == 1; p += used) {
        struct candump_frame f;
        int n = snprintf(line, sizeof line, "(1.000000) can0 %s", frame);
        CHECK(candump_line(line, (size_t)n, &f));
        row->ops->feed(rig.state, (const uint8_t *)&f.frame, f.n, 100000000000, &io);
    }
}

static void feed(const struct row *row)
{
    uint8_t bytes[1024];
    if (row->form == CAN)
        feed_frames(row);
    else if (row->form == TEXT)
        row->ops->feed(rig.state, (const uint8_t *)row->bytes, strlen(row->bytes), 100000000000, &io);
    else
        row->ops->feed(rig.state, bytes, from_hex(row, bytes), 100000000000, &io);
}

TEST(every_beam_points_where_its_definition_says)
{
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        const struct row *row = &rows[i];
        const struct device_conf conf = {.range_m = 20,
                                         .sound_speed_mps = 1500,
                                         .gain = -1,
                                         .step_rad = geo_rad(1.8),
                                         .min_confidence = 0.5,
                                         .listen_only = true,
                                         .node = -1,
                                         .sensor_id = -1};
        struct fault fault = {""};
        rig = (struct rig){.state = calloc(1, row->ops->state_size)};
        if (!row->ops->init(rig.state, &conf, &fault)) {
            printf("%s: %s\n", row->name, fault.text);
            abort();
        }
        row->ops->opened(rig.state, 100000000000, &io);
        feed(row);
        const struct ping_beam *b = &rig.beam[0];
        const double off_rad = geo_wrap_pi((double)b->az_rad - geo_rad(row->az_deg));
        if (rig.pings != 1 || rig.ping.n_beams != 1 || !(fabs(off_rad) < 1e-6) ||
            !(fabs(geo_deg((double)b->el_rad) - row->el_deg) < 1e-5) ||
            !(fabs((double)b->range_m - row->range_m) < 1e-6) ||
            !(fabs((double)rig.ping.r0_m - row->from_m) < 1e-6)) {
            printf("%s: %u pings, azimuth %g, elevation %g, %g m, from %g m\n", row->name, rig.pings,
                   geo_deg((double)b->az_rad), geo_deg((double)b->el_rad), (double)b->range_m,
                   (double)rig.ping.r0_m);
            CHECK(false);
        }
        if (row->ops->axial)
            CHECK(b->az_rad == 0 && b->el_rad == 0);
        free(rig.state);
    }
}

/* A device that has no row here, and is not in test_surveyor.c, has a sense that nothing confirms. */
TEST(every_device_has_its_row)
{
    for (const struct device_ops *const *ops = device_table; *ops; ops++) {
        bool there = *ops == &device_surveyor;
        for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++)
            there |= rows[i].ops == *ops;
        if (!there) {
            printf("%s\n", (*ops)->name);
            CHECK(false);
        }
    }
}

int main(void)
{
    RUN(every_beam_points_where_its_definition_says);
    RUN(every_device_has_its_row);
    return test_end();
}
