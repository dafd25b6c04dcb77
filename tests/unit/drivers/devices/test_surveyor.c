/* SPDX-License-Identifier: MIT */
/*
 * The Surveyor device against a scripted sonar on a simulated clock, and what its points become as a ping.
 */
#include "core/fault.h"
#include "drivers/devices/device.h"
#include "drivers/devices/ping_bytes.h"
#include "drivers/devices/surveyor.h"
#include "tests/lib/test.h"

#define MS     1000000ull
#define SEC    1000000000ull
#define POINTS 64

static struct rig {
    void *state;
    struct device_io io;
    uint64_t now_ns;

    /* what the sonar does */
    bool mute, nameless, nack, forgets;
    uint8_t type;
    unsigned lose, flip; /* so many of the next pings */
    bool yz_too;

    /* where it is */
    struct surveyor_settings set;
    uint64_t next_ns;
    uint32_t number;

    /* what was seen */
    unsigned asked, set_ups, pings, warnings;
    struct ping last;
    struct ping_beam beam[PING_MAX_BEAMS];
    char notes[2048];
    struct ping buffer;
    uint32_t room;
} rig;

/* A flat bottom 10 m below, seen from 60 degrees to starboard to 60 to port. */
static void bottom(float (*point)[2], bool atof)
{
    for (int i = 0; i < POINTS; i++) {
        double angle = geo_rad(-60.0 + 120.0 * i / (POINTS - 1)), range_m = 10.0 / cos(angle);
        point[i][0] = (float)(atof ? angle : range_m * sin(angle));
        point[i][1] = (float)(atof ? 2.0 * range_m / 1500.0 : -range_m * cos(angle));
    }
}

/* How far it listens: as it was set, or 30 m. */
static double end_m(void)
{
    return rig.set.end_mm > 0 ? rig.set.end_mm * 1e-3 : 30.0;
}

static size_t points_frame(uint8_t *b, size_t size, uint32_t number)
{
    float point[POINTS][2];
    const struct surveyor_points head = {
        .ping_number = number, .listening_s = 2.0 * end_m() / 1500.0, .pulse_s = 100e-6, .n = POINTS};
    bottom(point, true);
    return surveyor_encode_atof(b, size, 1, &head, 1500.0f, (const float(*)[2])point);
}

static size_t yz_frame(uint8_t *b, size_t size)
{
    float point[POINTS][2];
    const struct surveyor_points head = {
        .start_m = rig.set.ping ? rig.set.start_mm * 1e-3 : 0.5, .end_m = end_m(), .n = POINTS};
    bottom(point, false);
    return surveyor_encode_yz(b, size, 1, &head, (const float(*)[2])point);
}

static void feed(const uint8_t *b, size_t n)
{
    device_surveyor.feed(rig.state, b, n, rig.now_ns, &rig.io);
}

static void say(uint16_t id, const void *payload, size_t n)
{
    uint8_t b[PING_FRAME_MAX];
    feed(b, ping_frame_build(b, sizeof b, id, 1, payload, n));
}

static void take_sent(void *ctx, const uint8_t *b, size_t n)
{
    static struct ping_parser parser;
    struct ping_frame f;
    (void)ctx;
    ping_parser_init(&parser, PING_PAYLOAD_MAX);
    CHECK(ping_parser_next(&parser, &b, &n, rig.now_ns, &f) && n == 0);
    rig.asked += f.id == PING_GENERAL_REQUEST;
    if (f.id == SURVEYOR_SET_PING_PARAMETERS) {
        rig.set_ups++;
        CHECK_INT(f.length, 36);
        if (!rig.mute && !rig.nack)
            CHECK(surveyor_decode_settings(&f, &rig.set));
    }
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
    rig.buffer = (struct ping){.beam = rig.beam, .max_beams = rig.room};
    return rig.room ? &rig.buffer : NULL;
}

