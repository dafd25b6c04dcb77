/* SPDX-License-Identifier: MIT */
/* MAVLink frames: CRC, tables, every message against bytes written by hand, resynchronisation, signatures. */
#include "client/mavlink/mavlink_frame.h"
#include "client/mavlink/sha256.h"
#include "tests/lib/test.h"

/* "FD 09 .." to bytes; returns how many. */
static size_t unhex(const char *text, uint8_t *out)
{
    size_t n = 0;
    unsigned byte;
    int used;
    while (sscanf(text, " %2x%n", &byte, &used) == 1) {
        out[n++] = (uint8_t)byte;
        text += used;
    }
    return n;
}

static void check_hex(const uint8_t *bytes, size_t n, const char *want)
{
    char got[1000];
    for (size_t i = 0; i < n; i++)
        snprintf(got + 3 * i, 4, "%02X ", bytes[i]);
    got[n ? 3 * n - 1 : 0] = '\0';
    CHECK_STR(got, want);
}

static size_t build(uint8_t sequence, uint8_t component, enum mavlink_id id, const void *content, uint8_t *out)
{
    struct mavlink_sender sender = {.system_id = 1, .component_id = component, .sequence = sequence};
    return mavlink_build(&sender, mavlink_message(id), content, out);
}

/* Feeds all in pieces of `piece` bytes; returns the number of frames, the last in *frame. */
static int feed(struct mavlink_parser *parser, const uint8_t *bytes, size_t n, size_t piece,
                struct mavlink_frame *frame)
{
    int frames = 0;
    for (size_t at = 0; at < n; at += piece) {
        const uint8_t *from = bytes + at;
        size_t left = n - at < piece ? n - at : piece;
        while (mavlink_parser_next(parser, &from, &left, frame))
            frames++;
    }
    return frames;
}

TEST(the_crc_is_mcrf4xx)
{
    CHECK_INT(mavlink_crc("123456789", 9, 0xFFFF), 0x6F91);
}

/* CRC_EXTRA covers the definition's name, and the types and names of its fields without extensions, in wire order. */
TEST(every_tables_crc_extra_follows_from_its_names_and_types)
{
    static const char *const types[] = {
        [MAVLINK_U8] = "uint8_t",   [MAVLINK_CHAR] = "char",    [MAVLINK_U16] = "uint16_t",
        [MAVLINK_I16] = "int16_t",  [MAVLINK_U32] = "uint32_t", [MAVLINK_F32] = "float",
        [MAVLINK_U64] = "uint64_t", [MAVLINK_I64] = "int64_t",  [MAVLINK_I32] = "int32_t"};
    for (size_t i = 0; i < mavlink_message_count; i++) {
        const struct mavlink_message *m = &mavlink_messages[i];
        char text[120];
        size_t size = 0, wire = 8;
        uint16_t crc = mavlink_crc(text, (size_t)snprintf(text, sizeof text, "%s ", m->name), 0xFFFF);
        for (const struct mavlink_field *f = m->fields; f->name; f++) {
            const size_t element = mavlink_type_size(f->type);
            size += element * (f->count ? f->count : 1u);
            if (f->extension)
                continue;
            CHECK(element <= wire);
            wire = element;
            crc = mavlink_crc(text, (size_t)snprintf(text, sizeof text, "%s %s ", types[f->type], f->name), crc);
            if (f->count)
                crc = mavlink_crc(&f->count, 1, crc);
        }
        if (((crc & 0xFF) ^ (crc >> 8)) != m->crc_extra || size != m->size)
            printf("# %s\n", m->name);
        CHECK_INT((crc & 0xFF) ^ (crc >> 8), m->crc_extra);
        CHECK_INT(size, m->size);
    }
}

