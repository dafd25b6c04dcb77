/* SPDX-License-Identifier: MIT */
/*
 * mavlink_link - the way to the autopilot: UDP to a known place, UDP to whoever speaks to our port, or a serial line.
 * Never blocks but for the look-up of a name; reopens by itself what was lost. Moves bytes, and says whose they are;
 * knows no frames, and believes nobody.
 */
#ifndef SONARD_MAVLINK_LINK_H
#define SONARD_MAVLINK_LINK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/fault.h"
#include "mavlink_peer.h"

#define MAVLINK_LINK_OUT_BYTES 4096

enum mavlink_link_kind { MAVLINK_UDP, MAVLINK_UDPIN, MAVLINK_SERIAL };

struct mavlink_link {
    enum mavlink_link_kind kind;
    char place[256]; /* host or device */
    char port[6];    /* UDP */
    unsigned baud;   /* serial */
    int fd;          /* -1: not open; may be polled for mavlink_link_events */
    uint64_t retry_ns;
    unsigned retry_s; /* between attempts at the name; 0: it is known */
    char error[256];  /* why it is not open, or deaf, one sentence; "": all is well */
    bool received;    /* something of those who may be believed, since it was opened; the owner's */
    struct mavlink_source peer, sender;  /* udpin: who gets our frames; whose datagram came last */
    uint8_t out[MAVLINK_LINK_OUT_BYTES]; /* serial: not yet written */
    size_t n_out;
    uint64_t dropped; /* frames for which there was no room, or no way */
};

/**
 * mavlink_link_init - from "udp:HOST:PORT", "udpin:PORT", "udpin:ADDRESS:PORT" (an IPv4 address of this computer) or
 * "serial:/dev/NAME:BAUD"; opens nothing. False with a sentence in fault.
 */
bool mavlink_link_init(struct mavlink_link *link, const char *address, struct fault *fault);

/**
 * mavlink_link_open - try to open, at most once a second, and more and more seldom a name that is not known; true
 * while it is open.
 */
bool mavlink_link_open(struct mavlink_link *link, uint64_t now_ns);

/** mavlink_link_events - what to poll the descriptor for. */
short mavlink_link_events(const struct mavlink_link *link);

/**
 * mavlink_link_read - bytes that came, 0: none. A serial line that cannot be read any more is closed; a peer that the
 * network says is not there stays open until it is heard. Both with link->error set.
 */
size_t mavlink_link_read(struct mavlink_link *link, void *buffer, size_t size, uint64_t now_ns);

/** mavlink_link_answer - udpin: from now on the sender of what was read last gets our frames. */
void mavlink_link_answer(struct mavlink_link *link);

/** mavlink_link_write - send a frame, whole or not at all (then counted as dropped). */
void mavlink_link_write(struct mavlink_link *link, const void *frame, size_t n, uint64_t now_ns);

/** mavlink_link_flush - write what waits, when the descriptor is ready for it. */
void mavlink_link_flush(struct mavlink_link *link, uint64_t now_ns);

void mavlink_link_close(struct mavlink_link *link);

#endif
