/* SPDX-License-Identifier: MIT */
/*
 * The Ping1D device against a scripted echosounder on a simulated clock, and its messages against the worked frames of
 * the protocol's description.
 */
#include "core/fault.h"
#include "drivers/devices/device.h"
#include "drivers/devices/ping1d.h"
#include "drivers/devices/ping_bytes.h"
#include "tests/lib/test.h"

#define MS  1000000ull
#define SEC 1000000000ull

/* ---- the rig: device, clock, echosounder ---- */

struct answer {
    uint64_t t_ns;
    size_t n;
    uint8_t bytes[PING_FRAME_MAX];
};

static struct rig {
    void *state;
    struct device_io io;
    uint64_t now_ns;

    /* what the echosounder does */
    bool mute, no_acks, nack_all, deaf_to_speed, no_stream;
    bool refuses_4, refuses_1200, deaf_to_1200, refuses_stream, no_distances, no_profiles, refuses_profiles;
    uint16_t refused_as; /* id in the refusal of a request; 0: of the wanted message */
    uint8_t type, revision;
    uint32_t distance_mm;
    uint16_t confidence;
    bool same_number;
    unsigned lose, flip; /* so many of the next readings */

    /* where it is */
    bool streams;
    uint64_t next_ns;
    uint32_t number, speed_mmps, start_mm, length_mm, gain;
    bool ignores_settings;
    struct answer queue[64];
    unsigned queued;

    /* what was seen */
    uint16_t sent[256];
    uint32_t sent_a[256];
    unsigned n_sent, pings, warnings;
    struct ping last;
    struct ping_beam last_beam;
    char notes[4096];
    struct ping buffer;
    struct ping_beam beam;
    uint8_t samples[PING1D_SAMPLES_MAX];
} rig;

static void answer(const uint8_t *bytes, size_t n)
{
    if (rig.queued == 64)
        abort();
    struct answer *a = &rig.queue[rig.queued++];
    a->t_ns = rig.now_ns + 5 * MS;
    a->n = n;
    memcpy(a->bytes, bytes, n);
}

static void answer_message(uint16_t id, const void *payload, size_t n)
{
    uint8_t b[PING_FRAME_MAX];
    answer(b, ping_frame_build(b, sizeof b, id, 1, payload, n));
}

static void answer_reading(bool profile)
{
    static const uint8_t samples[PING1D_SAMPLES];
    uint8_t b[PING_FRAME_MAX];
    struct ping1d_reading r = {.distance_mm = rig.distance_mm,
                               .confidence_percent = rig.confidence,
                               .transmit_us = 100,
                               .ping_number = rig.same_number ? rig.number : ++rig.number,
                               .start_mm = rig.start_mm,
                               .length_mm = rig.length_mm,
                               .gain = rig.gain,
                               .n_samples = profile ? PING1D_SAMPLES : 0,
                               .samples = samples};
    size_t n = ping1d_encode_reading(b, sizeof b, 1, &r);
    if (rig.lose > 0) {
        rig.lose--;
        return;
    }
    if (rig.flip > 0) {
        rig.flip--;
        b[12] ^= 0x10;
    }
    answer(b, n);
}

static void refuse(uint16_t id, const char *text)
{
    uint8_t payload[64];
    put_u16(payload, id);
    memcpy(payload + 2, text, strlen(text));
    answer_message(PING_NACK, payload, 2 + strlen(text));
}

static void on_request(uint16_t id)
{
    static const uint8_t firmware[6] = {1, 1, 3, 0, 24, 0}; /* echosounder, Ping1D, 3.24 */
    uint8_t speed[4];
    const uint8_t info[6] = {rig.type, rig.revision, 3, 29, 1, 0};
    put_u32(speed, rig.speed_mmps);
    if ((id == PING_DEVICE_INFORMATION && rig.refuses_4) || (id == PING1D_FIRMWARE_VERSION && rig.refuses_1200))
        refuse(rig.refused_as ? rig.refused_as : id, "bad request");
    else if (id == PING_DEVICE_INFORMATION)
        answer_message(id, info, sizeof info);
    else if (id == PING1D_FIRMWARE_VERSION && !rig.deaf_to_1200)
        answer_message(id, firmware, sizeof firmware);
    else if (id == PING1D_SPEED_OF_SOUND)
        answer_message(id, speed, sizeof speed);
    else if (id == PING1D_DISTANCE && !rig.no_distances)
        answer_reading(false);
    else if (id == PING1D_PROFILE && rig.refuses_profiles)
        refuse(rig.refused_as ? rig.refused_as : id, "bad request");
    else if (id == PING1D_PROFILE && !rig.no_profiles)
        answer_reading(true);
}

static void on_set(uint16_t id, uint32_t value, uint32_t second)
{
    uint8_t payload[2 + 9];
    put_u16(payload, id);
    memcpy(payload + 2, "won't do\x01", 9);
    if (rig.nack_all || (id == PING1D_CONTINUOUS_START && rig.refuses_stream)) {
        answer_message(PING_NACK, payload, sizeof payload);
        return;
    }
    if (id == PING1D_SET_SPEED_OF_SOUND && !rig.deaf_to_speed)
        rig.speed_mmps = value;
    if (id == PING1D_SET_RANGE && !rig.ignores_settings)
        rig.start_mm = value, rig.length_mm = second;
    if (id == PING1D_SET_GAIN && !rig.ignores_settings)
        rig.gain = value;
    if (id == PING1D_CONTINUOUS_STOP)
        rig.streams = false;
    if (id == PING1D_CONTINUOUS_START && !rig.no_stream) {
        rig.streams = true;
        rig.next_ns = rig.now_ns + 50 * MS;
    }
    if (!rig.no_acks)
        answer_message(PING_ACK, payload, 2);
}