static void done_ping(void *ctx, struct ping *p)
{
    (void)ctx;
    CHECK(p->n_beams > 0);
    rig.pings++;
    rig.last = *p;
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

static void rig_new(bool listen_only)
{
    struct fault fault = {""};
    const struct device_conf conf = {
        .range_m = 30.0, .sound_speed_mps = 1500.0, .gain = -1, .listen_only = listen_only};
    free(rig.state);
    rig = (struct rig){.state = calloc(1, device_surveyor.state_size),
                       .io = {NULL, take_sent, take_break, begin_ping, done_ping, take_note},
                       .now_ns = 100 * SEC,
                       .room = PING_MAX_BEAMS,
                       .type = 12};
    if (!device_surveyor.init(rig.state, &conf, &fault)) {
        printf("init: %s\n", fault.text);
        abort();
    }
}

static void rig_open(void)
{
    rig_new(false);
    device_surveyor.opened(rig.state, rig.now_ns, &rig.io);
}

/* The sonar answers what was asked since the last step, and pings. */
static void sonar_step(unsigned *answered_asks, unsigned *answered_sets)
{
    static uint8_t b[PING_FRAME_LIMIT];
    const uint8_t info[6] = {rig.type, 1, 1, 2, 3, 0};
    uint8_t ack[2];
    put_u16(ack, SURVEYOR_SET_PING_PARAMETERS);
    if (*answered_asks != rig.asked && !rig.nameless)
        say(PING_DEVICE_INFORMATION, info, sizeof info);
    *answered_asks = rig.asked;
    if (*answered_sets != rig.set_ups)
        say(rig.nack ? PING_NACK : PING_ACK, ack, sizeof ack);
    *answered_sets = rig.set_ups;
    if (!rig.set.ping || rig.forgets || rig.now_ns < rig.next_ns)
        return;
    rig.next_ns = rig.now_ns + (uint64_t)(rig.set.interval_ms * 1000000);
    size_t n = points_frame(b, sizeof b, ++rig.number);
    if (rig.lose > 0) {
        rig.lose--;
        return;
    }
    if (rig.flip > 0) {
        rig.flip--;
        b[100] ^= 1;
    }
    feed(b, n / 2);
    feed(b + n / 2, n - n / 2);
    if (rig.yz_too)
        feed(b, yz_frame(b, sizeof b));
}

static void run_for(uint64_t ns)
{
    static unsigned asks, sets;
    for (uint64_t end_ns = rig.now_ns + ns; rig.now_ns < end_ns; rig.now_ns += 5 * MS) {
        if (device_surveyor.deadline(rig.state) <= rig.now_ns) {
            device_surveyor.tick(rig.state, rig.now_ns, &rig.io);
            CHECK(device_surveyor.deadline(rig.state) > rig.now_ns);
        }
        if (!rig.mute)
            sonar_step(&asks, &sets);
        else
            asks = rig.asked, sets = rig.set_ups;
    }
}

static struct device_status status(void)
{
    struct device_status s;
    device_surveyor.status(rig.state, &s);
    return s;
}

/* ---- messages ---- */

TEST(settings_as_the_description_lays_them_out)
{
    static const uint8_t want[] = {0x42, 0x52, 36,   0,    0xcf, 0x0b, 0, 0, /* 3023 */
                                   0,    0,    0,    0,    0x30, 0x75, 0, 0, /* 0 .. 30000 mm */
                                   0,    0x80, 0xbb, 0x44,                   /* 1500.0 */
                                   0xff, 0xff, 65,   0,                      /* gain -1, 65 ms */
                                   0,    0,    0,    1,    0,    0,    0, 1, /* ping, atof */
                                   0x80, 0xa9, 3,    0,    0x90, 1,    0, 0,
                                   0,    0,    0xc0, 0x3f}; /* 240000, 400, 0, 1.5 */
    uint8_t b[64];
    const struct surveyor_settings set = {.end_mm = 30000,
                                          .sound_speed_mps = 1500.0f,
                                          .gain = -1,
                                          .interval_ms = 65,
                                          .ping = true,
                                          .atof = true,
                                          .n_steps = 400};
    CHECK_INT(surveyor_encode_settings(b, sizeof b, &set), 46);
    CHECK_INT(sizeof want, 44);
    CHECK(memcmp(b, want, sizeof want) == 0);
    CHECK_INT(surveyor_encode_settings(b, 45, &set), 0);
}

TEST(points_become_beams)
{
    static uint8_t b[PING_FRAME_LIMIT];
    for (int yz = 0; yz < 2; yz++) {
        rig_new(true);
        device_surveyor.opened(rig.state, rig.now_ns, &rig.io);
        feed(b, yz ? yz_frame(b, sizeof b) : points_frame(b, sizeof b, 7));
        CHECK_INT(rig.pings, 1);
        CHECK_INT(rig.last.kind, PING_RANGES);
        CHECK_INT(rig.last.n_beams, POINTS);
        CHECK_INT(ping_bytes(&rig.last), 0);
        CHECK_NEAR(rig.last.r0_m, 1.5, 1e-6, 0); /* 5 % of 30 m */
        CHECK_NEAR(rig.last.r0_m + rig.last.dr_m, 30.0, 1e-6, 0);
        for (int i = 0; i < POINTS; i++) {
            double angle = geo_rad(-60.0 + 120.0 * i / (POINTS - 1));
            CHECK_NEAR(geo_wrap_pi((double)rig.beam[i].az_rad), -angle, 1e-5, 1e-6);
            CHECK_NEAR(rig.beam[i].range_m, 10.0 / cos(angle), 1e-5, 0);
            CHECK_NEAR(rig.beam[i].el_rad, 0, 0, 0);
        }
        CHECK_NEAR((double)(rig.now_ns - rig.last.t_ns), 40e6, 1e-6, 0);
        CHECK_INT(rig.last.t_in_ns, rig.now_ns);
    }
}

/* By hand from Cerulean's pages, without our encoder: one point 8 m to port and 8 m below, listened to 40 m. */
static const uint8_t by_hand_yz[] = {
    0x42, 0x52, 108, 0, 0xc3, 0x0b, 1,    0,                            /* 3011 */
    0x88, 0x13, 0,   0, 1,    0,    0,    0,    0x00, 0x80, 0xbb, 0x44, /* 5000 ms, ping 1, 1500.0 m/s */
    0,    0,    0,   0, 0,    0,    0,    0,    0,    0,    0,    0,    /* up vector */
    0,    0,    0,   0, 0,    0,    0,    0,    0,    0,    0,    0,    /* magnetic vector */
    0,    0,    0,   0, 0,    0,    0,    0,    0,    0,    0,    0,    /* ten reserved words ... */
    0,    0,    0,   0, 0,    0,    0,    0,    0,    0,    0,    0,    /* ... */
    0,    0,    0,   0, 0,    0,    0,    0,    0,    0,    0,    0,    /* ... */
    0,    0,    0,   0, 0,    0,    0,    0,    0,    0,    0,    0,    /* ... 10, degrees, bar */
    0,    0,    0,   0, 0x00, 0x00, 0x00, 0x3f, 0x00, 0x00, 0x20, 0x42, /* heave, start 0.5 m, end 40.0 m */
    0,    0,    1,   0, 0x00, 0x00, 0x00, 0x41, 0x00, 0x00, 0x00, 0xc1, /* 1 point: y = 8.0 to port, z = -8.0 up */
    0x8e, 0x05};
static const uint8_t by_hand_atof[] = {
    0x42, 0x52, 56,   0,    0xc4, 0x0b, 1,    0,                         /* 3012 */
    0x88, 0x13, 0,    0,    0,    0,    0,    0,    0,    0,    0,    0, /* 5000 ms, no UTC */
    0x0a, 0xd7, 0x23, 0x3d, 0x00, 0x80, 0xbb, 0x44, 1,    0,    0,    0, /* listens 0.04 s; 1500.0 m/s, ping 1 */
    0x80, 0xa9, 3,    0,    0x17, 0xb7, 0xd1, 0x38, 0,    0,    0,    0, /* 240000 Hz, pulse 100 us */
    1,    0,    0,    0,    0xdb, 0x0f, 0x49, 0x3f, 0xd8, 0x26, 0x77, 0x3c, /* 1 point: pi / 4 to port, 15.08 ms */
    0,    0,    0,    0,    0,    0,    0,    0,    0x1f, 0x0b};

TEST(port_is_port)
{
    double looks_down[4], along[3];
    quat_from_rpy(0, -GEO_PI / 2, 0, looks_down);
    for (int yz = 0; yz < 2; yz++) {
        rig_new(true);
        device_surveyor.opened(rig.state, rig.now_ns, &rig.io);
        feed(yz ? by_hand_yz : by_hand_atof, yz ? sizeof by_hand_yz : sizeof by_hand_atof);
        CHECK_INT(rig.pings, 1);
        CHECK_INT(rig.last.n_beams, 1);
        CHECK_NEAR(rig.beam[0].range_m, sqrt(128.0), 1e-6, 0);
        CHECK_NEAR(rig.last.r0_m, yz ? 2.0 : 1.5, 1e-6, 0);
        geo_direction((double)rig.beam[0].az_rad, (double)rig.beam[0].el_rad, along);
        quat_rotate(looks_down, along, along);
        CHECK_NEAR(along[0], 0, 0, 1e-6);
        CHECK_NEAR(along[1], -sqrt(0.5), 0, 1e-6); /* the body's y is to starboard ... */
        CHECK_NEAR(along[2], sqrt(0.5), 0, 1e-6);  /* ... and its z down */
    }
}

/* Nearer than its start, and than 5 % of its end, the sonar records nothing, so such water is not free. */
TEST(it_frees_nothing_nearer_than_it_listens)
{
    static const struct {
        const char *name;
        int start_mm;            /* of a 3023 in the recording; -1: none */
        float start_m, end_m;    /* of the 3011, which has one point at 10 m */
        double begin_m, reach_m; /* wanted of that ping */
        double atof_begin_m;     /* wanted of a 3012 after it, listened to 30 m */
    } row[] = {{"five percent", -1, 0.5f, 40, 2.0, 40, 1.5},
               {"a start", -1, 3.0f, 40, 3.0, 40, 3.0},
               {"a start that was set", 4000, 0, 0, 4.0, 30, 4.0},
               {"set, and then told otherwise", 4000, 0.5f, 20, 1.0, 20, 1.5},
               {"not told", -1, 0, 0, 1.5, 30, 1.5},
               {"senseless", -1, NAN, 40, 1.5, 30, 1.5},
               {"turned round", -1, 40, 3.0f, 1.5, 30, 1.5},
               {"beyond the end", 50000, 0, 0, 50.0, 50, 50.0}};
    static uint8_t b[PING_FRAME_LIMIT];
    static const float point[1][2] = {{0, -10}};

    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        const struct surveyor_points head = {
            .start_m = (double)row[i].start_m, .end_m = (double)row[i].end_m, .n = 1};
        const struct surveyor_settings set = {.start_mm = row[i].start_mm, .end_mm = 30000};
        rig_new(true);
        device_surveyor.opened(rig.state, rig.now_ns, &rig.io);
        if (row[i].start_mm >= 0)
            feed(b, surveyor_encode_settings(b, sizeof b, &set));
        feed(b, surveyor_encode_yz(b, sizeof b, 1, &head, point));
        bool good = rig.pings == 1 && fabs((double)rig.last.r0_m - row[i].begin_m) < 1e-5 &&
                    fabs((double)(rig.last.r0_m + rig.last.dr_m) - row[i].reach_m) < 1e-5;
        feed(b, points_frame(b, sizeof b, 1));
        good &= rig.pings == 2 && fabs((double)rig.last.r0_m - row[i].atof_begin_m) < 1e-5;
        if (!good) {
            printf("%s: from %g m\n", row[i].name, (double)rig.last.r0_m);
            CHECK(false);
        }
        device_surveyor.opened(rig.state, rig.now_ns, &rig.io); /* our own settings again */
        feed(b, points_frame(b, sizeof b, 1));
        CHECK_NEAR(rig.last.r0_m, 1.5, 1e-6, 0);
    }
}

