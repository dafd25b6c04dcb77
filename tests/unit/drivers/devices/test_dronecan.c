/* SPDX-License-Identifier: MIT */
/*
 * DroneCAN: transfers, the Measurement message and the device, on the frames of an independent implementation (node 42,
 * sensor 3, 7.25 m, field of view 0.436) and on broken ones.
 */
#include "drivers/devices/dronecan.h"
#include "tests/lib/can_rig.h"

#define FIRST  "10041A2A#859087D612000085"
#define SECOND "10041A2A#0000030685FB3625"
#define LAST   "10041A2A#09404745"

/* The same payload, byte 12 (types) and range replaced, as a transfer of its own from `node`. */
static void hear_made(unsigned node, unsigned transfer, uint8_t types, uint16_t range)
{
    uint8_t b[15] = {
        0x87, 0xD6, 0x12, 0, 0, 0, 0, 3, 6, 0x85, 0xFB, 0x36, types, (uint8_t)range, (uint8_t)(range >> 8)};
    static const uint8_t signature[8] = {0x52, 0x19, 0x77, 0xFC, 0x70, 0xFE, 0xFF, 0x68};
    unsigned crc = dronecan_crc(dronecan_crc(0xFFFF, signature, 8), b, 15);
    char f[3][64];
    snprintf(f[0], 64, "10041A%02X#%02X%02X%02X%02X%02X%02X%02X%02X", node, crc & 0xFF, crc >> 8, b[0], b[1], b[2],
             b[3], b[4], 0x80 | transfer);
    snprintf(f[1], 64, "10041A%02X#%02X%02X%02X%02X%02X%02X%02X%02X", node, b[5], b[6], b[7], b[8], b[9], b[10],
             b[11], 0x20 | transfer);
    snprintf(f[2], 64, "10041A%02X#%02X%02X%02X%02X", node, b[12], b[13], b[14], 0x40 | transfer);
    for (int i = 0; i < 3; i++)
        rig_hear(f[i]);
}

static void hear_all(void)
{
    rig_hear(FIRST);
    rig_hear(SECOND);
    rig_hear(LAST);
}

TEST(crc_is_that_of_the_sheet)
{
    static const uint8_t signature[8] = {0x52, 0x19, 0x77, 0xFC, 0x70, 0xFE, 0xFF, 0x68};
    CHECK_INT(dronecan_crc(0xFFFF, (const uint8_t *)"123456789", 9), 0x29B1);
    CHECK_INT(dronecan_crc(0xFFFF, signature, 8), 0x049C);
}

TEST(measurement_becomes_a_ping)
{
    CHECK(rig_open(&device_dronecan, -1, -1));
    CHECK_INT(rig_status().state, DEVICE_IDENTIFY);
    hear_all();
    CHECK_INT(rig.pings, 1);
    CHECK(rig.ping.kind == PING_RANGES && rig.ping.n_beams == 1);
    CHECK_NEAR(rig.beam.range_m, 7.25, 0, 0);
    CHECK_NEAR(rig.ping.az_aperture_rad, 0.436, 1e-3, 0);
    CHECK_NEAR(rig.ping.el_aperture_rad, 0.436, 1e-3, 0);
    CHECK_INT(rig.ping.t_in_ns, rig.now_ns);
    CHECK_INT(rig.now_ns - rig.ping.t_ns, 9666666);
    CHECK_NEAR((double)rig.ping.n_bins * (double)rig.ping.dr_m, 50, 0, 0);
    CHECK_STR(rig_status().what, "DroneCAN node 42 sensor 3");
    CHECK_INT(rig_status().state, DEVICE_RUNNING);
    CHECK_INT(rig_status().frames, 1);
}

TEST(fields_are_decoded)
{
    static const uint8_t payload[15] = {0x87, 0xD6, 0x12, 0, 0, 0, 0, 3, 6, 0x85, 0xFB, 0x36, 9, 0x40, 0x47};
    struct dronecan_measurement m;
    CHECK(dronecan_decode_measurement(payload, 15, &m));
    CHECK_INT(m.timestamp_us, 1234567);
    CHECK_INT(m.sensor_id, 3);
    CHECK_INT(m.sensor_type, DRONECAN_SENSOR_SONAR);
    CHECK_INT(m.reading_type, DRONECAN_READING_VALID);
    CHECK_NEAR(m.field_of_view_rad, 0.436, 1e-3, 0);
    CHECK_NEAR(m.resolution_m, 1.0 / 256, 0, 0);
    CHECK(!dronecan_decode_measurement(payload, 14, &m));
}

