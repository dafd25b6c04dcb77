/* SPDX-License-Identifier: MIT */
/*
 * test_find_sonar - which sonar is on a port, and what it was sent: a port of this test's own, on a clock that waiting
 * alone moves. The program is linked with --wrap (Makefile).
 */
#include <errno.h>
#include <poll.h>
#include <time.h>

#include "client/ctl/find_sonar.h"
#include "drivers/devices/ping_frame.h"
#include "drivers/devices/seanet_frame.h"
#include "drivers/ports/port.h"
#include "tests/lib/test.h"

#define EVERY_MS 1000 /* what a sonar says by itself */

/* Who is at the far end. */
struct far {
    bool lost;              /* the port cannot be opened */
    bool refuses;           /* datagrams to it come back */
    bool breaks;            /* the wire ends with the first look at it */
    unsigned baud;          /* it hears and speaks at this rate alone; 0: at any */
    bool wants_autobaud;    /* it answers after a break and some 'U' alone */
    const uint8_t *says;    /* by itself, at any rate */
    const uint8_t *answers; /* to who asks who it is */
    size_t n_says, n_answers;
};

static struct far far;
static int64_t now_ms, said_ms;
static char opened[600];                  /* every port that was, in turn */
static unsigned port_baud, asked, others; /* requests of identity, and anything else but 'U' */
static bool break_on, had_break, awake;
static const uint8_t *waiting; /* what is there to read */
static size_t n_waiting;

int __wrap_clock_gettime(clockid_t clock, struct timespec *t);
int __wrap_clock_gettime(clockid_t clock, struct timespec *t)
{
    (void)clock;
    *t = (struct timespec){.tv_sec = now_ms / 1000, .tv_nsec = now_ms % 1000 * 1000000};
    return 0;
}

int __wrap_poll(struct pollfd *fds, nfds_t n, int ms);
int __wrap_poll(struct pollfd *fds, nfds_t n, int ms)
{
    (void)fds, (void)n;
    if (!n_waiting && far.says && now_ms + ms >= said_ms + EVERY_MS) {
        now_ms = said_ms += EVERY_MS;
        waiting = far.says;
        n_waiting = far.n_says;
        return 1;
    }
    if (!n_waiting && !far.breaks)
        now_ms += ms;
    return n_waiting || far.breaks ? 1 : 0;
}

static bool open_far(struct port *port, const char *rest, struct fault *fault)
{
    const char *baud = strrchr(rest, ':');
    const size_t used = strlen(opened);
    snprintf(opened + used, sizeof opened - used, "%s;", rest);
    port_baud = baud ? (unsigned)atoi(baud + 1) : 0;
    port->error = far.lost ? ENOENT : 0;
    port->fd = far.lost ? -1 : 7;
    break_on = had_break = awake = false;
    return !far.lost || fault_set(fault, "it is not there");
}

static ssize_t read_far(struct port *port, void *buf, size_t size)
{
    const size_t n = n_waiting < size ? n_waiting : size;
    if (far.breaks) {
        port->error = EIO;
        return -1;
    }
    if (n)
        memcpy(buf, waiting, n);
    n_waiting -= n;
    return (ssize_t)n;
}

static ssize_t write_far(struct port *port, const void *buf, size_t size)
{
    static const uint8_t who[] = {PING_DEVICE_INFORMATION, 0};
    uint8_t wanted[32];
    const size_t n = ping_frame_build(wanted, sizeof wanted, PING_GENERAL_REQUEST, 0, who, sizeof who);
    const uint8_t *bytes = buf;
    port->refused += far.refuses;
    if (size && bytes[0] == 'U') {
        awake = had_break && !break_on;
        return (ssize_t)size;
    }
    if (size != n || memcmp(buf, wanted, n) != 0) {
        others++;
        return (ssize_t)size;
    }
    asked++;
    if (far.answers && (!far.baud || far.baud == port_baud) && (!far.wants_autobaud || awake)) {
        waiting = far.answers;
        n_waiting = far.n_answers;
    }
    return (ssize_t)size;
}

static void hold_break(struct port *port, bool on)
{
    (void)port;
    had_break = had_break || on;
    break_on = on;
}

static void close_far(struct port *port)
{
    port->fd = -1;
}

static struct port_ops wire = {.kind = "serial",
                               .encoding = "octet-stream",
                               .open = open_far,
                               .read = read_far,
                               .write = write_far,
                               .hold_break = hold_break,
                               .close = close_far};