TEST(senseless_points_are_left_out)
{
    static const float bad[][2] = {{NAN, 0.01f},  {0.1f, NAN},     {INFINITY, 0.01f}, {0.1f, INFINITY},
                                   {2.0f, 0.01f}, {0.1f, 0.0f},    {0.1f, 1e-45f},    {0.1f, -1.0f},
                                   {0.1f, 1e30f}, {-1e30f, 0.01f}, {0.2f, 0.01f}};
    const unsigned n = sizeof bad / sizeof bad[0];
    uint8_t b[512];
    struct surveyor_points head = {.ping_number = 1, .listening_s = 0.04, .n = n};
    rig_new(true);
    device_surveyor.opened(rig.state, rig.now_ns, &rig.io);
    feed(b, surveyor_encode_atof(b, sizeof b, 1, &head, 1500.0f, bad));
    CHECK_INT(rig.pings, 1);
    CHECK_INT(rig.last.n_beams, 1);
    CHECK_NEAR(rig.beam[0].range_m, 7.5, 1e-6, 0);
    head.n = n - 1, head.ping_number = 2;
    feed(b, surveyor_encode_atof(b, sizeof b, 1, &head, 1500.0f, bad));
    CHECK_INT(rig.pings, 2);
    CHECK(rig.last.flags & PING_UNHEARD); /* over all of its swath it cannot tell */
    CHECK(rig.last.az_aperture_rad > 1.5f);
    CHECK_INT(status().pings, 2);
}