static void take_sent(void *ctx, const uint8_t *b, size_t n)
{
    static struct ping_parser parser;
    struct ping_frame f;
    (void)ctx;
    ping_parser_init(&parser, PING_PAYLOAD_MAX);
    CHECK(ping_parser_next(&parser, &b, &n, rig.now_ns, &f) && n == 0);
    uint16_t id = f.id == PING_GENERAL_REQUEST ? get_u16(f.payload) : f.id;
    CHECK(id != 1100); /* the way to the bootloader */
    uint8_t value[8] = {0};
    memcpy(value, f.payload, f.length < 8 ? f.length : 8);
    rig.sent[rig.n_sent % 256] = id;
    rig.sent_a[rig.n_sent++ % 256] = get_u32(value);
    if (rig.mute)
        return;
    if (f.id == PING_GENERAL_REQUEST)
        on_request(id);
    else
        on_set(id, get_u32(value), get_u32(value + 4));
}

static void take_break(void *ctx, bool on)
{
    (void)ctx;
    (void)on;
    CHECK(false);
}

static struct ping *begin_ping(void *ctx)
{
    (void)ctx;
    rig.buffer = (struct ping){
        .beam = &rig.beam, .max_beams = 1, .samples = rig.samples, .max_samples = sizeof rig.samples};
    return &rig.buffer;
}

static void done_ping(void *ctx, struct ping *p)
{
    (void)ctx;
    rig.pings++;
    rig.last = *p;
    rig.last_beam = p->beam[0];
}

static void take_note(void *ctx, enum device_note level, const char *fmt, ...)
{
    size_t used = strlen(rig.notes);
    va_list args;
    (void)ctx;
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
        .range_m = 10.5, .sound_speed_mps = 1500.0, .gain = -1, .min_confidence = 0.5, .baud = 115200};
}

static void rig_new(const struct device_conf *conf)
{
    struct fault fault = {""};
    free(rig.state);
    rig = (struct rig){.state = calloc(1, device_ping1d.state_size),
                       .io = {NULL, take_sent, take_break, begin_ping, done_ping, take_note},
                       .now_ns = 100 * SEC,
                       .type = 1,
                       .distance_mm = 7250,
                       .confidence = 95,
                       .speed_mmps = 1500000,
                       .start_mm = 500,
                       .length_mm = 10000};
    if (!device_ping1d.init(rig.state, conf, &fault)) {
        printf("init: %s\n", fault.text);
        abort();
    }
}

static void rig_open(const struct device_conf *conf)
{
    rig_new(conf);
    device_ping1d.opened(rig.state, rig.now_ns, &rig.io);
}

static void run_for(uint64_t ns)
{
    uint64_t end_ns = rig.now_ns + ns;
    for (;;) {
        uint64_t due_ns = device_ping1d.deadline(rig.state), next_ns = end_ns;
        unsigned first = UINT32_MAX;
        for (unsigned i = 0; i < rig.queued; i++)
            if (rig.queue[i].t_ns < next_ns)
                next_ns = rig.queue[i].t_ns, first = i;
        bool profile = rig.streams && rig.next_ns < next_ns;
        next_ns = profile ? rig.next_ns : next_ns;
        bool tick = due_ns < next_ns;
        next_ns = tick ? due_ns : next_ns;
        rig.now_ns = next_ns > rig.now_ns ? next_ns : rig.now_ns;
        if (tick) {
            device_ping1d.tick(rig.state, rig.now_ns, &rig.io);
            CHECK(device_ping1d.deadline(rig.state) > rig.now_ns);
        } else if (profile) {
            rig.next_ns += 50 * MS;
            if (!rig.mute)
                answer_reading(true);
        } else if (first != UINT32_MAX) {
            struct answer a = rig.queue[first];
            rig.queue[first] = rig.queue[--rig.queued];
            device_ping1d.feed(rig.state, a.bytes, a.n, rig.now_ns, &rig.io);
        } else {
            return;
        }
    }
}

static struct device_status status(void)
{
    struct device_status s;
    device_ping1d.status(rig.state, &s);
    return s;
}

static unsigned times_sent(uint16_t id)
{
    unsigned n = 0;
    for (unsigned i = 0; i < rig.n_sent && i < 256; i++)
        n += rig.sent[i] == id;
    return n;
}

static uint32_t value_sent(uint16_t id)
{
    for (unsigned i = 0; i < rig.n_sent && i < 256; i++)
        if (rig.sent[i] == id)
            return rig.sent_a[i];
    return UINT32_MAX;
}

/* Bytes of a worked frame, fed to a device that only listens. */
static void hear(const struct device_conf *conf, const uint8_t *bytes, size_t n)
{
    struct device_conf listener = *conf;
    listener.listen_only = true;
    rig_open(&listener);
    device_ping1d.feed(rig.state, bytes, n, rig.now_ns, &rig.io);
}

/* ---- messages ---- */

static const uint8_t worked_profile[] = {0x42, 0x52, 0x22, 0x00, 0x14, 0x05, 0x01, 0x00, 0x52, 0x1C, 0x00,
                                         0x00, 0x5F, 0x00, 0x64, 0x00, 0x67, 0x12, 0x00, 0x00, 0xF4, 0x01,
                                         0x00, 0x00, 0x10, 0x27, 0x00, 0x00, 0x03, 0x00, 0x00, 0x00, 0x08,
                                         0x00, 0x00, 0x03, 0x09, 0x28, 0xFA, 0x78, 0x1E, 0x05, 0x7A, 0x05};
static const uint8_t worked_simple[] = {0x42, 0x52, 0x05, 0x00, 0xBB, 0x04, 0x01, 0x00,
                                        0x52, 0x1C, 0x00, 0x00, 0x5F, 0x26, 0x02};