TEST(heartbeat)
{
    const struct mavlink_heartbeat m = {.type = 18, .autopilot = 8, .system_status = 4, .mavlink_version = 3};
    uint8_t frame[MAVLINK_FRAME_MAX];
    check_hex(frame, build(0, 196, MAVLINK_HEARTBEAT, &m, frame),
              "FD 09 00 00 00 01 C4 00 00 00 00 00 00 00 12 08 00 04 03 F4 9A");
}

TEST(attitude)
{
    uint8_t bytes[MAVLINK_FRAME_MAX];
    const size_t n =
        unhex("FD 1C 00 00 07 01 01 1E 00 00 40 E2 01 00 CD CC CC 3D CD CC 4C BD DA 0F C9 3F 00 00 00 00 "
              "00 00 00 00 0A D7 23 3C 34 7C",
              bytes);
    struct mavlink_parser parser = {0};
    struct mavlink_frame frame;
    struct mavlink_attitude m;

    CHECK_INT(feed(&parser, bytes, n, n, &frame), 1);
    CHECK_INT(frame.sequence, 7);
    CHECK_INT(frame.version, 2);
    mavlink_unpack(frame.message, frame.payload, &m);
    CHECK_INT(m.time_boot_ms, 123456);
    CHECK_NEAR(m.roll, 0.1, 1e-6, 0);
    CHECK_NEAR(m.pitch, -0.05, 1e-6, 0);
    CHECK_NEAR(m.yaw, 1.5708, 1e-4, 0);
    CHECK_NEAR(m.rollspeed, 0, 0, 0);
    CHECK_NEAR(m.yawspeed, 0.01, 1e-6, 0);
}

TEST(command_long_loses_its_last_zero)
{
    const struct mavlink_command_long m = {
        .param = {32, 50000}, .command = 511, .target_system = 1, .target_component = 1};
    uint8_t frame[MAVLINK_FRAME_MAX];
    check_hex(
        frame, build(5, 196, MAVLINK_COMMAND_LONG, &m, frame),
        "FD 20 00 00 05 01 C4 4C 00 00 00 00 00 42 00 50 43 47 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 "
        "00 00 00 00 FF 01 01 01 09 AD");
}

TEST(obstacle_distance)
{
    struct mavlink_obstacle_distance m = {.time_usec = 123456000,
                                          .distances = {725, 730},
                                          .min_distance = 75,
                                          .max_distance = 2000,
                                          .sensor_type = 1,
                                          .increment = 5,
                                          .frame = 12};
    uint8_t frame[MAVLINK_FRAME_MAX], want[MAVLINK_FRAME_MAX];
    size_t n = unhex("FD A7 00 00 03 01 C4 4A 01 00 00 CA 5B 07 00 00 00 00 D5 02 DA 02", want);
    for (int i = 2; i < 71; i++)
        m.distances[i] = 65535;
    m.distances[71] = 2001;
    memset(want + n, 0xFF, 138);
    n += 138;
    n += unhex("D1 07 4B 00 D0 07 01 05 00 00 00 00 00 00 00 00 0C D9 4E", want + n);
    CHECK_INT(build(3, 196, MAVLINK_OBSTACLE_DISTANCE, &m, frame), n);
    CHECK(memcmp(frame, want, n) == 0);
}

TEST(obstacle_distance_3d)
{
    const struct mavlink_obstacle_distance_3d m = {.time_boot_ms = 123456,
                                                   .x = 5,
                                                   .y = -2,
                                                   .z = 0.5f,
                                                   .min_distance = 0.75f,
                                                   .max_distance = 20,
                                                   .obstacle_id = 65535,
                                                   .sensor_type = 1,
                                                   .frame = 12};
    uint8_t frame[MAVLINK_FRAME_MAX];
    check_hex(
        frame, build(6, 196, MAVLINK_OBSTACLE_DISTANCE_3D, &m, frame),
        "FD 1C 00 00 06 01 C4 1D 2B 00 40 E2 01 00 00 00 A0 40 00 00 00 C0 00 00 00 3F 00 00 40 3F 00 00 A0 41 "
        "FF FF 01 0C 95 71");
}

