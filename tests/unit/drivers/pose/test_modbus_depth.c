/* SPDX-License-Identifier: MIT */
/*
 * test_modbus_depth - the reader against a slave that the test owns, on a pseudo-terminal: numbers, faults, and the
 * answer that comes too late, which must never be taken for the answer to the next question. Time is the test's own:
 * it passes only while the reader waits, so no verdict depends on how fast the machine is.
 */
#include "drivers/pose/modbus_depth.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/select.h>
#include <sys/syscall.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "core/fault.h"
#include "daemon/input/depth.h"
#include "tests/lib/patience.h"
#include "tests/lib/test.h"

/* ---- the slave ---- */

enum how { GOOD, SILENT, LATE, EXCEPTION, BAD_CRC, WRONG_SLAVE, CUT, GARBAGE, TWICE, NOT_A_NUMBER };

#define TIMEOUT_MS    60
#define LATE_MS       150
#define TURNAROUND_MS 300
#define MS            UINT64_C(1000000)
#define QUESTION      8 /* bytes */
#define QUESTIONS     64

static int master = -1, line = -1; /* line: another descriptor of the reader's end */
static char slave_name[64];
static enum how how;
static int questions;
static bool echoes = true; /* function 8 is sent back, as late as all else; or refused */
static uint64_t late_ms = LATE_MS;
static struct {
    const char *before, *behind; /* of every answer, in hex */
    bool echoes;                 /* the question, as some adapters do */
} adapter = {"", "", false};

static uint64_t now_ns = 1000 * MS;

/* Questions that the slave has not answered, the oldest first. It looks at one when it is done with the one before. */
static struct {
    uint8_t bytes[QUESTIONS][QUESTION];
    int n;
    bool busy; /* with the first */
    enum how how;
    float value;
    uint64_t due_ns;
} slave;

static unsigned crc16(const uint8_t *p, size_t n)
{
    unsigned c = 0xffff;
    while (n--) {
        c ^= *p++;
        for (int i = 0; i < 8; i++)
            c = c & 1 ? c >> 1 ^ 0xa001 : c >> 1;
    }
    return c;
}

static int waiting_bytes(void)
{
    int n = 0;
    CHECK(ioctl(line, FIONREAD, &n) == 0);
    return n;
}

/* All of it is at the reader's end when this returns: the kernel takes its time to carry it. */
static void put(const void *bytes, size_t n)
{
    const int before = waiting_bytes();
    CHECK_INT(syscall(SYS_write, master, bytes, n), n);
    for (int i = 0; i < PATIENCE_MS && waiting_bytes() < before + (int)n; i++)
        syscall(SYS_nanosleep, &(struct timespec){.tv_nsec = 1000000}, NULL);
}

/* Sub-function 0 alone is sent back: others restart the slave, or clear its counters. */
static void echo(const uint8_t q[QUESTION])
{
    const bool back = echoes && q[2] == 0 && q[3] == 0;
    uint8_t refusal[5] = {q[0], q[1] | 0x80, 1};
    unsigned crc = crc16(refusal, 3);
    refusal[3] = (uint8_t)crc;
    refusal[4] = (uint8_t)(crc >> 8);
    put(back ? q : refusal, back ? QUESTION : sizeof refusal);
}

/* Every answer holds the number of its question. */
static void answer(enum how h, uint8_t function, float value)
{
    uint8_t a[16] = {1, function, 4};
    uint32_t bits;
    size_t n = 7;
    memcpy(&bits, &value, sizeof bits);
    for (int i = 0; i < 4; i++)
        a[3 + i] = (uint8_t)(bits >> (24 - 8 * i));
    if (h == EXCEPTION) {
        a[1] |= 0x80;
        n = 3;
    }
    if (h == WRONG_SLAVE)
        a[0] = 9;
    unsigned crc = crc16(a, n) ^ (h == BAD_CRC ? 0x1234 : 0);
    a[n++] = (uint8_t)crc;
    a[n++] = (uint8_t)(crc >> 8);
    if (h == GARBAGE)
        put("\xff\x80\x01", 3);
    for (int i = 0; i < (h == TWICE ? 2 : 1); i++)
        put(a, h == CUT ? n - 3 : n);
}

static void put_hex(const char *hex)
{
    for (unsigned byte; sscanf(hex, "%2x", &byte) == 1; hex += 2)
        put(&(uint8_t){(uint8_t)byte}, 1);
}