TEST(frames_that_are_too_short_or_senseless)
{
    static const struct {
        const char *name;
        uint16_t id;
        size_t n;
        uint16_t points;
        float listening_s, pulse_s;
    } row[] = {{"atof cut", SURVEYOR_ATOF_POINTS, 39, 1, 0.04f, 0},
               {"yz cut", SURVEYOR_YZ_POINTS, 99, 1, 0, 0},
               {"atof of 513", SURVEYOR_ATOF_POINTS, 8300, 513, 0.04f, 0},
               {"yz of 513", SURVEYOR_YZ_POINTS, 8300, 513, 0, 0},
               {"no time", SURVEYOR_ATOF_POINTS, 200, 4, 0, 0},
               {"a long time", SURVEYOR_ATOF_POINTS, 200, 4, 60.0f, 0},
               {"NaN", SURVEYOR_ATOF_POINTS, 200, 4, NAN, 0},
               {"pulse NaN", SURVEYOR_ATOF_POINTS, 200, 4, 0.04f, NAN},
               {"no identity", PING_DEVICE_INFORMATION, 4, 0, 0, 0},
               {"ack of nothing", PING_ACK, 1, 0, 0, 0},
               {"nack of nothing", PING_NACK, 1, 0, 0, 0}};
    static uint8_t payload[PING_PAYLOAD_LIMIT], b[PING_FRAME_LIMIT];
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        rig_new(true);
        device_surveyor.opened(rig.state, rig.now_ns, &rig.io);
        put_f32(payload + 12, row[i].listening_s);
        put_f32(payload + 28, row[i].pulse_s);
        put_u16(payload + 36, row[i].points);
        put_u16(payload + 98, row[i].points);
        feed(b, ping_frame_build(b, sizeof b, row[i].id, 1, payload, row[i].n));
        if (rig.pings != 0 || status().bad_frame != 1 || status().frames != 1) {
            printf("%s\n", row[i].name);
            CHECK(false);
        }
    }
}