TEST(worked_frames_are_written)
{
    static const uint8_t range[] = {0x42, 0x52, 0x08, 0x00, 0xE9, 0x03, 0x00, 0x00, 0xF4,
                                    0x01, 0x00, 0x00, 0x10, 0x27, 0x00, 0x00, 0xB4, 0x02};
    static const uint8_t start[] = {0x42, 0x52, 0x02, 0x00, 0x78, 0x05, 0x00, 0x00, 0x14, 0x05, 0x2C, 0x01};
    static const uint8_t stop[] = {0x42, 0x52, 0x02, 0x00, 0x79, 0x05, 0x00, 0x00, 0x14, 0x05, 0x2D, 0x01};
    uint8_t b[PING_FRAME_MAX];
    CHECK_INT(ping1d_encode_set(b, sizeof b, PING1D_SET_RANGE, 500, 10000), sizeof range);
    CHECK(memcmp(b, range, sizeof range) == 0);
    CHECK_INT(ping1d_encode_set(b, sizeof b, PING1D_CONTINUOUS_START, PING1D_PROFILE, 0), sizeof start);
    CHECK(memcmp(b, start, sizeof start) == 0);
    CHECK_INT(ping1d_encode_set(b, sizeof b, PING1D_CONTINUOUS_STOP, PING1D_PROFILE, 0), sizeof stop);
    CHECK(memcmp(b, stop, sizeof stop) == 0);
    CHECK_INT(ping1d_encode_set(b, sizeof b, PING1D_SET_GAIN, 3, 0), PING_OVERHEAD + 1);
    CHECK_INT(ping1d_encode_set(b, 5, PING1D_SET_GAIN, 3, 0), 0);

    const struct ping1d_reading r = {7250, 95, false, 100, 4711, 500, 10000, 3, 8, worked_profile + 34};
    CHECK_INT(ping1d_encode_reading(b, sizeof b, 1, &r), sizeof worked_profile);
    CHECK(memcmp(b, worked_profile, sizeof worked_profile) == 0);
    const struct ping1d_reading simple = {.distance_mm = 7250, .confidence_percent = 95, .simple = true};
    CHECK_INT(ping1d_encode_reading(b, sizeof b, 1, &simple), sizeof worked_simple);
    CHECK(memcmp(b, worked_simple, sizeof worked_simple) == 0);
}

TEST(worked_profile_is_read)
{
    const struct device_conf conf = usual_conf();
    hear(&conf, worked_profile, sizeof worked_profile);
    CHECK_INT(rig.pings, 1);
    CHECK_INT(rig.last.kind, PING_CHOICE);
    CHECK_INT(rig.last.law, AMPLITUDE_LINEAR);
    CHECK_INT(rig.last.n_beams, 1);
    CHECK_INT(rig.last.gain, 3);
    CHECK_NEAR(rig.last_beam.range_m, 7.25, 1e-6, 0);
    CHECK_NEAR(rig.last_beam.confidence, 0.95, 1e-6, 0);
    CHECK_NEAR(rig.last_beam.range_sd_m, 10.0 / 8 / sqrt(12.0), 1e-6, 0);
    CHECK_NEAR(rig.last.pulse_m, 0.075, 1e-6, 0);
    CHECK_NEAR(rig.last.r0_m, 0.5, 1e-6, 0);
    CHECK_NEAR(rig.last.dr_m, 10.0 / 8, 1e-6, 0);
    CHECK_NEAR(rig.last.deaf_m, 0.5, 1e-6, 0);
    CHECK_INT(ping_bytes(&rig.last), 8);
    CHECK(memcmp(rig.samples, worked_profile + 34, 8) == 0);
    CHECK_NEAR(rig.last.az_aperture_rad, geo_rad(30), 1e-6, 0);
    CHECK_INT(rig.last.t_in_ns, rig.now_ns);
    CHECK_NEAR((double)(rig.now_ns - rig.last.t_ns) * 1e-9, 44 * 10 / 115200.0 + 2 * 10.5 / 1500.0, 1e-6, 0);
    CHECK_NEAR(status().range_m, 10.5, 1e-9, 0);
}

TEST(worked_simple_distance_is_read)
{
    const struct device_conf conf = usual_conf();
    hear(&conf, worked_simple, sizeof worked_simple);
    CHECK_INT(rig.pings, 1);
    CHECK_INT(rig.last.kind, PING_RANGES);
    CHECK_INT(ping_bytes(&rig.last), 0);
    CHECK_NEAR(rig.last_beam.range_m, 7.25, 1e-6, 0);
    CHECK_NEAR(rig.last.r0_m, 0.5, 1e-6, 0);
    CHECK_NEAR(rig.last.r0_m + rig.last.dr_m, 10.5, 1e-6, 0);
    CHECK_INT(rig.warnings, 1);
    CHECK(strstr(rig.notes, "distances without profiles, which cannot be checked") != NULL);
}

/* A profile comes as it is, on the axis of its scan; a longer pulse rings for longer. */
TEST(a_profile_is_what_the_choice_is_judged_by)
{
    static const struct {
        uint32_t start_mm;
        uint16_t transmit_us, n;
        double deaf_m;
    } row[] = {{0, 100, 200, 0.5}, {500, 50, 200, 0.5}, {0, 400, 200, 0.7}, {700, 100, PING1D_SAMPLES_MAX, 0.5}};
    static uint8_t samples[PING1D_SAMPLES_MAX];
    const struct device_conf conf = usual_conf();

    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        uint8_t b[PING_FRAME_MAX];
        for (unsigned k = 0; k < row[i].n; k++)
            samples[k] = (uint8_t)(k + i);
        const struct ping1d_reading reading = {.distance_mm = 7250,
                                               .confidence_percent =
                                                   20, /* no choice, and a profile all the same */
                                               .transmit_us = row[i].transmit_us,
                                               .ping_number = 1,
                                               .start_mm = row[i].start_mm,
                                               .length_mm = 10000,
                                               .gain = 700,
                                               .n_samples = row[i].n,
                                               .samples = samples};
        hear(&conf, b, ping1d_encode_reading(b, sizeof b, 1, &reading));
        CHECK_INT(rig.pings, 1);
        CHECK_INT(rig.last.kind, PING_CHOICE);
        CHECK_INT(rig.last.n_bins, row[i].n);
        CHECK(memcmp(rig.samples, samples, row[i].n) == 0);
        CHECK_NEAR(rig.last.r0_m, row[i].start_mm * 1e-3, 1e-6, 0);
        CHECK_NEAR((double)rig.last.dr_m * row[i].n, 10, 1e-6, 0);
        CHECK_NEAR(rig.last.deaf_m, row[i].deaf_m, 1e-6, 0);
        CHECK_INT(rig.last.gain, UINT8_MAX);
        CHECK(rig.last_beam.range_m == 0.0f);
    }
}