const struct port_ops *__wrap_port_find(const char *address, const char **rest, struct fault *fault);
const struct port_ops *__wrap_port_find(const char *address, const char **rest, struct fault *fault)
{
    const char *colon = strchr(address, ':');
    *rest = colon ? colon + 1 : "";
    if (colon)
        return &wire;
    fault_set(fault, "no such port");
    return NULL;
}

static struct found_sonar found;
static struct fault fault;

static bool find(const char *address, bool ask, struct far at_the_end)
{
    far = at_the_end;
    now_ms = said_ms = 1000;
    asked = others = 0;
    n_waiting = 0;
    opened[0] = '\0';
    fault.text[0] = '\0';
    return find_sonar_on(address, ask, &found, &fault);
}

static struct far answering(const uint8_t *frame, size_t n)
{
    return (struct far){.answers = frame, .n_answers = n};
}

static size_t information(uint8_t *out, size_t size, uint8_t type)
{
    const uint8_t payload[] = {type, 1, 3, 29, 2, 0};
    return ping_frame_build(out, size, PING_DEVICE_INFORMATION, 1, payload, sizeof payload);
}

TEST(each_device_by_its_answer)
{
    static const struct {
        uint8_t type;
        const char *device, *how;
    } row[] = {{1, "ping1d", "answered as Ping echosounder, firmware 3.29.2"},
               {2, "ping360", "answered as Ping360, firmware 3.29.2"},
               {7, "surveyor", "answered as Cerulean sonar, firmware 3.29.2"}};
    uint8_t frame[64];

    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        CHECK(find("udp:10.0.0.1:9092", true, answering(frame, information(frame, sizeof frame, row[i].type))));
        CHECK_STR(found.device ? found.device : "none", row[i].device);
        CHECK_STR(found.how, row[i].how);
        CHECK_STR(found.port, "udp:10.0.0.1:9092");
        CHECK(asked == 1 && others == 0);
    }
    CHECK_STR(opened, "10.0.0.1:9092;");
}

/* An old Ping1D does not know the question; a refusal of something else tells nothing. */
TEST(a_refusal_tells_an_old_echosounder)
{
    const uint8_t refused[] = {PING_DEVICE_INFORMATION, 0, 'n', 'o', 0},
                  other[] = {PING360_MOTOR_OFF & 0xff, PING360_MOTOR_OFF >> 8, 'n', 'o', 0};
    uint8_t frame[64];
    size_t n = ping_frame_build(frame, sizeof frame, PING_NACK, 1, refused, sizeof refused);
    CHECK(find("/dev/ttyUSB0", true, answering(frame, n)));
    CHECK_STR(found.device ? found.device : "none", "ping1d");
    CHECK_STR(found.port, "serial:/dev/ttyUSB0:115200");
    n = ping_frame_build(frame, sizeof frame, PING_NACK, 1, other, sizeof other);
    CHECK(!find("/dev/ttyUSB0", true, answering(frame, n)) && !found.device);
}

TEST(a_ping360_is_found_at_the_faster_rate_if_it_follows)
{
    uint8_t frame[64];
    struct far head = answering(frame, information(frame, sizeof frame, 2));
    CHECK(find("/dev/ttyUSB0", true, head));
    CHECK_STR(found.port, "serial:/dev/ttyUSB0:921600");
    CHECK_STR(opened, "/dev/ttyUSB0:115200;/dev/ttyUSB0:921600;");
    head.baud = 115200;
    CHECK(find("/dev/ttyUSB0", true, head));
    CHECK_STR(found.port, "serial:/dev/ttyUSB0:115200");
    head.baud = 921600;
    head.wants_autobaud = true;
    CHECK(find("/dev/ttyUSB0", true, head));
    CHECK_STR(found.port, "serial:/dev/ttyUSB0:921600");
    CHECK(find("serial:/dev/ttyUSB0:115200", true, answering(frame, information(frame, sizeof frame, 2))));
    CHECK_STR(opened, "/dev/ttyUSB0:115200;"); /* a rate that was given stays */
    CHECK_INT(others, 0);
}

