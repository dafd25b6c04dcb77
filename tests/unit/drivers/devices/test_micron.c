/* SPDX-License-Identifier: MIT */
/*
 * The Micron: its arithmetic and messages, and the device against a scripted head on a simulated clock. The head reads
 * what the device sends, byte by byte by its own hand, and answers after the time that line and sound need.
 */
#include "core/fault.h"
#include "drivers/devices/device.h"
#include "drivers/devices/micron.h"
#include "tests/lib/test.h"

#define MS  1000000ull
#define SEC 1000000000ull

/* ---- arithmetic and messages ---- */

TEST(settings_for_a_range)
{
    static const struct {
        double range_m;
        unsigned n, interval, pulse_us, range_dm;
        double back_m;
    } row[] = {
        {0.75, 312, 5, 50, 8, 0.7488},   {1, 400, 5, 50, 10, 0.96},        {2, 400, 10, 50, 20, 1.92},
        {5, 400, 26, 50, 50, 4.992},     {10, 400, 52, 50, 100, 9.984},    {20, 400, 104, 75, 200, 19.968},
        {50, 400, 260, 150, 500, 49.92}, {75, 400, 391, 213, 750, 75.072}, {200, 400, 1042, 350, 2000, 200.064},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct micron_settings set = {0};
        micron_set_range(&set, row[i].range_m, 1500.0);
        CHECK_INT(set.n_bins, row[i].n);
        CHECK_INT(set.interval, row[i].interval);
        CHECK_INT(set.pulse_us, row[i].pulse_us);
        CHECK_INT(set.range_dm, row[i].range_dm);
        CHECK_NEAR(set.n_bins * micron_bin_m(set.interval, 1500.0), row[i].back_m, 1e-9, 0);
    }
}

TEST(settings_are_legal_everywhere)
{
    uint64_t rng = test_seed();
    for (int i = 0; i < 100000; i++) {
        double range_m = 0.75 + 199.25 * test_uniform(&rng) * test_uniform(&rng);
        double c = 1350.0 + 300.0 * test_uniform(&rng);
        struct micron_settings s = {0};
        micron_set_range(&s, range_m, c);
        double back_m = s.n_bins * micron_bin_m(s.interval, c);
        if (s.n_bins < 200 || s.n_bins > MICRON_BINS || s.interval < 5 || s.pulse_us < 50 || s.pulse_us > 350 ||
            fabs(back_m - range_m) > 0.11) {
            printf("range %.17g m, c %.17g: n %u interval %u back %g\n", range_m, c, s.n_bins, s.interval, back_m);
            CHECK(false);
            return;
        }
    }
}

TEST(settings_for_a_scan)
{
    static const struct {
        double start_deg, end_deg, step_deg;
        unsigned left, right, step;
        bool circle;
    } row[] = {
        {0, 360, 0.9, 0, 6399, 16, true},       {0, 0, 1.8, 0, 6399, 32, true},
        {90, 450, 0.9, 0, 6399, 16, true},      {-45, 45, 0.45, 2400, 4000, 8, false},
        {315, 45, 0.225, 2400, 4000, 4, false}, {135, 225, 3.6, 5600, 800, 64, false},
        {-90, 0, 0.01, 1600, 3200, 1, false},   {90, 180, 14.36, 4800, 0, 255, false},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct micron_settings s = {0};
        micron_set_scan(&s, geo_rad(row[i].start_deg), geo_rad(row[i].end_deg), geo_rad(row[i].step_deg));
        CHECK_INT(s.left, row[i].left);
        CHECK_INT(s.right, row[i].right);
        CHECK_INT(s.step, row[i].step);
        CHECK_INT(s.control, row[i].circle ? 0x2307 : 0x2305);
    }
}

/* 20 m, 400 bins, ahead, gain 40 %: every byte written by hand. */
static const uint8_t plain_command[66] = {
    '@',  '0',  '0',  '3',  'C',  0x3c, 0,    255,  2,    0x37, 0x13, 0x80, 2,    1,    0x07, 0x23, 2,
    0x66, 0x66, 0x66, 0x05, 0xcc, 0xcc, 0xcc, 0x06, 0x70, 0x3d, 0x0a, 0x09, 0xd7, 0xa3, 0x70, 0x0a, 0x4b,
    0,    0xc8, 0,    0,    0,    0xff, 0x18, 0x51, 8,    0x54, 0x54, 0x7d, 0,    0x7d, 0,    0x19, 0x10,
    0x68, 0,    0x90, 1,    0xf4, 1,    0x64, 0,    0x40, 6,    1,    0,    0,    0,    10};

static struct micron_settings usual_settings(void)
{
    struct micron_settings set = {.frequency_hz = 675000, .gain = 84};
    micron_set_range(&set, 20.0, 1500.0);
    micron_set_scan(&set, 0.0, GEO_TURN, geo_rad(0.9));
    return set;
}

TEST(commands_byte_by_byte)
{
    static const uint8_t dst_block[17] = {0x51, 0x51, 8, 8, 0x54, 0x54, 0, 0, 0x7d, 0, 0x7d, 0, 0, 0, 0, 0, 10};
    static const uint8_t send_version[14] = {'@', '0', '0', '0', '8', 8, 0, 255, 2, 3, 23, 0x80, 2, 10};
    static const uint8_t send_data[18] = {'@', '0',  '0',  '0', 'C',  12,   0, 255, 2,
                                          7,   0x19, 0x80, 2,   0x40, 0xe2, 1, 0,   10};
    uint8_t out[MICRON_COMMAND_BYTES], want[82];
    struct micron_settings set = usual_settings();
    CHECK_INT(micron_encode_head_command(out, sizeof out, &set), 66);
    CHECK(memcmp(out, plain_command, 66) == 0);
    set.dst = true;
    memcpy(want, plain_command, 65);
    memcpy(want + 65, dst_block, 17);
    want[3] = '4', want[4] = 'C', want[5] = 0x4c, want[9] = 0x47, want[13] = 0x1d, want[16] = 0x11;
    CHECK_INT(micron_encode_head_command(out, sizeof out, &set), 82);
    CHECK(memcmp(out, want, 82) == 0);
    CHECK_INT(micron_encode_head_command(out, 81, &set), 0);
    CHECK_INT(micron_encode_short(out, sizeof out, SEANET_SEND_VERSION), 14);
    CHECK(memcmp(out, send_version, 14) == 0);
    CHECK_INT(micron_encode_send_data(out, sizeof out, 123456), 18);
    CHECK(memcmp(out, send_data, 18) == 0);
}

