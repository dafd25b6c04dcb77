/* SPDX-License-Identifier: MIT */
/* line - a paced pseudo-terminal or UDP port; see line.h. */
#include "line.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "pace.h"

#include <asm/termbits.h> /* for any baud rate; excludes termios.h */

#define BITS_PER_BYTE   10 /* 8N1 */
#define BAUD_UNKNOWN    115200
#define BAUD_UDP        10000000 /* so that a long frame leaves in several datagrams */
#define DATAGRAM_MAX    1400
#define CHUNK_NS        1000000 /* write at most so often: a UART's FIFO, an adapter's packets */
#define FLOOD_CHUNK_MAX 512

bool line_init(struct line *line, const char *link, unsigned fixed_baud, uint64_t seed)
{
    memset(line, 0, sizeof *line);
    line->fd = -1;
    line->udp_port = LINE_NO_UDP;
    line->fixed_baud = fixed_baud;
    line->random = seed;
    int n = snprintf(line->link, sizeof line->link, "%s", link ? link : "");
    return n >= 0 && (size_t)n < sizeof line->link;
}

/* No echo, no line editing, before a host has said so: else our own bytes would come back to us. */
static bool make_raw(int fd)
{
    struct termios2 tio;
    if (ioctl(fd, TCGETS2, &tio) < 0)
        return false;
    tio.c_iflag = 0;
    tio.c_oflag = 0;
    tio.c_lflag = 0;
    return ioctl(fd, TCSETS2, &tio) == 0;
}

/* The new link appears in one step under its name, over a stale one too; anything but a link is left alone. */
static bool make_link(const char *target, const char *link, struct fault *fault)
{
    char temporary[LINE_PATH_MAX + 8], old[4];
    if (readlink(link, old, sizeof old) < 0 && errno != ENOENT)
        return fault_set(fault, "%s: exists and is no symbolic link", link);
    snprintf(temporary, sizeof temporary, "%s.new", link);
    unlink(temporary);
    if (symlink(target, temporary) < 0 || rename(temporary, link) < 0)
        return fault_set(fault, "%s: cannot make the link: %s", link, strerror(errno));
    return true;
}

void line_use_udp(struct line *line, int port)
{
    line->udp_port = port;
}

static bool plug_udp(struct line *line, struct fault *fault)
{
    struct sockaddr_in a = {.sin_family = AF_INET,
                            .sin_addr.s_addr = htonl(INADDR_LOOPBACK),
                            .sin_port = htons((uint16_t)line->udp_port)};
    socklen_t n = sizeof a;
    int fd = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (fd < 0 || bind(fd, (struct sockaddr *)&a, n) < 0 || getsockname(fd, (struct sockaddr *)&a, &n) < 0) {
        fault_set(fault, "UDP port %d: %s", line->udp_port, strerror(errno));
        if (fd >= 0)
            close(fd);
        return false;
    }
    line->udp_port = ntohs(a.sin_port);
    snprintf(line->slave, sizeof line->slave, "127.0.0.1:%d", line->udp_port);
    line->fd = fd;
    line->peer.sin_port = 0;
    line->begin = line->end = 0;
    return true;
}

bool line_plug(struct line *line, struct fault *fault)
{
    if (pace_line() >= 0) {
        line->fd = pace_line();
        line->begin = line->end = 0;
        return true;
    }
    if (line->udp_port != LINE_NO_UDP)
        return plug_udp(line, fault);
    int slave = -1, fd = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);

    if (fd < 0 || grantpt(fd) < 0 || unlockpt(fd) < 0 || ptsname_r(fd, line->slave, sizeof line->slave) != 0 ||
        (slave = open(line->slave, O_RDWR | O_NOCTTY | O_CLOEXEC)) < 0 || !make_raw(slave)) {
        fault_set(fault, "pseudo-terminal: %s", strerror(errno));
        goto fail;
    }
    if (line->link[0] != '\0' && !make_link(line->slave, line->link, fault))
        goto fail;
    close(slave); /* from now on a hang-up on the master means that nobody has the line open */
    line->fd = fd;
    line->begin = line->end = 0;
    return true;
fail:
    if (slave >= 0)
        close(slave);
    if (fd >= 0)
        close(fd);
    return false;
}

void line_unplug(struct line *line)
{
    if (line->fd < 0)
        return;
    if (line->link[0] != '\0')
        unlink(line->link);
    close(line->fd);
    line->fd = -1;
    line->lost_bytes += line->end - line->begin;
    line->begin = line->end = 0;
}

bool line_connected(const struct line *line)
{
    struct pollfd p = {.fd = line->fd};
    if (line->udp_port != LINE_NO_UDP)
        return line->fd >= 0 && line->peer.sin_port != 0;
    return line->fd >= 0 && poll(&p, 1, 0) >= 0 && (p.revents & POLLHUP) == 0;
}

static unsigned line_baud(const struct line *line)
{
    struct termios2 tio;
    if (line->fixed_baud != 0)
        return line->fixed_baud;
    if (line->udp_port != LINE_NO_UDP)
        return BAUD_UDP;
    if (line->fd < 0 || ioctl(line->fd, TCGETS2, &tio) < 0 || tio.c_ospeed == 0)
        return BAUD_UNKNOWN;
    return tio.c_ospeed;
}

static uint64_t line_time(const struct line *line, size_t n)
{
    return (uint64_t)n * BITS_PER_BYTE * 1000000000u / line_baud(line);
}