/* Nothing is sent to what speaks by itself; with `ask` false nothing to anything. */
TEST(what_speaks_by_itself_is_not_asked)
{
    const struct seanet_head head = {
        .sender = 2, .receiver = SEANET_HOST, .id = SEANET_ALIVE, .packet = SEANET_LAST_PACKET};
    uint8_t alive[64], host[64], pings[64];
    const uint8_t nothing[8] = {0};
    struct far micron = {.says = alive,
                         .n_says = seanet_build(alive, sizeof alive, head, nothing, sizeof nothing)};
    struct far surveyor = {.says = pings,
                           .n_says = ping_frame_build(pings, sizeof pings, SURVEYOR_ATOF_POINTS, 1, nothing, 4)};
    CHECK(micron.n_says && find("/dev/ttyUSB0", false, micron));
    CHECK_STR(found.device ? found.device : "none", "micron");
    CHECK_STR(found.how, "received a SeaNet head's messages");
    CHECK(surveyor.n_says && find("udp:10.0.0.1:62312", true, surveyor));
    CHECK_STR(found.device ? found.device : "none", "surveyor");
    CHECK(asked == 0 && others == 0);

    const struct seanet_head from_host = {
        .sender = SEANET_HOST, .receiver = 2, .id = SEANET_SEND_VERSION, .packet = SEANET_LAST_PACKET};
    struct far echo = {.says = host, .n_says = seanet_build(host, sizeof host, from_host, nothing, 1)};
    CHECK(echo.n_says && !find("/dev/ttyUSB0", false, echo)); /* another host on the bus is no sonar */
    CHECK(asked == 0 && others == 0);
    CHECK_STR(fault.text, "/dev/ttyUSB0: no known sonar detected");
}

TEST(the_pings_of_a_ping360_tell_it)
{
    static uint8_t frame[2000];
    const uint8_t data[] = {1, 2, 3, 4};
    const struct ping360_data ping = {.set = {.mode = 1, .gain = 1, .n_samples = sizeof data},
                                      .data = data,
                                      .data_length = sizeof data,
                                      .n_data = sizeof data};
    const struct far head = {.says = frame, .n_says = ping360_encode_data(frame, sizeof frame, 2, &ping)};
    CHECK(head.n_says && find("udp:10.0.0.1:9092", false, head));
    CHECK_STR(found.device ? found.device : "none", "ping360");
    CHECK_STR(found.how, "received its pings");
}

TEST(no_answer_says_what_was_tried)
{
    const struct far nobody = {0};
    CHECK(!find("/dev/ttyUSB0", true, nobody));
    CHECK_STR(fault.text, "/dev/ttyUSB0: no known sonar detected, and no answer at 115200 or 921600 baud");
    CHECK_STR(opened, "/dev/ttyUSB0:115200;/dev/ttyUSB0:921600;");
    CHECK_INT(asked, 4);
    CHECK(now_ms - 1000 <= 6000); /* as its header says */
    CHECK(!find("udp:10.0.0.1:9092", true, nobody) && !found.refused);
    CHECK_STR(fault.text, "udp:10.0.0.1:9092: no known sonar detected, and no answer");
    CHECK(!find("udp:10.0.0.1:9092", true, (struct far){.refuses = true}) && found.refused);
    CHECK_STR(fault.text, "udp:10.0.0.1:9092: no known sonar detected, and nothing listens there");
}

TEST(a_port_that_cannot_be_had)
{
    CHECK(!find("/dev/ttyUSB0", true, (struct far){.lost = true}));
    CHECK_STR(fault.text, "it is not there");
    CHECK_INT(found.error, ENOENT);
    CHECK(!find("nonsense", true, (struct far){0}));
    CHECK_STR(fault.text, "no such port");
    CHECK(!find("/dev/ttyUSB0", true, (struct far){.breaks = true})); /* pulled meanwhile: it ends */
    wire.encoding = "socketcan";
    CHECK(!find("can:can0", true, (struct far){0}));
    CHECK_STR(fault.text, "can:can0: sonars are found on serial lines, UDP and TCP only; give --device");
    wire.encoding = "octet-stream";
}

int main(void)
{
    RUN(each_device_by_its_answer);
    RUN(a_refusal_tells_an_old_echosounder);
    RUN(a_ping360_is_found_at_the_faster_rate_if_it_follows);
    RUN(what_speaks_by_itself_is_not_asked);
    RUN(the_pings_of_a_ping360_tell_it);
    RUN(no_answer_says_what_was_tried);
    RUN(a_port_that_cannot_be_had);
    return test_end();
}
