/* SPDX-License-Identifier: MIT */
/* test_nmea0183_device - sentences of an echosounder in, pings out: what frees water, and what must not. */
#include "tests/lib/can_rig.h"

static void hear_bytes(const char *text)
{
    rig.now_ns += RIG_MS;
    rig.ops->feed(rig.state, (const uint8_t *)text, strlen(text), rig.now_ns, &rig.io);
}

/* A sentence without its $, with its checksum. */
static void hear(const char *body)
{
    char line[128];
    unsigned sum = 0;
    for (const char *c = body; *c; c++)
        sum ^= (unsigned char)*c;
    snprintf(line, sizeof line, "$%s*%02X\r\n", body, sum);
    hear_bytes(line);
}

static void open_sounder(void)
{
    CHECK(rig_open(&device_nmea0183, -1, -1));
}

TEST(depth_becomes_a_ping)
{
    open_sounder();
    hear_bytes("$SDDPT,7.25,0.50,100.0*51\r\n");
    CHECK_INT(rig.pings, 1);
    CHECK(rig.ping.kind == PING_RANGES && rig.ping.n_beams == 1);
    CHECK_NEAR(rig.beam.range_m, 7.25, 1e-7, 0);
    CHECK_NEAR(rig.ping.r0_m, 0.5, 0, 0);
    CHECK_NEAR((double)rig.ping.r0_m + (double)rig.ping.n_bins * (double)rig.ping.dr_m, 50, 1e-6, 0);
    CHECK_NEAR(geo_deg((double)rig.ping.az_aperture_rad), 10, 1e-6, 0);
    CHECK_INT(rig.now_ns - rig.ping.t_ns, 9666666);
    CHECK_INT(rig_status().state, DEVICE_RUNNING);
}

