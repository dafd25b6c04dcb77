/* SPDX-License-Identifier: MIT */
#include "mavlink_link.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netdb.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <termios.h>
#include <unistd.h>

#define RETRY_NS   1000000000u
#define RETRY_MOST 30 /* seconds between attempts at a name that is not known: asking may take long */

static const struct {
    unsigned baud;
    speed_t speed;
} rates[] = {
    {9600, B9600},       {19200, B19200},     {38400, B38400},     {57600, B57600},
    {115200, B115200},   {230400, B230400},   {460800, B460800},   {921600, B921600},
    {1500000, B1500000}, {2000000, B2000000}, {3000000, B3000000},
};

static speed_t speed_of(unsigned baud)
{
    for (size_t i = 0; i < sizeof rates / sizeof *rates; i++)
        if (rates[i].baud == baud)
            return rates[i].speed;
    return B0;
}

/* A number up to max that fills the text; 0 for anything else. */
static unsigned parse_number(const char *text, unsigned max)
{
    const size_t digits = strspn(text, "0123456789");
    if (digits == 0 || digits > 8 || text[digits])
        return 0;
    const unsigned long value = strtoul(text, NULL, 10);
    return value <= max ? (unsigned)value : 0;
}

/* A kind of address that others know and this program does not. */
static bool refuse_tcp(const char *address, struct fault *fault)
{
    if (strncmp(address, "tcp:", 4) != 0 && strncmp(address, "tcpin:", 6) != 0)
        return true;
    return fault_set(
        fault,
        "link '%.100s': TCP is not supported; let the router (mavlink-router, MAVProxy, BlueOS) send UDP "
        "to this computer and use udpin:PORT, or udp:HOST:PORT where it waits for us",
        address);
}

/* What others write for it: "udp:14550" is both in one. */
static bool refuse_udp_port(const char *address, const char *number, struct fault *fault)
{
    return fault_set(
        fault,
        "link '%.100s': expected udpin:%s to wait for datagrams at that port, or udp:HOST:%s to send to HOST",
        address, number, number);
}

/* udpin: the address of this computer to listen at; none: all of them. */
static bool check_own_address(const char *address, const char *place, struct fault *fault)
{
    struct in_addr own;
    if (!place[0] || inet_pton(AF_INET, place, &own) == 1)
        return true;
    return fault_set(
        fault,
        "link '%.100s': '%.60s' is no IPv4 address: expected udpin:PORT, or udpin:ADDRESS:PORT with an address "
        "of this computer",
        address, place);
}

bool mavlink_link_init(struct mavlink_link *link, const char *address, struct fault *fault)
{
    static const char *const prefixes[] = {
        [MAVLINK_UDP] = "udp:", [MAVLINK_UDPIN] = "udpin:", [MAVLINK_SERIAL] = "serial:"};
    static const char udpout[] = "udpout:"; /* what pymavlink calls udp: */
    const char *rest = NULL, *number;
    size_t place_n;
    *link = (struct mavlink_link){.fd = -1};
    if (!refuse_tcp(address, fault))
        return false;
    for (int kind = MAVLINK_UDP; kind <= MAVLINK_SERIAL && !rest; kind++) {
        const size_t n = strlen(prefixes[kind]);
        link->kind = (enum mavlink_link_kind)kind;
        rest = strncmp(address, prefixes[kind], n) == 0 ? address + n : NULL;
    }
    if (!rest && strncmp(address, udpout, sizeof udpout - 1) == 0) {
        link->kind = MAVLINK_UDP;
        rest = address + sizeof udpout - 1;
    }
    number = rest ? strrchr(rest, ':') : NULL;
    place_n = number ? (size_t)(number - rest) : 0;
    number = number ? number + 1 : rest;
    if (rest && link->kind == MAVLINK_UDP && number == rest && parse_number(number, 65535) > 0)
        return refuse_udp_port(address, number, fault);
    if (!rest || (place_n == 0 && link->kind != MAVLINK_UDPIN) || place_n >= sizeof link->place)
        return fault_set(
            fault,
            "link '%.100s': expected udp:HOST:PORT, udpin:PORT, udpin:ADDRESS:PORT or serial:/dev/NAME:BAUD",
            address);
    memcpy(link->place, rest, place_n);
    if (link->kind == MAVLINK_UDPIN && !check_own_address(address, link->place, fault))
        return false;
    if (link->kind == MAVLINK_SERIAL) {
        link->baud = parse_number(number, 4000000);
        if (speed_of(link->baud) != B0)
            return true;
        return fault_set(fault, "link '%.100s': '%.20s' is no baud rate for a serial line, for instance 115200",
                         address, number);
    }
    if (parse_number(number, 65535) == 0)
        return fault_set(fault, "link '%.100s': expected a UDP port from 1 to 65535, not '%.20s'", address,
                         number);
    snprintf(link->port, sizeof link->port, "%u", parse_number(number, 65535));
    return true;
}