/* What another program asks for would be believed unchecked. When profiles stay away it is all that there is. */
TEST(distances_are_left_out_while_profiles_come)
{
    const struct ping1d_reading simple = {.distance_mm = 9000, .confidence_percent = 100, .simple = true};
    const struct ping1d_reading whole = {
        .distance_mm = 9000, .confidence_percent = 100, .ping_number = 4712, .start_mm = 500, .length_mm = 10000};
    const struct device_conf conf = usual_conf();
    uint8_t b[PING_FRAME_MAX];
    for (int k = 0; k < 2; k++) {
        const struct ping1d_reading *alone = k ? &simple : &whole;
        hear(&conf, worked_profile, sizeof worked_profile);
        const size_t n = ping1d_encode_reading(b, sizeof b, 1, alone);
        rig.now_ns += 4 * SEC;
        device_ping1d.feed(rig.state, b, n, rig.now_ns, &rig.io);
        CHECK_INT(rig.pings, 1);
        rig.now_ns += 2 * SEC;
        device_ping1d.feed(rig.state, b, n, rig.now_ns, &rig.io);
        CHECK_INT(rig.pings, 2);
    }
}

/* It detects nothing nearer than its scan begins, as last told, and than its transducer does. */
TEST(water_nearer_than_the_scan_is_not_heard)
{
    static const struct {
        uint32_t start_mm, length_mm;
        double from_m, to_m;
    } row[] = {{500, 10000, 0.5, 10.5}, {2000, 5000, 2.0, 7.0}, {0, 3000, 0.5, 3.0}, {0, 400, 0.5, 0.5}};
    const struct ping1d_reading simple = {.distance_mm = 7250, .confidence_percent = 95, .simple = true};
    const struct device_conf conf = usual_conf();
    uint8_t b[64];

    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        const struct ping1d_reading whole = {.distance_mm = 7250,
                                             .confidence_percent = 95,
                                             .ping_number = 1,
                                             .start_mm = row[i].start_mm,
                                             .length_mm = row[i].length_mm};
        size_t n = ping1d_encode_reading(b, sizeof b, 1, &whole);
        hear(&conf, b, n);
        CHECK_NEAR(rig.last.r0_m, row[i].from_m, 1e-6, 0);
        CHECK_NEAR(rig.last.r0_m + rig.last.dr_m, row[i].to_m, 1e-6, 0);
        n = ping1d_encode_reading(b, sizeof b, 1, &simple);
        device_ping1d.feed(rig.state, b, n, rig.now_ns, &rig.io);
        CHECK_INT(rig.pings, 2);
        CHECK_NEAR(rig.last.r0_m, row[i].from_m, 1e-6, 0);
        hear(&conf, b, n); /* opened anew: nothing is known of its scan */
        CHECK_NEAR(rig.last.r0_m, 0.5, 1e-6, 0);
    }
}

TEST(frames_that_are_too_short_or_senseless)
{
    static const struct {
        const char *name;
        uint16_t id;
        size_t n;
        size_t at;
        uint32_t value;
    } row[] = {
        {"simple cut", PING1D_DISTANCE_SIMPLE, 4, 0, 7250},
        {"distance cut", PING1D_DISTANCE, 23, 0, 7250},
        {"profile cut", PING1D_PROFILE, 25, 0, 7250},
        {"far away", PING1D_PROFILE, 40, 0, 400000},
        {"confidence 101", PING1D_PROFILE, 40, 4, 101},
        {"no length", PING1D_PROFILE, 40, 16, 0},
        {"length of km", PING1D_PROFILE, 40, 16, 0xffffffff},
        {"start of km", PING1D_PROFILE, 40, 12, 0xffffffff},
        {"sound of lead", PING1D_SPEED_OF_SOUND, 4, 0, 5000000},
        {"ack of nothing", PING_ACK, 1, 0, 0},
        {"nack of nothing", PING_NACK, 1, 0, 0},
        {"no identity", PING_DEVICE_INFORMATION, 4, 0, 0},
        {"firmware cut", PING1D_FIRMWARE_VERSION, 5, 0, 0},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        uint8_t payload[40] = {0}, b[64];
        const struct device_conf conf = usual_conf();
        put_u32(payload, 7250);
        put_u32(payload + 12, 500);
        put_u32(payload + 16, 10000);
        put_u32(payload + row[i].at, row[i].value);
        hear(&conf, b, ping_frame_build(b, sizeof b, row[i].id, 1, payload, row[i].n));
        if (rig.pings != 0 || status().bad_frame != 1 || status().frames != 1) {
            printf("%s\n", row[i].name);
            CHECK(false);
        }
    }
}

TEST(a_profile_has_the_samples_that_it_says)
{
    uint8_t b[sizeof worked_profile];
    struct ping1d_reading r;
    memcpy(b, worked_profile, sizeof b);
    const struct ping_frame f = {.id = PING1D_PROFILE, .length = 26 + 8, .payload = b + 8};
    CHECK(ping1d_decode(&f, &r));
    CHECK_INT(r.n_samples, 8);
    put_u16(b + 32, 9);
    CHECK(!ping1d_decode(&f, &r));
    put_u16(b + 32, 60000);
    CHECK(!ping1d_decode(&f, &r));
    put_u16(b + 32, 0);
    CHECK(!ping1d_decode(&f, &r));
    put_u16(b + 32, 5);
    CHECK(ping1d_decode(&f, &r));
    CHECK_INT(r.n_samples, 5);
}

