/* SPDX-License-Identifier: MIT */
/* Logs of candump: lines of every kind that it writes, lines that it does not, and whole files. */
#include <unistd.h>

#include "core/fault.h"
#include "drivers/capture/candump.h"
#include "tests/lib/test.h"

static bool parse(const char *line, struct candump_frame *f)
{
    return candump_line(line, strlen(line), f);
}

TEST(lines_that_are_frames)
{
    static const struct {
        const char *line;
        canid_t id;
        size_t n;
        uint8_t len, flags, first, last;
    } cases[] = {
        {"(1700000000.123456) can0 10041A2A#859087D612000085", 0x90041A2A, CAN_MTU, 8, 0, 0x85, 0x85},
        {"(1700000000.123456789) can0 123#DEAD", 0x123, CAN_MTU, 2, 0, 0xDE, 0xAD},
        {"(0.1) slcan0 7ff#11.22.33", 0x7FF, CAN_MTU, 3, 0, 0x11, 0x33},
        {"(1.000000) can0 123#", 0x123, CAN_MTU, 0, 0, 0, 0},
        {"(1.000000) can0 00000123#11", 0x80000123, CAN_MTU, 1, 0, 0x11, 0x11},
        {"(1.000000) can0 123#R", 0x40000123, CAN_MTU, 0, 0, 0, 0},
        {"(1.000000) can0 123#R8", 0x40000123, CAN_MTU, 0, 0, 0, 0},
        {"(1.000000) can0 123#1122334455667788_D", 0x123, CAN_MTU, 8, 0, 0x11, 0x88},
        {"(1.000000) can0 20000040#0000000000000000", 0x20000040, CAN_MTU, 8, 0, 0, 0},
        {"(1.000000) can0 123##1AB", 0x123, CANFD_MTU, 1, 1, 0xAB, 0xAB},
        {"(1.000000) can0 123##5AB", 0x123, CANFD_MTU, 1, 1, 0xAB, 0xAB},
        {"(1.000000) can0 123##0112233445566778899AABBCC", 0x123, CANFD_MTU, 12, 0, 0x11, 0xCC},
        {"(1.000000) can0 123#11 R", 0x123, CAN_MTU, 1, 0, 0x11, 0x11},
        {"(1.000000) can0 123#11 T", 0x123, CAN_MTU, 1, 0, 0x11, 0x11},
        {"(1.000000) can0 123#11\r", 0x123, CAN_MTU, 1, 0, 0x11, 0x11},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct candump_frame f;
        bool good = parse(cases[i].line, &f) && f.frame.can_id == cases[i].id && f.n == cases[i].n &&
                    f.frame.len == cases[i].len && f.frame.flags == cases[i].flags &&
                    f.frame.data[0] == cases[i].first &&
                    (!f.frame.len || f.frame.data[f.frame.len - 1] == cases[i].last);
        if (!good)
            printf("%s\n", cases[i].line);
        CHECK(good);
    }
}

TEST(times_and_names)
{
    struct candump_frame f;
    CHECK(parse("(1700000000.123456) can0 123#", &f) && f.t_ns == 1700000000123456000u);
    CHECK(parse("(1700000000.123456789) vcan0.5 123#", &f) && f.t_ns == 1700000000123456789u);
    CHECK_STR(f.name, "vcan0.5");
    CHECK(parse("(0000000001.000000) abcdefghijklmno 123#", &f));
    CHECK_STR(f.name, "abcdefghijklmno");
}

TEST(lines_that_are_none)
{
    static const char *const lines[] = {
        "",
        "# comment",
        "DROPCOUNT: dropped 3 CAN frames on 'can0' socket (total drops 3)",
        "  can0  123   [8]  11 22 33 44 55 66 77 88",
        "<0x0df50b23> [8] ff ff ff ff ff 00 00 ff",
        "(1.000000) can0 123",
        "(1.000000) can0 12#11",
        "(1.000000) can0 1234#11",
        "(1.000000) can0 123456789#11",
        "(1.000000) can0 800#11",
        "(1.000000) can0 90041A2A#11",
        "(1.000000) can0 123#1",
        "(1.000000) can0 123#112",
        "(1.000000) can0 123#112233445566778899",
        "(1.000000) can0 123#11x",
        "(1.000000) can0 123#1122334455667788_1",
        "(1.000000) can0 123##",
        "(1.000000) can0 123##1112233445566778899", /* nine bytes are no length of CAN FD */
        "(1.000000) can0 123#R9",
        "(1.000000) abcdefghijklmnop 123#11",
        "(1.000000)can0 123#11",
        "(1.) can0 123#11",
        "(.5) can0 123#11",
        "(1.0000000001) can0 123#11",
        "(12345678901.0) can0 123#11",
        "(-1.000000) can0 123#11",
        "(1.000000) can0 00100#81:00:12345678#112233", /* CAN XL */
    };
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        struct candump_frame f;
        bool taken = parse(lines[i], &f);
        if (taken)
            printf("taken: %s\n", lines[i]);
        CHECK(!taken);
    }
}