static void look_at_question(void)
{
    slave.busy = true;
    slave.how = how;
    questions += slave.bytes[0][1] != 8;
    slave.value = how == NOT_A_NUMBER ? NAN : (float)questions;
    slave.due_ns = now_ns + (how == LATE ? late_ms * MS : 0);
}

/* True: it has said something. */
static bool answer_question(void)
{
    uint8_t q[QUESTION];
    memcpy(q, slave.bytes[0], sizeof q);
    memmove(slave.bytes[0], slave.bytes[1], sizeof slave.bytes - sizeof q);
    slave.n--;
    slave.busy = false;
    if (adapter.echoes)
        put(q, sizeof q);
    if (slave.how == SILENT)
        return adapter.echoes;
    put_hex(adapter.before);
    if (q[1] == 8)
        echo(q);
    else
        answer(slave.how, q[1], slave.value);
    put_hex(adapter.behind);
    return true;
}

/* Time passes until the slave says something, or until end_ns. */
static void pass_until_said(uint64_t end_ns)
{
    while (slave.n > 0) {
        if (!slave.busy)
            look_at_question();
        if (slave.due_ns > end_ns)
            break;
        now_ns = slave.due_ns > now_ns ? slave.due_ns : now_ns;
        if (answer_question())
            return;
    }
    now_ns = end_ns > now_ns ? end_ns : now_ns;
}

static void pass(uint64_t ms)
{
    for (const uint64_t end_ns = now_ns + ms * MS; now_ns < end_ns;)
        pass_until_said(end_ns);
}

/* ---- in the place of the C library's ---- */

int clock_gettime(clockid_t which, struct timespec *t)
{
    if (which != CLOCK_MONOTONIC)
        return (int)syscall(SYS_clock_gettime, which, t);
    *t = (struct timespec){(time_t)(now_ns / (1000 * MS)), (long)(now_ns % (1000 * MS))};
    return 0;
}

static int ready_now(struct pollfd *fds, nfds_t n)
{
    return (int)syscall(SYS_ppoll, fds, n, &(struct timespec){0}, NULL, 0);
}

int poll(struct pollfd *fds, nfds_t n, int ms)
{
    const uint64_t end_ns = now_ns + (ms > 0 ? (uint64_t)ms * MS : 0);
    int ready;
    while ((ready = ready_now(fds, n)) == 0 && now_ns < end_ns)
        pass_until_said(end_ns);
    return ready;
}

/* Of one descriptor to read from, as libmodbus asks; the time left is told. */
int select(int n, fd_set *in, fd_set *out, fd_set *except, struct timeval *timeout)
{
    struct pollfd p = {.fd = n - 1, .events = POLLIN};
    const uint64_t end_ns = now_ns + (uint64_t)timeout->tv_sec * 1000 * MS + (uint64_t)timeout->tv_usec * 1000;
    int ready;
    CHECK(FD_ISSET(n - 1, in) && !out && !except);
    while ((ready = ready_now(&p, 1)) == 0 && now_ns < end_ns)
        pass_until_said(end_ns);
    const uint64_t left_us = now_ns < end_ns ? (end_ns - now_ns) / 1000 : 0;
    *timeout = (struct timeval){(time_t)(left_us / 1000000), (suseconds_t)(left_us % 1000000)};
    if (ready == 0)
        FD_ZERO(in);
    return ready;
}

/* A question is with the slave when this returns. */
ssize_t write(int fd, const void *bytes, size_t n)
{
    struct pollfd p = {.fd = master, .events = POLLIN};
    const ssize_t written = syscall(SYS_write, fd, bytes, n);
    if (written <= 0 || fd <= STDERR_FILENO || !isatty(fd))
        return written;
    CHECK(written == QUESTION && slave.n < QUESTIONS);
    for (ssize_t got = 0; got < written;) {
        if (syscall(SYS_ppoll, &p, 1, &(struct timespec){PATIENCE_S, 0}, NULL, 0) != 1)
            break;
        const ssize_t more = read(master, slave.bytes[slave.n] + got, (size_t)(written - got));
        got += more > 0 ? more : written;
    }
    slave.n++;
    return written;
}

/* ---- the reader ---- */