TEST(configuration_faults_name_the_key)
{
    static const struct {
        const char *key;
        double range_m, sound_speed_mps, min_confidence;
        int gain;
    } row[] = {{"range", 1.4, 1500, 0.5, -1},        {"range", 201, 1500, 0.5, -1},
               {"range", NAN, 1500, 0.5, -1},        {"sound_speed", 10, 1300, 0.5, -1},
               {"gain", 10, 1500, 0.5, 7},           {"min_confidence", 10, 1500, 0.0, -1},
               {"min_confidence", 10, 1500, NAN, -1}};
    void *state = calloc(1, device_ping1d.state_size);
    struct fault fault;
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        const struct device_conf conf = {.range_m = row[i].range_m,
                                         .sound_speed_mps = row[i].sound_speed_mps,
                                         .gain = row[i].gain,
                                         .min_confidence = row[i].min_confidence};
        CHECK(!device_ping1d.init(state, &conf, &fault));
        CHECK(strncmp(fault.text, row[i].key, strlen(row[i].key)) == 0);
    }
    free(state);
}

/* ---- readings ---- */

TEST(unsure_readings_are_nothing_heard)
{
    static const struct {
        double least;
        uint16_t confidence;
        uint32_t distance_mm;
        bool heard;
    } row[] = {{0.5, 50, 7250, true},  {0.5, 49, 7250, false}, {0.01, 0, 7250, false}, {0.01, 1, 7250, true},
               {1.0, 99, 7250, false}, {1.0, 100, 7250, true}, {0.5, 100, 0, false}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        uint8_t b[PING_FRAME_MAX];
        struct device_conf conf = usual_conf();
        conf.min_confidence = row[i].least;
        const struct ping1d_reading r = {.distance_mm = row[i].distance_mm,
                                         .confidence_percent = row[i].confidence,
                                         .start_mm = 500,
                                         .length_mm = 10000};
        hear(&conf, b, ping1d_encode_reading(b, sizeof b, 1, &r));
        CHECK_INT(rig.pings, 1);
        CHECK_INT(rig.last_beam.range_m > 0.0f, row[i].heard);
        const bool unsure = !row[i].heard && row[i].confidence > 0 && row[i].distance_mm > 0;
        CHECK_INT(rig.last.flags & PING_UNHEARD, unsure ? PING_UNHEARD : 0);
    }
}

TEST(distances_are_on_the_speed_that_the_device_has)
{
    struct device_conf conf = usual_conf();
    conf.sound_speed_mps = 1450.0;
    rig_open(&conf);
    run_for(SEC);
    CHECK_INT(value_sent(PING1D_SET_SPEED_OF_SOUND), 1450000);
    CHECK_NEAR(rig.last_beam.range_m, 7.25, 1e-6, 0); /* it was told, and says that it obeys */

    rig_new(&conf);
    rig.deaf_to_speed = true;
    device_ping1d.opened(rig.state, rig.now_ns, &rig.io);
    run_for(SEC);
    CHECK_NEAR(rig.last_beam.range_m, 7.25 * 1450 / 1500, 1e-6, 0);
    CHECK_NEAR(rig.last.r0_m, 0.5 * 1450 / 1500, 1e-6, 0);
}

TEST(a_distance_told_twice_is_one_ping)
{
    struct device_conf conf = usual_conf();
    conf.request_response = true;
    rig_open(&conf);
    run_for(SEC);
    unsigned pings = rig.pings, asked = times_sent(PING1D_PROFILE);
    CHECK(pings > 5);
    rig.same_number = true;
    run_for(SEC);
    CHECK(rig.pings <= pings + 1);
    CHECK(times_sent(PING1D_PROFILE) > asked + 5);
    CHECK_INT(times_sent(PING1D_DISTANCE), 0);
    CHECK_INT(status().state, DEVICE_RUNNING);
}

/* ---- life ---- */

TEST(it_is_set_up_and_streams)
{
    struct device_conf conf = usual_conf();
    rig_open(&conf);
    CHECK_INT(status().state, DEVICE_IDENTIFY);
    run_for(SEC);
    CHECK_INT(status().state, DEVICE_RUNNING);
    CHECK_STR(status().what, "Ping1D fw 3.29.1 id 1");
    static const uint16_t order[] = {PING_DEVICE_INFORMATION, PING1D_CONTINUOUS_STOP, PING1D_SET_SPEED_OF_SOUND,
                                     PING1D_SPEED_OF_SOUND,   PING1D_SET_MODE_AUTO,   PING1D_SET_PING_INTERVAL,
                                     PING1D_SET_PING_ENABLE,  PING1D_CONTINUOUS_START};
    CHECK_INT(rig.n_sent, sizeof order / sizeof order[0]);
    CHECK(memcmp(rig.sent, order, sizeof order) == 0);
    CHECK_INT(value_sent(PING1D_SET_MODE_AUTO), 1);
    CHECK_INT(value_sent(PING1D_SET_PING_INTERVAL), 50);
    CHECK_INT(value_sent(PING1D_CONTINUOUS_START), PING1D_PROFILE);
    CHECK(rig.pings > 10);
    CHECK_NEAR(rig.last_beam.range_m, 7.25, 1e-6, 0);
    CHECK_INT(status().timeouts + status().nacks + status().lost_frames + status().restarts, 0);
    CHECK_INT(rig.warnings, 0);
}

TEST(a_gain_of_ones_own_sets_the_range_too)
{
    struct device_conf conf = usual_conf();
    conf.gain = 3;
    conf.range_m = 60.0;
    rig_open(&conf);
    run_for(SEC);
    CHECK_INT(value_sent(PING1D_SET_MODE_AUTO), 0);
    CHECK_INT(value_sent(PING1D_SET_GAIN), 3);
    CHECK_INT(value_sent(PING1D_SET_RANGE), 500);
    CHECK_INT(value_sent(PING1D_SET_PING_INTERVAL), 105);
}

