/* SPDX-License-Identifier: MIT */
/*
 * mavlink_peer - whose datagrams are believed. Anybody may send to a UDP port that listens, so nothing of a datagram is
 * looked at before this module has said whose it is. The peer is one source address and port: the first of the network
 * that is named that speaks like the autopilot. It stays the peer until it has been silent for five seconds; what
 * others send meanwhile is dropped unread and counted. A link with one far end (serial, a connected socket) has one
 * source, and the same rules. Pure. Times are CLOCK_MONOTONIC nanoseconds.
 *
 * A source address is no proof: whoever can write on the network can forge one. Signed frames are the proof.
 */
#ifndef SONARD_MAVLINK_PEER_H
#define SONARD_MAVLINK_PEER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/socket.h>

#include "core/fault.h"

/* Where a datagram came from; size 0: over a link that has one far end only. */
struct mavlink_source {
    struct sockaddr_storage address;
    socklen_t size;
};

/* Whose datagrams may be believed at all: all zeros, anybody's. */
struct mavlink_network {
    uint32_t host, mask; /* IPv4, in the machine's byte order */
};

enum mavlink_whose {
    MAVLINK_PEERS,      /* believe it */
    MAVLINK_CANDIDATES, /* there is no peer: look only for what the autopilot says of itself */
    MAVLINK_SOMEBODYS,  /* of another than the peer, or of outside the network: counted, not to be looked at */
};

struct mavlink_peer {
    struct mavlink_network network;
    bool held;
    struct mavlink_source source;         /* of the peer, or of the one before */
    uint64_t heard_ns;                    /* when held: the peer spoke as the autopilot */
    uint64_t strangers;                   /* datagrams dropped */
    bool outside;                         /* the newest of them is of outside the network */
    struct mavlink_source stranger, told; /* whose the newest was; who was named last */
    uint64_t told_ns;                     /* 0: nobody was */
};

/** mavlink_network_parse - "192.168.2.2" or "192.168.2.0/24". False with a sentence in fault. */
bool mavlink_network_parse(const char *text, struct mavlink_network *network, struct fault *fault);

/** mavlink_peer_judge - whose is a datagram that came at now_ns? Counts those of strangers. */
enum mavlink_whose mavlink_peer_judge(struct mavlink_peer *peer, const struct mavlink_source *from,
                                      uint64_t now_ns);

/** mavlink_peer_hold - this one spoke like the autopilot: it is the peer. True: it was not the peer before. */
bool mavlink_peer_hold(struct mavlink_peer *peer, const struct mavlink_source *from, uint64_t now_ns);

/** mavlink_source_same - the same address, and the same port. */
bool mavlink_source_same(const struct mavlink_source *a, const struct mavlink_source *b);

/** mavlink_source_same_host - the same address, whatever the port. */
bool mavlink_source_same_host(const struct mavlink_source *a, const struct mavlink_source *b);

/** mavlink_peer_text - "autopilot: at 192.168.2.2:14550"; returns text. */
const char *mavlink_peer_text(const struct mavlink_peer *peer, char *text, size_t size);

/** mavlink_peer_news - a line that names a stranger: the first at once, another at most once a minute. False: none. */
bool mavlink_peer_news(struct mavlink_peer *peer, uint64_t now_ns, char *text, size_t size);

#endif