TEST(points_that_the_frame_has_no_room_for)
{
    static uint8_t b[PING_FRAME_LIMIT];
    struct surveyor_points points;
    size_t n = points_frame(b, sizeof b, 1);
    struct ping_frame f = {
        .id = SURVEYOR_ATOF_POINTS, .length = (uint16_t)(n - PING_OVERHEAD - 17), .payload = b + 8};
    CHECK(surveyor_decode_points(&f, &points));
    CHECK_INT(points.n, POINTS - 2);
}

TEST(most_points_and_a_small_buffer)
{
    static uint8_t b[PING_FRAME_LIMIT];
    static float point[SURVEYOR_POINTS_MAX + 1][2];
    struct surveyor_points head = {.ping_number = 1, .listening_s = 0.04, .n = SURVEYOR_POINTS_MAX};
    for (int i = 0; i <= SURVEYOR_POINTS_MAX; i++)
        point[i][1] = 0.01f;
    rig_new(true);
    device_surveyor.opened(rig.state, rig.now_ns, &rig.io);
    feed(b, surveyor_encode_atof(b, sizeof b, 1, &head, 1500.0f, (const float(*)[2])point));
    CHECK_INT(rig.last.n_beams, 512);
    rig.room = 3;
    head.ping_number = 2;
    feed(b, surveyor_encode_atof(b, sizeof b, 1, &head, 1500.0f, (const float(*)[2])point));
    CHECK_INT(rig.last.n_beams, 3);
    rig.room = 0;
    head.ping_number = 3;
    feed(b, surveyor_encode_atof(b, sizeof b, 1, &head, 1500.0f, (const float(*)[2])point));
    CHECK_INT(rig.pings, 2);
    CHECK_INT(status().pings, 3);
    head.n = SURVEYOR_POINTS_MAX + 1;
    CHECK_INT(surveyor_encode_atof(b, sizeof b, 1, &head, 1500.0f, (const float(*)[2])point), 0);
}