TEST(ping2_has_a_narrower_beam)
{
    struct device_conf conf = usual_conf();
    rig_new(&conf);
    rig.revision = 2;
    device_ping1d.opened(rig.state, rig.now_ns, &rig.io);
    run_for(SEC);
    CHECK_STR(status().what, "Ping2 fw 3.29.1 id 1");
    CHECK_NEAR(rig.last.az_aperture_rad, geo_rad(25), 1e-6, 0);
    CHECK_NEAR(rig.last.el_aperture_rad, geo_rad(25), 1e-6, 0);
}

TEST(another_device_is_refused_and_asked_again)
{
    struct device_conf conf = usual_conf();
    rig_new(&conf);
    rig.type = 2;
    device_ping1d.opened(rig.state, rig.now_ns, &rig.io);
    run_for(5 * SEC);
    CHECK_INT(status().state, DEVICE_SILENT);
    CHECK_INT(rig.warnings, 1);
    CHECK(strstr(rig.notes, "ping360") != NULL);
    rig.type = 1;
    run_for(5 * SEC);
    CHECK_INT(status().state, DEVICE_RUNNING);
}

TEST(old_firmware_that_refuses_its_name_is_set_up_all_the_same)
{
    static const struct {
        const char *name;
        bool refuses_1200, deaf_to_1200;
        uint16_t refused_as;
        const char *what;
    } row[] = {
        {"it tells its firmware", false, false, 0, "Ping1D fw 3.24 id 1"},
        {"and refuses the request around it", false, false, PING_GENERAL_REQUEST, "Ping1D fw 3.24 id 1"},
        {"it refuses that too", true, false, 0, "Ping1D of old firmware"},
        {"it refuses any request", true, false, PING_GENERAL_REQUEST, "Ping1D of old firmware"},
        {"it says nothing to it", false, true, 0, "Ping1D of old firmware"},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        const struct device_conf conf = usual_conf();
        rig_new(&conf);
        rig.refuses_4 = true;
        rig.refuses_1200 = row[i].refuses_1200;
        rig.deaf_to_1200 = row[i].deaf_to_1200;
        rig.refused_as = row[i].refused_as;
        device_ping1d.opened(rig.state, rig.now_ns, &rig.io);
        run_for(3 * SEC);
        const bool good = status().state == DEVICE_RUNNING && strcmp(status().what, row[i].what) == 0;
        if (!good)
            printf("%s: '%s'\n%s", row[i].name, status().what, rig.notes);
        CHECK(good);
        CHECK(rig.pings > 10);
        CHECK_INT(value_sent(PING1D_SET_SPEED_OF_SOUND), 1500000);
        CHECK_INT(rig.warnings, 0);
        CHECK(strstr(rig.notes, "wiring") == NULL);
    }
}

TEST(a_name_that_comes_late_is_taken)
{
    const struct device_conf conf = usual_conf();
    static const uint8_t info[6] = {1, 2, 3, 29, 1, 0}, other[6] = {2, 0, 3, 3, 8, 0};
    rig_new(&conf);
    rig.refuses_4 = rig.deaf_to_1200 = true; /* the refusal was of something else */
    device_ping1d.opened(rig.state, rig.now_ns, &rig.io);
    run_for(100 * MS);
    answer_message(PING_DEVICE_INFORMATION, info, sizeof info);
    run_for(SEC);
    CHECK_STR(status().what, "Ping2 fw 3.29.1 id 1");
    CHECK_INT(status().state, DEVICE_RUNNING);

    rig_new(&conf);
    rig.refuses_4 = rig.deaf_to_1200 = true;
    device_ping1d.opened(rig.state, rig.now_ns, &rig.io);
    run_for(100 * MS);
    answer_message(PING_DEVICE_INFORMATION, other, sizeof other);
    run_for(100 * MS);
    CHECK(strstr(rig.notes, "is a Ping360") != NULL);
}

TEST(profiles_that_are_refused_are_asked_for_one_by_one)
{
    const struct device_conf conf = usual_conf();
    rig_new(&conf);
    rig.refuses_stream = true;
    device_ping1d.opened(rig.state, rig.now_ns, &rig.io);
    run_for(2 * SEC);
    CHECK_INT(status().state, DEVICE_RUNNING);
    CHECK(times_sent(PING1D_PROFILE) > 10 && rig.pings > 10);
    CHECK_INT(times_sent(PING1D_DISTANCE), 0);
    CHECK_INT(rig.last.kind, PING_CHOICE);
    CHECK(strstr(rig.notes, "polled mode") != NULL);
    CHECK_INT(rig.warnings, 0);
}

/* Distances alone are the last resort, and said to be one. Once profiles come it is asked for these again. */
TEST(a_device_without_profiles_is_asked_for_distances)
{
    for (int refuses = 0; refuses < 2; refuses++) {
        struct device_conf conf = usual_conf();
        conf.request_response = true;
        rig_new(&conf);
        rig.no_profiles = !refuses;
        rig.refuses_profiles = refuses;
        device_ping1d.opened(rig.state, rig.now_ns, &rig.io);
        run_for(4 * SEC);
        CHECK_INT(status().state, DEVICE_RUNNING);
        CHECK(times_sent(PING1D_DISTANCE) > 10 && rig.pings > 10);
        CHECK_INT(times_sent(PING1D_PROFILE), refuses ? 1 : 3);
        CHECK_INT(rig.last.kind, PING_RANGES);
        CHECK_INT(rig.warnings, 1);
        CHECK(strstr(rig.notes, "distances without profiles, which cannot be checked") != NULL);
        rig.no_profiles = rig.refuses_profiles = false;
        answer_reading(true);
        run_for(SEC);
        CHECK(times_sent(PING1D_PROFILE) > 10);
        CHECK_INT(rig.last.kind, PING_CHOICE);
    }
}

