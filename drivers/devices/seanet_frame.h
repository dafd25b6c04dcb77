/* SPDX-License-Identifier: MIT */
/*
 * seanet_frame - Tritech's SeaNet protocol on the wire: frames out of a byte stream, frames into bytes. Knows what a
 * frame must look like and nothing of what its message means.
 *
 * A frame: '@', the length as four hexadecimal digits, the same as u16, u8 sender, u8 receiver, u8 a count that not
 * all heads fill in, u8 message id, u8 packet number (bit 7: the last one), u8 node, payload, LF. The length counts
 * from its u16 form to before the LF. Numbers are little-endian. There is no checksum and LF occurs in data, so a
 * frame is believed when all that can be checked is right. Source: agreement of public drivers, and recordings.
 */
#ifndef SONARD_SEANET_FRAME_H
#define SONARD_SEANET_FRAME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define SEANET_OVERHEAD    14 /* bytes of a frame that are not payload: 13 before it and the LF */
#define SEANET_PAYLOAD_AT  13
#define SEANET_FRAME_MAX   4096
#define SEANET_DATA_AT     31   /* in the payload of mtHeadData: where the echo begins, behind its u16 length */
#define SEANET_DATA_MAX    1500 /* bytes of echo in one mtHeadData */
#define SEANET_HOST        255  /* node of whoever asks */
#define SEANET_LAST_PACKET 0x80

enum seanet_message {
    SEANET_VERSION_DATA = 1,
    SEANET_HEAD_DATA = 2,
    SEANET_ALIVE = 4,
    SEANET_USER_DATA = 6,
    SEANET_REBOOT = 16,
    SEANET_HEAD_COMMAND = 19,
    SEANET_SEND_VERSION = 23,
    SEANET_SEND_USER_DATA = 24,
    SEANET_SEND_DATA = 25,
};

/* A good frame; payload points into the parser and lives until the parser is called again. */
struct seanet_frame {
    uint8_t sender, receiver, node;
    uint8_t id;
    uint8_t packet;  /* 0, 1, ... of a message in several packets */
    bool last;       /* the last, or only, packet */
    uint16_t length; /* of the payload */
    const uint8_t *payload;
    uint64_t t_first_ns; /* arrival of its first byte ... */
    uint64_t t_last_ns;  /* ... and of its last */
};

/* Finds frames in a stream that was cut anywhere. Counters only grow. */
struct seanet_parser {
    size_t n;     /* bytes held: the beginning of what may be a frame */
    size_t taken; /* of these, how many were handed out as a frame by the last call */
    uint64_t frames, garbage_bytes, cut_bytes;
    uint64_t broken; /* what began as a frame with a right head and did not end as one */
    uint8_t buf[SEANET_FRAME_MAX];
    uint64_t t_ns[SEANET_FRAME_MAX]; /* arrival of each byte in buf */
};

/** seanet_parser_init - empty, counters 0. */
void seanet_parser_init(struct seanet_parser *p);

/** seanet_parser_reset - forget the bytes held (a new connection): they count in cut_bytes, the counters stay. */
void seanet_parser_reset(struct seanet_parser *p);

/**
 * seanet_parser_next - take bytes from (*bytes, *n), which arrived at now_ns, up to the end of the next good frame.
 * True with *out filled: call again with what is left. False: all bytes are taken. After noise, and after a frame
 * that turns out to hold the head of another (bytes were lost), the search goes on one byte behind the false start:
 * no good frame behind it is lost.
 */
bool seanet_parser_next(struct seanet_parser *p, const uint8_t **bytes, size_t *n, uint64_t now_ns,
                        struct seanet_frame *out);

/**
 * seanet_parser_give_up - the unfinished frame held, if its last byte came no later than then_ns, will not be
 * completed: look for frames behind its start. Those are handed out by seanet_parser_next, even without new bytes.
 */
void seanet_parser_give_up(struct seanet_parser *p, uint64_t then_ns);

/* Who sends what to whom in a frame. */
struct seanet_head {
    uint8_t sender, receiver;
    uint8_t id;
    uint8_t packet; /* its number, with SEANET_LAST_PACKET on the last */
};

/**
 * seanet_build - write a frame of one packet to out; its length, or 0 when `size` has no room or the payload is too
 * long. Its node is the sender of a reply, the receiver of a command.
 */
size_t seanet_build(uint8_t *out, size_t size, struct seanet_head head, const void *payload, size_t length);

/** seanet_u16, seanet_u32, seanet_put_u16, seanet_put_u32 - numbers as they stand in frames. */
static inline uint16_t seanet_u16(const uint8_t *b)
{
    return (uint16_t)(b[0] | (unsigned)b[1] << 8);
}

static inline uint32_t seanet_u32(const uint8_t *b)
{
    return seanet_u16(b) | (uint32_t)seanet_u16(b + 2) << 16;
}

static inline void seanet_put_u16(uint8_t *b, unsigned v)
{
    b[0] = (uint8_t)v;
    b[1] = (uint8_t)(v >> 8);
}

static inline void seanet_put_u32(uint8_t *b, uint32_t v)
{
    seanet_put_u16(b, v & 0xffff);
    seanet_put_u16(b + 2, v >> 16);
}

#endif
