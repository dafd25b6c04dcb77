/* SPDX-License-Identifier: MIT */
/* test_garbage - what a port that brings garbage writes to the log, whatever comes between.
 * Standard error is a file here. */
#include "tests/lib/test.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "daemon/input/garbage.h"
#include "core/log.h"

#define SECOND 1000000000ull
#define MINUTE (60 * SECOND)

static struct port {
    struct loop *loop;
    struct garbage garbage;
    struct garbage_count came;
    uint64_t told; /* bytes of garbage in all lines */
    int lines;
    off_t read;
} port;

static int terminal;

static void count(const void *owner, struct garbage_count *now)
{
    const struct port *p = owner;
    *now = p->came;
}

static void begin(enum log_level level)
{
    char name[] = "/tmp/sonard-garbage-XXXXXX";
    const int fd = mkstemp(name);
    unlink(name);
    terminal = dup(STDERR_FILENO);
    dup2(fd, STDERR_FILENO);
    close(fd);
    log_set_level(level);
    port = (struct port){.loop = loop_new(true)};
    port.garbage = (struct garbage){.loop = port.loop,
                                    .sonar = "front",
                                    .whose = "",
                                    .port = "serial:x",
                                    .speech = "ping360",
                                    .count = count,
                                    .owner = &port};
}

static void end(void)
{
    garbage_end(&port.garbage);
    loop_free(port.loop);
    dup2(terminal, STDERR_FILENO);
    close(terminal);
}

/* The line that was written since the last one, if one was. */
static const char *line(void)
{
    static char text[1000];
    const ssize_t n = pread(STDERR_FILENO, text, sizeof text - 1, port.read);
    text[n > 0 ? n : 0] = '\0';
    if (n <= 0)
        return NULL;
    port.read += n;
    port.lines++;
    const char *bytes = strstr(text, "serial:x: discarded ");
    port.told += bytes ? strtoull(bytes + strlen("serial:x: discarded "), NULL, 10) : 0;
    return text;
}

/* So many bytes of garbage and messages of 10 bytes come, and then nothing for so long. */
static const char *hear(unsigned garbage, unsigned messages, uint64_t then_ns)
{
    port.came.bytes += garbage + 10 * messages;
    port.came.garbage += garbage;
    port.came.messages += messages;
    if (garbage || messages)
        garbage_heard(&port.garbage);
    loop_advance(port.loop, loop_now(port.loop) + then_ns);
    return line();
}

static bool says(const char *text, const char *what)
{
    return text && strstr(text, what);
}

TEST(what_is_nothing_else_is_told_at_once_and_every_minute)
{
    begin(LOG_INFO);
    CHECK(says(hear(100, 0, SECOND),
               "warning: front: serial:x: discarded 100 of 100 bytes that are not valid ping360 messages; check"));
    for (int s = 1; s < 600; s++) {
        const char *told = hear(50, 0, SECOND);
        CHECK(!told == (s % 60 != 0) && (!told || says(told, "warning: ")));
    }
    CHECK_INT(port.lines, 10);
    CHECK_INT(port.told, port.came.garbage - 59 * 50);
    end();
}

/* A wrong baud rate lets some messages through. */
TEST(what_is_mostly_garbage_is_a_warning_that_names_the_rate)
{
    begin(LOG_INFO);
    port.garbage.port = "serial:x: y:57600";
    CHECK(!hear(0, 20, SECOND) && !port.garbage.mostly);
    const char *told = hear(1000, 3, SECOND);
    CHECK(says(told, "warning: ") && says(told, "1000 of 1030 bytes") && says(told, "check the baud rate 57600,"));
    hear(1000, 3, SECOND);
    CHECK(port.garbage.mostly);
    for (int s = 0; s < 5; s++)
        hear(10, 30, SECOND);
    CHECK(!port.garbage.mostly);
    end();
}

TEST(networks_have_no_rate)
{
    begin(LOG_INFO);
    port.garbage.port = "udp:192.168.2.2:9092";
    const char *told = hear(1000, 3, SECOND);
    CHECK(says(told, "check the address and the port, and what") && !says(told, "baud"));
    end();
    begin(LOG_INFO);
    port.garbage.port = "canstream:can0:201:202";
    told = hear(1000, 3, SECOND);
    CHECK(says(told, "check the device and its identifiers on the bus, and what") && !says(told, "address"));
    end();
}

/* Every so many seconds a little noise between messages. */
TEST(noise_is_told_when_it_begins)
{
    for (int every = 2; every <= 100; every++) {
        begin(LOG_INFO);
        for (int s = 0; s < 1000; s++) {
            const char *told = hear(s % every == 1, 3, SECOND);
            CHECK(!told || (s == 1 && says(told, "info: front: serial:x: discarded 1 of 31 bytes")));
        }
        CHECK_INT(port.lines, 1);
        for (int s = 0; s < 300; s++)
            CHECK(!hear(0, s % 2 == 0, SECOND));
        CHECK(says(hear(7, 3, SECOND),
                   "info: front: serial:x: discarded 7 of 37 bytes")); /* after a clean time it begins anew */
        hear(0, 0, 10 * MINUTE);
        CHECK(says(hear(7, 3, SECOND), "info: ")); /* also after a silent one */
        end();
    }
}

/* Of all that may come: never two lines within a minute, and no garbage that is not told in the end. */
TEST(no_sequence_writes_more_than_a_line_a_minute)
{
    uint64_t random = test_seed();
    for (int run = 0; run < 50; run++) {
        unsigned dirty = 1, clean = 1;
        uint64_t least_ns = UINT64_MAX;
        begin(LOG_DEBUG);
        for (int i = 0; i < 5000; i++) {
            if (test_random(&random) % 50 == 0) {
                dirty = 1 + (unsigned)(test_random(&random) % 20);
                clean = 1 + (unsigned)(test_random(&random) % 20);
            }
            const bool good = (unsigned)i % (dirty + clean) >= dirty;
            const uint64_t before_ns = port.garbage.told_ns,
                           then_ns = test_random(&random) % (3 * SECOND) / (1 + test_random(&random) % 100);
            if (hear(good ? 0 : 5, good || test_random(&random) % 4 == 0, then_ns) && before_ns)
                least_ns =
                    port.garbage.told_ns - before_ns < least_ns ? port.garbage.told_ns - before_ns : least_ns;
        }
        if (least_ns < MINUTE)
            printf("# run %d: %d lines, two within %.1f s\n", run, port.lines, (double)least_ns * 1e-9);
        CHECK(port.lines > 1 && least_ns >= MINUTE);
        hear(0, 0, 2 * MINUTE);
        CHECK_INT(port.told, port.came.garbage);
        end();
    }
}

int main(void)
{
    RUN(what_is_nothing_else_is_told_at_once_and_every_minute);
    RUN(what_is_mostly_garbage_is_a_warning_that_names_the_rate);
    RUN(networks_have_no_rate);
    RUN(noise_is_told_when_it_begins);
    RUN(no_sequence_writes_more_than_a_line_a_minute);
    return test_end();
}