TEST(ways)
{
    static const struct {
        unsigned from, to;
        int way;
    } row[] = {{0, 16, 16},     {16, 0, -16},    {6384, 0, 16}, {0, 6384, -16},
               {0, 3200, 3200}, {3200, 0, 3200}, {5, 5, 0},     {1, 3202, -3199}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++)
        CHECK_INT(micron_angle_to(row[i].from, row[i].to), row[i].way);
}

/* A mtHeadData frame as the head makes it. */
struct reply {
    unsigned control, interval, bearing, n, status, low, span, step, gain, left, right;
};

static const struct reply usual_reply = {0x2307, 104, 3200, 400, 0x10, 8, 81, 16, 84, 0, 6399};

static size_t build_payload(uint8_t *payload, const struct reply *r, const uint8_t *data)
{
    memset(payload, 0, SEANET_DATA_AT);
    seanet_put_u16(payload, SEANET_DATA_AT + r->n);
    payload[2] = 0x11;
    payload[3] = (uint8_t)r->status;
    seanet_put_u16(payload + 5, r->control);
    payload[16] = (uint8_t)r->span;
    payload[17] = (uint8_t)r->low;
    seanet_put_u16(payload + 20, r->interval);
    payload[13] = (uint8_t)r->gain;
    seanet_put_u16(payload + 22, r->left);
    seanet_put_u16(payload + 24, r->right);
    payload[26] = (uint8_t)r->step;
    seanet_put_u16(payload + 27, r->bearing);
    seanet_put_u16(payload + 29, r->n);
    memcpy(payload + SEANET_DATA_AT, data, r->n);
    return SEANET_DATA_AT + r->n;
}

static struct seanet_frame frame_of(const uint8_t *payload, size_t length, unsigned packet, bool last)
{
    return (struct seanet_frame){.sender = 2,
                                 .receiver = 255,
                                 .node = 2,
                                 .id = SEANET_HEAD_DATA,
                                 .packet = (uint8_t)packet,
                                 .last = last,
                                 .length = (uint16_t)length,
                                 .payload = payload,
                                 .t_first_ns = 1000 * MS,
                                 .t_last_ns = 1040 * MS};
}

static struct ping_beam beam;
static uint8_t samples[PING_MAX_BINS];

static struct ping room_for(uint32_t n)
{
    return (struct ping){.beam = &beam, .samples = samples, .max_beams = 1, .max_samples = n};
}

TEST(eight_bit_line_as_ping)
{
    uint8_t payload[600], data[400];
    struct reply r = usual_reply;
    static struct micron_line line;
    for (int i = 0; i < 400; i++)
        data[i] = (uint8_t)i;
    r.bearing = 4800;
    struct seanet_frame f = frame_of(payload, build_payload(payload, &r, data), 0, true);
    CHECK_INT(micron_line_add(&line, &f), MICRON_LINE_WHOLE);
    CHECK_INT(micron_line_bins(&line), 400);
    struct ping p = room_for(PING_MAX_BINS);
    micron_fill_ping(&p, &line, 1500.0, 115200);
    CHECK_INT(p.n_bins, 400);
    CHECK_INT(p.law, AMPLITUDE_LOG);
    CHECK_NEAR(p.db_per_count, 0.313725, 1e-5, 0);
    CHECK_NEAR(p.dr_m, 0.04992, 1e-6, 0);
    CHECK_NEAR(p.pulse_m, 0.05625, 1e-6, 0); /* 75 us */
    CHECK_NEAR(p.deaf_m, 0.075, 1e-6, 0);    /* the 100 us of the command, in which the receiver is locked out */
    CHECK_NEAR(beam.az_rad, GEO_PI / 2, 1e-6, 0);
    CHECK_NEAR(geo_deg((double)p.az_aperture_rad), 3.0, 1e-5, 0);
    CHECK_NEAR(geo_deg((double)p.el_aperture_rad), 35.0, 1e-5, 0);
    CHECK_INT(p.head_units, 4800);
    CHECK_INT(p.head_turn, 6400);
    CHECK(memcmp(samples, data, 400) == 0);
    /* 445 bytes take 38.628 ms, so they began at 1000 ms, and 400 bins of 66.56 us before that */
    CHECK_INT(p.t_ns, 1000 * MS - 400 * 104 * 640);
    CHECK_INT(p.t_in_ns, 1040 * MS);
    p = room_for(10);
    micron_fill_ping(&p, &line, 1500.0, 9600); /* 445 bytes take 463.5 ms */
    CHECK_INT(p.n_bins, 10);
    CHECK_INT(p.t_ns, 1040 * MS - 463541666 - 400 * 104 * 640);
}

TEST(bearings)
{
    static const struct {
        unsigned bearing;
        double az_deg;
    } row[] = {{3200, 0}, {4800, 90}, {0, 180}, {6399, 179.94375}, {1600, 270}, {3199, 359.94375}, {3216, 0.9}};
    uint8_t payload[100], data[8] = {0};
    static struct micron_line line;
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct reply r = usual_reply;
        r.n = 8, r.bearing = row[i].bearing;
        struct seanet_frame f = frame_of(payload, build_payload(payload, &r, data), 0, true);
        struct ping p = room_for(8);
        CHECK_INT(micron_line_add(&line, &f), MICRON_LINE_WHOLE);
        micron_fill_ping(&p, &line, 1500.0, 0);
        CHECK_NEAR(geo_deg((double)beam.az_rad), row[i].az_deg, 1e-6, 1e-6);
    }
}