TEST(distance_sensor)
{
    const struct mavlink_distance_sensor m = {.time_boot_ms = 123456,
                                              .min_distance = 30,
                                              .max_distance = 10000,
                                              .current_distance = 725,
                                              .type = 1,
                                              .id = 1,
                                              .orientation = 25,
                                              .covariance = 255,
                                              .horizontal_fov = 0.4363f,
                                              .vertical_fov = 0.4363f,
                                              .signal_quality = 95};
    uint8_t frame[MAVLINK_FRAME_MAX], want[MAVLINK_FRAME_MAX];
    const size_t n = build(4, 196, MAVLINK_DISTANCE_SENSOR, &m, frame);
    CHECK_INT(unhex("FD 27 00 00 04 01 C4 84 00 00 40 E2 01 00 1E 00 10 27 D5 02 01 01 19 FF", want), 24);
    CHECK(memcmp(frame, want, 24) == 0);
    CHECK_INT(n, 51);
    CHECK_INT(frame[48], 95);
}

TEST(statustext_and_timesync)
{
    struct mavlink_statustext text = {.severity = 4, .text = "sonar"};
    const struct mavlink_timesync sync = {.ts1 = 0x0102030405060708, .target_system = 1};
    uint8_t frame[MAVLINK_FRAME_MAX];
    size_t n = build(0, 196, MAVLINK_STATUSTEXT, &text, frame);
    check_hex(frame, n - 2, "FD 06 00 00 00 01 C4 FD 00 00 04 73 6F 6E 61 72");
    memset(text.text, 'x', sizeof text.text);
    CHECK_INT(build(0, 196, MAVLINK_STATUSTEXT, &text, frame), 10 + 51 + 2);
    n = build(0, 196, MAVLINK_TIMESYNC, &sync, frame);
    check_hex(frame + 10, n - 12, "00 00 00 00 00 00 00 00 08 07 06 05 04 03 02 01 01");
}

