/* SPDX-License-Identifier: MIT */
/*
 * Real recordings of a Ping360 (Ping-Viewer logs, not part of the repository) through the framing and the device:
 * every frame that an independent decoder listed must be found, with the same settings and the same samples.
 */
#include <unistd.h>

#include "core/fault.h"
#include "drivers/devices/device.h"
#include "drivers/devices/ping_frame.h"
#include "tests/lib/test.h"

#define FOLDER "../shared/data/ping360-openwater-pingviewer/"

static uint8_t *load(const char *path, size_t *n)
{
    FILE *f = fopen(path, "rb");
    if (!f || fseek(f, 0, SEEK_END) != 0)
        abort();
    long size = ftell(f);
    rewind(f);
    uint8_t *b = malloc((size_t)size + 1);
    if (!b || fread(b, 1, (size_t)size, f) != (size_t)size)
        abort();
    fclose(f);
    *n = (size_t)size;
    return b;
}

/* A text or record of the log: u32 length, big-endian, then so many bytes. */
static size_t field(const uint8_t *b, size_t n, size_t *at)
{
    if (n - *at < 4)
        return 0;
    size_t length = (size_t)b[*at] << 24 | (size_t)b[*at + 1] << 16 | (size_t)b[*at + 2] << 8 | b[*at + 3];
    *at += 4;
    return length <= n - *at ? length : 0;
}

/* The link bytes of a log, joined in place; their number. */
static size_t unwrap(uint8_t *b, size_t n)
{
    size_t at = 0, out = 0;
    at += field(b, n, &at) + 4; /* name of the format, version */
    for (int i = 0; i < 5; i++)
        at += field(b, n, &at);
    at += 8; /* family and type of the sensor */
    while (n - at >= 8) {
        at += field(b, n, &at); /* time of day */
        size_t length = field(b, n, &at);
        memmove(b + out, b + at, length);
        out += length;
        at += length;
    }
    return out;
}

/* The next frame that the list has: id and, of a data frame, the fields. False at its end. */
static bool next_row(FILE *csv, unsigned v[9])
{
    char row[256];
    while (fgets(row, sizeof row, csv)) {
        memset(v, 0, 9 * sizeof v[0]);
        if (sscanf(row, "%*[0-9.],%u,%u,%u,%u,%u,%u,%u,%u,%u", v, v + 1, v + 2, v + 3, v + 4, v + 5, v + 6, v + 7,
                   v + 8) >= 1)
            return true;
    }
    return false;
}

static bool same(const struct ping_frame *f, const unsigned v[9])
{
    struct ping360_data d;
    unsigned sum = 0;
    if (f->id != v[0] || f->id != PING360_DEVICE_DATA)
        return f->id == v[0];
    if (!ping360_decode_data(f, &d))
        return false;
    for (unsigned i = 0; i < d.n_data; i++)
        sum += d.data[i];
    return d.set.angle == v[1] && d.set.gain == v[2] && d.set.transmit_us == v[3] && d.set.sample_period == v[4] &&
           d.set.frequency_khz == v[5] && d.set.n_samples == v[6] && d.n_data == v[7] && sum == v[8];
}

/* All frames of the log against its list, fed in pieces of `split` bytes. */
static void check_log(const char *name, size_t split, unsigned data_frames, unsigned bad_checksums,
                      unsigned garbage)
{
    char path[128];
    size_t n;
    snprintf(path, sizeof path, FOLDER "%s.bin", name);
    uint8_t *bytes = load(path, &n);
    n = unwrap(bytes, n);
    snprintf(path, sizeof path, FOLDER "%s.frames.csv", name);
    FILE *csv = fopen(path, "r");
    if (!csv)
        abort();

    static struct ping_parser parser;
    unsigned v[9], data = 0, wrong = 0;
    ping_parser_init(&parser, PING_PAYLOAD_MAX);
    for (size_t at = 0; at < n;) {
        const uint8_t *piece = bytes + at;
        size_t left = n - at < split ? n - at : split;
        struct ping_frame f;
        at += left;
        while (ping_parser_next(&parser, &piece, &left, at, &f)) {
            data += f.id == PING360_DEVICE_DATA;
            wrong += !next_row(csv, v) || !same(&f, v);
        }
    }
    CHECK_INT(wrong, 0);
    CHECK(!next_row(csv, v));
    CHECK_INT(data, data_frames);
    CHECK_INT(parser.bad_checksum, bad_checksums);
    CHECK_INT(parser.garbage_bytes, garbage);
    fclose(csv);
    free(bytes);
}

