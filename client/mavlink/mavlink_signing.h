/* SPDX-License-Identifier: MIT */
/*
 * mavlink_signing - signatures of MAVLink 2 frames: who knows the key may speak, and nobody may say it again later.
 * Pure; time is handed in. Knows frames only as bytes.
 */
#ifndef SONARD_MAVLINK_SIGNING_H
#define SONARD_MAVLINK_SIGNING_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define MAVLINK_KEY_BYTES       32
#define MAVLINK_SIGNATURE_BYTES 13 /* link id, time stamp of 6 bytes, 6 bytes of hash */
#define MAVLINK_STREAMS_MAX     16

/* Time stamps are units of 10 us since 2015-01-01 UTC. */
struct mavlink_signing {
    uint8_t key[MAVLINK_KEY_BYTES];
    uint8_t link_id;
    uint64_t newest; /* time stamp sent or accepted */
    struct mavlink_stream {
        uint8_t system_id, component_id, link_id;
        uint64_t newest;
    } stream[MAVLINK_STREAMS_MAX]; /* one per sender and link received from */
    size_t n_streams;
};

/** mavlink_signing_key - from 64 hexadecimal digits, white space around them; false for any other text. */
bool mavlink_signing_key(struct mavlink_signing *signing, const char *text);

/** mavlink_signing_clock - tell what time it is: unix_us microseconds since 1970. Never turns back. */
void mavlink_signing_clock(struct mavlink_signing *signing, uint64_t unix_us);

/** mavlink_sign - append the signature to a frame of n bytes (magic to CRC); its time stamp is a new one. */
void mavlink_sign(struct mavlink_signing *signing, uint8_t *frame, size_t n);

/**
 * mavlink_signature_holds - is the signature behind the frame's n bytes made with the key, and its time stamp later
 * than all of this sender and link before (of a new one: at most a minute old)? Remembers what it accepts. A 17th
 * sender is not accepted.
 */
bool mavlink_signature_holds(struct mavlink_signing *signing, const uint8_t *frame, size_t n);

#endif