/* The rest of what is taken: a payload by hand, all fields different. */
TEST(fields_lie_where_the_definitions_say)
{
    uint8_t payload[MAVLINK_PAYLOAD_MAX] = {0};
    struct mavlink_system_time time;
    struct mavlink_local_position_ned place;
    struct mavlink_attitude_quaternion turn;
    struct mavlink_scaled_pressure pressure;
    struct mavlink_global_position_int globe;
    struct mavlink_vfr_hud hud;
    struct mavlink_ahrs2 ahrs2;
    unhex("15 CD 5B 07 00 00 00 01 D2 04 00 00", payload);
    mavlink_unpack(mavlink_message(MAVLINK_SYSTEM_TIME), payload, &time);
    CHECK(time.time_unix_usec == 0x01000000075BCD15u && time.time_boot_ms == 1234);
    unhex("01 00 00 00 00 00 80 3F 00 00 00 40 00 00 40 40 00 00 80 40 00 00 A0 40 00 00 C0 C0", payload);
    mavlink_unpack(mavlink_message(MAVLINK_LOCAL_POSITION_NED), payload, &place);
    CHECK(place.time_boot_ms == 1 && place.x == 1 && place.y == 2 && place.z == 3 && place.vx == 4 &&
          place.vy == 5 && place.vz == -6);
    unhex("01 00 00 00 00 00 80 3F 00 00 00 40 00 00 40 40 00 00 80 40 00 00 A0 40 00 00 C0 C0 00 00 E0 40",
          payload);
    mavlink_unpack(mavlink_message(MAVLINK_ATTITUDE_QUATERNION), payload, &turn);
    CHECK(turn.q1 == 1 && turn.q2 == 2 && turn.q3 == 3 && turn.q4 == 4 && turn.rollspeed == 5 &&
          turn.pitchspeed == -6 && turn.yawspeed == 7);
    unhex("01 00 00 00 00 00 80 44 00 00 80 3F 18 FC", payload);
    mavlink_unpack(mavlink_message(MAVLINK_SCALED_PRESSURE2), payload, &pressure);
    CHECK(pressure.time_boot_ms == 1 && pressure.press_abs == 1024 && pressure.press_diff == 1 &&
          pressure.temperature == -1000);
    CHECK(mavlink_message(MAVLINK_SCALED_PRESSURE)->fields == mavlink_message(MAVLINK_SCALED_PRESSURE2)->fields &&
          mavlink_message(MAVLINK_SCALED_PRESSURE3)->fields == mavlink_message(MAVLINK_SCALED_PRESSURE2)->fields);
    unhex("01 00 00 00 02 00 00 00 03 00 00 00 04 00 00 00 F8 E9 FF FF 05 00 06 00 F9 FF 08 00", payload);
    mavlink_unpack(mavlink_message(MAVLINK_GLOBAL_POSITION_INT), payload, &globe);
    CHECK(globe.time_boot_ms == 1 && globe.lat == 2 && globe.lon == 3 && globe.alt == 4 &&
          globe.relative_alt == -5640 && globe.vx == 5 && globe.vy == 6 && globe.vz == -7 && globe.hdg == 8);
    unhex("00 00 80 3F 00 00 00 40 00 00 C0 C0 00 00 80 40 05 00 06 00", payload);
    mavlink_unpack(mavlink_message(MAVLINK_VFR_HUD), payload, &hud);
    CHECK(hud.airspeed == 1 && hud.groundspeed == 2 && hud.alt == -6 && hud.climb == 4 && hud.heading == 5 &&
          hud.throttle == 6);
    unhex("00 00 80 3F 00 00 00 40 00 00 40 40 00 00 C0 C0 05 00 00 00 06 00 00 00", payload);
    mavlink_unpack(mavlink_message(MAVLINK_AHRS2), payload, &ahrs2);
    CHECK(ahrs2.roll == 1 && ahrs2.pitch == 2 && ahrs2.yaw == 3 && ahrs2.altitude == -6 && ahrs2.lat == 5 &&
          ahrs2.lng == 6);
}

TEST(a_payload_of_zeros_keeps_one_byte)
{
    const struct mavlink_timesync m = {0};
    uint8_t bytes[MAVLINK_FRAME_MAX];
    struct mavlink_parser parser = {0};
    struct mavlink_frame frame;
    const size_t n = build(0, 1, MAVLINK_TIMESYNC, &m, bytes);
    CHECK_INT(bytes[1], 1);
    CHECK_INT(feed(&parser, bytes, n, 1, &frame), 1);
}

/* MAVLink 1: header of 6 bytes, id of one; the CRC as before. */
static size_t heartbeat_1(uint8_t *out)
{
    const uint8_t extra = 50;
    size_t n = unhex("FE 09 02 01 01 00 00 00 00 00 02 03 51 04 03", out);
    const uint16_t crc = mavlink_crc(&extra, 1, mavlink_crc(out + 1, n - 1, 0xFFFF));
    out[n++] = (uint8_t)crc;
    out[n++] = (uint8_t)(crc >> 8);
    return n;
}

TEST(version_1_is_understood)
{
    uint8_t bytes[MAVLINK_FRAME_MAX];
    struct mavlink_parser parser = {0};
    struct mavlink_frame frame;
    struct mavlink_heartbeat m;
    CHECK_INT(feed(&parser, bytes, heartbeat_1(bytes), 3, &frame), 1);
    mavlink_unpack(frame.message, frame.payload, &m);
    CHECK(frame.version == 1 && frame.sequence == 2 && frame.system_id == 1 && frame.component_id == 1);
    CHECK(m.type == 2 && m.autopilot == 3 && m.base_mode == 0x51 && m.system_status == 4);
}