static uint8_t line_random(struct line *line)
{
    line->random = line->random * 6364136223846793005u + 1442695040888963407u;
    return (uint8_t)(line->random >> 56);
}

/* What does not fit is lost, as in an overrun. */
static void queue_put(struct line *line, const uint8_t *bytes, size_t n, uint64_t now_ns)
{
    if (line->begin == line->end) {
        line->begin = line->end = 0;
        line->begin_ns = now_ns;
    }
    if (n > sizeof line->queue - line->end) {
        memmove(line->queue, line->queue + line->begin, line->end - line->begin);
        line->end -= line->begin;
        line->begin = 0;
    }
    size_t room = sizeof line->queue - line->end;
    size_t taken = n < room ? n : room;
    memcpy(line->queue + line->end, bytes, taken);
    line->end += taken;
    line->lost_bytes += n - taken;
}

static void queue_random(struct line *line, uint64_t n, uint64_t now_ns)
{
    for (; n > 0; n--) {
        uint8_t byte = line_random(line);
        queue_put(line, &byte, 1, now_ns);
    }
}

static bool take_one(uint64_t *left)
{
    if (*left == 0)
        return false;
    --*left;
    return true;
}

uint64_t line_send(struct line *line, const uint8_t *frame, size_t n, uint64_t now_ns)
{
    struct line_faults *faults = &line->faults;
    if (faults->garbage > 0) {
        queue_random(line, faults->garbage, now_ns);
        faults->garbage = 0;
    }
    if (line->fd < 0 || take_one(&faults->drop)) {
        line->lost_bytes += n;
        return now_ns + line_time(line, n); /* the head speaks all the same */
    }
    if (line->held_n == 0 && n <= sizeof line->held && take_one(&faults->swap)) {
        memcpy(line->held, frame, n);
        line->held_n = n;
        return now_ns + line_time(line, n);
    }
    if (take_one(&faults->cut))
        n /= 2;
    if (take_one(&faults->corrupt)) {
        size_t at = n / 2;
        uint8_t changed = (uint8_t)(frame[at] ^ 0x10);
        queue_put(line, frame, at, now_ns);
        queue_put(line, &changed, 1, now_ns);
        queue_put(line, frame + at + 1, n - at - 1, now_ns);
    } else {
        queue_put(line, frame, n, now_ns);
    }
    if (take_one(&faults->twice))
        queue_put(line, frame, n, now_ns);
    queue_put(line, line->held, line->held_n, now_ns);
    line->held_n = 0;
    return line->begin_ns + line_time(line, line->end - line->begin);
}

static ssize_t write_some(const struct line *line, const uint8_t *bytes, size_t n)
{
    if (line->udp_port == LINE_NO_UDP)
        return write(line->fd, bytes, n);
    return sendto(line->fd, bytes, n, 0, (const struct sockaddr *)&line->peer, sizeof line->peer);
}

/* Write queue[begin .. begin + n); whatever the host's side has no room for is lost. */
static void write_out(struct line *line, size_t n)
{
    bool heard = line_connected(line);
    for (size_t done = 0, chunk; done < n; done += chunk) {
        chunk = line->faults.split ? 1 : n - done;
        if (line->udp_port != LINE_NO_UDP && chunk > DATAGRAM_MAX)
            chunk = DATAGRAM_MAX;
        ssize_t written = heard ? write_some(line, line->queue + line->begin + done, chunk) : 0;
        size_t sent = written > 0 ? (size_t)written : 0;
        line->sent_bytes += sent;
        line->lost_bytes += chunk - sent;
    }
}

uint64_t line_pump(struct line *line, uint64_t now_ns)
{
    if (line->fd < 0)
        return LINE_NEVER;
    if (now_ns < line->faults.silent_ns) {
        line->lost_bytes += line->end - line->begin;
        line->begin = line->end = 0;
    } else if (now_ns < line->faults.flood_ns && line->end - line->begin < FLOOD_CHUNK_MAX) {
        queue_random(line, FLOOD_CHUNK_MAX, now_ns);
    }
    if (line->begin == line->end)
        return LINE_NEVER;

    uint64_t byte_ns = line_time(line, 1);
    uint64_t passed_ns = now_ns > line->begin_ns ? now_ns - line->begin_ns : 0;
    size_t waiting = line->end - line->begin;
    size_t due = byte_ns == 0 || passed_ns / byte_ns >= waiting ? waiting : (size_t)(passed_ns / byte_ns);
    write_out(line, due);
    line->begin += due;
    line->begin_ns += due * byte_ns;
    if (line->begin == line->end)
        return now_ns < line->faults.flood_ns ? now_ns : LINE_NEVER;
    uint64_t rest_ns = (uint64_t)(waiting - due) * byte_ns;
    return now_ns + (rest_ns < CHUNK_NS ? rest_ns : CHUNK_NS) + byte_ns;
}

size_t line_read(struct line *line, uint8_t *buf, size_t size, uint64_t now_ns)
{
    if (line->fd < 0 || now_ns < line->faults.stall_ns)
        return 0;
    socklen_t peer_size = sizeof line->peer;
    ssize_t n = line->udp_port == LINE_NO_UDP
                    ? read(line->fd, buf, size)
                    : recvfrom(line->fd, buf, size, 0, (struct sockaddr *)&line->peer, &peer_size);
    return n > 0 ? (size_t)n : 0;
}
