/* SPDX-License-Identifier: MIT */
/*
 * Imagenex heads: frames as the specification has them, streams cut and damaged, the device against a scripted head,
 * and the recordings of an 852 where they are at hand (../shared/data).
 */
#include "core/fault.h"
#include "drivers/devices/device.h"
#include "drivers/devices/imagenex_frame.h"
#include "grid/range/extract.h"
#include "tests/lib/test.h"

#include <unistd.h>

#define MS     1000000ull
#define SECOND 1000000000ull
#define FOLDER "../shared/data/imagenex852-echosounder/"

static struct imagenex_parser parser;
static const struct device_ops *ops;
static _Alignas(16) uint8_t state[65536];
static uint64_t now_ns;
static uint8_t sent[IMAGENEX_SWITCH_BYTES];
static int n_sent, n_pings;
static struct ping ping;
static struct ping_beam beam;
static uint8_t samples[1024];
static char last_note[200];

/* ---- surroundings of a device ---- */

static void on_send(void *ctx, const uint8_t *bytes, size_t n)
{
    (void)ctx;
    CHECK_INT(n, IMAGENEX_SWITCH_BYTES);
    memcpy(sent, bytes, sizeof sent);
    n_sent++;
}

static void on_break(void *ctx, bool on)
{
    (void)ctx, (void)on;
    CHECK(false);
}

static struct ping *on_begin(void *ctx)
{
    (void)ctx;
    ping = (struct ping){.beam = &beam, .samples = samples, .max_beams = 1, .max_samples = sizeof samples};
    return &ping;
}

static void on_done(void *ctx, struct ping *p)
{
    (void)ctx;
    CHECK(p == &ping);
    n_pings++;
}

static void on_note(void *ctx, enum device_note level, const char *fmt, ...)
{
    va_list args;
    (void)ctx, (void)level;
    va_start(args, fmt);
    vsnprintf(last_note, sizeof last_note, fmt, args);
    va_end(args);
}

static const struct device_io io = {NULL, on_send, on_break, on_begin, on_done, on_note};

static struct device_conf usual(void)
{
    return (struct device_conf){
        .range_m = 20.0, .sound_speed_mps = 1500.0, .gain = -1, .step_rad = geo_rad(0.9), .baud = 115200};
}

static void open_device(const struct device_ops *which, const struct device_conf *conf)
{
    struct fault fault = {""};
    ops = which;
    CHECK(ops->state_size <= sizeof state);
    if (!ops->init(state, conf, &fault)) {
        printf("%s\n", fault.text);
        CHECK(false);
    }
    now_ns = 10 * SECOND;
    n_sent = n_pings = 0;
    ops->opened(state, now_ns, &io);
}

static struct device_status status_now(void)
{
    struct device_status s;
    ops->status(state, &s);
    return s;
}

/* The head's reply to what was asked, 60 ms later. */
static void reply(const struct imagenex_frame *f)
{
    uint8_t out[IMAGENEX_FRAME_MAX];
    const size_t n = imagenex_encode_reply(out, sizeof out, f);
    now_ns += 60 * MS;
    ops->feed(state, out, n, now_ns, &io);
}

static struct imagenex_frame frame_of(uint8_t head, uint16_t position, uint8_t range_m)
{
    static uint8_t data[500];
    for (int i = 0; i < 500; i++)
        data[i] = (uint8_t)(i % 128);
    return (struct imagenex_frame){.head = head,
                                   .status = 0x45,
                                   .position = position,
                                   .clockwise = true,
                                   .range_m = range_m,
                                   .n_points = 500,
                                   .n_data = 500,
                                   .data = data};
}

/* ---- the wire ---- */

static void hex(const char *text, uint8_t *out, int n)
{
    for (int i = 0; i < n; i++) {
        unsigned v;
        sscanf(text + 3 * i, "%2x", &v);
        out[i] = (uint8_t)v;
    }
}

