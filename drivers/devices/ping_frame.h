/* SPDX-License-Identifier: MIT */
/*
 * ping_frame - the Ping protocol on the wire: frames out of a byte stream, frames into bytes, and the messages of a
 * Ping360 as structs. Knows the layout of messages and nothing of what a device does with them.
 *
 * A frame: 'B' 'R', u16 payload length, u16 message id, u8 source, u8 destination, payload, u16 sum of all bytes
 * before it. All numbers are little-endian. Source: the public definition of the Blue Robotics Ping protocol.
 */
#ifndef SONARD_PING_FRAME_H
#define SONARD_PING_FRAME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define PING_OVERHEAD      10   /* bytes of a frame that are not payload */
#define PING_PAYLOAD_MAX   1300 /* no Blue Robotics message is longer; a greater length is noise */
#define PING_FRAME_MAX     (PING_OVERHEAD + PING_PAYLOAD_MAX)
#define PING_PAYLOAD_LIMIT 16384 /* the same for Cerulean, and for any parser */
#define PING_FRAME_LIMIT   (PING_OVERHEAD + PING_PAYLOAD_LIMIT)

enum ping_message {
    PING_ACK = 1,
    PING_NACK = 2,
    PING_ASCII_TEXT = 3,
    PING_DEVICE_INFORMATION = 4,
    PING_PROTOCOL_VERSION = 5,
    PING_GENERAL_REQUEST = 6,
    PING360_DEVICE_DATA = 2300,
    PING360_AUTO_DEVICE_DATA = 2301,
    PING360_TRANSDUCER = 2601,
    PING360_AUTO_TRANSMIT = 2602,
    PING360_MOTOR_OFF = 2903,
    SURVEYOR_YZ_POINTS = 3011,
    SURVEYOR_ATOF_POINTS = 3012,
};

/* ---- frames ---- */

/* A good frame; payload points into the parser and lives until the parser is called again. */
struct ping_frame {
    uint16_t id;
    uint8_t src, dst;
    uint16_t length; /* of the payload, at most the parser's payload_max */
    const uint8_t *payload;
    uint64_t t_first_ns; /* arrival of its first byte ... */
    uint64_t t_last_ns;  /* ... and of its last */
};

/* Bytes are moved to the front when a quarter of a frame has been left, and not for each. */
#define PING_PARSER_ROOM (PING_FRAME_LIMIT + PING_FRAME_LIMIT / 4)

/* Finds frames in a stream that was cut anywhere, in a time that its length sets, whatever is in it: each byte may
 * begin a frame of the largest size. Counters only grow. */
struct ping_parser {
    size_t payload_max;
    size_t at, n; /* bytes held, from buf[at] on: the beginning of what may be a frame */
    size_t taken; /* of these, how many were handed out as a frame by the last call */
    uint64_t frames, garbage_bytes, cut_bytes, bad_checksum;
    uint16_t sum; /* of all bytes so far, modulo 65536 */
    uint8_t buf[PING_PARSER_ROOM];
    uint16_t sum_before[PING_PARSER_ROOM]; /* of all bytes before each in buf */
    uint64_t t_ns[PING_PARSER_ROOM];       /* arrival of each */
};

/** ping_parser_init - empty, counters 0; payload_max (at most PING_PAYLOAD_LIMIT) is the longest payload to believe. */
void ping_parser_init(struct ping_parser *p, size_t payload_max);

/** ping_parser_reset - forget the bytes held (a new connection): they count in cut_bytes, the counters stay. */
void ping_parser_reset(struct ping_parser *p);

/**
 * ping_parser_next - take bytes from (*bytes, *n), which arrived at now_ns, up to the end of the next good frame.
 * True with *out filled: call again with what is left. False: all bytes are taken. After noise the search goes on
 * one byte behind the false start, so a wrong length costs no good frame that came after it.
 */
bool ping_parser_next(struct ping_parser *p, const uint8_t **bytes, size_t *n, uint64_t now_ns,
                      struct ping_frame *out);