static void note(struct mavlink_link *link, const char *what, const char *why)
{
    snprintf(link->error, sizeof link->error, "%.100s%s%s: %s: %s", link->place,
             link->place[0] && link->port[0] ? ":" : "", link->port, what, why);
}

/* Notes why, closes, and lets a second pass. */
static void lose_link(struct mavlink_link *link, const char *what, const char *why, uint64_t now_ns)
{
    note(link, what, why);
    mavlink_link_close(link);
    link->retry_ns = now_ns + RETRY_NS;
}

static void open_udp(struct mavlink_link *link, uint64_t now_ns)
{
    const bool in = link->kind == MAVLINK_UDPIN;
    const struct addrinfo hints = {.ai_family = in ? AF_INET : AF_UNSPEC,
                                   .ai_socktype = SOCK_DGRAM,
                                   .ai_flags = AI_NUMERICSERV | (in ? AI_PASSIVE | AI_NUMERICHOST : 0)};
    struct addrinfo *found = NULL;
    const int failure = getaddrinfo(link->place[0] ? link->place : NULL, link->port, &hints, &found);
    if (failure) {
        lose_link(link, "look-up", gai_strerror(failure), now_ns);
        link->retry_s = link->retry_s == 0 ? 1 : link->retry_s < RETRY_MOST / 2 ? 2 * link->retry_s : RETRY_MOST;
        link->retry_ns = now_ns + link->retry_s * (uint64_t)RETRY_NS;
        return;
    }
    link->retry_s = 0;
    link->fd = socket(found->ai_family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (link->fd < 0 || (in ? bind(link->fd, found->ai_addr, found->ai_addrlen)
                            : connect(link->fd, found->ai_addr, found->ai_addrlen)) < 0)
        lose_link(link, in ? "cannot listen" : "cannot send", strerror(errno), now_ns);
    freeaddrinfo(found);
}

static void open_serial(struct mavlink_link *link, uint64_t now_ns)
{
    const speed_t speed = speed_of(link->baud);
    struct termios line;
    link->fd = open(link->place, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (link->fd < 0) {
        lose_link(link, "cannot be opened", strerror(errno), now_ns);
        return;
    }
    if (flock(link->fd, LOCK_EX | LOCK_NB) < 0) {
        lose_link(link, "in use by another process", strerror(errno), now_ns);
        return;
    }
    if (tcgetattr(link->fd, &line) < 0) {
        lose_link(link, "no serial line", strerror(errno), now_ns);
        return;
    }
    cfmakeraw(&line);
    line.c_cflag &= ~(tcflag_t)(CSTOPB | CRTSCTS);
    line.c_cflag |= CLOCAL | CREAD;
    line.c_cc[VMIN] = 1; /* so that a read of nothing means that the line is gone */
    line.c_cc[VTIME] = 0;
    if (cfsetspeed(&line, speed) < 0 || tcsetattr(link->fd, TCSANOW, &line) < 0 ||
        tcgetattr(link->fd, &line) < 0) {
        lose_link(link, "cannot be set up", strerror(errno), now_ns);
        return;
    }
    if (cfgetospeed(&line) != speed) {
        lose_link(link, "cannot be set up", "the hardware does not support this baud rate", now_ns);
        return;
    }
    tcflush(link->fd, TCIOFLUSH);
}

bool mavlink_link_open(struct mavlink_link *link, uint64_t now_ns)
{
    if (link->fd >= 0)
        return true;
    if (now_ns < link->retry_ns)
        return false;
    if (link->kind == MAVLINK_SERIAL)
        open_serial(link, now_ns);
    else
        open_udp(link, now_ns);
    if (link->fd >= 0)
        link->error[0] = '\0';
    return link->fd >= 0;
}

short mavlink_link_events(const struct mavlink_link *link)
{
    return (short)(POLLIN | (link->n_out > 0 ? POLLOUT : 0));
}

/* Only a serial line is closed: a UDP peer that is not there yet, or a network that is down, comes back. */
static void failed(struct mavlink_link *link, uint64_t now_ns)
{
    if (errno == EAGAIN || errno == EINTR || errno == ENOBUFS)
        return;
    if (link->kind == MAVLINK_SERIAL)
        lose_link(link, "lost", strerror(errno), now_ns);
    else
        note(link, "no peer answers", strerror(errno));
}

size_t mavlink_link_read(struct mavlink_link *link, void *buffer, size_t size, uint64_t now_ns)
{
    ssize_t n;
    if (link->fd < 0)
        return 0;
    if (link->kind == MAVLINK_SERIAL) {
        n = read(link->fd, buffer, size);
        if (n == 0)
            errno = ENODEV;
    } else {
        link->sender = (struct mavlink_source){.size = sizeof link->sender.address};
        n = recvfrom(link->fd, buffer, size, 0, (struct sockaddr *)&link->sender.address, &link->sender.size);
    }
    if (n > 0) {
        link->error[0] = '\0';
        return (size_t)n;
    }
    if (n < 0 || link->kind == MAVLINK_SERIAL)
        failed(link, now_ns);
    return 0;
}

void mavlink_link_answer(struct mavlink_link *link)
{
    link->peer = link->sender;
}

/* Hands a datagram over, to `peer` where the socket has none of its own. */
static bool sent(struct mavlink_link *link, const void *frame, size_t n, const struct mavlink_source *peer,
                 uint64_t now_ns)
{
    const struct sockaddr *to = peer ? (const struct sockaddr *)&peer->address : NULL;
    const ssize_t k = sendto(link->fd, frame, n, MSG_NOSIGNAL, to, peer ? peer->size : 0);
    if (k < 0)
        failed(link, now_ns);
    return k == (ssize_t)n;
}

void mavlink_link_write(struct mavlink_link *link, const void *frame, size_t n, uint64_t now_ns)
{
    bool taken = false;
    if (link->fd >= 0 && link->kind == MAVLINK_UDP) {
        taken = sent(link, frame, n, NULL, now_ns);
    } else if (link->fd >= 0 && link->kind == MAVLINK_UDPIN && link->peer.size > 0) {
        taken = sent(link, frame, n, &link->peer, now_ns);
    } else if (link->fd >= 0 && link->kind == MAVLINK_SERIAL && n <= sizeof link->out - link->n_out) {
        memcpy(link->out + link->n_out, frame, n);
        link->n_out += n;
        taken = true;
        mavlink_link_flush(link, now_ns);
    }
    link->dropped += !taken;
}

void mavlink_link_flush(struct mavlink_link *link, uint64_t now_ns)
{
    ssize_t n;
    if (link->fd < 0 || link->n_out == 0)
        return;
    n = write(link->fd, link->out, link->n_out);
    if (n > 0) {
        link->n_out -= (size_t)n;
        memmove(link->out, link->out + n, link->n_out);
    } else if (n < 0) {
        failed(link, now_ns);
    }
}

void mavlink_link_close(struct mavlink_link *link)
{
    if (link->fd >= 0)
        close(link->fd);
    link->fd = -1;
    link->received = false;
    link->n_out = 0;
}