TEST(worked_requests)
{
    uint8_t want[IMAGENEX_SWITCH_BYTES];
    struct device_conf conf = usual();
    conf.gain = 6;
    hex("FE 44 11 14 00 00 43 00 06 00 14 00 00 00 64 00 00 00 00 32 00 00 00 00 00 00 FD", want, sizeof want);
    open_device(&device_imagenex852, &conf);
    CHECK(memcmp(sent, want, sizeof want) == 0);

    conf.gain = 20;
    hex("FE 44 10 14 00 00 43 00 14 00 14 3C 78 03 0A 00 00 00 00 32 08 06 00 00 00 64 FD", want, sizeof want);
    open_device(&device_imagenex881a, &conf);
    CHECK(memcmp(sent, want, sizeof want) == 0);
}

TEST(worked_reply)
{
    uint8_t bytes[13 + 500] = {0};
    struct imagenex_frame f;
    const uint8_t *at = bytes;
    size_t n = sizeof bytes;
    hex("49 47 58 11 45 78 0A 32 40 03 74 03", bytes, 12);
    bytes[12] = 0xfc;
    bytes[511] = 9;
    bytes[512] = 0xfc;
    parser = (struct imagenex_parser){0};
    CHECK(imagenex_parser_next(&parser, &at, &n, 5, &f));
    CHECK(f.head == 0x11 && f.status == 0x45 && f.range_m == 50 && f.profile == 448 && f.n_points == 500);
    CHECK(f.n_data == 500 && f.data[499] == 9 && f.t_first_ns == 5);

    uint8_t made[13 + 252] = {0};
    hex("49 4D 58 10 41 6E 45 14 00 00 7C 01", made, 12);
    made[264] = 0xfc;
    at = made;
    n = sizeof made;
    CHECK(imagenex_parser_next(&parser, &at, &n, 6, &f));
    CHECK(f.position == 750 && f.clockwise && f.n_points == 252);
    CHECK_INT(parser.garbage_bytes, 0);
}

TEST(no_byte_but_the_last_is_the_end)
{
    uint8_t out[IMAGENEX_SWITCH_BYTES];
    struct imagenex_switch s, back;
    memset(&s, 0xfd, sizeof s);
    imagenex_encode_switch(&s, out);
    CHECK(memchr(out, 0xfd, sizeof out) == out + sizeof out - 1);
    CHECK(imagenex_decode_switch(out, &back) && back.gain_db == 0xfc);
}

TEST(what_is_no_frame)
{
    static const struct {
        const char *name;
        int at;
        uint8_t value;
        bool bad_end;
    } row[] = {
        {"first letter", 0, 'J', false},    {"second letter", 1, 'N', false}, {"third letter", 2, 'Y', false},
        {"head below", 3, 0x0f, false},     {"head beyond", 3, 0x16, false},  {"another length", 10, 0x73, false},
        {"name and length", 1, 'M', false}, {"end", 512, 0xfd, true},
    };
    const struct imagenex_frame f = frame_of(0x11, 0, 20);
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        uint8_t bytes[2 * 513 + 2];
        struct imagenex_frame got;
        imagenex_encode_reply(bytes, 513, &f);
        bytes[row[i].at] = row[i].value;
        imagenex_encode_reply(bytes + 513, 513, &f);
        const uint8_t *at = bytes;
        size_t n = 2 * 513;
        parser = (struct imagenex_parser){0};
        const bool found = imagenex_parser_next(&parser, &at, &n, 1, &got);
        if (!found || parser.garbage_bytes != 513 || parser.bad_end != row[i].bad_end) {
            printf("%s: %d, %" PRIu64 " bytes of garbage\n", row[i].name, found, parser.garbage_bytes);
            CHECK(false);
        }
    }
}

TEST(echoed_requests_are_passed_over)
{
    uint8_t bytes[27 + 513];
    struct imagenex_frame got;
    const struct imagenex_frame f = frame_of(0x11, 0, 20);
    imagenex_encode_switch(&(struct imagenex_switch){.head = 'I', .range_m = 'G'}, bytes);
    imagenex_encode_reply(bytes + 27, 513, &f);
    const uint8_t *at = bytes;
    size_t n = sizeof bytes;
    parser = (struct imagenex_parser){0};
    CHECK(imagenex_parser_next(&parser, &at, &n, 1, &got));
    CHECK_INT(parser.garbage_bytes, 0);
}