static struct modbus_depth *begin_with(bool with_echo, int stop_fd)
{
    struct fault fault = {""};
    struct termios t;
    struct modbus_depth_conf conf = {.parity = 'N',
                                     .slave = 1,
                                     .reg = 2,
                                     .type = MODBUS_FLOAT32,
                                     .timeout_ms = TIMEOUT_MS,
                                     .turnaround_ms = TURNAROUND_MS,
                                     .echo = with_echo,
                                     .stop_fd = stop_fd};
    master = posix_openpt(O_RDWR | O_NOCTTY);
    grantpt(master);
    unlockpt(master);
    ptsname_r(master, slave_name, sizeof slave_name);
    tcgetattr(master, &t);
    cfmakeraw(&t);
    tcsetattr(master, TCSANOW, &t);
    line = open(slave_name, O_RDWR | O_NOCTTY);
    CHECK(line >= 0);
    how = GOOD;
    questions = 0;
    memset(&slave, 0, sizeof slave);
    snprintf(conf.source, sizeof conf.source, "modbus-rtu:%s:9600", slave_name);
    struct modbus_depth *m = modbus_depth_new(&conf, &fault);
    CHECK_STR(fault.text, "");
    return m;
}

static struct modbus_depth *begin(int stop_fd)
{
    return begin_with(false, stop_fd);
}

static void end(struct modbus_depth *m)
{
    modbus_depth_free(m);
    close(line);
    close(master);
}

static enum modbus_result ask(struct modbus_depth *m, double *value)
{
    struct fault fault;
    enum modbus_result r = modbus_depth_prepare(m, &fault);
    return r == MODBUS_OK ? modbus_depth_read(m, value, &fault) : r;
}

/* ---- cases ---- */

TEST(good_answers)
{
    double v = 0;
    struct modbus_depth *m = begin(-1);
    for (int i = 2; i <= 6; i++) { /* the answer to the first question after opening is thrown away */
        CHECK_INT(ask(m, &v), MODBUS_OK);
        CHECK_NEAR(v, i, 0, 0);
    }
    end(m);
}

TEST(a_late_answer_is_never_taken_for_the_next)
{
    double v = 0;
    struct modbus_depth *m = begin(-1);
    CHECK_INT(ask(m, &v), MODBUS_OK);
    for (int round = 0; round < 3; round++) {
        how = LATE;
        CHECK_INT(ask(m, &v), MODBUS_TIMEOUT);
        how = GOOD;
        int before = questions;
        CHECK_INT(ask(m, &v), MODBUS_OK);
        CHECK_INT(questions, before + 2);
        CHECK_NEAR(v, before + 2, 0, 0);
    }
    end(m);
}

/* The answer taken must be to a question that was asked since the last one:
 * every answer holds its question's number. */
static void check_nothing_old(struct modbus_depth *m, int rounds, enum how (*next_how)(uint64_t *random))
{
    uint64_t random = test_seed();
    int taken = 0;
    double v = 0;
    CHECK_INT(ask(m, &v), MODBUS_OK);
    for (int round = 0; round < rounds; round++) {
        int before = questions;
        how = next_how(&random);
        if (ask(m, &v) == MODBUS_OK) {
            CHECK(v > before);
            taken++;
        }
    }
    CHECK(taken > 0);
    how = GOOD;
    for (int i = 0; i < 10 && ask(m, &v) != MODBUS_OK; i++) {
    }
    CHECK_NEAR(v, questions, 0, 0);
    late_ms = LATE_MS;
}

static enum how late_in_runs(uint64_t *random)
{
    static int left;
    static enum how now;
    if (left-- <= 0) {
        left = 2 + (int)(test_random(random) % 4);
        now = now == LATE ? GOOD : LATE;
        late_ms = TURNAROUND_MS + TIMEOUT_MS + 10 + test_random(random) % 200;
    }
    return now;
}

static enum how late_at_random(uint64_t *random)
{
    late_ms = TURNAROUND_MS + TIMEOUT_MS + 5 + test_random(random) % 45;
    return test_random(random) % 2 ? GOOD : LATE;
}

TEST(silence_bears_a_slave_that_is_later_than_it_promised_for_some_time)
{
    struct modbus_depth *m = begin(-1);
    check_nothing_old(m, 500, late_in_runs);
    end(m);
}

TEST(with_an_echo_no_lateness_makes_an_old_value_new)
{
    struct modbus_depth *m = begin_with(true, -1);
    check_nothing_old(m, 500, late_at_random);
    end(m);
}