TEST(an_echosounder_without_readings_is_not_called_one_that_stopped)
{
    const struct device_conf conf = usual_conf();
    rig_new(&conf);
    rig.refuses_stream = rig.no_distances = rig.no_profiles = true;
    device_ping1d.opened(rig.state, rig.now_ns, &rig.io);
    run_for(5 * SEC);
    CHECK_INT(status().state, DEVICE_SILENT);
    CHECK_INT(rig.warnings, 1);
    CHECK(strstr(rig.notes, "is there, but sends no readings") != NULL);
    CHECK(strstr(rig.notes, "stopped") == NULL);
}

TEST(settings_without_ack_are_done_without)
{
    struct device_conf conf = usual_conf();
    rig_new(&conf);
    rig.no_acks = true;
    device_ping1d.opened(rig.state, rig.now_ns, &rig.io);
    run_for(20 * SEC);
    CHECK_INT(status().state, DEVICE_RUNNING);
    CHECK(rig.pings > 10);
    CHECK(strstr(rig.notes, "1003 is not acknowledged") != NULL);
}

TEST(refusals_are_counted_and_end_nothing)
{
    struct device_conf conf = usual_conf();
    rig_new(&conf);
    rig.nack_all = true;
    device_ping1d.opened(rig.state, rig.now_ns, &rig.io);
    run_for(400 * MS);
    CHECK_INT(status().nacks, 6);
    CHECK(strstr(rig.notes, "won't do\\x01") != NULL);
    rig.nack_all = false;
    run_for(3 * SEC);
    CHECK_INT(status().state, DEVICE_RUNNING);
    uint64_t nacks = status().nacks, restarts = status().restarts;
    answer_message(PING_NACK, "\6\0bad continuous request id: 6", 30);
    run_for(SEC);
    CHECK_INT(status().nacks, nacks + 1);
    CHECK_INT(status().state, DEVICE_RUNNING);
    CHECK_INT(status().restarts, restarts);
}

TEST(nobody_there_is_said_once)
{
    struct device_conf conf = usual_conf();
    rig_new(&conf);
    rig.mute = true;
    device_ping1d.opened(rig.state, rig.now_ns, &rig.io);
    run_for(60 * SEC);
    CHECK_INT(status().state, DEVICE_SILENT);
    CHECK_INT(rig.warnings, 1);
    CHECK(times_sent(PING_DEVICE_INFORMATION) > 20);
    rig.mute = false;
    run_for(5 * SEC);
    CHECK_INT(status().state, DEVICE_RUNNING);
}

TEST(silence_is_answered_by_setting_it_up_anew)
{
    struct device_conf conf = usual_conf();
    rig_open(&conf);
    run_for(SEC);
    rig.mute = true;
    run_for(10 * SEC);
    CHECK_INT(status().state, DEVICE_SILENT);
    CHECK_INT(status().restarts, 1);
    CHECK_INT(rig.warnings, 1);
    rig.mute = false;
    run_for(5 * SEC);
    CHECK_INT(status().state, DEVICE_RUNNING);
}

/* Power came back after `dark`: it counts from 1, sends nothing by itself, and reckons with a speed of its own. */
static void start_rig_anew(uint64_t dark_ns)
{
    rig.mute = true;
    run_for(dark_ns);
    rig.mute = rig.streams = false;
    rig.number = 0;
    rig.speed_mmps = 1500000;
}

TEST(an_echosounder_that_started_anew_is_set_up_anew)
{
    static const struct {
        bool request;
        uint64_t dark_ns;
    } row[] = {{false, 0}, {false, 300 * MS}, {false, 20 * SEC}, {true, 0}, {true, 300 * MS}, {true, 20 * SEC}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct device_conf conf = usual_conf();
        conf.request_response = row[i].request;
        conf.sound_speed_mps = 1450;
        rig_open(&conf);
        run_for(3 * SEC);
        CHECK_NEAR(rig.last_beam.range_m, 7.25, 1e-6, 0);
        unsigned settings = times_sent(PING1D_SET_PING_INTERVAL);
        start_rig_anew(row[i].dark_ns);
        run_for(4 * SEC);
        CHECK_INT(rig.speed_mmps, 1450000);
        CHECK(times_sent(PING1D_SET_PING_INTERVAL) > settings);
        CHECK_INT(status().state, DEVICE_RUNNING);
        CHECK_INT(rig.warnings, 1);
        CHECK_NEAR(rig.last_beam.range_m, 7.25, 1e-6, 0);
    }
}

/* Another program sets 2 m, another gain and speed of sound; it is noticed by what the readings say. */
TEST(an_echosounder_with_settings_of_others_is_set_up_again)
{
    for (int request = 0; request < 2; request++) {
        struct device_conf conf = usual_conf();
        conf.gain = 3;
        conf.range_m = 20;
        conf.request_response = request;
        rig_open(&conf);
        run_for(3 * SEC);
        CHECK_INT(status().taken_over, 0);
        unsigned settings = times_sent(PING1D_SET_RANGE);
        rig.length_mm = 1500;
        rig.gain = 6;
        rig.speed_mmps = 1400000;
        rig.distance_mm = 0; /* nothing within 2 m */
        const unsigned before = rig.pings;
        for (int i = 0; i < 2000 && rig.pings < before + 4; i++)
            run_for(MS);
        CHECK_NEAR(rig.last.r0_m + rig.last.dr_m * PING1D_SAMPLES, 2, 1e-6,
                   0); /* free up to there, not to what was sent */
        CHECK_NEAR(status().range_m, 2, 1e-9, 0);
        run_for(3 * SEC);
        CHECK_INT(times_sent(PING1D_SET_RANGE), settings + 1);
        CHECK_INT(status().taken_over, 1);
        CHECK_INT(status().restarts, 1);
        CHECK_INT(rig.warnings, 1);
        CHECK(strstr(rig.notes,
                     "another program?); sending them again: scan_length 1500 (sent 19500), gain_setting 6 "
                     "(sent 3)") != NULL);
        CHECK_STR(status().other_settings, "");
        CHECK_INT(rig.speed_mmps, 1500000);
        CHECK_NEAR(status().range_m, 20, 1e-9, 0);
        CHECK_INT(status().state, DEVICE_RUNNING);
    }
}