TEST(configuration_faults_name_the_key)
{
    static const struct {
        const char *key;
        struct device_conf conf;
    } row[] = {{"range", {.range_m = 0.9, .sound_speed_mps = 1500, .gain = -1}},
               {"range", {.range_m = NAN, .sound_speed_mps = 1500, .gain = -1}},
               {"sound_speed", {.range_m = 30, .sound_speed_mps = 1700, .gain = -1}},
               {"gain", {.range_m = 30, .sound_speed_mps = 1500, .gain = 11}}};
    void *state = calloc(1, device_surveyor.state_size);
    struct fault fault;
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        CHECK(!device_surveyor.init(state, &row[i].conf, &fault));
        CHECK(strncmp(fault.text, row[i].key, strlen(row[i].key)) == 0);
    }
    free(state);
}

/* ---- life ---- */

TEST(it_is_set_up_and_pings)
{
    rig_open();
    CHECK_INT(status().state, DEVICE_IDENTIFY);
    run_for(2 * SEC);
    CHECK_INT(status().state, DEVICE_RUNNING);
    CHECK_STR(status().what, "Surveyor fw 1.2.3 id 1");
    CHECK_INT(rig.asked, 1);
    CHECK_INT(rig.set_ups, 1);
    CHECK(rig.set.ping && rig.set.atof && !rig.set.yz);
    CHECK_INT(rig.set.end_mm, 30000);
    CHECK_NEAR(rig.set.sound_speed_mps, 1500, 0, 0);
    CHECK_INT(rig.set.interval_ms, 65);
    CHECK(rig.pings > 20);
    CHECK_INT(status().pings, rig.pings);
    CHECK_INT(status().timeouts + status().restarts + status().lost_frames + rig.warnings, 0);
    CHECK_NEAR(status().range_m, 30.0, 1e-6, 0);
}

TEST(one_that_has_no_name_works_all_the_same)
{
    rig_new(false);
    rig.nameless = true;
    device_surveyor.opened(rig.state, rig.now_ns, &rig.io);
    run_for(4 * SEC);
    CHECK_INT(status().state, DEVICE_RUNNING);
    CHECK_INT(rig.asked, 3);
    CHECK_INT(rig.warnings, 0);
}

TEST(both_kinds_of_points_are_one_ping)
{
    rig_new(false);
    rig.yz_too = true;
    device_surveyor.opened(rig.state, rig.now_ns, &rig.io);
    run_for(2 * SEC);
    CHECK_INT(rig.pings, rig.number);
    CHECK(rig.pings > 20);
}

TEST(the_same_ping_twice_is_one)
{
    static uint8_t b[PING_FRAME_LIMIT];
    rig_new(true);
    device_surveyor.opened(rig.state, rig.now_ns, &rig.io);
    size_t n = points_frame(b, sizeof b, 7);
    feed(b, n);
    feed(b, n);
    CHECK_INT(rig.pings, 1);
    CHECK_INT(status().frames, 2);
}

TEST(another_device_is_refused_and_asked_again)
{
    static const uint8_t types[] = {1, 2};
    for (int i = 0; i < 2; i++) {
        rig_new(false);
        rig.type = types[i];
        device_surveyor.opened(rig.state, rig.now_ns, &rig.io);
        run_for(5 * SEC);
        CHECK_INT(status().state, DEVICE_SILENT);
        CHECK_INT(rig.warnings, 1);
        CHECK_INT(rig.set_ups, 0);
        CHECK(strstr(rig.notes, i ? "ping360" : "ping1d") != NULL);
        rig.type = 12;
        run_for(5 * SEC);
        CHECK_INT(status().state, DEVICE_RUNNING);
    }
}

TEST(refused_settings_are_told_and_tried_again)
{
    rig_new(false);
    rig.nack = true;
    device_surveyor.opened(rig.state, rig.now_ns, &rig.io);
    run_for(5 * SEC);
    CHECK_INT(status().state, DEVICE_SILENT);
    CHECK(status().nacks > 1);
    CHECK_INT(rig.warnings, 1);
    rig.nack = false;
    run_for(5 * SEC);
    CHECK_INT(status().state, DEVICE_RUNNING);
}

TEST(silence_is_answered_every_second_and_anew)
{
    rig_open();
    run_for(2 * SEC);
    rig.mute = true;
    run_for(4 * SEC);
    CHECK_INT(rig.set_ups, 4); /* at 1.5, 2.5, 3.5 s */
    CHECK_INT(status().state, DEVICE_RUNNING);
    run_for(60 * SEC);
    CHECK_INT(status().state, DEVICE_SILENT);
    CHECK_INT(status().restarts, 1);
    CHECK_INT(rig.warnings, 1);
    rig.mute = false;
    run_for(5 * SEC);
    CHECK_INT(status().state, DEVICE_RUNNING);
}