/**
 * ping_parser_give_up - the unfinished frame held, if its last byte came no later than then_ns, will not be completed:
 * look for frames behind its start. Those are handed out by ping_parser_next, even without new bytes.
 */
void ping_parser_give_up(struct ping_parser *p, uint64_t then_ns);

/**
 * ping_frame_build - write a frame to out, to whom it may concern (dst 0); its length, or 0 when `size` has no room or
 * the payload is too long.
 */
size_t ping_frame_build(uint8_t *out, size_t size, uint16_t id, uint8_t src, const void *payload, size_t length);

/** ping_frame_bytes - that the frame had on the wire. */
size_t ping_frame_bytes(const struct ping_frame *f);

/* Ping numbers as a device counts them. Zeroed before the first. */
struct ping_count {
    bool known;
    uint32_t last;
};

/**
 * ping_count_is_new - false when `number` is the last one: the same ping again. Numbers that were left
 * out are added to *lost (NULL: not counted); a jump of more than 1000 is a restart and no loss.
 */
bool ping_count_is_new(struct ping_count *c, uint32_t number, uint64_t *lost);

/* ---- messages ---- */

struct ping_device_information {
    uint8_t type; /* 1: echosounder, 2: Ping360 */
    uint8_t revision;
    uint8_t firmware[3]; /* major, minor, patch */
};

/* What all Ping360 messages share. */
struct ping360_settings {
    uint8_t mode;           /* 1 */
    uint8_t gain;           /* 0 low, 1 normal, 2 high */
    uint16_t angle;         /* gradians 0..399; not in auto_transmit */
    uint16_t transmit_us;   /* 1..1000 */
    uint16_t sample_period; /* 80..40000 ticks of 25 ns */
    uint16_t frequency_khz; /* 500..1000 */
    uint16_t n_samples;     /* 200..1200 */
};

/* What the automatic scan has on top. */
struct ping360_sweep {
    uint16_t start, stop; /* gradians; 0, 399: full circles */
    uint8_t step;         /* gradians 1..10 */
    uint8_t delay_ms;     /* 0..100 */
};

/* device_data, or auto_device_data when `automatic`. */
struct ping360_data {
    struct ping360_settings set;
    bool automatic;
    struct ping360_sweep sweep; /* when automatic */
    uint16_t data_length;       /* as the frame says */
    uint16_t n_data;            /* samples that are there: the least of data_length, n_samples and the bytes */
    const uint8_t *data;
};

/*
 * Encoders: the whole frame from the host (source 0) to anyone (destination 0); its length, or 0 when `size` has no
 * room.
 */
size_t ping_encode_request(uint8_t *out, size_t size, uint16_t id);
size_t ping360_encode_transducer(uint8_t *out, size_t size, const struct ping360_settings *set, bool transmit);
size_t ping360_encode_auto_transmit(uint8_t *out, size_t size, const struct ping360_settings *set,
                                    const struct ping360_sweep *sweep);
size_t ping360_encode_motor_off(uint8_t *out, size_t size);

/** ping360_encode_data - what a head of id `src` says: 2300, or 2301 when d->automatic; n_data samples of d->data. */
size_t ping360_encode_data(uint8_t *out, size_t size, uint8_t src, const struct ping360_data *d);

/*
 * Decoders: false when the frame is another message or too short for the fields. Bytes appended by later firmware
 * are passed over.
 */
bool ping_decode_ack(const struct ping_frame *f, uint16_t *acked_id);
bool ping_decode_nack(const struct ping_frame *f, uint16_t *nacked_id, const char **text, size_t *text_n);
bool ping_decode_device_information(const struct ping_frame *f, struct ping_device_information *out);
bool ping_decode_protocol_version(const struct ping_frame *f, uint8_t version[3]);

/**
 * ping_text - n bytes of text from the line as dst, for a log: cut, and what is not printable ASCII as \xNN. NULs and
 * line ends behind it are left out.
 */
const char *ping_text(char *dst, size_t size, const char *text, size_t n);

/** ping360_decode_data - 2300 and 2301. The values are as sent: nothing is checked but the lengths. */
bool ping360_decode_data(const struct ping_frame *f, struct ping360_data *out);

#endif