TEST(four_bit_line_as_ping)
{
    /* low 8, span 81: step k is 8 + 5.4 k counts, the top full scale */
    static const uint8_t want[8] = {0, 13, 35, 255, 84, 0, 8 + 11, 8 + 16};
    const uint8_t data[4] = {0x01, 0x5f, 0xe0, 0x23};
    uint8_t payload[100];
    static struct micron_line line;
    struct reply r = usual_reply;
    r.n = 4, r.control = 0x2306;
    struct seanet_frame f = frame_of(payload, build_payload(payload, &r, data), 0, true);
    CHECK_INT(micron_line_add(&line, &f), MICRON_LINE_WHOLE);
    CHECK_INT(micron_line_bins(&line), 8);
    struct ping p = room_for(PING_MAX_BINS);
    micron_fill_ping(&p, &line, 1500.0, 115200);
    CHECK_INT(p.n_bins, 8);
    CHECK(memcmp(samples, want, 8) == 0);
    CHECK_NEAR(p.db_per_count, 80.0 / 255.0, 1e-6, 0);
    CHECK_NEAR(p.dr_m, 0.04992, 1e-6, 0);
    r.low = 200, r.span = 255; /* a window beyond full scale */
    f = frame_of(payload, build_payload(payload, &r, data), 0, true);
    micron_line_add(&line, &f);
    micron_fill_ping(&p, &line, 1500.0, 115200);
    CHECK_INT(samples[4], 255);
}

TEST(senseless_lines)
{
    static const struct {
        const char *name;
        struct reply reply;
    } row[] = {
        {"no interval", {.control = 0x2305, .bearing = 0, .n = 8}},
        {"bearing", {.control = 0x2305, .interval = 5, .bearing = 6400, .n = 8}},
        {"no echo", {.control = 0x2305, .interval = 5, .n = 0}},
        {"4-bit, too many bins", {.control = 0x2304, .interval = 5, .n = 751}},
    };
    static struct micron_line line;
    uint8_t payload[900], data[800] = {0};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct seanet_frame f = frame_of(payload, build_payload(payload, &row[i].reply, data), 0, true);
        CHECK_INT(micron_line_add(&line, &f), MICRON_LINE_WHOLE);
        CHECK_INT(micron_line_bins(&line), 0);
    }
}

/* ---- several packets ---- */

static uint8_t big_payload[2000], big_data[1500];

static enum micron_join add_part(struct micron_line *line, unsigned packet, bool last, size_t from, size_t n)
{
    struct reply r = usual_reply;
    r.n = 300;
    build_payload(big_payload, &r, big_data);
    const uint8_t *start = packet ? big_payload + SEANET_DATA_AT + from : big_payload;
    struct seanet_frame f = frame_of(start, packet ? n : SEANET_DATA_AT + n, packet, last);
    f.t_first_ns += packet * 100 * MS;
    f.t_last_ns += packet * 100 * MS;
    return micron_line_add(line, &f);
}

TEST(packets_are_joined)
{
    static struct micron_line line;
    for (int i = 0; i < 1500; i++)
        big_data[i] = (uint8_t)(i * 7);
    CHECK_INT(add_part(&line, 0, false, 0, 128), MICRON_LINE_OPEN);
    CHECK_INT(add_part(&line, 1, false, 128, 128), MICRON_LINE_OPEN);
    CHECK_INT(add_part(&line, 2, true, 256, 44), MICRON_LINE_WHOLE);
    struct ping p = room_for(PING_MAX_BINS);
    micron_fill_ping(&p, &line, 1500.0, 0);
    CHECK_INT(p.n_bins, 300);
    CHECK(memcmp(samples, big_data, 300) == 0);
    CHECK_INT(p.t_in_ns, 1240 * MS);
    CHECK_INT(p.t_ns, 1000 * MS - 300 * 104 * 640);
}

TEST(packets_with_a_gap_are_dropped)
{
    static struct micron_line line;
    CHECK_INT(add_part(&line, 0, false, 0, 256), MICRON_LINE_OPEN);
    CHECK_INT(add_part(&line, 2, true, 256, 44), MICRON_LINE_BROKEN);
    CHECK_INT(add_part(&line, 1, true, 256, 44), MICRON_LINE_BROKEN); /* all was dropped */
    CHECK_INT(add_part(&line, 0, false, 0, 128), MICRON_LINE_OPEN);
    CHECK_INT(add_part(&line, 0, false, 0, 256), MICRON_LINE_OPEN); /* begins anew */
    CHECK_INT(add_part(&line, 1, true, 256, 44), MICRON_LINE_WHOLE);
}

TEST(packets_of_the_wrong_size_are_dropped)
{
    static struct micron_line line;
    CHECK_INT(add_part(&line, 0, false, 0, 128), MICRON_LINE_OPEN);
    CHECK_INT(add_part(&line, 1, true, 128, 128), MICRON_LINE_BROKEN);
    CHECK_INT(add_part(&line, 0, false, 0, 200), MICRON_LINE_OPEN);
    CHECK_INT(add_part(&line, 1, true, 200, 1400), MICRON_LINE_BROKEN);
    CHECK_INT(line.n, 200);
    struct reply r = usual_reply;
    struct seanet_frame f = frame_of(big_payload, build_payload(big_payload, &r, big_data), 0, false);
    seanet_put_u16(big_payload + 29, SEANET_DATA_MAX + 1);
    CHECK_INT(micron_line_add(&line, &f), MICRON_LINE_BROKEN);
}

/* ---- the rig: device, clock, head ---- */

struct answer {
    uint64_t t_ns;
    size_t n;
    uint8_t bytes[1700];
};

struct rig {
    void *state;
    struct device_io io;
    struct device_conf conf;
    uint64_t now_ns;

    /* what the head does */
    bool mute, dst, echoes, knows_version, ignores_settings, motor_error, false_head;
    unsigned lose_replies, cut_replies, packets;
    uint64_t centring_ns;
    struct reply reply; /* n 0: as it was told */

    /* where the head is */
    uint64_t boot_ns, next_alive_ns;
    bool has_parameters, scanning, backward;
    unsigned bearing, left, right, step, interval, n_bins, control, gain;
    struct answer queue[64];
    unsigned queued;

    /* what was seen */
    unsigned reboots, ask_version, ask_user, commands, requests;
    size_t command_bytes;
    unsigned pings;
    struct ping last;
    uint32_t ping_units[20000];
    uint8_t ping_flags[20000];
    char notes[4096];
    unsigned warnings;
    bool no_room;
    struct ping buffer;
};

static struct rig rig;

static uint64_t wire(size_t bytes)
{
    return bytes * 10 * SEC / 115200;
}

static void answer(uint64_t t_ns, const uint8_t *bytes, size_t n)
{
    if (rig.queued == 64)
        abort();
    struct answer *a = &rig.queue[rig.queued++];
    a->t_ns = t_ns;
    a->n = n;
    memcpy(a->bytes, bytes, n);
}

