/* SPDX-License-Identifier: MIT */
/*
 * mavlink_frame - MAVLink 1 and 2 frames in a stream of bytes, cut anywhere, with anything in between; and frames of
 * our own. Pure. What a payload means is in mavlink_messages; ids that stand not there cannot be checked and are
 * skipped.
 */
#ifndef SONARD_MAVLINK_FRAME_H
#define SONARD_MAVLINK_FRAME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "mavlink_messages.h"
#include "mavlink_signing.h"

#define MAVLINK_FRAME_MAX 280

struct mavlink_frame {
    const struct mavlink_message *message;
    uint8_t version; /* 1 or 2 */
    uint8_t sequence, system_id, component_id;
    uint8_t size;                         /* of the payload on the wire */
    uint8_t payload[MAVLINK_PAYLOAD_MAX]; /* zeros behind what came */
};

struct mavlink_counters {
    uint64_t frames;        /* good ones */
    uint64_t unknown;       /* skipped: of an id that is not known here */
    uint64_t bad_crc;       /* or cut, or never a frame */
    uint64_t bad_flags;     /* incompatibility flags that are not known */
    uint64_t bad_signature; /* wrong, repeated or missing, while a key is set */
    uint64_t garbage_bytes; /* between frames, those of bad CRC and flags included */
};

struct mavlink_parser {
    struct mavlink_signing *signing; /* NULL: signed and unsigned frames alike are taken unverified */
    struct mavlink_counters counters;
    uint8_t held[MAVLINK_FRAME_MAX + 1];
    size_t n_held;
    bool searching; /* the bytes before those held were no frame */
};

/**
 * mavlink_parser_next - take bytes (advancing *bytes, *n) until a frame is whole: true, with *out. False: all bytes
 * were taken. A frame of an unknown id is skipped by its length only if it stands right behind another frame and
 * another one begins behind it, otherwise the search goes on one byte after its start: what looks like one amid garbage
 * would swallow good frames. With a key, frames must be signed.
 */
bool mavlink_parser_next(struct mavlink_parser *parser, const uint8_t **bytes, size_t *n,
                         struct mavlink_frame *out);

/** mavlink_parser_restart - forget the start of a frame that was held: what comes is of another sender. */
void mavlink_parser_restart(struct mavlink_parser *parser);

struct mavlink_sender {
    uint8_t system_id, component_id, sequence;
    struct mavlink_signing *signing; /* NULL: unsigned */
};

/**
 * mavlink_build - a MAVLink 2 frame with the struct that belongs to `message`; the sequence goes on by one. Returns
 * its size.
 */
size_t mavlink_build(struct mavlink_sender *sender, const struct mavlink_message *message, const void *content,
                     uint8_t out[MAVLINK_FRAME_MAX]);

/** mavlink_crc - CRC-16/MCRF4XX of n bytes, going on from crc (0xFFFF at the start). */
uint16_t mavlink_crc(const void *bytes, size_t n, uint16_t crc);

#endif