TEST(a_slave_without_an_echo_is_told)
{
    struct fault fault = {""};
    struct modbus_depth *m = begin_with(true, -1);
    echoes = false;
    CHECK_INT(modbus_depth_prepare(m, &fault), MODBUS_EXCEPTION);
    CHECK(strstr(fault.text, "resync = silence") != NULL);
    how = SILENT;
    CHECK_INT(modbus_depth_prepare(m, &fault), MODBUS_TIMEOUT);
    echoes = true;
    end(m);
}

TEST(what_nobody_asked_for_is_not_an_answer)
{
    double v = 0;
    struct modbus_depth *m = begin(-1);
    CHECK_INT(ask(m, &v), MODBUS_OK);
    how = TWICE;
    CHECK_INT(ask(m, &v), MODBUS_OK);
    how = GOOD;
    pass(LATE_MS);
    CHECK_INT(ask(m, &v), MODBUS_OUT_OF_STEP);
    CHECK_INT(ask(m, &v), MODBUS_OK);
    CHECK_NEAR(v, 5, 0, 0);
    end(m);
}

TEST(faults_are_told_apart_and_the_next_question_is_answered)
{
    static const struct {
        const char *name;
        enum how how;
        enum modbus_result want;
    } cases[] = {
        {"silent", SILENT, MODBUS_TIMEOUT},
        {"exception", EXCEPTION, MODBUS_EXCEPTION},
        {"wrong checksum", BAD_CRC, MODBUS_BAD_ANSWER},
        {"wrong slave", WRONG_SLAVE, MODBUS_BAD_ANSWER},
        {"cut", CUT, MODBUS_TIMEOUT},
        {"garbage", GARBAGE, MODBUS_BAD_ANSWER},
        {"not a number", NOT_A_NUMBER, MODBUS_NO_NUMBER},
    };
    struct modbus_depth *m = begin(-1);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        double v = 0;
        how = cases[i].how;
        enum modbus_result got = ask(m, &v);
        how = GOOD;
        if (got != cases[i].want || ask(m, &v) != MODBUS_OK || !(fabs(v - questions) < 1e-9)) {
            printf("%s: %d, expected %d; then %g\n", cases[i].name, (int)got, (int)cases[i].want, v);
            test_case_failed = true;
        }
    }
    end(m);
}

/* What cheap RS-485 adapters put around every answer. From the third question on, each gets its own answer. */
TEST(bytes_around_an_answer_are_forgiven)
{
    static const struct {
        const char *before, *behind;
        bool echoes, resync_by_echo;
        unsigned oddities;
    } cases[] = {
        {"", "", false, false, 0},
        {"00", "", false, false, MODBUS_STRAY_BEFORE},
        {"FF", "", false, false, MODBUS_STRAY_BEFORE},
        {"00FF", "", false, false, MODBUS_STRAY_BEFORE},
        {"", "00", false, false, MODBUS_STRAY_BEHIND},
        {"", "FFFF", false, false, MODBUS_STRAY_BEHIND},
        {"00", "00", false, false, MODBUS_STRAY_BEFORE | MODBUS_STRAY_BEHIND},
        {"", "", true, false, MODBUS_QUESTION_ECHOED},
        {"00", "", true, false, MODBUS_QUESTION_ECHOED | MODBUS_STRAY_BEFORE},
        {"", "", true, true, MODBUS_QUESTION_ECHOED},
        {"00", "", false, true, MODBUS_STRAY_BEFORE},
        {"", "00", false, true, MODBUS_STRAY_BEHIND},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        double v = 0;
        adapter.before = cases[i].before;
        adapter.behind = cases[i].behind;
        adapter.echoes = cases[i].echoes;
        struct modbus_depth *m = begin_with(cases[i].resync_by_echo, -1);
        ask(m, &v); /* may be the one that finds out that the adapter echoes */
        for (int k = 0; k < 5; k++)
            if (ask(m, &v) != MODBUS_OK || !(fabs(v - questions) < 1e-9)) {
                printf("case %zu: question %d not answered, %g\n", i, k, v);
                test_case_failed = true;
            }
        CHECK_INT(modbus_depth_oddities(m), cases[i].oddities);
        end(m);
    }
    adapter.before = adapter.behind = "";
    adapter.echoes = false;
}