static void answer_message(uint8_t id, size_t n, const uint8_t *payload)
{
    uint8_t b[300];
    answer(rig.now_ns + 2 * MS + wire(n), b,
           seanet_build(b, sizeof b, (struct seanet_head){2, 255, id, SEANET_LAST_PACKET}, payload, n));
}

static void send_alive(void)
{
    uint8_t payload[8] = {0x80};
    bool centring = rig.now_ns < rig.boot_ns + rig.centring_ns;
    seanet_put_u16(payload + 5, rig.bearing);
    payload[7] = (uint8_t)(centring ? 0x5d : 0x0a | (rig.has_parameters ? 0x80 : 0x40));
    answer_message(SEANET_ALIVE, 8, payload);
}

static void advance(void)
{
    if (rig.control & MICRON_CONTINUOUS) {
        rig.bearing = (rig.bearing + rig.step) % MICRON_TURN;
        return;
    }
    unsigned end = rig.backward ? rig.left : rig.right;
    int left = micron_angle_to(rig.bearing, end);
    if ((unsigned)abs(left) < rig.step) {
        rig.backward = !rig.backward;
        end = rig.backward ? rig.left : rig.right;
    }
    rig.bearing = (rig.bearing + (rig.backward ? MICRON_TURN - rig.step : rig.step)) % MICRON_TURN;
}

static void answer_data(void)
{
    static uint8_t payload[1600], data[1500], b[1700];
    struct reply r = rig.reply.n ? rig.reply : usual_reply;
    if (!rig.reply.n) {
        r.n = rig.n_bins;
        r.interval = rig.interval;
        r.control = rig.control;
        r.step = rig.step;
        r.gain = rig.gain;
        r.left = rig.left;
        r.right = rig.right;
    }
    r.bearing = rig.bearing;
    if (rig.motor_error)
        r.status |= MICRON_STATUS_MOTOR_ERROR;
    rig.motor_error = false;
    advance();
    if (rig.lose_replies) {
        rig.lose_replies--;
        return;
    }
    size_t n = build_payload(payload, &r, data);
    uint64_t t_ns = rig.now_ns + wire(18) + micron_listening_ns(r.interval, r.n);
    if (rig.packets) {
        for (size_t at = 0, k = 0; at < n; k++) {
            size_t part = n - at > 128 ? 128 : n - at;
            unsigned last = at + part == n ? SEANET_LAST_PACKET : 0;
            size_t length = seanet_build(b, sizeof b, (struct seanet_head){2, 255, 2, (uint8_t)(k | last)},
                                         payload + at, part);
            t_ns += wire(length);
            answer(t_ns, b, length);
            at += part;
        }
        return;
    }
    n = seanet_build(b, sizeof b, (struct seanet_head){2, 255, 2, SEANET_LAST_PACKET}, payload, n);
    if (rig.cut_replies) {
        rig.cut_replies--;
        n -= 30;
    }
    if (rig.false_head) { /* of a message that is never to come */
        static const uint8_t head[13] = {'@', '0', 'F', 'A', '0', 0xa0, 0x0f, 2, 255, 0, 99, 0x80, 2};
        memmove(b + sizeof head, b, n);
        memcpy(b, head, sizeof head);
        n += sizeof head;
        rig.false_head = false;
    }
    answer(t_ns + wire(n), b, n);
}

static void on_command(const uint8_t *b, size_t n)
{
    rig.commands++;
    rig.command_bytes = n;
    CHECK(n == (rig.dst ? 82 : 66));
    CHECK_INT(b[13], rig.dst ? 0x1d : 1);
    if (rig.ignores_settings)
        return;
    rig.control = b[14] | (unsigned)b[15] << 8;
    rig.left = seanet_u16(b + 37);
    rig.right = seanet_u16(b + 39);
    rig.gain = b[43];
    rig.step = b[50];
    rig.interval = seanet_u16(b + 51);
    rig.n_bins = seanet_u16(b + 53);
    if (!rig.has_parameters)
        rig.bearing = rig.control & MICRON_CONTINUOUS ? 3200 : rig.left;
    rig.has_parameters = true;
}

static void reboot_head(void)
{
    rig.boot_ns = rig.now_ns;
    rig.next_alive_ns = rig.now_ns + SEC;
    rig.has_parameters = rig.scanning = false;
    rig.queued = 0;
}

static void head_send(void *ctx, const uint8_t *b, size_t n)
{
    (void)ctx;
    CHECK(n >= 14 && b[0] == '@' && b[n - 1] == 10 && seanet_u16(b + 5) == n - 6 && b[7] == 255 && b[8] == 2);
    if (rig.echoes)
        answer(rig.now_ns + wire(n), b, n);
    if (rig.mute)
        return;
    switch (b[10]) {
    case SEANET_REBOOT:
        rig.reboots++;
        reboot_head();
        break;
    case SEANET_SEND_VERSION:
        rig.ask_version++;
        if (rig.knows_version)
            answer_message(SEANET_VERSION_DATA, 11, (const uint8_t[11]){6, 0, 0xd2, 4});
        break;
    case SEANET_SEND_USER_DATA: {
        uint8_t user[250] = {0};
        user[6] = rig.dst ? 15 : 3;
        rig.ask_user++;
        answer_message(SEANET_USER_DATA, rig.dst ? 250 : 161, user);
        break;
    }
    case SEANET_HEAD_COMMAND:
        on_command(b, n);
        break;
    case SEANET_SEND_DATA:
        rig.requests++;
        CHECK_INT(n, 18);
        CHECK(seanet_u32(b + 13) < 86400000);
        if (rig.has_parameters) {
            rig.scanning = true;
            answer_data();
        }
        break;
    default:
        CHECK(false);
    }
}

static void head_break(void *ctx, bool on)
{
    (void)ctx, (void)on;
    CHECK(false);
}

static struct ping *begin_ping(void *ctx)
{
    (void)ctx;
    rig.buffer = room_for(PING_MAX_BINS);
    return rig.no_room ? NULL : &rig.buffer;
}

static void done_ping(void *ctx, struct ping *p)
{
    (void)ctx;
    rig.ping_units[rig.pings % 20000] = p->head_units;
    rig.ping_flags[rig.pings % 20000] = p->flags;
    rig.last = *p;
    rig.pings++;
}

static void take_note(void *ctx, enum device_note level, const char *fmt, ...)
{
    (void)ctx;
    size_t used = strlen(rig.notes);
    va_list args;
    va_start(args, fmt);
    if (used < sizeof rig.notes - 200) {
        vsnprintf(rig.notes + used, 200, fmt, args);
        strcat(rig.notes, "\n");
    }
    va_end(args);
    rig.warnings += level == NOTE_WARNING;
}

