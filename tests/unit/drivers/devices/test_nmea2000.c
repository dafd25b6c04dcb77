/* SPDX-License-Identifier: MIT */
/*
 * NMEA 2000 Water Depth on made-up frames and, where the recordings are at hand, on those: as many depths as they hold,
 * and no other.
 */
#include "tests/lib/can_rig.h"

#define DATA "../shared/data/nmea2000-depth/"

TEST(depth_becomes_a_ping)
{
    CHECK(rig_open(&device_nmea2000, -1, -1));
    rig_hear("0DF50B23#11D502000006FF0A");
    CHECK_INT(rig.pings, 1);
    CHECK(rig.ping.kind == PING_RANGES && rig.ping.n_beams == 1);
    CHECK_NEAR(rig.beam.range_m, 7.25, 1e-7, 0);
    CHECK_NEAR((double)rig.ping.n_bins * (double)rig.ping.dr_m, 100, 0, 0);
    CHECK_INT(rig.now_ns - rig.ping.t_ns, 9666666);
    CHECK_STR(rig_status().what, "NMEA 2000 address 35, 0.250 m above the keel");
    CHECK_INT(rig_status().state, DEVICE_RUNNING);
}

TEST(what_is_no_depth)
{
    static const struct {
        const char *name, *frame;
        unsigned pings, frames, bad_frame;
        double range_max_m;
    } cases[] = {
        {"not available", "0DF50B23#11FFFFFFFF06FF0A", 0, 1, 0, 0},
        {"out of range", "0DF50B23#11FEFFFFFF06FF0A", 0, 1, 0, 0},
        {"reserved", "0DF50B23#11FDFFFFFF06FF0A", 0, 1, 0, 0},
        {"greatest", "0DF50B23#11FCFFFFFF06FF0A", 1, 1, 0, 100},
        {"zero", "0DF50B23#110000000006FF0A", 0, 1, 0, 0},
        {"range unknown", "0DF50B23#11D502000006FFFF", 1, 1, 0, 50},
        {"other priority", "19F50B23#11D502000006FF0A", 1, 1, 0, 100},
        {"short", "0DF50B23#11D502000006FF", 0, 0, 1, 0},
        {"speed (128259)", "09F50323#11D502000006FF0A", 0, 0, 0, 0},
        {"the page before", "0CF50B23#11D502000006FF0A", 0, 0, 0, 0},
        {"reserved bit", "0FF50B23#11D502000006FF0A", 0, 0, 0, 0},
        {"standard identifier", "123#11D502000006FF0A", 0, 0, 0, 0},
        {"remote", "0DF50B23#R8", 0, 0, 0, 0},
        {"error", "20000040#11D502000006FF0A", 0, 0, 0, 0},
        {"CAN FD", "0DF50B23##111D502000006FF0A", 0, 0, 1, 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        CHECK(rig_open(&device_nmea2000, -1, -1));
        rig_hear(cases[i].frame);
        struct device_status s = rig_status();
        CHECK_INT(rig.unheard, s.frames - rig.pings); /* a depth that is none takes back what was clear */
        if (rig.pings != cases[i].pings || s.frames != cases[i].frames || s.bad_frame != cases[i].bad_frame ||
            (rig.pings && (double)rig.ping.dr_m != cases[i].range_max_m)) {
            printf("%s: %u pings, %d frames, %d bad\n", cases[i].name, rig.pings, (int)s.frames, (int)s.bad_frame);
            CHECK(false);
        }
    }
}

TEST(offset_is_told_and_not_added)
{
    static const struct {
        const char *frame, *what;
    } cases[] = {{"0DF50B23#11D502000090010A", "NMEA 2000 address 35, 0.400 m below the water line"},
                 {"0DF50B23#11D5020000FF7F0A", "NMEA 2000 address 35"},
                 {"0DF50B23#11D5020000FFFF0A", "NMEA 2000 address 35"},
                 {"0DF50B23#11D502000000000A", "NMEA 2000 address 35"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        CHECK(rig_open(&device_nmea2000, -1, -1));
        rig_hear(cases[i].frame);
        CHECK_STR(rig_status().what, cases[i].what);
        CHECK_NEAR(rig.beam.range_m, 7.25, 1e-7, 0);
    }
}

TEST(source_is_chosen)
{
    CHECK(rig_open(&device_nmea2000, 0x23, -1));
    rig_hear("0DF50B23#11D502000006FF0A");
    rig_hear("0DF50B24#11D502000006FF0A");
    CHECK_INT(rig.pings, 1);
    CHECK(!rig_open(&device_nmea2000, 252, -1));
    CHECK(strstr(rig.fault.text, "node = 252: nmea2000 takes node 0 to 251"));
}

/* Of a bus with a transducer at 36 (24), and a display at 12 (0C) that repeats the message without a depth. */
TEST(a_display_without_depths_takes_nothing_back)
{
    CHECK(rig_open(&device_nmea2000, -1, -1));
    rig_hear("15F50B24#67BC010000F401FF");
    rig_wait(300);
    rig_hear("0DF50B0C#FFFFFFFFFFFF7FFF");
    CHECK_INT(rig.pings, 1);
    CHECK_INT(rig.unheard, 0);
    CHECK_STR(rig_status().what, "NMEA 2000 address 36, 0.500 m below the water line");
    rig_hear("15F50B24#67FFFFFFFFF401FF"); /* the transducer itself */
    CHECK_INT(rig.unheard, 1);
    rig_hear("0DF50B0C#FFFFFFFFFFFF7FFF"); /* nobody has a depth now, and the transducer has said so */
    CHECK_INT(rig.unheard, 1);
    CHECK_INT(rig_status().strangers, 0);
    CHECK_INT(rig.warnings, 0);
}

TEST(a_display_counts_again_when_the_transducer_is_silent)
{
    CHECK(rig_open(&device_nmea2000, -1, -1));
    rig_hear("15F50B24#67BC010000F401FF");
    rig_wait(5001);
    rig_hear("0DF50B0C#FFFFFFFFFFFF7FFF");
    CHECK_INT(rig.unheard, 1);
}

TEST(of_two_with_depths_the_first_is_used_until_it_is_silent)
{
    CHECK(rig_open(&device_nmea2000, -1, -1));
    for (int i = 0; i < 3; i++) {
        rig_hear("0DF50B0B#11D50200000000FF");
        rig_hear("0DF50B23#11BC0100000000FF");
    }
    CHECK_INT(rig.pings, 3);
    CHECK_INT(rig_status().strangers, 3);
    CHECK_INT(rig.warnings, 1);
    CHECK(strstr(rig.note, "addresses 11 and 35; those of 35 are not used"));
    rig_hear("0DF50B0B#11D50200000000FF");
    CHECK_STR(rig_status().what, "NMEA 2000 address 11 (depths also from 35)");
    rig_hear("0DF50B23#11FFFFFFFF0000FF");
    CHECK_INT(rig.unheard, 0);
    rig_hear("0DF50B0B#11FFFFFFFF0000FF"); /* what it cleared is taken back */
    CHECK_INT(rig.unheard, 1);
    rig_hear("0DF50B23#11BC0100000000FF"); /* it is still there, though it has no depth */
    CHECK_INT(rig.pings, 4);
    rig_wait(5001);
    rig_hear("0DF50B23#11BC0100000000FF");
    CHECK_INT(rig.pings, 5);
    CHECK_STR(rig_status().what, "NMEA 2000 address 35");
}

TEST(a_changed_address_is_no_second_transducer)
{
    CHECK(rig_open(&device_nmea2000, -1, -1));
    rig_hear("0DF50B0B#11D50200000000FF");
    rig_wait(5001);
    const unsigned warnings = rig.warnings; /* of the silence */
    rig_hear("0DF50B23#11BC0100000000FF");
    CHECK_INT(rig.warnings, warnings);
    CHECK_STR(rig_status().what, "NMEA 2000 address 35");
}

TEST(short_frames_are_named_once)
{
    CHECK(rig_open(&device_nmea2000, -1, -1));
    rig_hear("0DF50B23#11D502000006FF");
    rig_hear("0DF50B23#11D502000006FF");
    CHECK_INT(rig.pings, 0);
    CHECK_INT(rig_status().bad_frame, 2);
    CHECK_INT(rig.warnings, 1);
    CHECK_STR(rig.note, "NMEA 2000 address 35 sends depths of 7 bytes, not 8; they are not used");
    CHECK_STR(rig_status().what, "NMEA 2000 address 35: depths of 7 bytes not used");
    rig_hear("0DF50B24#11D502000006FF");
    CHECK_INT(rig.warnings, 2);
}

/* Every line of the file: in the form of candump -L, or "<0x0df50b23> [8] ff ff ...". Their number, of frames. */
static unsigned hear_file(FILE *f)
{
    char line[256];
    unsigned frames = 0;
    while (fgets(line, sizeof line, f)) {
        struct candump_frame c = {0};
        unsigned id, n, b[8];
        bool good = candump_line(line, strcspn(line, "\r\n"), &c);
        if (!good &&
            sscanf(line, "<0x%x> [%u] %x %x %x %x %x %x %x %x", &id, &n, b, b + 1, b + 2, b + 3, b + 4, b + 5,
                   b + 6, b + 7) >= 2 &&
            n <= 8) {
            good = true;
            c.n = CAN_MTU;
            c.frame.can_id = id | CAN_EFF_FLAG;
            c.frame.len = (uint8_t)n;
            for (unsigned i = 0; i < n; i++)
                c.frame.data[i] = (uint8_t)b[i];
        }
        if (!good)
            continue;
        frames++;
        rig.now_ns += RIG_MS;
        rig.ops->feed(rig.state, (const uint8_t *)&c.frame, c.n, rig.now_ns, &rig.io);
    }
    return frames;
}

/* "time,prio,pgn,src,dst,len,bytes": single frames of 8 bytes; others become frames that are nobody's. */
static unsigned hear_csv(FILE *f)
{
    char line[1024];
    unsigned messages = 0;
    while (fgets(line, sizeof line, f)) {
        unsigned prio, pgn, source, target, n, b[8];
        struct canfd_frame frame = {.len = 8};
        if (sscanf(line, "%*[^,],%u,%u,%u,%u,%u,%x,%x,%x,%x,%x,%x,%x,%x", &prio, &pgn, &source, &target, &n, b,
                   b + 1, b + 2, b + 3, b + 4, b + 5, b + 6, b + 7) != 13 ||
            n != 8)
            continue;
        messages++;
        frame.can_id = (canid_t)(CAN_EFF_FLAG | prio << 26 | pgn << 8 | source);
        for (unsigned i = 0; i < 8; i++)
            frame.data[i] = (uint8_t)b[i];
        rig.now_ns += RIG_MS;
        rig.ops->feed(rig.state, (const uint8_t *)&frame, CAN_MTU, rig.now_ns, &rig.io);
    }
    return messages;
}

static void hear_recording(const char *name, bool csv, unsigned frames, unsigned depths, unsigned pings, double lo,
                           double hi)
{
    char path[256];
    snprintf(path, sizeof path, DATA "%s", name);
    FILE *f = fopen(path, "r");
    CHECK(f != NULL);
    if (!f)
        return;
    CHECK(rig_open(&device_nmea2000, -1, -1));
    unsigned heard = csv ? hear_csv(f) : hear_file(f);
    fclose(f);
    if (frames)
        CHECK_INT(heard, frames);
    CHECK_INT(rig_status().frames, depths);
    CHECK_INT(rig.pings, pings);
    CHECK_INT(rig_status().bad_frame, 0);
    for (unsigned i = 0; i < rig.pings; i++)
        CHECK(rig.range_m[i] > lo - 1e-6 && rig.range_m[i] < hi + 1e-6);
}

TEST(recording_with_depths)
{
    hear_recording("candumpSample3.txt", false, 2368, 17, 17, 1.96, 2.08);
    CHECK_STR(rig_status().what, "NMEA 2000 address 116");
}

TEST(recording_without_bottom)
{
    hear_recording("candumpSample1.txt", false, 6026, 99, 0, 0, 0);
}

TEST(recording_with_offset)
{
    hear_recording("susteranna-actisense-serial.raw", true, 0, 31, 31, 3.76, 4.03);
    CHECK(strstr(rig_status().what, "0.400 m below the water line"));
}

int main(void)
{
    RUN(depth_becomes_a_ping);
    RUN(what_is_no_depth);
    RUN(offset_is_told_and_not_added);
    RUN(source_is_chosen);
    RUN(a_display_without_depths_takes_nothing_back);
    RUN(a_display_counts_again_when_the_transducer_is_silent);
    RUN(of_two_with_depths_the_first_is_used_until_it_is_silent);
    RUN(a_changed_address_is_no_second_transducer);
    RUN(short_frames_are_named_once);
    FILE *data = fopen(DATA "README.md", "r");
    if (data) {
        fclose(data);
        RUN(recording_with_depths);
        RUN(recording_without_bottom);
        RUN(recording_with_offset);
    } else {
        printf("skip recordings: there is no " DATA "\n");
    }
    return test_end();
}