/* A file that is removed as soon as it was opened. */
static struct candump *open_text(const char *text, struct fault *fault)
{
    char path[] = "/tmp/test_candump.XXXXXX";
    int fd = mkstemp(path);
    CHECK(fd >= 0 && write(fd, text, strlen(text)) == (ssize_t)strlen(text));
    close(fd);
    struct candump *log = candump_open(path, fault);
    unlink(path);
    return log;
}

TEST(a_file_with_other_lines_in_it)
{
    struct fault fault;
    struct candump_frame f;
    struct candump *log = open_text("# head\n\n(2.000000) can0 123#11\nDROPCOUNT: 3\n(1.000000) can1 124#22\r\n"
                                    "(3.000000) can0 12\n(4.000000) can0 125#33",
                                    &fault);
    CHECK(log != NULL);
    CHECK(candump_next(log, &f) && f.frame.can_id == 0x123);
    CHECK(candump_next(log, &f) && f.frame.can_id == 0x124 && f.t_ns == 1000000000u);
    CHECK_INT(candump_left_out(log), 0);
    CHECK(candump_next(log, &f) && f.frame.can_id == 0x125);
    CHECK(!candump_next(log, &f));
    CHECK_INT(candump_left_out(log), 1);
    candump_close(log);
}

/* candump -td writes how long each frame came after the one before; -tz and -ta write what they are taken for. */
TEST(differences_are_added_up)
{
    static const struct {
        const char *text;
        bool differences;
        uint64_t last_ms;
    } row[] = {
        {"(000.000000) can0 001#\n(000.100000) can0 002#\n(000.100000) can0 003#\n(000.050000) can0 004#\n", true,
         250},
        {"(000.000000) can0 001#\n(000.100000) can0 002#\n(000.200000) can0 003#\n(000.250000) can0 004#\n", false,
         250},
        {"(000.000000) can0 001#\n(000.100000) can0 002#\n", false, 100},
        {"(000.300000) can0 001#\n(000.100000) can0 002#\n(000.100000) can0 001#\n(000.100000) can0 002#\n"
         "(000.300000) can0 001#\n(000.100000) can0 002#\n(000.100000) can0 001#\n(000.100000) can0 002#\n",
         true, 1200},
        {"(1700000000.3) can0 001#\n(1700000000.3) can1 001#\n(1700000000.1) can0 001#\n(1700000000.1) can1 "
         "001#\n",
         false, 1700000000100},
        {"(9999999999.000000) can0 001#\n", false, 9999999999000},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct fault fault;
        struct candump_frame f = {0};
        struct candump *log = open_text(row[i].text, &fault);
        CHECK_INT(candump_has_differences(log), row[i].differences);
        while (candump_next(log, &f)) {
        }
        CHECK_INT(f.t_ns, row[i].last_ms * 1000000);
        candump_close(log);
    }
}

TEST(files_that_are_no_log)
{
    static const char *const texts[] = {"", "\n", "can0  123   [2]  11 22\n", "(1.0) can0 zzz\n"};
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        struct fault fault = {""};
        CHECK(open_text(texts[i], &fault) == NULL);
        CHECK(fault.text[0] != '\0');
    }
    struct fault fault;
    CHECK(open_text(texts[2], &fault) == NULL && strstr(fault.text, "candump -L"));
    CHECK(candump_open("/nonexistent/log", &fault) == NULL && strstr(fault.text, "No such file"));
    CHECK(candump_open("/tmp", &fault) == NULL);
}

int main(void)
{
    RUN(lines_that_are_frames);
    RUN(times_and_names);
    RUN(lines_that_are_none);
    RUN(a_file_with_other_lines_in_it);
    RUN(differences_are_added_up);
    RUN(files_that_are_no_log);
    return test_end();
}