TEST(longer_payloads_lose_what_is_not_known)
{
    uint8_t bytes[MAVLINK_FRAME_MAX], extra = 50;
    struct mavlink_parser parser = {0};
    struct mavlink_frame frame;
    size_t n = unhex("FD 0B 00 00 00 01 01 00 00 00 00 00 00 00 0C 03 00 04 03 AA BB", bytes);
    const uint16_t crc = mavlink_crc(&extra, 1, mavlink_crc(bytes + 1, n - 1, 0xFFFF));
    struct mavlink_heartbeat m;
    bytes[n++] = (uint8_t)crc;
    bytes[n++] = (uint8_t)(crc >> 8);
    CHECK_INT(feed(&parser, bytes, n, 5, &frame), 1);
    mavlink_unpack(frame.message, frame.payload, &m);
    CHECK_INT(m.type, 12);
}

/* One good frame, what comes before it, and how the counters stand behind it. */
TEST(whatever_stands_between_frames_is_counted_and_passed_over)
{
    static const struct {
        const char *name, *before;
        uint64_t unknown, bad_crc, bad_flags, garbage;
    } rows[] = {
        {"nothing", "", 0, 0, 0, 0},
        {"text", "68 65 6C 6C 6F", 0, 0, 0, 5},
        {"a wrong CRC", "FD 09 00 00 00 01 C4 00 00 00 00 00 00 00 12 08 00 04 03 F4 9B", 0, 1, 0, 21},
        {"a wrong byte", "FD 09 00 00 00 01 C4 00 00 00 00 00 00 00 13 08 00 04 03 F4 9A", 0, 1, 0, 21},
        {"unknown flags", "FD 01 02 00 00 01 01 00 00 00 00 00 00", 0, 0, 1, 13},
        {"an unknown id", "FD 03 00 00 00 01 01 01 00 00 11 22 33 44 55", 1, 0, 0, 0},
        {"an unknown id of version 1", "FE 02 00 01 01 01 11 22 33 44", 1, 0, 0, 0},
        {"an unknown id, then none", "FD 03 00 00 00 01 01 01 00 00 11 22 33 44 55 66", 0, 0, 0, 16},
    };
    uint8_t good[MAVLINK_FRAME_MAX];
    const size_t n_good = heartbeat_1(good);

    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        for (size_t piece = 1; piece < 40; piece++) {
            struct mavlink_parser parser = {0};
            struct mavlink_frame frame;
            uint8_t bytes[100];
            const size_t n = unhex(rows[i].before, bytes);
            const struct mavlink_counters *c = &parser.counters;
            memcpy(bytes + n, good, n_good);
            if (feed(&parser, bytes, n + n_good, piece, &frame) != 1 || c->frames != 1 ||
                c->unknown != rows[i].unknown || c->bad_crc != rows[i].bad_crc ||
                c->bad_flags != rows[i].bad_flags || c->garbage_bytes != rows[i].garbage) {
                printf("# %s, pieces of %zu: %d frames, %d unknown, %d bad, %d flags, %d garbage\n", rows[i].name,
                       piece, (int)c->frames, (int)c->unknown, (int)c->bad_crc, (int)c->bad_flags,
                       (int)c->garbage_bytes);
                CHECK(false);
            }
        }
    }
}

/* The head of an unknown frame whose length covers a good one: believed behind a frame, not behind garbage. */
TEST(what_looks_like_an_unknown_frame_amid_garbage_swallows_nothing)
{
    for (int garbage = 0; garbage < 2; garbage++) {
        struct mavlink_parser parser = {0};
        struct mavlink_frame frame;
        uint8_t bytes[100] = {0};
        size_t n = (size_t)garbage;
        n += unhex("FD 0F 00 00 00 01 01 01 00 00", bytes + n);
        n += heartbeat_1(bytes + n);
        n += heartbeat_1(bytes + n);
        CHECK_INT(feed(&parser, bytes, n, 7, &frame), garbage ? 2 : 1);
        CHECK_INT(parser.counters.unknown, garbage ? 0 : 1);
    }
}