TEST(half_precision_numbers)
{
    static const struct {
        uint16_t bits;
        double value;
    } cases[] = {{0x3C00, 1},  {0x0001, 0x1p-24}, {0x0400, 0x1p-14}, {0x7BFF, 65504},
                 {0xC000, -2}, {0x0000, 0},       {0x7C00, INFINITY}};
    uint8_t payload[15] = {0};
    struct dronecan_measurement m;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        payload[13] = (uint8_t)cases[i].bits;
        payload[14] = (uint8_t)(cases[i].bits >> 8);
        CHECK(dronecan_decode_measurement(payload, 15, &m));
        CHECK_NEAR(m.range_m, cases[i].value, 0, 0);
    }
    payload[13] = 1;
    payload[14] = 0x7C;
    CHECK(dronecan_decode_measurement(payload, 15, &m) && isnan(m.range_m));
}

TEST(fd_transfer_in_one_frame)
{
    CHECK(rig_open(&device_dronecan, -1, -1));
    rig_hear("10041A2A##187D612000000000306"
             "85FB3609404"
             "7C5");
    CHECK_INT(rig.pings, 1);
    CHECK_NEAR(rig.beam.range_m, 7.25, 0, 0);
}

/* What comes in, and what must come of it. */
TEST(broken_transfers_cost_themselves_only)
{
    static const struct {
        const char *name, *frame[6];
        unsigned garbage, bad_checksum, bad_frame;
    } cases[] = {
        {"first lost", {SECOND, LAST}, 12, 0, 0},
        {"middle lost", {FIRST, LAST}, 4, 0, 0},
        {"last lost", {FIRST, SECOND}, 0, 0, 0},
        {"swapped", {FIRST, LAST, SECOND}, 12, 0, 0},
        {"middle twice", {FIRST, SECOND, SECOND, LAST}, 12, 0, 0},
        {"flipped bit", {FIRST, "10041A2A#0000030685FB3725", LAST}, 0, 1, 0},
        {"other transfer id", {FIRST, "10041A2A#0000030685FB3626", LAST}, 12, 0, 0},
        {"toggle at the start", {"10041A2A#859087D6120000A5", SECOND, LAST}, 20, 0, 0},
        {"too short for a checksum", {"10041A2A#8585", NULL}, 0, 0, 1},
        {"no tail", {"10041A2A#", NULL}, 0, 0, 1},
        {"short message", {"10041A2A#0102C5", NULL}, 0, 0, 1},
        {"anonymous", {"10041A00#0102C5", NULL}, 0, 0, 1},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        CHECK(rig_open(&device_dronecan, -1, -1));
        for (int k = 0; k < 6 && cases[i].frame[k]; k++)
            rig_hear(cases[i].frame[k]);
        struct device_status s = rig_status();
        if (rig.pings != 0 || s.garbage_bytes != cases[i].garbage || s.bad_checksum != cases[i].bad_checksum ||
            s.bad_frame != cases[i].bad_frame) {
            printf("%s: %u pings, garbage %d, bad checksum %d, bad frame %d\n", cases[i].name, rig.pings,
                   (int)s.garbage_bytes, (int)s.bad_checksum, (int)s.bad_frame);
            CHECK(false);
        }
        hear_made(42, 6, 9, 0x4740);
        CHECK_INT(rig.pings, 1);
    }
}

TEST(transfers_of_two_nodes_may_interleave)
{
    CHECK(rig_open(&device_dronecan, -1, -1));
    rig_hear(FIRST);
    hear_made(43, 5, 9, 0x4400);
    rig_hear(SECOND);
    rig_hear(LAST);
    CHECK_INT(rig.pings, 1); /* both are whole; the first is believed */
    CHECK_NEAR(rig.range_m[0], 4, 0, 0);
    CHECK_INT(rig_status().strangers, 1);
}