static struct device_conf usual_conf(void)
{
    return (struct device_conf){
        .range_m = 20.0, .sound_speed_mps = 1500.0, .gain = -1, .step_rad = geo_rad(0.9), .baud = 115200};
}

/* A head that was switched on long ago and a device that knows conf; the port is still closed. */
static void rig_new(const struct device_conf *conf)
{
    struct fault fault = {""};
    free(rig.state);
    memset(&rig, 0, sizeof rig);
    rig.state = calloc(1, device_micron.state_size);
    rig.io = (struct device_io){.send = head_send,
                                .hold_break = head_break,
                                .ping_begin = begin_ping,
                                .ping_done = done_ping,
                                .note = take_note};
    rig.conf = *conf;
    rig.now_ns = 100 * SEC;
    rig.next_alive_ns = 100 * SEC + 600 * MS;
    rig.dst = rig.knows_version = true;
    rig.centring_ns = 8 * SEC;
    rig.bearing = 3200;
    if (!device_micron.init(rig.state, conf, &fault)) {
        printf("init: %s\n", fault.text);
        abort();
    }
}

static void rig_open(void)
{
    device_micron.opened(rig.state, rig.now_ns, &rig.io);
}

/* Let the time pass up to t_ns: answers arrive, deadlines come, a head that does not scan shows that it lives. */
static void run_until(uint64_t t_ns)
{
    for (;;) {
        uint64_t due_ns = device_micron.deadline(rig.state), next_ns = t_ns;
        unsigned first = UINT32_MAX;
        for (unsigned i = 0; i < rig.queued; i++) {
            if (rig.queue[i].t_ns < next_ns) {
                next_ns = rig.queue[i].t_ns;
                first = i;
            }
        }
        bool shows = !rig.mute && !rig.scanning && rig.next_alive_ns < next_ns;
        if (shows)
            next_ns = rig.next_alive_ns;
        bool tick = due_ns < next_ns;
        if (tick)
            next_ns = due_ns;
        rig.now_ns = next_ns > rig.now_ns ? next_ns : rig.now_ns;
        if (tick) {
            device_micron.tick(rig.state, rig.now_ns, &rig.io);
            CHECK(device_micron.deadline(rig.state) > rig.now_ns);
        } else if (shows) {
            rig.next_alive_ns += SEC;
            send_alive();
        } else if (first != UINT32_MAX) {
            struct answer a = rig.queue[first];
            rig.queue[first] = rig.queue[--rig.queued];
            device_micron.feed(rig.state, a.bytes, a.n, rig.now_ns, &rig.io);
        } else {
            return;
        }
    }
}

static void run_for(uint64_t ns)
{
    run_until(rig.now_ns + ns);
}

static void run_to_ping(unsigned pings, uint64_t at_most_ns)
{
    for (uint64_t end_ns = rig.now_ns + at_most_ns; rig.pings < pings && rig.now_ns < end_ns;)
        run_for(MS);
}

static struct device_status status(void)
{
    struct device_status s;
    device_micron.status(rig.state, &s);
    return s;
}

static void rig_running(const struct device_conf *conf)
{
    rig_new(conf);
    rig_open();
    run_to_ping(10, 60 * SEC);
    CHECK(rig.pings >= 10);
}

/* ---- the device ---- */

TEST(configuration_faults_name_the_key)
{
    static const struct {
        const char *key;
        size_t offset;
        double value;
    } row[] = {
        {"range", offsetof(struct device_conf, range_m), 0.74},
        {"range", offsetof(struct device_conf, range_m), NAN},
        {"sound_speed", offsetof(struct device_conf, sound_speed_mps), 0.0},
        {"frequency", offsetof(struct device_conf, frequency_hz), 1e5},
        {"step", offsetof(struct device_conf, step_rad), -0.1},
        {"step", offsetof(struct device_conf, step_rad), 0.2509},
        {"sector", offsetof(struct device_conf, sector_end_rad), INFINITY},
    };
    void *state = calloc(1, device_micron.state_size);
    struct fault fault;
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct device_conf conf = usual_conf();
        memcpy((char *)&conf + row[i].offset, &row[i].value, sizeof(double));
        CHECK(!device_micron.init(state, &conf, &fault));
        CHECK(strncmp(fault.text, row[i].key, strlen(row[i].key)) == 0);
    }
    struct device_conf conf = usual_conf();
    conf.gain = 11;
    CHECK(!device_micron.init(state, &conf, &fault));
    CHECK(strncmp(fault.text, "gain = 11", 9) == 0);
    free(state);
}

TEST(handshake)
{
    struct device_conf conf = usual_conf();
    for (int dst = 0; dst < 2; dst++) {
        rig_new(&conf);
        rig.dst = dst;
        CHECK_INT(status().state, DEVICE_CLOSED);
        rig_open();
        CHECK_INT(status().state, DEVICE_IDENTIFY);
        run_to_ping(1, 10 * SEC);
        CHECK_INT(rig.pings, 1);
        CHECK_INT(rig.reboots, 0);
        CHECK_INT(rig.ask_version, 1);
        CHECK_INT(rig.ask_user, 1);
        CHECK_INT(rig.commands, 1);
        CHECK_INT(status().state, DEVICE_RUNNING);
        CHECK_STR(status().what, dst ? "Micron DST sw 6 serial 1234" : "SeaNet head sw 6 serial 1234");
        CHECK_NEAR(status().range_m, 19.968, 1e-9, 0);
        CHECK_INT(rig.warnings, 0);
    }
}

/* A daemon that comes back finds a head that was left scanning: it shows no life before it is rebooted. */
TEST(head_that_was_left_scanning)
{
    struct device_conf conf = usual_conf();
    rig_new(&conf);
    rig.has_parameters = rig.scanning = true;
    rig_open();
    run_to_ping(1, 60 * SEC);
    CHECK_INT(rig.pings, 1);
    CHECK_INT(rig.reboots, 1);
    CHECK_INT(rig.warnings, 0);
}