/* A cut frame takes the next one with it at most: what follows is found in the bytes already held. */
TEST(a_cut_frame_costs_only_itself)
{
    const struct mavlink_obstacle_distance m = {.frame = 12};
    const struct mavlink_heartbeat beat = {.mavlink_version = 3};
    uint8_t bytes[2000];
    for (size_t cut = 1; cut < 179; cut++) {
        struct mavlink_parser parser = {0};
        struct mavlink_frame frame;
        uint8_t whole[MAVLINK_FRAME_MAX];
        size_t n = cut;
        build(0, 1, MAVLINK_OBSTACLE_DISTANCE, &m, whole);
        memcpy(bytes, whole, cut);
        for (int i = 0; i < 20; i++)
            n += build((uint8_t)i, 1, MAVLINK_HEARTBEAT, &beat, bytes + n);
        CHECK_INT(feed(&parser, bytes, n, n, &frame), 20);
    }
}

TEST(random_bytes_never_make_a_frame_go_missing)
{
    uint64_t random = test_seed();
    struct mavlink_parser parser = {0};
    struct mavlink_frame frame;
    const struct mavlink_heartbeat beat = {.mavlink_version = 3};
    uint8_t bytes[4096];
    int frames = 0, sent = 0;
    for (int round = 0; round < 2000; round++) {
        size_t n = test_random(&random) % 60;
        for (size_t i = 0; i < n; i++) /* no magic among them: the 280 bytes behind one would be waited for */
            bytes[i] = (uint8_t)(test_random(&random) % 0xFD);
        for (int i = (int)(test_random(&random) % 4); i > 0; i--, sent++)
            n += build((uint8_t)sent, 1, MAVLINK_HEARTBEAT, &beat, bytes + n);
        frames += feed(&parser, bytes, n, 1 + test_random(&random) % 50, &frame);
    }
    CHECK_INT(frames, sent);
    CHECK_INT(parser.counters.bad_crc, 0);
}

/* ---- signatures ---- */

static const char key_text[] = "000102030405060708090a0b0c0d0e0f101112131415161718191A1B1C1D1E1F\n";
#define NEW_YEAR_2026_US 1767225600000000u

static struct mavlink_signing signing_at(uint64_t unix_us, uint8_t link_id)
{
    struct mavlink_signing signing = {.link_id = link_id};
    CHECK(mavlink_signing_key(&signing, key_text));
    mavlink_signing_clock(&signing, unix_us);
    return signing;
}

static size_t signed_heartbeat(struct mavlink_signing *signing, uint8_t *out)
{
    struct mavlink_sender sender = {1, 196, 0, signing};
    const struct mavlink_heartbeat m = {.type = 18, .autopilot = 8, .system_status = 4, .mavlink_version = 3};
    return mavlink_build(&sender, mavlink_message(MAVLINK_HEARTBEAT), &m, out);
}

TEST(sha256_gives_the_standards_digests)
{
    static const struct {
        const char *text, *digest;
    } rows[] = {
        {"", "E3 B0 C4 42 98 FC 1C 14 9A FB F4 C8 99 6F B9 24 27 AE 41 E4 64 9B 93 4C A4 95 99 1B 78 52 B8 55"},
        {"abc", "BA 78 16 BF 8F 01 CF EA 41 41 40 DE 5D AE 22 23 B0 03 61 A3 96 17 7A 9C B4 10 FF 61 F2 00 15 AD"},
        {"abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq",
         "24 8D 6A 61 D2 06 38 B8 E5 C0 26 93 0C 3E 60 39 A3 3C E4 59 64 FF 21 67 F6 EC ED D4 19 DB 06 C1"},
    };
    struct sha256 hash;
    uint8_t digest[SHA256_BYTES], block[1000];

    for (size_t i = 0; i < 3; i++) {
        sha256_begin(&hash);
        sha256_add(&hash, rows[i].text, strlen(rows[i].text));
        sha256_end(&hash, digest);
        check_hex(digest, sizeof digest, rows[i].digest);
    }
    memset(block, 'a', sizeof block);
    sha256_begin(&hash);
    for (int i = 0; i < 1000; i++)
        sha256_add(&hash, block, sizeof block);
    sha256_end(&hash, digest);
    check_hex(digest, sizeof digest,
              "CD C7 6E 5C 99 14 FB 92 81 A1 C7 E2 84 D7 3E 67 F1 80 9A 48 A4 97 20 0E 04 6D 39 CC C7 11 2C D0");
}