/* Frames of all kinds between random bytes, fed in random pieces: every one is found, every other byte is counted. */
TEST(frames_survive_cuts_and_noise)
{
    uint64_t seed = test_seed();
    static uint8_t stream[200000];
    for (int round = 0; round < 20; round++) {
        size_t n = 0, garbage = 0;
        uint64_t made = 0;
        while (n < sizeof stream - 2000) {
            for (uint64_t k = test_random(&seed) % 40; k > 0; k--, garbage++)
                stream[n++] = (uint8_t)(test_random(&seed) % 'I'); /* begins no frame, and echoes no request */
            struct imagenex_frame f = frame_of(0x10, (uint16_t)(test_random(&seed) % 1201), 20);
            const uint64_t kind = test_random(&seed) % 3;
            f.n_points = f.n_data = kind == 0 ? 0 : kind == 1 ? 252 : 500;
            n += imagenex_encode_reply(stream + n, sizeof stream - n, &f);
            made++;
        }
        parser = (struct imagenex_parser){0};
        uint64_t found = 0;
        struct imagenex_frame got;
        for (size_t at = 0; at < n;) {
            size_t piece = 1 + test_random(&seed) % 700;
            piece = piece < n - at ? piece : n - at;
            const uint8_t *p = stream + at;
            size_t left = piece;
            while (imagenex_parser_next(&parser, &p, &left, at, &got))
                found++;
            at += piece;
        }
        CHECK_INT(found, made);
        CHECK_INT(parser.garbage_bytes, garbage);
    }
}

TEST(a_cut_frame_is_given_up)
{
    uint8_t bytes[513];
    struct imagenex_frame got;
    const struct imagenex_frame f = frame_of(0x11, 0, 20);
    imagenex_encode_reply(bytes, sizeof bytes, &f);
    parser = (struct imagenex_parser){0};
    const uint8_t *at = bytes;
    size_t n = 300;
    CHECK(!imagenex_parser_next(&parser, &at, &n, 100, &got));
    imagenex_parser_give_up(&parser, 99);
    CHECK_INT(parser.garbage_bytes, 0);
    imagenex_parser_give_up(&parser, 100);
    CHECK_INT(parser.garbage_bytes, 300);
    at = bytes;
    n = 513;
    CHECK(imagenex_parser_next(&parser, &at, &n, 200, &got) && got.t_first_ns == 200);
    imagenex_parser_reset(&parser);
    CHECK_INT(parser.cut_bytes, 0);
    at = bytes;
    n = 40;
    CHECK(!imagenex_parser_next(&parser, &at, &n, 300, &got));
    imagenex_parser_reset(&parser);
    CHECK_INT(parser.cut_bytes, 40); /* the port was lost amid it: no garbage */
    CHECK_INT(parser.garbage_bytes, 300);
}

/* ---- the device ---- */

TEST(configurations)
{
    static const struct {
        const char *name, *says; /* "": good */
        bool scans;
        double range_m, step_deg, frequency_khz;
        int gain;
    } row[] = {
        {"852", "", false, 20, 0.9, 0, -1},
        {"852 any step", "", false, 20, 90, 0, 40},
        {"852 too far", "takes range 0.75 to 50 m", false, 50.1, 0.9, 0, -1},
        {"852 gain", "takes gain 0 to 40 (dB; auto: 6)", false, 20, 0.9, 0, 41},
        {"881A", "", true, 100, 2.4, 1100, 0},
        {"881A too far", "takes range 0.75 to 100 m", true, 101, 0.9, 0, -1},
        {"881A step", "0.3, 0.6, 0.9, 1.2 or 2.4", true, 20, 3.6, 0, -1},
        {"881A frequency", "280", true, 20, 0.9, 200, -1},
        {"not a number", "range", true, NAN, 0.9, 0, -1},
        {"not a step", "step", true, 20, NAN, 0, -1},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct device_conf conf = usual();
        struct fault fault = {""};
        conf.range_m = row[i].range_m;
        conf.step_rad = geo_rad(row[i].step_deg);
        conf.frequency_hz = row[i].frequency_khz * 1e3;
        conf.gain = row[i].gain;
        const struct device_ops *which = row[i].scans ? &device_imagenex881a : &device_imagenex852;
        const bool good = which->init(state, &conf, &fault);
        if (good != !row[i].says[0] || !strstr(fault.text, row[i].says)) {
            printf("%s: %d, %s\n", row[i].name, good, fault.text);
            CHECK(false);
        }
    }
}