TEST(head_that_is_still_centring)
{
    struct device_conf conf = usual_conf();
    rig_new(&conf);
    rig.boot_ns = rig.now_ns;
    rig.centring_ns = 20 * SEC;
    rig_open();
    run_for(19 * SEC);
    CHECK_INT(rig.ask_version, 0);
    run_to_ping(1, 10 * SEC);
    CHECK_INT(rig.pings, 1);
    CHECK_INT(rig.reboots, 0);
}

TEST(one_request_per_ping)
{
    struct device_conf conf = usual_conf();
    rig_running(&conf);
    run_for(10 * SEC);
    CHECK(rig.requests == rig.pings || rig.requests == rig.pings + 1);
    CHECK(rig.pings > 100); /* 26.6 ms of listening, 40 ms of line */
    CHECK_INT(status().lost_frames, 0);
    CHECK_INT(status().garbage_bytes, 0);
}

TEST(full_circles)
{
    struct device_conf conf = usual_conf();
    rig_running(&conf);
    run_to_ping(1300, 200 * SEC);
    for (unsigned i = 1; i < 1300; i++)
        CHECK_INT(micron_angle_to(rig.ping_units[i - 1], rig.ping_units[i]), 16);
    for (unsigned i = 0; i < 1300; i++)
        CHECK_INT(rig.ping_flags[i], i > 0 && i % 400 == 0 ? PING_NEW_TURN : 0);
}

TEST(sectors)
{
    struct device_conf conf = usual_conf();
    conf.sector_start_rad = geo_rad(-45);
    conf.sector_end_rad = geo_rad(45);
    rig_running(&conf);
    CHECK_INT(rig.left, 2400);
    CHECK_INT(rig.right, 4000);
    run_to_ping(450, 100 * SEC);
    unsigned turns = 0;
    for (unsigned i = 0; i < 450; i++) {
        CHECK(rig.ping_units[i] >= 2400 && rig.ping_units[i] <= 4000);
        if (rig.ping_flags[i] & PING_NEW_TURN) {
            turns++;
            CHECK(rig.ping_units[i - 1] == 2400 || rig.ping_units[i - 1] == 4000);
        }
    }
    CHECK_INT(turns, 4);
}

TEST(four_bit_and_several_packets)
{
    struct device_conf conf = usual_conf();
    rig_running(&conf);
    rig.reply = (struct reply){0x2306, 52, 0, 300, 0, 8, 81, 16, 84, 0, 6399};
    run_for(SEC);
    CHECK_INT(rig.last.n_bins, 600);
    CHECK_NEAR(rig.last.dr_m, 0.02496, 1e-6, 0);
    rig.packets = 1;
    run_for(2 * SEC);
    CHECK_INT(rig.last.n_bins, 600);
    CHECK_INT(status().bad_frame, 0);
    CHECK_INT(status().lost_frames, 0);
}

/* The geometry is the reply's, whatever was asked for. */
TEST(range_that_changes_while_running)
{
    struct device_conf conf = usual_conf();
    rig_running(&conf);
    CHECK_NEAR(rig.last.dr_m, 0.04992, 1e-6, 0);
    rig.ignores_settings = true;
    rig.interval = 26;
    run_for(SEC);
    CHECK_NEAR(rig.last.dr_m, 0.01248, 1e-6, 0);
    CHECK_NEAR(status().range_m, 4.992, 1e-9, 0);
    rig.n_bins = 800;
    run_for(SEC);
    CHECK_INT(rig.last.n_bins, 800);
    CHECK_NEAR(status().range_m, 9.984, 1e-9, 0);
    CHECK_INT(status().lost_frames, 0);
}

/* Another program told the head to look ahead only, 5 m far, with little gain: seen in the replies, and set right. */
TEST(a_head_with_settings_of_others_is_set_up_again)
{
    struct device_conf conf = usual_conf();
    rig_running(&conf);
    CHECK_STR(status().other_settings, "");
    for (int again = 0; again < 2; again++) {
        rig.control = MICRON_COMMON | MICRON_8_BIT | MICRON_SCAN_RIGHT;
        rig.left = 2400, rig.right = 4000;
        rig.interval = 26;
        rig.gain = 42;
        rig.ignores_settings = again; /* the other program is quicker */
        const unsigned before = rig.pings, commands = rig.commands;
        run_to_ping(before + 8, 10 * SEC); /* the first is of before */
        CHECK_STR(status().other_settings, "");
        run_to_ping(before + 9, 10 * SEC);
        CHECK_STR(status().other_settings, "continuous 0 (sent 1), gain 42 (sent 84), ADInterval 26 (sent 104), "
                                           "left limit 2400 (sent 0), right limit 4000 (sent 6399)");
        CHECK_NEAR(status().range_m, 4.992, 1e-9, 0); /* the ping is what it says, not what was asked for */
        CHECK_NEAR(rig.last.dr_m, 0.01248, 1e-6, 0);
        CHECK_INT(rig.last.gain, 42);
        CHECK_INT(status().taken_over, again + 1);
        CHECK_INT(rig.warnings, 1);
        CHECK_INT(rig.commands, commands + 1);
        run_for(4 * SEC);
        CHECK_INT(rig.commands, commands + 1);
        CHECK_INT(status().other_settings[0] == '\0', !again);
        run_for(8 * SEC);
    }
    CHECK(
        strstr(
            rig.notes,
            "its settings are not the ones that were sent (another program?); sending them again: continuous 0") !=
        NULL);
    CHECK(strstr(rig.notes, "its settings are again the ones that were sent") != NULL);
    unsigned commands = rig.commands;
    run_for(200 * SEC); /* in vain: every 40 s at last */
    CHECK(rig.commands >= commands + 4 && rig.commands <= commands + 6);
    CHECK_INT(rig.warnings, 1);
    CHECK_INT(status().state, DEVICE_RUNNING);
    rig.ignores_settings = false;
    run_for(60 * SEC);
    CHECK_STR(status().other_settings, "");
    CHECK_NEAR(status().range_m, 19.968, 1e-9, 0);
}

/* What heads do to their settings by themselves, as recorded: fewer bins, and a direction that changes. */
TEST(a_head_that_leaves_bins_out_is_not_taken_over)
{
    struct device_conf conf = usual_conf();
    rig_running(&conf);
    rig.n_bins = 394;
    rig.control ^= MICRON_SCAN_RIGHT;
    rig.control |= 0x80;
    run_for(10 * SEC);
    CHECK_INT(status().taken_over, 0);
    CHECK_INT(rig.commands, 1);
}