TEST(an_echo_of_the_adapter_is_not_the_slave)
{
    double v = 0;
    for (int with_echo = 0; with_echo < 2; with_echo++) {
        struct modbus_depth *m = begin_with(with_echo, -1);
        adapter.echoes = true;
        how = SILENT;
        for (int i = 0; i < 5; i++)
            CHECK(ask(m, &v) != MODBUS_OK);
        how = GOOD;
        adapter.echoes = false;
        end(m);
    }
}

TEST(a_damaged_answer_costs_one_sample)
{
    double v = 0;
    struct modbus_depth *m = begin(-1);
    CHECK_INT(ask(m, &v), MODBUS_OK);
    how = BAD_CRC;
    CHECK_INT(ask(m, &v), MODBUS_BAD_ANSWER);
    how = GOOD;
    const uint64_t then_ns = now_ns;
    const int before = questions;
    CHECK_INT(ask(m, &v), MODBUS_OK);
    CHECK_INT(questions, before + 1);
    CHECK(now_ns - then_ns < TURNAROUND_MS * MS);
    end(m);
}

TEST(a_lost_line_is_told_and_opened_again)
{
    double v = 0;
    struct modbus_depth *m = begin(-1);
    CHECK_INT(ask(m, &v), MODBUS_OK);
    close(line);
    close(master);
    CHECK_INT(ask(m, &v), MODBUS_NO_LINK);
    CHECK_INT(ask(m, &v), MODBUS_NO_LINK);
    modbus_depth_free(m);
}

TEST(waiting_for_quiet_ends_when_it_is_told_to)
{
    uint64_t one = 1;
    double v;
    int stop = eventfd(0, EFD_NONBLOCK);
    struct modbus_depth *m = begin(stop);
    CHECK(write(stop, &one, sizeof one) == sizeof one);
    CHECK_INT(ask(m, &v), MODBUS_STOPPED);
    end(m);
    close(stop);
}

