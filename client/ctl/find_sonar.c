/* SPDX-License-Identifier: MIT */
#include "find_sonar.h"

#include <glob.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "drivers/devices/ping_frame.h"
#include "drivers/devices/seanet_frame.h"
#include "drivers/ports/port.h"

/* A SeaNet head says once a second that it is alive. */
#define LISTEN_MS      2500
#define ANSWER_MS      600
#define TRIES          2
#define BREAK_MS       15 /* what a Ping360 needs to take the line's speed anew: a break, a pause, some 'U' */
#define AUTOBAUD_BYTES 10
#define AUTOBAUD_MS    15
#define CONNECT_MS     5000

enum { TYPE_ECHOSOUNDER = 1, TYPE_PING360 = 2 }; /* of struct ping_device_information */

struct search {
    struct port port;
    struct ping_parser ping;
    struct seanet_parser seanet;
    struct found_sonar *found;
};

size_t find_sonar_ports(char path[FIND_SONAR_PORTS][FIND_SONAR_PATH])
{
    static const char *const patterns[] = {"/dev/serial/by-id/*", "/dev/ttyUSB*", "/dev/ttyACM*"};
    char *real[FIND_SONAR_PORTS] = {0};
    size_t n = 0;
    for (size_t i = 0; i < sizeof patterns / sizeof *patterns; i++) {
        glob_t files;
        if (glob(patterns[i], 0, NULL, &files) != 0)
            continue;
        for (size_t k = 0; k < files.gl_pathc && n < FIND_SONAR_PORTS; k++) {
            char *there = realpath(files.gl_pathv[k], NULL);
            bool known = !there || strlen(files.gl_pathv[k]) >= FIND_SONAR_PATH;
            for (size_t j = 0; j < n && !known; j++)
                known = strcmp(real[j], there) == 0;
            if (known) {
                free(there);
                continue;
            }
            snprintf(path[n], FIND_SONAR_PATH, "%s", files.gl_pathv[k]);
            real[n++] = there;
        }
        globfree(&files);
    }
    for (size_t j = 0; j < n; j++)
        free(real[j]);
    return n;
}

static int64_t now_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000 + t.tv_nsec / 1000000;
}

static bool is(struct search *s, const char *device, const char *how)
{
    s->found->device = device;
    snprintf(s->found->how, sizeof s->found->how, "%s", how);
    return true;
}

/* Does this frame tell what it is from? */
static bool judge_ping(struct search *s, const struct ping_frame *frame)
{
    struct ping_device_information info;
    struct ping360_data data;
    char how[80];
    const char *text;
    size_t n;
    uint16_t refused;
    if (ping360_decode_data(frame, &data))
        return is(s, "ping360", "received its pings");
    if (frame->id == SURVEYOR_ATOF_POINTS)
        return is(s, "surveyor", "received its pings");
    if (ping_decode_nack(frame, &refused, &text, &n) &&
        (refused == PING_DEVICE_INFORMATION || refused == PING_GENERAL_REQUEST))
        return is(s, "ping1d", "refused to tell its name, as a Ping1D with old firmware does");
    if (!ping_decode_device_information(frame, &info))
        return false;
    snprintf(how, sizeof how, "answered as %s, firmware %u.%u.%u",
             info.type == TYPE_PING360       ? "Ping360"
             : info.type == TYPE_ECHOSOUNDER ? "Ping echosounder"
                                             : "Cerulean sonar",
             info.firmware[0], info.firmware[1], info.firmware[2]);
    return is(s,
              info.type == TYPE_PING360       ? "ping360"
              : info.type == TYPE_ECHOSOUNDER ? "ping1d"
                                              : "surveyor",
              how);
}

static bool judge(struct search *s, const uint8_t *bytes, size_t n)
{
    struct ping_frame frame;
    struct seanet_frame seanet;
    const uint8_t *p = bytes;
    size_t left = n;
    while (ping_parser_next(&s->ping, &p, &left, 0, &frame))
        if (judge_ping(s, &frame))
            return true;
    p = bytes;
    left = n;
    while (seanet_parser_next(&s->seanet, &p, &left, 0, &seanet))
        if (seanet.sender != SEANET_HOST)
            return is(s, "micron", "received a SeaNet head's messages");
    return false;
}

/* Listens for so long. True: it is known. */
static bool listen_ms(struct search *s, int ms)
{
    const int64_t until = now_ms() + ms;
    uint8_t bytes[4096];
    for (int64_t left; (left = until - now_ms()) > 0;) {
        struct pollfd fd = {.fd = s->port.fd, .events = POLLIN};
        if (poll(&fd, 1, (int)left) <= 0)
            continue;
        const ssize_t n = s->port.ops->read(&s->port, bytes, sizeof bytes);

        if (n < 0)
            return false;
        if (n > 0 && judge(s, bytes, (size_t)n))
            return true;
    }
    return false;
}

