/* SPDX-License-Identifier: MIT */
/*
 * line - the wire of a virtual sonar, with faults on request: the master of a pseudo-terminal, paced as a UART of the
 * host's baud rate would be, or a UDP port on the loopback interface that answers whoever spoke last, as a network
 * bridge does. Knows bytes and frames' borders; no protocol. The time is handed in, monotonic nanoseconds.
 *
 * As a UART, it has no flow control: bytes for which nobody listens are lost.
 */
#ifndef SONARD_SIM_LINE_H
#define SONARD_SIM_LINE_H

#include <netinet/in.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

#include "core/fault.h"

#define LINE_QUEUE    65536
#define LINE_NEVER    UINT64_MAX
#define LINE_PATH_MAX 256
#define LINE_HELD_MAX 16394 /* the longest frame that can be put behind the next one */
#define LINE_NO_UDP   (-1)

struct line_faults {
    uint64_t drop;      /* so many next frames are lost */
    uint64_t corrupt;   /* ... arrive with one byte changed */
    uint64_t cut;       /* ... are cut short */
    uint64_t twice;     /* ... are sent twice */
    uint64_t swap;      /* ... change places with the frame behind them */
    uint64_t garbage;   /* so many random bytes before the next frame */
    bool split;         /* one byte per write */
    uint64_t silent_ns; /* nothing leaves before that time */
    uint64_t stall_ns;  /* what the host writes is not taken before that time */
    uint64_t flood_ns;  /* random bytes without a pause until that time */
};

struct line {
    int fd;                   /* master, or socket; -1: unplugged */
    int udp_port;             /* LINE_NO_UDP: a pseudo-terminal; 0: any that is free, until it is plugged in */
    struct sockaddr_in peer;  /* who spoke last; port 0: nobody */
    char link[LINE_PATH_MAX]; /* name that the host opens; empty: none */
    char slave[64];           /* what it points to, or 127.0.0.1:PORT */
    unsigned fixed_baud;      /* 0: as the host has set its side */
    struct line_faults faults;
    uint64_t random; /* state of the faults' random numbers */
    uint64_t sent_bytes, lost_bytes;
    size_t held_n; /* bytes of the frame that waits for the next one; 0: none */
    uint8_t held[LINE_HELD_MAX];
    uint64_t begin_ns; /* when the first byte of the queue began to leave */
    size_t begin, end; /* of the queue */
    uint8_t queue[LINE_QUEUE];
};

/** line_init - an unplugged line. link: NULL or "" for none. False when the name is too long. */
bool line_init(struct line *line, const char *link, unsigned fixed_baud, uint64_t seed);

/** line_use_udp - let the unplugged line be a UDP port: 1 .. 65535, or 0 for any that is free. */
void line_use_udp(struct line *line, int port);

/** line_plug - a new pseudo-terminal behind the link, raw from the start; or the UDP port; in a voyage its line, which
 * line_unplug ends for good. False with a sentence in fault. */
bool line_plug(struct line *line, struct fault *fault);

/** line_unplug - close the master and remove the link, as if the adapter were pulled; queued bytes are lost. */
void line_unplug(struct line *line);

/** line_send - queue one frame, subject to the faults; returns the time when its last byte has left. */
uint64_t line_send(struct line *line, const uint8_t *frame, size_t n, uint64_t now_ns);

/** line_pump - write what is due by now; returns when to call again (LINE_NEVER: nothing waits). */
uint64_t line_pump(struct line *line, uint64_t now_ns);

/** line_read - bytes from the host; 0: none, or stalled, or nobody has the line open. */
size_t line_read(struct line *line, uint8_t *buf, size_t size, uint64_t now_ns);

/** line_connected - does somebody have the line open? */
bool line_connected(const struct line *line);

#endif