TEST(settings_of_a_scan)
{
    static const struct {
        double start_deg, end_deg, step_deg;
        uint8_t train, sector, step;
    } row[] = {
        {0, 360, 0.9, 60, 120, 3},  {300, 60, 0.3, 60, 40, 1},  {-45, 45, 2.0, 60, 30, 8},
        {90, 180, 1.1, 105, 30, 4}, {180, 270, 0.6, 15, 30, 2}, {170, 190, 2.4, 120, 7, 8},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct device_conf conf = usual();
        struct imagenex_switch s;
        conf.sector_start_rad = geo_rad(row[i].start_deg);
        conf.sector_end_rad = row[i].end_deg == 360 ? conf.sector_start_rad : geo_rad(row[i].end_deg);
        conf.step_rad = geo_rad(row[i].step_deg);
        open_device(&device_imagenex881a, &conf);
        CHECK(imagenex_decode_switch(sent, &s));
        const bool train = s.train == row[i].train || (row[i].train == 120 && s.train == 0); /* both are aft */
        if (!train || s.sector != row[i].sector || s.step != row[i].step) {
            printf("%g %g: train %u, sector %u, step %u\n", row[i].start_deg, row[i].end_deg, s.train, s.sector,
                   s.step);
            CHECK(false);
        }
    }
}

/* In units of 5 kHz about 675. */
TEST(frequency_of_a_scan)
{
    static const struct {
        double khz;
        uint8_t code;
    } row[] = {{0, 100}, {280, 21}, {672, 99}, {675, 100}, {680, 101}, {1100, 185}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct device_conf conf = usual();
        struct imagenex_switch s;
        conf.frequency_hz = row[i].khz * 1e3;
        open_device(&device_imagenex881a, &conf);
        CHECK(imagenex_decode_switch(sent, &s));
        CHECK_INT(s.frequency, row[i].code);
    }
}

TEST(geometry_is_the_replys_own)
{
    struct device_conf conf = usual();
    conf.sound_speed_mps = 1450.0;
    open_device(&device_imagenex881a, &conf);
    const struct imagenex_frame f = frame_of(0x10, 750, 40);
    reply(&f);
    CHECK_INT(n_pings, 1);
    CHECK_INT(ping.n_bins, 500);
    CHECK_NEAR(ping.dr_m, 40.0 / 500 * 1450 / 1500, 1e-6, 0);
    CHECK_NEAR(beam.az_rad, geo_rad(45), 1e-6, 0);
    CHECK(ping.head_units == 750 && ping.head_turn == 1200 && ping.law == AMPLITUDE_LINEAR);
    CHECK_NEAR(status_now().range_m, 40.0 * 1450 / 1500, 1e-9, 0);
    /* it listened for 2 * 40 m / 1500 m/s before the 513 bytes came */
    CHECK_NEAR((double)(now_ns - ping.t_ns), 513e10 / 115200 + 2 * 40.0 / 1500 * 1e9, 0, 1e3);
}

TEST(full_scale_of_the_852_is_saturation)
{
    const struct device_conf conf = usual();
    open_device(&device_imagenex852, &conf);
    const struct imagenex_frame f = frame_of(0x11, 1400, 20);
    reply(&f);
    CHECK(samples[126] == 126 && samples[127] == 255 && samples[128] == 0);
    CHECK(ping.head_turn == 0 && beam.az_rad == 0.0f); /* its position bytes mean something else */
}