/* "Who are you?", which everything that speaks this protocol answers. */
static void ask_identity(struct search *s)
{
    static const uint8_t wanted[] = {PING_DEVICE_INFORMATION, 0};
    uint8_t out[32];
    const size_t n = ping_frame_build(out, sizeof out, PING_GENERAL_REQUEST, 0, wanted, sizeof wanted);
    for (int i = 0; i < TRIES; i++)
        if (s->port.ops->write(&s->port, out, n) < 0 || listen_ms(s, ANSWER_MS))
            return;
}

/* So that a Ping360 hears us at this speed. */
static void autobaud(struct search *s)
{
    uint8_t out[AUTOBAUD_BYTES];
    memset(out, 'U', sizeof out);
    s->port.ops->hold_break(&s->port, true);
    listen_ms(s, BREAK_MS);
    s->port.ops->hold_break(&s->port, false);
    listen_ms(s, AUTOBAUD_MS);
    if (s->port.ops->write(&s->port, out, sizeof out) >= 0)
        listen_ms(s, AUTOBAUD_MS);
}

enum method { LISTEN, LISTEN_AND_ASK, WAKE_AND_ASK };

/* Open, and connected where the wire needs that: here one may wait. */
static bool open_port(struct port *port, const char *rest, struct fault *fault)
{
    const struct port_ops *ops = port->ops;
    if (ops->named && ops->named(rest) && !ops->look_up(rest, &port->far, fault))
        return false;
    if (!ops->open(port, rest, fault) || !port->connecting)
        return port->fd >= 0;

    struct pollfd fd = {.fd = port->fd, .events = POLLOUT};
    const bool answered = poll(&fd, 1, CONNECT_MS) > 0;

    if (answered && ops->connected(port, rest, fault))
        return true;
    if (!answered)
        fault_set(fault, "%s: cannot connect: no answer", rest);
    ops->close(port);
    return false;
}

/* False: the port cannot be opened. What is known then is in *found, nothing where its device is NULL. */
static bool search(const char *address, enum method method, struct found_sonar *found, struct fault *fault)
{
    static struct search s; /* parsers are large */
    const char *rest;
    bool known = false;
    s = (struct search){.port = {.fd = -1}, .found = found};
    s.port.ops = port_find(address, &rest, fault);
    if (!s.port.ops)
        return false;
    if (strcmp(s.port.ops->encoding, "octet-stream") != 0)
        return fault_set(fault, "%s: sonars are found on serial lines, UDP and TCP only; give --device", address);
    if (!open_port(&s.port, rest, fault)) {
        found->error = s.port.error;
        return false;
    }
    ping_parser_init(&s.ping, PING_PAYLOAD_LIMIT);
    seanet_parser_init(&s.seanet);
    if (method == WAKE_AND_ASK)
        autobaud(&s);
    else
        known = listen_ms(&s, LISTEN_MS);
    if (!known && method != LISTEN)
        ask_identity(&s);
    found->refused = s.port.refused > 0;
    s.port.ops->close(&s.port);
    snprintf(found->port, sizeof found->port, "%s", address);
    return true;
}

/* At 115200 baud the line limits the scan of a Ping360, which follows a faster one if the adapter can. */
static void raise_rate(const char *path, struct found_sonar *found)
{
    char serial[FIND_SONAR_PATH + 32];
    struct found_sonar faster = {.device = NULL};
    struct fault fault;
    snprintf(serial, sizeof serial, "serial:%.*s:921600", (int)sizeof serial - 16, path);
    if (search(serial, WAKE_AND_ASK, &faster, &fault) && faster.device)
        *found = faster;
}

bool find_sonar_on(const char *address, bool ask, struct found_sonar *found, struct fault *fault)
{
    char serial[FIND_SONAR_PATH + 32];
    const bool is_file = address[0] == '/';
    *found = (struct found_sonar){.device = NULL};
    snprintf(serial, sizeof serial, is_file ? "serial:%.*s:115200" : "%.*s", (int)sizeof serial - 16, address);
    if (!search(serial, ask ? LISTEN_AND_ASK : LISTEN, found, fault))
        return false;
    if (found->device) {
        if (ask && is_file && strcmp(found->device, "ping360") == 0)
            raise_rate(address, found);
        return true;
    }
    if (!ask)
        return fault_set(fault, "%s: no known sonar detected", address);
    if (!is_file)
        return fault_set(fault, "%s: no known sonar detected, and %s", address,
                         found->refused ? "nothing listens there" : "no answer");
    snprintf(serial, sizeof serial, "serial:%.*s:921600", (int)sizeof serial - 16, address);
    if (!search(serial, WAKE_AND_ASK, found, fault))
        return false;
    return found->device ||
           fault_set(fault, "%s: no known sonar detected, and no answer at 115200 or 921600 baud", address);
}