TEST(of_two_sensors_the_first_is_used_until_it_is_silent)
{
    CHECK(rig_open(&device_dronecan, -1, -1));
    for (unsigned i = 0; i < 3; i++) {
        hear_made(43, i, 9, 0x4400);
        hear_made(44, i, 9, 0x4000);
    }
    CHECK_INT(rig.pings, 3);
    CHECK_INT(rig_status().strangers, 3);
    CHECK_INT(rig.warnings, 1);
    CHECK(strstr(rig.note, "of node 43 and from sensor") &&
          strstr(rig.note, "of node 44; the latter are not used"));
    rig_wait(3001);
    hear_made(44, 3, 9, 0x4000);
    CHECK_INT(rig.pings, 4);
}

TEST(a_transfer_that_comes_twice_counts_once)
{
    CHECK(rig_open(&device_dronecan, -1, -1));
    hear_all();
    hear_all();
    CHECK_INT(rig.pings, 1);
    rig_wait(2000);
    hear_all(); /* so much later it is a new one */
    CHECK_INT(rig.pings, 2);
}

TEST(missing_transfers_are_counted)
{
    CHECK(rig_open(&device_dronecan, -1, -1));
    hear_made(42, 30, 9, 0x4400);
    hear_made(42, 31, 9, 0x4400);
    hear_made(42, 0, 9, 0x4400);
    CHECK_INT(rig_status().lost_frames, 0);
    hear_made(42, 4, 9, 0x4400);
    CHECK_INT(rig_status().lost_frames, 3);
    CHECK_INT(rig.pings, 4);
}

TEST(a_transfer_that_pauses_is_given_up)
{
    CHECK(rig_open(&device_dronecan, -1, -1));
    rig_hear(FIRST);
    rig_wait(2000);
    rig_hear(SECOND);
    rig_hear(LAST);
    CHECK_INT(rig.pings, 0);
}

TEST(readings_that_are_no_range)
{
    static const struct {
        const char *name;
        uint8_t types;
        uint16_t range;
        unsigned pings;
        double range_m;
        unsigned bad_frame, unheard; /* a reading that cannot tell takes back what was clear */
    } cases[] = {
        {"valid", 9, 0x4740, 1, 7.25, 0, 0},  {"valid, type undefined", 1, 0x4740, 1, 7.25, 0, 0},
        {"undefined", 8, 0x4740, 0, 0, 0, 1}, {"too close", 10, 0x4740, 0, 0, 0, 1},
        {"too far", 11, 0x4740, 1, 0, 0, 0},  {"reading 7", 15, 0x4740, 0, 0, 0, 1},
        {"lidar", 17, 0x4740, 0, 0, 0, 0},    {"radar", 25, 0x4740, 0, 0, 0, 0},
        {"zero", 9, 0, 0, 0, 1, 0},           {"negative", 9, 0xC740, 0, 0, 1, 0},
        {"infinite", 9, 0x7C00, 0, 0, 1, 0},  {"not a number", 9, 0x7E00, 0, 0, 1, 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        CHECK(rig_open(&device_dronecan, -1, -1));
        hear_made(42, 1, cases[i].types, cases[i].range);
        if (rig.pings != cases[i].pings || (rig.pings && rig.range_m[0] != cases[i].range_m) ||
            rig_status().bad_frame != cases[i].bad_frame || rig.unheard != cases[i].unheard) {
            printf("%s: %u pings, %u unheard, %g m\n", cases[i].name, rig.pings, rig.unheard, rig.range_m[0]);
            CHECK(false);
        }
    }
}

TEST(node_and_sensor_are_chosen)
{
    static const struct {
        int node, sensor_id;
        unsigned pings;
    } cases[] = {{-1, -1, 1}, {42, -1, 1}, {43, 3, 1}, {44, -1, 0}, {-1, 3, 1}, {42, 4, 0}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        CHECK(rig_open(&device_dronecan, cases[i].node, cases[i].sensor_id));
        hear_all();
        hear_made(43, 5, 9, 0x4400);
        CHECK_INT(rig.pings, cases[i].pings);
    }
    CHECK(!rig_open(&device_dronecan, 0, -1));
    CHECK(strstr(rig.fault.text, "node = 0: dronecan takes node 1 to 127"));
    CHECK(!rig_open(&device_dronecan, 128, -1));
}

TEST(other_messages_are_not_looked_at)
{
    CHECK(rig_open(&device_dronecan, -1, -1));
    rig_hear("1001552A#64000000000000C1");
    rig_hear("10041AAA#859087D612000085"); /* a service */
    rig_hear("41A#859087D612000085");
    rig_hear("10041A2A#R8");
    rig_hear("20000040#0000000000000000");
    struct device_status s = rig_status();
    CHECK(s.garbage_bytes == 0 && s.bad_frame == 0 && s.frames == 0 && s.state == DEVICE_IDENTIFY);
    rig.ops->feed(rig.state, (const uint8_t *)"abc", 3, rig.now_ns, &rig.io);
    CHECK_INT(rig_status().garbage_bytes, 3);
}

TEST(filter_lets_only_the_sensor_through)
{
    static const struct {
        canid_t id;
        bool passes;
    } cases[] = {{0x90041A2A, true},  {0x80041A2A, true},  {0x90041A2B, false}, {0x90041AAA, false},
                 {0x9001552A, false}, {0x10041A2A, false}, {0xD0041A2A, false}, {0x90051A2A, false}};
    CHECK(rig_open(&device_dronecan, 42, -1));
    struct can_match match = rig.ops->can_match(rig.state);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct canfd_frame f = {.can_id = cases[i].id};
        CHECK_INT(can_frame_matches(&f, match), cases[i].passes);
    }
}