TEST(registers_as_numbers)
{
    static const struct {
        enum modbus_type type;
        bool little;
        uint16_t reg[2];
        double want;
    } cases[] = {
        {MODBUS_INT16, false, {0xffff, 7}, -1},
        {MODBUS_UINT16, false, {0xffff, 7}, 65535},
        {MODBUS_INT32, false, {0xffff, 0xfffe}, -2},
        {MODBUS_INT32, true, {0xfffe, 0xffff}, -2},
        {MODBUS_INT32, false, {0x8000, 0}, -2147483648.0},
        {MODBUS_INT16, false, {0x8000, 7}, -32768},
        {MODBUS_INT32, false, {0x7fff, 0xffff}, 2147483647.0},
        {MODBUS_FLOAT32, false, {0x8000, 0}, 0},
        {MODBUS_FLOAT32, false, {0, 1}, 0x1p-149},
        {MODBUS_FLOAT32, false, {0x7f7f, 0xffff}, 0x1.fffffep127},
        {MODBUS_FLOAT32, false, {0x3f75, 0xf07b}, 0.960701},
        {MODBUS_FLOAT32, true, {0xf07b, 0x3f75}, 0.960701},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        CHECK_NEAR(modbus_depth_number(cases[i].type, cases[i].little, cases[i].reg), cases[i].want, 1e-6, 0);
    CHECK(isnan(modbus_depth_number(MODBUS_FLOAT32, false, (const uint16_t[2]){0x7fc0, 0})));
    CHECK(isinf(modbus_depth_number(MODBUS_FLOAT32, true, (const uint16_t[2]){0, 0xff80})));
}

TEST(sources)
{
    static const struct {
        const char *source;
        bool good;
    } cases[] = {
        {"modbus-rtu:/dev/ttyUSB1:9600", true},
        {"modbus-rtu:/dev/serial/by-path/pci-0:1.0-port0:19200", true},
        {"modbus-tcp:192.168.2.5:502", true},
        {"modbus-tcp:[fe80::1]:502", true},
        {"modbus-tcp:::1:502", true},
        {"modbus-rtu:/dev/ttyUSB1", false},
        {"modbus-rtu:ttyUSB1:9600", false},
        {"modbus-rtu:/dev/ttyUSB1:fast", false},
        {"modbus-rtu:/dev/ttyUSB1:0", false},
        {"modbus-rtu::9600", false},
        {"modbus-tcp:depth.local:502", false},
        {"modbus-tcp:192.168.2.5:0", false},
        {"modbus-tcp:192.168.2.5:65536", false},
        {"modbus-tcp:192.168.2.5", false},
        {"modbus:1", false},
        {"", false},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct fault fault = {""};
        if (modbus_depth_check(cases[i].source, &fault) != cases[i].good || cases[i].good != !fault.text[0]) {
            printf("'%s': %s\n", cases[i].source, fault.text);
            test_case_failed = true;
        }
    }
}

TEST(pressure_becomes_depth)
{
    struct conf conf;
    conf_defaults(&conf);
    struct conf_depth *c = &conf.depth;
    CHECK_NEAR(depth_of_value(c, 1025, 1.01325), 0, 0, 1e-9);
    CHECK_NEAR(depth_of_value(c, 1025, 11.01325), 99.485, 1e-5, 0); /* 100 dbar */
    CHECK_NEAR(depth_of_value(c, 997, 11.01325), 102.278, 1e-5, 0);
    c->unit = CONF_UNIT_DBAR;
    c->surface_pa = 0;
    CHECK_NEAR(depth_of_value(c, 1029, 300), 297.293, 1e-5, 0);
    c->unit = CONF_UNIT_M;
    c->scale = 0.01;
    c->offset = -0.5;
    CHECK_NEAR(depth_of_value(c, 1025, 1250), 12, 1e-12, 0);
}

#define S 1000000000ull

TEST(lies_are_not_believed_and_do_not_lock_out_the_truth)
{
    struct conf conf;
    conf_defaults(&conf);
    const struct conf_depth *c = &conf.depth;
    CHECK(depth_plausible(c, 10, 5 * S, 0, 0));
    CHECK(!depth_plausible(c, 301, 5 * S, 0, 0));
    CHECK(!depth_plausible(c, -1.5, 5 * S, 0, 0));
    CHECK(!depth_plausible(c, NAN, 5 * S, 0, 0));
    CHECK(!depth_plausible(c, INFINITY, 5 * S, 0, 0));
    CHECK(!depth_plausible(c, -INFINITY, 5 * S, 0, 0));
    CHECK(!depth_plausible(c, 0x1.fffffep127, 5 * S, 0, 0));
    CHECK(depth_plausible(c, 12.9, 6 * S, 10, 5 * S));
    CHECK(depth_plausible(c, 13.1, 6 * S, 10, 5 * S)); /* 3 m/s, and 0.2 m at once */
    CHECK(!depth_plausible(c, 13.3, 6 * S, 10, 5 * S));
    CHECK(depth_plausible(c, 10.1, 5 * S + 1, 10, 5 * S));
    CHECK(depth_plausible(c, 40, 4 * S, 10, 5 * S)); /* older than what was believed: nothing to hold it against */
    CHECK(!depth_plausible(c, 6.5, 6 * S, 10, 5 * S));
    CHECK(depth_plausible(c, 10, 45 * S, 120, 5 * S)); /* the first value was the lie */
}

TEST(an_answer_that_was_read_late_has_no_time)
{
    struct conf conf;
    conf_defaults(&conf);
    CHECK(depth_dated(&conf.depth, S / 100));
    CHECK(depth_dated(&conf.depth, S * 2 / 5)); /* of 0.3 s that a sensor may take */
    CHECK(!depth_dated(&conf.depth, S / 2));
    CHECK(!depth_dated(&conf.depth, 5 * S));
}

int main(void)
{
    RUN(good_answers);
    RUN(a_late_answer_is_never_taken_for_the_next);
    RUN(silence_bears_a_slave_that_is_later_than_it_promised_for_some_time);
    RUN(with_an_echo_no_lateness_makes_an_old_value_new);
    RUN(a_slave_without_an_echo_is_told);
    RUN(what_nobody_asked_for_is_not_an_answer);
    RUN(faults_are_told_apart_and_the_next_question_is_answered);
    RUN(bytes_around_an_answer_are_forgiven);
    RUN(an_echo_of_the_adapter_is_not_the_slave);
    RUN(a_damaged_answer_costs_one_sample);
    RUN(a_lost_line_is_told_and_opened_again);
    RUN(waiting_for_quiet_ends_when_it_is_told_to);
    RUN(registers_as_numbers);
    RUN(sources);
    RUN(pressure_becomes_depth);
    RUN(lies_are_not_believed_and_do_not_lock_out_the_truth);
    RUN(an_answer_that_was_read_late_has_no_time);
    return test_end();
}