/* Its limits change with every stretch: they are our own. */
TEST(a_head_that_is_steered_is_not_taken_over)
{
    struct device_conf conf = usual_conf();
    conf.steered = true;
    rig_running(&conf);
    device_micron.steer(rig.state, geo_rad(-20), geo_rad(20), false);
    run_for(120 * SEC);
    CHECK(rig.commands > 10);
    CHECK_INT(status().taken_over + status().restarts, 0);
    rig.gain = 42;
    rig.ignores_settings = true;
    run_for(2 * SEC);
    CHECK_INT(status().taken_over, 1);
}

TEST(lost_reply_is_asked_for_again)
{
    struct device_conf conf = usual_conf();
    rig_running(&conf);
    rig.lose_replies = 3;
    unsigned before = rig.pings;
    run_for(5 * SEC);
    CHECK(rig.pings > before + 10);
    CHECK_INT(status().lost_frames, 3);
    CHECK_INT(status().timeouts, 3);
    CHECK_INT(status().restarts, 0);
    CHECK_INT(rig.commands, 1);
    CHECK_INT(rig.warnings, 0);
}

TEST(cut_reply_costs_itself)
{
    struct device_conf conf = usual_conf();
    rig_running(&conf);
    rig.cut_replies = 1;
    run_for(3 * SEC);
    CHECK_INT(status().lost_frames, 1);
    CHECK_INT(status().bad_frame, 1);
    CHECK_INT(status().garbage_bytes, 415);
    unsigned before = rig.pings;
    run_for(SEC);
    CHECK(rig.pings > before + 5);
}

TEST(reply_behind_a_false_head)
{
    struct device_conf conf = usual_conf();
    rig_running(&conf);
    rig.false_head = true;
    run_for(3 * SEC);
    CHECK_INT(status().lost_frames, 0);
    CHECK_INT(status().timeouts, 0);
    CHECK_INT(status().garbage_bytes, 13);
    CHECK_INT(status().bad_frame, 1);
}

TEST(packet_that_comes_too_late)
{
    struct device_conf conf = usual_conf();
    uint8_t payload[100], b[100], data[50] = {0};
    struct reply r = usual_reply;
    conf.listen_only = true;
    r.n = 50;
    build_payload(payload, &r, data);
    for (int late = 0; late < 2; late++) {
        rig_new(&conf);
        rig_open();
        size_t n = seanet_build(b, sizeof b, (struct seanet_head){2, 255, SEANET_HEAD_DATA, 0}, payload, 61);
        device_micron.feed(rig.state, b, n, rig.now_ns, &rig.io);
        rig.now_ns += late ? SEC + MS : SEC;
        n = seanet_build(b, sizeof b, (struct seanet_head){2, 255, SEANET_HEAD_DATA, 1 | SEANET_LAST_PACKET}, data,
                         20);
        device_micron.feed(rig.state, b, n, rig.now_ns, &rig.io);
        CHECK_INT(rig.pings, !late);
        CHECK_INT(status().bad_frame, late);
    }
}

TEST(gain_in_tenths)
{
    static const struct {
        int gain;
        unsigned sent;
    } row[] = {{-1, 84}, {0, 0}, {1, 21}, {10, 210}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct device_conf conf = usual_conf();
        conf.gain = row[i].gain;
        rig_running(&conf);
        CHECK_INT(rig.gain, row[i].sent);
    }
}

/* Between two pings, once, and its own new settings are no other program's. */
TEST(a_head_takes_other_settings_while_it_scans)
{
    struct device_conf conf = usual_conf();
    rig_running(&conf);
    const unsigned commands = rig.commands;
    conf.range_m = 5;
    conf.gain = 8;
    device_micron.retune(rig.state, &conf, rig.now_ns, &rig.io);
    CHECK_INT(rig.commands, commands);
    run_for(10 * SEC);
    CHECK_INT(rig.commands, commands + 1);
    CHECK_INT(rig.gain, 168);
    CHECK_NEAR(status().range_m, 5, 0.1, 0);
    CHECK_INT(status().taken_over, 0);
    CHECK_INT(status().restarts, 0);
    CHECK_INT(status().timeouts, 0);
}

TEST(silence_settings_reboot)
{
    struct device_conf conf = usual_conf();
    rig_running(&conf);
    rig.lose_replies = 7;
    run_for(9 * SEC);
    CHECK_INT(rig.commands, 2); /* told again, not rebooted */
    CHECK_INT(rig.reboots, 0);
    CHECK_INT(rig.warnings, 1);
    CHECK_INT(status().state, DEVICE_RUNNING);
    rig.mute = true;
    rig.queued = 0;
    run_for(15 * SEC);
    CHECK_INT(status().state, DEVICE_SILENT);
    CHECK_INT(status().restarts, 1);
    run_for(300 * SEC);
    CHECK_INT(rig.warnings, 2); /* once per silence */
    rig.mute = false;
    reboot_head();
    unsigned before = rig.pings;
    run_for(12 * SEC); /* no need to wait for the next try: it shows itself */
    CHECK(rig.pings > before + 10);
    CHECK_INT(status().state, DEVICE_RUNNING);
}

TEST(reboots_come_ever_later)
{
    struct device_conf conf = usual_conf();
    rig_new(&conf);
    rig.mute = true;
    rig_open();
    run_for(1000 * SEC);
    /* deadlines at 3, 33, 93, 213, 333, ... s */
    CHECK_INT(status().timeouts, 10);
    CHECK_INT(rig.warnings, 1);
    CHECK_INT(status().state, DEVICE_SILENT);
}

TEST(power_dip)
{
    struct device_conf conf = usual_conf();
    rig_running(&conf);
    reboot_head();
    run_for(20 * SEC);
    CHECK_INT(rig.commands, 2);
    CHECK_INT(rig.reboots, 0);
    CHECK_INT(status().restarts, 1);
    CHECK_INT(rig.warnings, 1);
    CHECK_INT(status().state, DEVICE_RUNNING);
}

TEST(motor_error)
{
    struct device_conf conf = usual_conf();
    rig_running(&conf);
    unsigned before = rig.pings;
    rig.motor_error = true;
    run_for(200 * MS);
    CHECK_INT(rig.commands, 2);
    CHECK_INT(status().bad_frame, 1);
    CHECK_INT(rig.warnings, 1);
    rig.scanning = false; /* and it shows that it has the settings */
    rig.next_alive_ns = rig.now_ns;
    run_for(3 * SEC);
    CHECK(rig.pings > before + 10);
}