TEST(a_signed_heartbeat)
{
    struct mavlink_signing signing = signing_at(NEW_YEAR_2026_US, 2);
    uint8_t frame[MAVLINK_FRAME_MAX];
    signing.newest--; /* the frame takes the time stamp after it */
    check_hex(
        frame, signed_heartbeat(&signing, frame),
        "FD 09 01 00 00 01 C4 00 00 00 00 00 00 00 12 08 00 04 03 13 62 02 00 E0 3C D6 92 1F 09 A8 F5 56 78 F9");
}

TEST(signatures_are_wanted_and_held_against_the_key)
{
    static const struct {
        const char *name;
        int change; /* byte of the frame to change; -1: none */
        int frames;
    } rows[] = {{"as it is", -1, 1}, {"link id", 21, 0}, {"time", 22, 0}, {"hash", 28, 0}, {"last byte", 33, 0}};

    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct mavlink_signing ours = signing_at(NEW_YEAR_2026_US, 2), theirs = ours;
        struct mavlink_parser parser = {.signing = &ours};
        struct mavlink_frame frame;
        uint8_t bytes[MAVLINK_FRAME_MAX];
        const size_t n = signed_heartbeat(&theirs, bytes);
        if (rows[i].change >= 0)
            bytes[rows[i].change] ^= 1;
        CHECK_INT(feed(&parser, bytes, n, 4, &frame), rows[i].frames);
        CHECK_INT(parser.counters.bad_signature, 1 - rows[i].frames);
        CHECK_INT(parser.counters.garbage_bytes, 0);
    }
    struct mavlink_signing ours = signing_at(NEW_YEAR_2026_US, 2);
    struct mavlink_parser parser = {.signing = &ours};
    struct mavlink_frame frame;
    uint8_t bytes[MAVLINK_FRAME_MAX];
    CHECK_INT(feed(&parser, bytes, heartbeat_1(bytes), 50, &frame), 0); /* not signed at all */
    CHECK_INT(parser.counters.bad_signature, 1);
}

TEST(signed_frames_are_taken_unverified_without_a_key)
{
    struct mavlink_signing theirs = signing_at(NEW_YEAR_2026_US, 2);
    struct mavlink_parser parser = {0};
    struct mavlink_frame frame;
    uint8_t bytes[MAVLINK_FRAME_MAX];
    const size_t n = signed_heartbeat(&theirs, bytes);
    bytes[n - 1] ^= 1;
    CHECK_INT(feed(&parser, bytes, n, n, &frame), 1);
}