TEST(lost_and_broken_pings_are_counted)
{
    rig_open();
    run_for(2 * SEC);
    rig.lose = 3;
    run_for(SEC);
    CHECK_INT(status().lost_frames, 3);
    rig.flip = 1;
    run_for(SEC);
    CHECK_INT(status().bad_checksum, 1);
    CHECK_INT(status().lost_frames, 4);
    say(SURVEYOR_ATTITUDE, "0123456789ab", 12);
    say(10, "{}", 2);
    CHECK_INT(status().bad_frame, 0);
    CHECK_INT(status().state, DEVICE_RUNNING);
}

/* ---- its clock ---- */

/* What the sonar and the way to it do to time. */
struct clockwork {
    const char *name;
    double ppm, jitter_ms; /* of the sonar's clock; mean delay beyond the least */
    uint32_t first_ms;     /* what it counts at first */
    double tick_ms;        /* that it counts as one */
    double restart_s;      /* when it is started anew; 0: never */
    bool usable;
};

#define LEAST_NS  (3 * MS)
#define LISTEN_NS (40 * MS)

/* 100 s of pings: t_ns of each against its truth, in figures. */
static void listen_through(const struct clockwork *w, uint64_t *seed, double *by_clock_s, double *by_arrival_s)
{
    static uint8_t b[PING_FRAME_LIMIT];
    uint64_t arrival_ns = 0, on_ns = rig.now_ns, restarted_ns = 0;
    uint32_t number = 0;
    unsigned n = 0;
    *by_clock_s = *by_arrival_s = 0;
    for (uint64_t sent_ns = rig.now_ns; sent_ns < on_ns + 100 * SEC; sent_ns += 97 * MS) {
        if (w->restart_s > 0 && !restarted_ns && sent_ns - on_ns > (uint64_t)(w->restart_s * 1e9)) {
            restarted_ns = sent_ns;
            number = 0;
        }
        uint64_t since_ns = sent_ns - (restarted_ns ? restarted_ns : on_ns);
        float point[POINTS][2];
        const struct surveyor_points head = {
            .ping_number = ++number,
            .power_up_ms = (restarted_ns ? 0 : w->first_ms) +
                           (uint32_t)((double)since_ns * 1e-6 * (1 + w->ppm * 1e-6) / w->tick_ms),
            .listening_s = LISTEN_NS * 1e-9,
            .pulse_s = 100e-6,
            .n = POINTS};
        bottom(point, true);
        double delay_ms = -w->jitter_ms * log(1.0 - test_uniform(seed));
        uint64_t in_ns = sent_ns + LISTEN_NS + LEAST_NS + (uint64_t)(delay_ms * 1e6);
        arrival_ns = in_ns > arrival_ns ? in_ns : arrival_ns;
        unsigned before = rig.pings;
        rig.now_ns = arrival_ns;
        feed(b, surveyor_encode_atof(b, sizeof b, 1, &head, 1500.0f, (const float(*)[2])point));
        CHECK_INT(rig.pings, before + 1);
        CHECK(rig.last.t_ns <= arrival_ns - LISTEN_NS + 100); /* listening_s is a float */
        if (restarted_ns) /* a ping is never put among those of the life before */
            CHECK(rig.last.t_ns + 2 * MS >= restarted_ns);
        if (since_ns < 12 * SEC)
            continue;
        double error_s = ((double)rig.last.t_ns - (double)sent_ns) * 1e-9;
        double arrival_s = (double)(arrival_ns - LISTEN_NS - sent_ns) * 1e-9;
        *by_clock_s += error_s * error_s;
        *by_arrival_s += arrival_s * arrival_s;
        n++;
    }
    *by_clock_s = sqrt(*by_clock_s / n);
    *by_arrival_s = sqrt(*by_arrival_s / n);
}