TEST(ranges_without_profile)
{
    static const struct {
        const struct device_ops *ops;
        uint8_t range_m;
        uint16_t profile;
        double metres;
    } row[] = {{&device_imagenex852, 20, 448, 4.48},
               {&device_imagenex881a, 4, 448, 0.896},
               {&device_imagenex881a, 5, 448, 4.48},
               {&device_imagenex852, 20, 0, 0}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        const struct device_conf conf = usual();
        open_device(row[i].ops, &conf);
        const uint8_t head = row[i].ops == &device_imagenex852 ? 0x11 : 0x10;
        struct imagenex_frame f = frame_of(head, 600, row[i].range_m);
        f.n_points = f.n_data = 0;
        f.profile = row[i].profile;
        reply(&f);
        CHECK(ping.kind == PING_RANGES && ping_bytes(&ping) == 0 && ping.dr_m == row[i].range_m);
        CHECK_NEAR(beam.range_m, row[i].metres, 1e-6, 0);
    }
}

TEST(replies_of_other_heads_are_counted_and_not_used)
{
    static const struct {
        const struct device_ops *ops;
        bool listen_only;
        uint8_t head;
        bool used;
    } row[] = {{&device_imagenex852, false, 0x11, true},   {&device_imagenex852, false, 0x12, false},
               {&device_imagenex852, false, 0x10, false},  {&device_imagenex852, true, 0x15, true},
               {&device_imagenex852, true, 0x10, false},   {&device_imagenex881a, false, 0x10, true},
               {&device_imagenex881a, false, 0x11, false}, {&device_imagenex881a, true, 0x11, false}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct device_conf conf = usual();
        conf.listen_only = row[i].listen_only;
        open_device(row[i].ops, &conf);
        const int before = n_pings;
        const struct imagenex_frame f = frame_of(row[i].head, 600, 20);
        reply(&f);
        CHECK_INT(n_pings - before, row[i].used);
        CHECK_INT(status_now().bad_frame, !row[i].used);
        CHECK_INT(status_now().frames, 1);
    }
}

TEST(senseless_replies_are_counted)
{
    const struct device_conf conf = usual();
    open_device(&device_imagenex881a, &conf);
    struct imagenex_frame f = frame_of(0x10, 600, 0);
    reply(&f);
    f = frame_of(0x10, 1201, 20);
    reply(&f);
    f = frame_of(0x10, 600, 20);
    f.n_data = 250; /* 4 bits */
    reply(&f);
    CHECK_INT(n_pings, 0);
    CHECK_INT(status_now().bad_frame, 3);
    CHECK_INT(status_now().frames, 3);
}

TEST(every_reply_is_followed_by_a_request)
{
    const struct device_conf conf = usual();
    open_device(&device_imagenex852, &conf);
    CHECK_INT(status_now().state, DEVICE_IDENTIFY);
    for (int i = 1; i <= 10; i++) {
        const struct imagenex_frame f = frame_of(0x11, 0, 20);
        CHECK_INT(n_sent, i);
        reply(&f);
    }
    CHECK_INT(n_pings, 10);
    CHECK_INT(status_now().state, DEVICE_RUNNING);
    CHECK_STR(status_now().what, "Imagenex 852 head 0x11");
    ops->stop(state, now_ns, &io);
    CHECK(ops->deadline(state) == UINT64_MAX);
    CHECK_INT(status_now().state, DEVICE_CLOSED);
}

TEST(the_next_request_has_other_settings)
{
    struct device_conf conf = usual();
    struct imagenex_switch s;
    open_device(&device_imagenex852, &conf);
    const struct imagenex_frame before = frame_of(0x11, 0, 20), after = frame_of(0x11, 0, 5);
    reply(&before);
    conf.range_m = 5;
    conf.gain = 33;
    ops->retune(state, &conf, now_ns, &io);
    CHECK_INT(n_sent, 2);
    reply(&before); /* was under way */
    CHECK(imagenex_decode_switch(sent, &s));
    CHECK(s.range_m == 5 && s.gain_db == 33);
    for (int i = 0; i < 10; i++)
        reply(&after);
    CHECK_STR(status_now().other_settings, "");
    CHECK_NEAR(status_now().range_m, 5, 1e-9, 0);
}