TEST(time_stamps_must_rise_per_sender_and_link)
{
    struct mavlink_signing ours = signing_at(NEW_YEAR_2026_US, 0);
    struct mavlink_signing a = signing_at(NEW_YEAR_2026_US, 1), b = signing_at(NEW_YEAR_2026_US - 30000000, 2);
    struct mavlink_signing old = signing_at(NEW_YEAR_2026_US - 61000000, 3);
    struct mavlink_parser parser = {.signing = &ours};
    struct mavlink_frame frame;
    uint8_t first[MAVLINK_FRAME_MAX], bytes[MAVLINK_FRAME_MAX];
    const size_t n = signed_heartbeat(&a, first);
    CHECK_INT(feed(&parser, first, n, n, &frame), 1);
    CHECK_INT(feed(&parser, first, n, n, &frame), 0); /* said again */
    CHECK_INT(feed(&parser, bytes, signed_heartbeat(&a, bytes), n, &frame), 1);
    CHECK_INT(feed(&parser, bytes, signed_heartbeat(&b, bytes), n, &frame),
              1); /* another link, half a minute old */
    CHECK_INT(feed(&parser, bytes, signed_heartbeat(&old, bytes), n, &frame), 0); /* a new one, too old */
    CHECK_INT(parser.counters.bad_signature, 2);
    CHECK(ours.newest >= a.newest);
}

TEST(a_wrong_frame_does_not_take_a_senders_place)
{
    struct mavlink_signing ours = signing_at(NEW_YEAR_2026_US, 0), theirs = ours;
    struct mavlink_parser parser = {.signing = &ours};
    struct mavlink_frame frame;
    uint8_t bytes[MAVLINK_FRAME_MAX];
    size_t n = 0;
    for (int link = 0; link < 100; link++) {
        theirs.link_id = (uint8_t)link;
        n = signed_heartbeat(&theirs, bytes);
        bytes[n - 1] ^= 1;
        CHECK_INT(feed(&parser, bytes, n, n, &frame), 0);
    }
    CHECK_INT(ours.n_streams, 0);
    for (int link = 0; link < 100; link++) {
        theirs.link_id = (uint8_t)link;
        n = signed_heartbeat(&theirs, bytes);
        CHECK_INT(feed(&parser, bytes, n, n, &frame), link < MAVLINK_STREAMS_MAX);
    }
}

TEST(keys_are_64_digits_and_nothing_else)
{
    struct mavlink_signing signing;
    char text[80];
    snprintf(text, sizeof text, " %.64s \n", key_text);
    CHECK(mavlink_signing_key(&signing, text));
    CHECK(signing.key[0] == 0 && signing.key[1] == 1 && signing.key[31] == 31);
    snprintf(text, sizeof text, "%.63s", key_text);
    CHECK(!mavlink_signing_key(&signing, text));
    snprintf(text, sizeof text, "%.64s0", key_text);
    CHECK(!mavlink_signing_key(&signing, text));
    CHECK(!mavlink_signing_key(&signing, "g00102030405060708090a0b0c0d0e0f101112131415161718191A1B1C1D1E1F"));
}

int main(void)
{
    RUN(the_crc_is_mcrf4xx);
    RUN(every_tables_crc_extra_follows_from_its_names_and_types);
    RUN(heartbeat);
    RUN(attitude);
    RUN(command_long_loses_its_last_zero);
    RUN(obstacle_distance);
    RUN(obstacle_distance_3d);
    RUN(distance_sensor);
    RUN(statustext_and_timesync);
    RUN(fields_lie_where_the_definitions_say);
    RUN(a_payload_of_zeros_keeps_one_byte);
    RUN(version_1_is_understood);
    RUN(longer_payloads_lose_what_is_not_known);
    RUN(whatever_stands_between_frames_is_counted_and_passed_over);
    RUN(what_looks_like_an_unknown_frame_amid_garbage_swallows_nothing);
    RUN(a_cut_frame_costs_only_itself);
    RUN(random_bytes_never_make_a_frame_go_missing);
    RUN(sha256_gives_the_standards_digests);
    RUN(a_signed_heartbeat);
    RUN(signatures_are_wanted_and_held_against_the_key);
    RUN(signed_frames_are_taken_unverified_without_a_key);
    RUN(time_stamps_must_rise_per_sender_and_link);
    RUN(a_wrong_frame_does_not_take_a_senders_place);
    RUN(keys_are_64_digits_and_nothing_else);
    return test_end();
}