TEST(pings_are_timed_by_its_clock)
{
    static const struct clockwork row[] = {
        {"steady", 0, 20, 1000, 1, 0, true},
        {"fast", 80, 20, 1000, 1, 0, true},
        {"slow", -120, 20, 1000, 1, 0, true},
        {"wraps", 30, 20, 0u - 50000u, 1, 0, true},
        {"is started anew", 30, 20, 3600000, 1, 41, true},
        {"is started anew soon after", 0, 20, 1000, 1, 30, true},
        {"hardly any delays", 10, 0.5, 1000, 1, 0, true},
        {"long delays", 10, 40, 1000, 1, 0, true},
        {"stands", 0, 20, 1000, 1e12, 0, false},
        {"counts seconds", 0, 20, 1000, 1000, 0, false},
        {"counts microseconds", 0, 20, 1000, 1e-3, 0, false},
        {"a tenth off", 0, 20, 1000, 1.1, 0, false},
    };
    uint64_t seed = test_seed();
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        double by_clock_s, by_arrival_s;
        rig_new(true);
        device_surveyor.opened(rig.state, rig.now_ns, &rig.io);
        listen_through(&row[i], &seed, &by_clock_s, &by_arrival_s);
        const double least_s = LEAST_NS * 1e-9;
        bool good = row[i].usable ? by_clock_s < least_s + 0.1 * (by_arrival_s - least_s) + 0.002
                                  : by_clock_s <= by_arrival_s * 1.000001;
        if (!good || status().clock.running != row[i].usable) {
            printf("%s: off by %.2f ms, by arrival %.2f ms\n", row[i].name, by_clock_s * 1e3, by_arrival_s * 1e3);
            CHECK(false);
        }
    }
}

TEST(it_is_stopped)
{
    rig_open();
    run_for(2 * SEC);
    device_surveyor.stop(rig.state, rig.now_ns, &rig.io);
    run_for(SEC);
    CHECK(!rig.set.ping);
    CHECK(device_surveyor.deadline(rig.state) == UINT64_MAX);
    CHECK_INT(status().state, DEVICE_CLOSED);

    rig_open();
    run_for(2 * SEC);
    rig.mute = true;
    device_surveyor.stop(rig.state, rig.now_ns, &rig.io);
    run_for(2 * SEC);
    CHECK_INT(rig.set_ups, 1 + 3);
    CHECK(device_surveyor.deadline(rig.state) == UINT64_MAX);
}

/* Another program gives it another range: seen in its points, said once, and set up again. */
TEST(a_taken_over_sonar_is_set_up_again)
{
    static const struct {
        int32_t start_mm, end_mm;
        bool yz;
        const char *says;
    } row[] = {{0, 60000, false, "end_mm 60000 (sent 30000)"},
               {0, 10000, true, "end_mm 10000 (sent 30000)"},
               {5000, 30000, true, "start_mm 5000 (sent 0)"}};

    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        rig_open();
        rig.yz_too = row[i].yz;
        run_for(2 * SEC);
        CHECK_INT(rig.warnings + status().taken_over, 0);
        CHECK_STR(status().other_settings, "");
        const unsigned set_ups = rig.set_ups;
        rig.set.start_mm = row[i].start_mm;
        rig.set.end_mm = row[i].end_mm;
        run_for(4 * SEC);
        CHECK_INT(status().taken_over, 1);
        CHECK_INT(rig.warnings, 1);
        CHECK(strstr(rig.notes, row[i].says) != NULL);
        CHECK_INT(rig.set_ups, set_ups + 1);
        CHECK_INT(rig.set.start_mm, 0);
        CHECK_INT(rig.set.end_mm, 30000);
        CHECK_STR(status().other_settings, "");
        CHECK_INT(status().state, DEVICE_RUNNING);
    }
}

int main(void)
{
    RUN(settings_as_the_description_lays_them_out);
    RUN(points_become_beams);
    RUN(port_is_port);
    RUN(it_frees_nothing_nearer_than_it_listens);
    RUN(senseless_points_are_left_out);
    RUN(frames_that_are_too_short_or_senseless);
    RUN(points_that_the_frame_has_no_room_for);
    RUN(most_points_and_a_small_buffer);
    RUN(configuration_faults_name_the_key);
    RUN(it_is_set_up_and_pings);
    RUN(one_that_has_no_name_works_all_the_same);
    RUN(both_kinds_of_points_are_one_ping);
    RUN(the_same_ping_twice_is_one);
    RUN(another_device_is_refused_and_asked_again);
    RUN(refused_settings_are_told_and_tried_again);
    RUN(silence_is_answered_every_second_and_anew);
    RUN(lost_and_broken_pings_are_counted);
    RUN(pings_are_timed_by_its_clock);
    RUN(it_is_stopped);
    RUN(a_taken_over_sonar_is_set_up_again);
    free(rig.state);
    return test_end();
}