TEST(a_range_that_was_not_sent_is_told)
{
    const struct device_conf conf = usual();
    open_device(&device_imagenex852, &conf);
    const struct imagenex_frame ours = frame_of(0x11, 0, 20), other = frame_of(0x11, 0, 5);
    for (int i = 0; i < 8; i++) {
        CHECK_STR(status_now().other_settings, "");
        reply(&other);
    }
    CHECK_STR(status_now().other_settings, "range 5 (sent 20)");
    CHECK_STR(last_note,
              "its settings are not the ones that were sent (another program?); sending them again: range 5 "
              "(sent 20)");
    CHECK_NEAR(status_now().range_m, 5, 1e-9, 0);
    CHECK_INT(n_sent, 9);
    for (int i = 0; i < 16; i++)
        reply(&ours);
    CHECK_STR(status_now().other_settings, "");
    CHECK_INT(status_now().taken_over, 1);

    struct device_conf listener = usual();
    listener.listen_only = true;
    open_device(&device_imagenex852, &listener);
    for (int i = 0; i < 20; i++)
        reply(&other);
    CHECK_INT(status_now().taken_over, 0);
}

TEST(refused_settings_come_again)
{
    const struct device_conf conf = usual();
    open_device(&device_imagenex852, &conf);
    struct imagenex_frame f = frame_of(0x11, 0, 20);
    f.status = 0x05;
    reply(&f);
    CHECK_INT(status_now().nacks, 1);
    CHECK_INT(n_sent, 2);
}

TEST(silence_is_told_once_and_ends)
{
    const struct device_conf conf = usual();
    open_device(&device_imagenex852, &conf);
    last_note[0] = '\0';
    for (int i = 0; i < 4; i++) {
        now_ns = ops->deadline(state);
        ops->tick(state, now_ns, &io);
    }
    CHECK_STR(last_note, "");
    CHECK_INT(n_sent, 5);
    uint64_t longest_ns = 0;
    for (int i = 0; i < 20; i++) {
        const uint64_t due_ns = ops->deadline(state);
        longest_ns = due_ns - now_ns > longest_ns ? due_ns - now_ns : longest_ns;
        now_ns = due_ns;
        ops->tick(state, now_ns, &io);
        CHECK(i > 0 || strstr(last_note, "no answer from an Imagenex 852"));
        if (i > 0)
            CHECK_STR(last_note, "");
        last_note[0] = '\0';
    }
    CHECK(longest_ns == 2 * SECOND);
    CHECK_INT(status_now().state, DEVICE_SILENT);
    const struct imagenex_frame f = frame_of(0x11, 0, 20);
    const int before = n_sent;
    reply(&f);
    CHECK_INT(status_now().state, DEVICE_RUNNING);
    CHECK_INT(n_sent, before + 1);
}

/* Replies that stay out now and then are no silence. */
TEST(misses_count_in_a_row)
{
    const struct device_conf conf = usual();
    const struct imagenex_frame f = frame_of(0x11, 0, 20);
    open_device(&device_imagenex852, &conf);
    for (int i = 0; i < 20; i++) {
        now_ns = ops->deadline(state);
        ops->tick(state, now_ns, &io);
        if (i % 4 == 3)
            reply(&f);
        CHECK(status_now().state != DEVICE_SILENT);
    }
    CHECK_INT(status_now().lost_frames, 20);
    CHECK_INT(status_now().timeouts, 20);
}

/* A broken frame that swallowed the beginning of a whole one costs only itself. */
TEST(a_reply_behind_a_broken_one_counts_at_the_deadline)
{
    const struct device_conf conf = usual();
    uint8_t out[IMAGENEX_FRAME_MAX];
    const struct imagenex_frame f = frame_of(0x11, 0, 20);
    open_device(&device_imagenex852, &conf);
    imagenex_encode_reply(out, sizeof out, &f);
    ops->feed(state, out, 100, now_ns + 20 * MS, &io);
    struct imagenex_frame small = f;
    small.n_points = small.n_data = 252;
    ops->feed(state, out, imagenex_encode_reply(out, sizeof out, &small), now_ns + 80 * MS, &io);
    CHECK_INT(n_pings, 0);
    now_ns = ops->deadline(state);
    ops->tick(state, now_ns, &io);
    CHECK_INT(n_pings, 1);
    CHECK_INT(status_now().garbage_bytes, 100);
}