TEST(settings_that_are_never_taken)
{
    struct device_conf conf = usual_conf();
    rig_new(&conf);
    rig.ignores_settings = true;
    rig_open();
    run_for(60 * SEC);
    CHECK(status().restarts > 1);
    CHECK_INT(rig.warnings, 1);
    CHECK_INT(status().state, DEVICE_SILENT);
}

TEST(version_that_is_never_told)
{
    struct device_conf conf = usual_conf();
    rig_new(&conf);
    rig.knows_version = false;
    rig_open();
    run_for(14 * SEC);
    CHECK_INT(rig.ask_version, 3);
    CHECK_INT(rig.reboots, 1);
    CHECK_INT(rig.warnings, 1);
}

TEST(own_words_on_a_two_wire_line)
{
    struct device_conf conf = usual_conf();
    rig_new(&conf);
    rig.echoes = true;
    rig_open();
    run_to_ping(20, 10 * SEC);
    CHECK_INT(rig.pings, 20);
    CHECK_INT(status().garbage_bytes, 0);
    CHECK_INT(status().bad_frame, 0);
}

TEST(other_nodes_of_the_bus)
{
    struct device_conf conf = usual_conf();
    uint8_t b[300], payload[200], data[50] = {0};
    struct reply r = usual_reply;
    r.n = 50;
    size_t length = build_payload(payload, &r, data);
    rig_running(&conf);
    unsigned before = rig.pings;
    uint64_t frames = status().frames;
    size_t n = seanet_build(b, sizeof b, (struct seanet_head){20, 255, SEANET_HEAD_DATA, SEANET_LAST_PACKET},
                            payload, length);
    device_micron.feed(rig.state, b, n, rig.now_ns, &rig.io);
    CHECK_INT(rig.pings, before);
    CHECK_INT(status().frames, frames + 1);
}

TEST(listening)
{
    struct device_conf conf = usual_conf();
    uint8_t b[300], payload[200], data[50] = {0};
    struct reply r = {0x2305, 104, 0, 50, 0x10, 8, 81, 32, 84, 0, 6399};
    static const unsigned bearing[] = {3000, 3032, 3064, 3160, 3188, 3188, 3156};
    conf.listen_only = true;
    rig_new(&conf);
    rig_open();
    CHECK(device_micron.deadline(rig.state) == UINT64_MAX);
    for (size_t i = 0; i < sizeof bearing / sizeof bearing[0]; i++) {
        r.bearing = bearing[i];
        size_t n = seanet_build(b, sizeof b, (struct seanet_head){2, 255, SEANET_HEAD_DATA, SEANET_LAST_PACKET},
                                payload, build_payload(payload, &r, data));
        device_micron.feed(rig.state, b, n, rig.now_ns, &rig.io);
    }
    CHECK_INT(rig.pings, 7);
    CHECK_INT(status().lost_frames, 2);
    CHECK_INT(rig.ping_flags[5], PING_NEW_TURN); /* where it turned round */
    CHECK_INT(rig.ping_flags[4] | rig.ping_flags[6], 0);
    CHECK_INT(rig.requests + rig.commands + rig.reboots, 0);
    CHECK_INT(status().state, DEVICE_RUNNING);
}

TEST(stop_asks_no_more)
{
    struct device_conf conf = usual_conf();
    rig_running(&conf);
    unsigned requests = rig.requests;
    device_micron.stop(rig.state, rig.now_ns, &rig.io);
    CHECK(device_micron.deadline(rig.state) == UINT64_MAX);
    run_for(5 * SEC);
    CHECK_INT(rig.requests, requests);
    CHECK_INT(status().state, DEVICE_CLOSED);
}

TEST(no_room_drops_the_ping_only)
{
    struct device_conf conf = usual_conf();
    rig_running(&conf);
    unsigned before = rig.pings;
    rig.no_room = true;
    run_for(SEC);
    CHECK_INT(rig.pings, before);
    CHECK(status().pings > before);
}

TEST(reopened)
{
    struct device_conf conf = usual_conf();
    rig_running(&conf);
    device_micron.closed(rig.state, rig.now_ns);
    CHECK_INT(status().state, DEVICE_CLOSED);
    CHECK(device_micron.deadline(rig.state) == UINT64_MAX);
    rig.queued = 0;
    run_for(SEC);
    unsigned before = rig.pings;
    rig_open();
    run_to_ping(before + 5, 40 * SEC);
    CHECK_INT(rig.pings, before + 5);
}

int main(void)
{
    RUN(settings_for_a_range);
    RUN(settings_are_legal_everywhere);
    RUN(settings_for_a_scan);
    RUN(commands_byte_by_byte);
    RUN(ways);
    RUN(eight_bit_line_as_ping);
    RUN(bearings);
    RUN(four_bit_line_as_ping);
    RUN(senseless_lines);
    RUN(packets_are_joined);
    RUN(packets_with_a_gap_are_dropped);
    RUN(packets_of_the_wrong_size_are_dropped);
    RUN(configuration_faults_name_the_key);
    RUN(handshake);
    RUN(head_that_was_left_scanning);
    RUN(head_that_is_still_centring);
    RUN(one_request_per_ping);
    RUN(full_circles);
    RUN(sectors);
    RUN(four_bit_and_several_packets);
    RUN(range_that_changes_while_running);
    RUN(a_head_with_settings_of_others_is_set_up_again);
    RUN(a_head_that_leaves_bins_out_is_not_taken_over);
    RUN(a_head_that_is_steered_is_not_taken_over);
    RUN(lost_reply_is_asked_for_again);
    RUN(cut_reply_costs_itself);
    RUN(reply_behind_a_false_head);
    RUN(packet_that_comes_too_late);
    RUN(gain_in_tenths);
    RUN(a_head_takes_other_settings_while_it_scans);
    RUN(silence_settings_reboot);
    RUN(reboots_come_ever_later);
    RUN(power_dip);
    RUN(motor_error);
    RUN(settings_that_are_never_taken);
    RUN(version_that_is_never_told);
    RUN(own_words_on_a_two_wire_line);
    RUN(other_nodes_of_the_bus);
    RUN(listening);
    RUN(stop_asks_no_more);
    RUN(no_room_drops_the_ping_only);
    RUN(reopened);
    free(rig.state);
    return test_end();
}