TEST(silence_is_told_once_and_ends)
{
    CHECK(rig_open(&device_dronecan, -1, -1));
    hear_all();
    rig_wait(2900);
    CHECK_INT(rig_status().state, DEVICE_RUNNING);
    rig_wait(200);
    CHECK_INT(rig_status().state, DEVICE_SILENT);
    rig_wait(60000);
    CHECK_INT(rig.warnings, 1);
    CHECK_INT(rig_status().timeouts, 1);
    hear_made(42, 9, 9, 0x4400);
    CHECK_INT(rig_status().state, DEVICE_RUNNING);
    rig.ops->stop(rig.state, rig.now_ns, &rig.io);
    CHECK(rig.ops->deadline(rig.state) == UINT64_MAX);
}

TEST(a_replay_never_times_out)
{
    CHECK(rig_open(&device_dronecan, -1, -1));
    rig.conf.listen_only = true;
    CHECK(rig.ops->init(rig.state, &rig.conf, &rig.fault));
    rig.ops->opened(rig.state, rig.now_ns, &rig.io);
    hear_all();
    CHECK(rig.pings == 1 && rig.ops->deadline(rig.state) == UINT64_MAX);
}

/* Frames lost, doubled and swapped at random: every ping is one that was sent, whole and in order. */
TEST(no_transfer_is_invented)
{
    uint64_t seed = test_seed();
    unsigned heard = 0;
    CHECK(rig_open(&device_dronecan, -1, -1));
    for (int round = 0; round < 2000; round++) {
        const char *frames[3] = {FIRST, SECOND, LAST};
        for (int i = 0; i < 3; i++) {
            int k = test_uniform(&seed) < 0.1 ? (int)(test_random(&seed) % 3) : i;
            if (test_uniform(&seed) < 0.9)
                rig_hear(frames[k]);
        }
        rig_wait(2000);
        CHECK(rig.pings - heard <= 1);
        CHECK(rig.pings == heard || rig.range_m[heard % 4096] == 7.25);
        heard = rig.pings;
    }
    CHECK(heard > 1000);
}

int main(void)
{
    RUN(crc_is_that_of_the_sheet);
    RUN(measurement_becomes_a_ping);
    RUN(fields_are_decoded);
    RUN(half_precision_numbers);
    RUN(fd_transfer_in_one_frame);
    RUN(broken_transfers_cost_themselves_only);
    RUN(transfers_of_two_nodes_may_interleave);
    RUN(of_two_sensors_the_first_is_used_until_it_is_silent);
    RUN(a_transfer_that_comes_twice_counts_once);
    RUN(missing_transfers_are_counted);
    RUN(a_transfer_that_pauses_is_given_up);
    RUN(readings_that_are_no_range);
    RUN(node_and_sensor_are_chosen);
    RUN(other_messages_are_not_looked_at);
    RUN(filter_lets_only_the_sensor_through);
    RUN(silence_is_told_once_and_ends);
    RUN(a_replay_never_times_out);
    RUN(no_transfer_is_invented);
    return test_end();
}