TEST(viewer_logs_frame_by_frame)
{
    check_log("20240814-094253162", 1, 145, 0, 1);
    check_log("20240814-094407726", 100, 1725, 0, 150);
    check_log("20240814-102337673", 333, 2436, 1, 1201);
    check_log("20240814-103146484", 4096, 2471, 0, 1);
}

static unsigned pings, new_turns;
static float az_min = 100.0f, az_max = -100.0f;

static struct ping *begin_ping(void *ctx)
{
    static uint8_t samples[1300];
    static struct ping_beam beam;
    struct ping *p = ctx;
    *p = (struct ping){.beam = &beam, .samples = samples, .max_beams = 1, .max_samples = sizeof samples};
    return p;
}

static void done_ping(void *ctx, struct ping *p)
{
    (void)ctx;
    pings++;
    new_turns += p->flags & PING_NEW_TURN;
    az_min = fminf(az_min, p->beam->az_rad);
    az_max = fmaxf(az_max, p->beam->az_rad);
    CHECK_INT(p->n_bins, 1200);
}

static void nothing_sent(void *ctx, const uint8_t *bytes, size_t n)
{
    (void)ctx, (void)bytes, (void)n;
    CHECK(false);
}

static void no_break(void *ctx, bool on)
{
    (void)ctx, (void)on;
    CHECK(false);
}

static void no_note(void *ctx, enum device_note level, const char *fmt, ...)
{
    (void)ctx, (void)level, (void)fmt;
}

TEST(link_bytes_through_the_device)
{
    struct ping buffer;
    struct device_io io = {&buffer, nothing_sent, no_break, begin_ping, done_ping, no_note};
    struct device_conf conf = {.range_m = 2, .sound_speed_mps = 1500, .step_rad = 0.016, .listen_only = true};
    struct device_status status;
    struct fault fault;
    size_t n;
    uint8_t *bytes = load(FOLDER "20240814-094253162.stream", &n);
    void *state = calloc(1, device_ping360.state_size);
    CHECK(device_ping360.init(state, &conf, &fault));
    device_ping360.opened(state, 0, &io);
    for (size_t at = 0; at < n; at += 997)
        device_ping360.feed(state, bytes + at, n - at < 997 ? n - at : 997, at * 1000, &io);
    device_ping360.status(state, &status);
    CHECK_INT(pings, 145);
    CHECK_INT(new_turns, 0); /* 201 .. 345 gradians, once */
    CHECK_NEAR(az_min, 1 * GEO_TURN / 400, 1e-5, 0);
    CHECK_NEAR(az_max, 145 * GEO_TURN / 400, 1e-5, 0);
    CHECK_INT(status.frames, 167);
    CHECK_INT(status.garbage_bytes, 1);
    CHECK_INT(status.bad_frame, 0);
    CHECK_STR(status.what, "Ping360 fw 3.1.1 id 2");
    free(state);
    free(bytes);
}

int main(void)
{
    if (access(FOLDER, R_OK) != 0) {
        printf("skip viewer_logs_frame_by_frame: " FOLDER " is not there\n");
        printf("skip link_bytes_through_the_device: " FOLDER " is not there\n");
        return 0;
    }
    RUN(viewer_logs_frame_by_frame);
    RUN(link_bytes_through_the_device);
    return test_end();
}