/* Its own choice is not anybody's; and how it rounds what it is told is not known. */
TEST(a_scan_that_the_echosounder_chose_is_no_takeover)
{
    struct device_conf conf = usual_conf();
    rig_open(&conf);
    run_for(SEC);
    rig.length_mm = 3000;
    rig.gain = 5;
    run_for(3 * SEC);
    CHECK_INT(status().taken_over, 0);
    CHECK_NEAR(status().range_m, 3.5, 1e-9, 0);

    conf.gain = 3;
    conf.range_m = 20;
    rig_open(&conf);
    run_for(SEC);
    rig.length_mm = 19000;
    run_for(3 * SEC);
    CHECK_INT(status().taken_over, 0);
}

/* distance_simple says no scan: it is the one that the last reading said, and no more is called free. */
TEST(a_simple_distance_is_of_the_scan_that_was_told_last)
{
    const struct ping1d_reading whole = {
        .distance_mm = 1200, .confidence_percent = 95, .ping_number = 5, .start_mm = 700, .length_mm = 1500};
    const struct ping1d_reading nothing = {.simple = true};
    const struct device_conf conf = usual_conf();
    uint8_t b[PING_FRAME_MAX];
    hear(&conf, b, ping1d_encode_reading(b, sizeof b, 1, &nothing));
    CHECK_NEAR(rig.last.r0_m, 0.5, 1e-6, 0);
    CHECK_NEAR(rig.last.r0_m + rig.last.dr_m, 10.5, 1e-6, 0);
    hear(&conf, b, ping1d_encode_reading(b, sizeof b, 1, &whole));
    device_ping1d.feed(rig.state, b, ping1d_encode_reading(b, sizeof b, 1, &nothing), rig.now_ns, &rig.io);
    CHECK_INT(rig.pings, 2);
    CHECK_NEAR(rig.last.r0_m, 0.7, 1e-6, 0);
    CHECK_NEAR(rig.last.r0_m + rig.last.dr_m, 2.2, 1e-6, 0);
    CHECK_NEAR(status().range_m, 2.2, 1e-9, 0);
}

TEST(lost_and_broken_readings_are_counted)
{
    struct device_conf conf = usual_conf();
    rig_open(&conf);
    run_for(SEC);
    rig.lose = 3;
    run_for(SEC);
    CHECK_INT(status().lost_frames, 3);
    rig.flip = 2;
    run_for(SEC);
    CHECK_INT(status().bad_checksum, 2);
    CHECK_INT(status().lost_frames, 5);
    CHECK_INT(status().restarts, 0);
    rig.number = 5; /* it was switched off and on */
    run_for(SEC);
    CHECK_INT(status().lost_frames, 5);
}

TEST(it_is_stopped)
{
    struct device_conf conf = usual_conf();
    rig_open(&conf);
    run_for(SEC);
    device_ping1d.stop(rig.state, rig.now_ns, &rig.io);
    run_for(SEC);
    CHECK(!rig.streams);
    CHECK(device_ping1d.deadline(rig.state) == UINT64_MAX);
    CHECK_INT(status().state, DEVICE_CLOSED);

    rig_open(&conf);
    run_for(SEC);
    rig.mute = true;
    unsigned stops = times_sent(PING1D_CONTINUOUS_STOP);
    device_ping1d.stop(rig.state, rig.now_ns, &rig.io);
    run_for(2 * SEC);
    CHECK_INT(times_sent(PING1D_CONTINUOUS_STOP), stops + 3);
    CHECK(device_ping1d.deadline(rig.state) == UINT64_MAX);
}

TEST(a_listener_says_nothing)
{
    const struct device_conf conf = usual_conf();
    hear(&conf, worked_profile, sizeof worked_profile);
    device_ping1d.stop(rig.state, rig.now_ns, &rig.io);
    run_for(10 * SEC);
    CHECK_INT(rig.n_sent, 0);
    CHECK(device_ping1d.deadline(rig.state) == UINT64_MAX);
}

int main(void)
{
    RUN(worked_frames_are_written);
    RUN(worked_profile_is_read);
    RUN(worked_simple_distance_is_read);
    RUN(a_profile_is_what_the_choice_is_judged_by);
    RUN(distances_are_left_out_while_profiles_come);
    RUN(water_nearer_than_the_scan_is_not_heard);
    RUN(frames_that_are_too_short_or_senseless);
    RUN(a_profile_has_the_samples_that_it_says);
    RUN(configuration_faults_name_the_key);
    RUN(unsure_readings_are_nothing_heard);
    RUN(distances_are_on_the_speed_that_the_device_has);
    RUN(a_distance_told_twice_is_one_ping);
    RUN(it_is_set_up_and_streams);
    RUN(a_gain_of_ones_own_sets_the_range_too);
    RUN(ping2_has_a_narrower_beam);
    RUN(another_device_is_refused_and_asked_again);
    RUN(old_firmware_that_refuses_its_name_is_set_up_all_the_same);
    RUN(a_name_that_comes_late_is_taken);
    RUN(profiles_that_are_refused_are_asked_for_one_by_one);
    RUN(a_device_without_profiles_is_asked_for_distances);
    RUN(an_echosounder_without_readings_is_not_called_one_that_stopped);
    RUN(settings_without_ack_are_done_without);
    RUN(refusals_are_counted_and_end_nothing);
    RUN(nobody_there_is_said_once);
    RUN(silence_is_answered_by_setting_it_up_anew);
    RUN(an_echosounder_that_started_anew_is_set_up_anew);
    RUN(an_echosounder_with_settings_of_others_is_set_up_again);
    RUN(a_scan_that_the_echosounder_chose_is_no_takeover);
    RUN(a_simple_distance_is_of_the_scan_that_was_told_last);
    RUN(lost_and_broken_readings_are_counted);
    RUN(it_is_stopped);
    RUN(a_listener_says_nothing);
    free(rig.state);
    return test_end();
}