TEST(turns_of_the_head)
{
    struct device_conf conf = usual();
    conf.listen_only = true;
    open_device(&device_imagenex881a, &conf);
    CHECK_INT(n_sent, 0);
    static const struct {
        uint16_t position;
        bool clockwise, new_turn;
    } row[] = {{1100, true, false}, {1150, true, false}, {1200, true, false}, {2, true, true},
               {50, true, false},   {47, false, true},   {10, false, false}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct imagenex_frame f = frame_of(0x10, row[i].position, 20);
        f.clockwise = row[i].clockwise;
        reply(&f);
        CHECK_INT(ping.flags, row[i].new_turn ? PING_NEW_TURN : 0);
        CHECK(ping.head_units < 1200 && beam.az_rad >= 0.0f && beam.az_rad < (float)GEO_TURN);
    }
    CHECK_INT(n_sent, 0);
    CHECK(ops->deadline(state) == UINT64_MAX);
}

/* ---- recordings ---- */

static _Alignas(16) uint8_t memory[1 << 19];

/* Every reply of a file is a ping; how many first echoes lie where the head itself says. */
static void recording(const char *path, int pings, int with_range, int agreeing_least)
{
    static uint8_t file[300000];
    struct extract_conf extract_conf;
    struct beam_echoes found;
    struct echoes out = {.max_beams = 1, .beam = &found};
    struct device_conf conf = usual();
    struct fault fault;
    FILE *f = fopen(path, "rb");
    CHECK(f != NULL);
    if (!f)
        return;
    const size_t size = fread(file, 1, sizeof file, f);
    fclose(f);
    extract_defaults(&extract_conf);
    struct extract *e = extract_init(memory, &extract_conf, 500, &fault);
    conf.listen_only = true;
    open_device(&device_imagenex852, &conf);
    int ranged = 0, agreeing = 0;
    for (size_t at = 0; at < size; at += 64) {
        const int before = n_pings;
        now_ns += 6 * MS;
        ops->feed(state, file + at, size - at < 64 ? size - at : 64, now_ns, &io);
        if (n_pings == before)
            continue;
        const uint8_t *reply_bytes = file + (size_t)before * 640 + 100;
        const double range_m = ((reply_bytes[9] & 127) << 7 | (reply_bytes[8] & 127)) * 0.01;
        extract_run(e, &ping, NULL, &out);
        ranged += range_m > 0;
        agreeing += range_m > 0 && found.n > 0 && fabs((double)found.echo[0].range_m - range_m) < 0.5;
    }
    printf("# %s: %d pings, %d ranges, %d agree\n", path, n_pings, ranged, agreeing);
    CHECK_INT(n_pings, pings);
    CHECK_INT(status_now().frames, pings);
    CHECK_INT(status_now().garbage_bytes, size - (size_t)pings * 513);
    CHECK_INT(ranged, with_range);
    CHECK(agreeing >= agreeing_least);
}

TEST(recordings)
{
    recording(FOLDER "hydroball.852", 177, 177, 172);
    recording(FOLDER "19_26_51-2016_11_18-sonar.first400.852", 400, 207, 185);
}

int main(void)
{
    RUN(worked_requests);
    RUN(worked_reply);
    RUN(no_byte_but_the_last_is_the_end);
    RUN(what_is_no_frame);
    RUN(echoed_requests_are_passed_over);
    RUN(frames_survive_cuts_and_noise);
    RUN(a_cut_frame_is_given_up);
    RUN(configurations);
    RUN(settings_of_a_scan);
    RUN(frequency_of_a_scan);
    RUN(geometry_is_the_replys_own);
    RUN(full_scale_of_the_852_is_saturation);
    RUN(ranges_without_profile);
    RUN(replies_of_other_heads_are_counted_and_not_used);
    RUN(senseless_replies_are_counted);
    RUN(every_reply_is_followed_by_a_request);
    RUN(the_next_request_has_other_settings);
    RUN(a_range_that_was_not_sent_is_told);
    RUN(refused_settings_come_again);
    RUN(silence_is_told_once_and_ends);
    RUN(misses_count_in_a_row);
    RUN(a_reply_behind_a_broken_one_counts_at_the_deadline);
    RUN(turns_of_the_head);
    if (access(FOLDER, R_OK) == 0)
        RUN(recordings);
    else
        printf("skip recordings: %s is not there\n", FOLDER);
    return test_end();
}