/* The range is what was measured; the offset says where the water line or the keel is. */
TEST(offset_is_told_and_not_added)
{
    static const struct {
        const char *body, *what;
    } cases[] = {{"SDDPT,7.25,0.5", "NMEA 0183 SDDPT, 0.500 m below the water line"},
                 {"SDDPT,7.25,-0.4,50", "NMEA 0183 SDDPT, 0.400 m above the keel"},
                 {"SDDPT,7.25,-1.-1", "NMEA 0183 SDDPT"},
                 {"SDDPT,7.25", "NMEA 0183 SDDPT"},
                 {"SDDBT,23.8,f,7.25,M,3.9,F", "NMEA 0183 SDDBT"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        open_sounder();
        hear(cases[i].body);
        CHECK_STR(rig_status().what, cases[i].what);
        CHECK_NEAR(rig.beam.range_m, 7.25, 1e-7, 0);
    }
}

TEST(what_is_no_depth_takes_back_what_was_clear)
{
    static const char *const bodies[] = {"SDDPT,,0.5",     "SDDPT,0.0,0.5",           "SDDPT,-1.0,0.5",
                                         "SDDBT,,f,,M,,F", "SDDBT,0.0,f,0.0,M,0.0,F", "SDDPT"};
    for (size_t i = 0; i < sizeof bodies / sizeof bodies[0]; i++) {
        open_sounder();
        hear(bodies[i]);
        CHECK_INT(rig.pings, 0);
        CHECK_INT(rig.unheard, 1);
        CHECK(rig.beam.range_m == 0);
    }
}

TEST(what_is_broken_or_foreign_is_no_ping)
{
    static const struct {
        const char *bytes;
        unsigned bad_checksum, bad_frame;
    } cases[] = {{"$SDDPT,7.25,0.50,100.0*52\r\n", 1, 0},
                 {"$SDDPT,7.25,0.50,100.0\r\n", 1, 0},
                 {"$SDDPT,7.2x,0*34\r\n", 0, 1},
                 {"$GPHDT,274.07,T*03\r\n", 0, 0},
                 {"$SDDPT,7.25,0.50,10", 0, 0}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        open_sounder();
        hear_bytes(cases[i].bytes);
        CHECK_INT(rig.pings + rig.unheard, 0);
        CHECK_INT(rig_status().bad_checksum, cases[i].bad_checksum);
        CHECK_INT(rig_status().bad_frame, cases[i].bad_frame);
    }
}

/* A multiplexer sends AIS and more beside the depths, and lines of makers have no checksum. */
TEST(what_a_multiplexer_sends_beside_is_no_garbage)
{
    open_sounder();
    hear_bytes("!AIVDM,1,1,,A,13aGua?P00PHfERNFruh0?vN289E,0*36\r\n\\s:r1*0A\\!AIVDM,1,1,,A,x,0*5E\r\n");
    CHECK_STR(rig_status().what, "NMEA 0183 AIVDM, no depth");
    hear_bytes("$PFEC,GPatt,1,2\r\n\\s:r1*0A\\$SDDPT,7.25,0.50,100.0*51\r\n!AIVDM,1,1,,A,x,0*5F\r\n");
    CHECK_INT(rig.pings, 1);
    CHECK_INT(rig.warnings, 0);
    CHECK_INT(rig_status().garbage_bytes, 0);
    CHECK_INT(rig_status().bad_checksum, 1);
    CHECK_INT(rig_status().frames, 4);
}

TEST(missing_checksums_are_a_warning_once)
{
    open_sounder();
    hear_bytes("$SDDPT,7.25,0.50\r\n$SDDPT,7.25,0.50\r\n");
    hear_bytes("$SDDPT,7.25,0.50\r\n");
    CHECK_INT(rig.warnings, 1);
    CHECK(strstr(rig.note, "without a checksum"));
}

/* Sounders send one measurement in several sentences: it is evidence once. */
TEST(one_measurement_in_two_sentences_is_one_ping)
{
    open_sounder();
    for (int i = 0; i < 3; i++) {
        hear("SDDBT,23.8,f,7.25,M,3.9,F");
        hear("SDDPT,7.25,0.5");
        rig_wait(1000);
    }
    CHECK_INT(rig.pings, 3);
    CHECK_INT(rig.warnings, 0);
    CHECK_STR(rig_status().what, "NMEA 0183 SDDBT");
}

TEST(a_display_without_depths_takes_nothing_back)
{
    open_sounder();
    hear("SDDPT,7.25,0.5");
    hear("IIDPT,,");
    CHECK_INT(rig.unheard, 0);
    hear("SDDPT,,0.5"); /* the sounder itself */
    CHECK_INT(rig.unheard, 1);
    hear("IIDPT,9.0,");
    CHECK_INT(rig.pings, 1);
}

TEST(two_talkers_with_depths_are_a_warning)
{
    open_sounder();
    for (int i = 0; i < 3; i++) {
        hear("SDDPT,7.25,0.5");
        hear("YXDPT,3.0,0.5");
    }
    CHECK_INT(rig.pings, 3);
    CHECK_INT(rig.warnings, 1);
    CHECK_STR(rig.note, "depths come in SDDPT and in YXDPT; only those in SDDPT are used");
    CHECK_STR(rig_status().what, "NMEA 0183 SDDPT, 0.500 m below the water line (depths also in YXDPT)");
}

TEST(another_sentence_takes_over_when_the_first_ends)
{
    open_sounder();
    hear("SDDPT,7.25,0.5");
    rig_wait(4000);
    hear("SDDBT,9.8,f,3.00,M,1.6,F");
    CHECK_INT(rig.pings, 1);
    rig_wait(1001);
    hear("SDDBT,9.8,f,3.00,M,1.6,F");
    CHECK_INT(rig.pings, 2);
    CHECK_NEAR(rig.beam.range_m, 3, 1e-7, 0);
}

TEST(silence_and_foreign_sentences_are_told)
{
    open_sounder();
    hear("GPZDA,,,,,,");
    CHECK_STR(rig_status().what, "NMEA 0183 GPZDA, no depth");
    CHECK_INT(rig_status().state, DEVICE_IDENTIFY);
    rig_wait(5001);
    CHECK_INT(rig_status().state, DEVICE_SILENT);
    CHECK_INT(rig.warnings, 1);
    hear("SDDPT,7.25,0.5");
    CHECK_INT(rig_status().state, DEVICE_RUNNING);
}

TEST(half_a_sentence_is_counted_when_the_port_goes)
{
    open_sounder();
    hear_bytes("$SDDPT,7.2");
    rig.ops->closed(rig.state, rig.now_ns);
    rig.ops->opened(rig.state, rig.now_ns, &rig.io);
    hear_bytes("5,0.50,100.0*51\r\n");
    CHECK_INT(rig.pings, 0);
    CHECK_INT(rig_status().cut_bytes, 10);
}

int main(void)
{
    RUN(depth_becomes_a_ping);
    RUN(offset_is_told_and_not_added);
    RUN(what_is_no_depth_takes_back_what_was_clear);
    RUN(what_is_broken_or_foreign_is_no_ping);
    RUN(what_a_multiplexer_sends_beside_is_no_garbage);
    RUN(missing_checksums_are_a_warning_once);
    RUN(one_measurement_in_two_sentences_is_one_ping);
    RUN(a_display_without_depths_takes_nothing_back);
    RUN(two_talkers_with_depths_are_a_warning);
    RUN(another_sentence_takes_over_when_the_first_ends);
    RUN(silence_and_foreign_sentences_are_told);
    RUN(half_a_sentence_is_counted_when_the_port_goes);
    return test_end();
}
