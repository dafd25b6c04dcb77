/* SPDX-License-Identifier: MIT */
/*
 * imagenex_frame - what an Imagenex 852 or 881A head sends and receives: replies out of a byte stream,
 * switch data into bytes. Knows the layout and nothing of what a device does with it.
 *
 * Switch data: FE 44, 24 settings, FD. Reply: 'I' 'M'|'G'|'P' 'X', head id, status, head position, range, profile
 * range, number of data bytes (two bytes of seven bits each), data, FC. There is no checksum: name, head id, length
 * and last byte must agree. FC and the rest occur in data. Source: the makers' specification of the 852's serial
 * interface, and for the 881A what open drivers do.
 */
#ifndef SONARD_IMAGENEX_FRAME_H
#define SONARD_IMAGENEX_FRAME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define IMAGENEX_SWITCH_BYTES 27
#define IMAGENEX_OVERHEAD     13   /* bytes of a reply that are not data */
#define IMAGENEX_DATA_MAX     1000 /* 500 points of 16 bits */
#define IMAGENEX_FRAME_MAX    (IMAGENEX_OVERHEAD + IMAGENEX_DATA_MAX)

enum imagenex_status {
    IMAGENEX_ACCEPTED = 0x40, /* the switch data were */
};

/* A good reply; data points into the parser and lives until the parser is called again. */
struct imagenex_frame {
    uint8_t head;      /* 0x10..0x15 */
    uint8_t status;    /* set of enum imagenex_status and others */
    uint16_t position; /* of the head, its own units; the fixed 852 has something else there */
    bool clockwise;    /* it steps that way */
    uint8_t range_m;   /* at 1500 m/s */
    uint16_t profile;  /* range that the head has picked, model's own units; 0: none */
    uint16_t n_points; /* 252, 500, or 0: a reply without profile */
    uint16_t n_data;   /* bytes: half as many, as many or twice as many as points */
    const uint8_t *data;
    uint64_t t_first_ns, t_last_ns; /* arrival of its first and last byte */
};

/* Finds replies in a stream that was cut anywhere. Counters only grow. */
struct imagenex_parser {
    size_t n;     /* bytes held: the beginning of what may be a frame */
    size_t taken; /* of these, how many were handed out by the last call */
    uint64_t frames, garbage_bytes, cut_bytes;
    uint64_t bad_end; /* the last byte is not FC; the search goes on behind the start of these */
    uint8_t buf[IMAGENEX_FRAME_MAX];
    uint64_t t_ns[IMAGENEX_FRAME_MAX]; /* arrival of each byte in buf */
};

/** imagenex_parser_reset - forget the bytes held (a new connection): they count in cut_bytes.
 * A zeroed parser is new. */
void imagenex_parser_reset(struct imagenex_parser *p);

/**
 * imagenex_parser_next - take bytes from (*bytes, *n), which arrived at now_ns, up to the end of the next good reply.
 * True with *out filled: call again with what is left. False: all bytes are taken. Switch data that an RS-485
 * adapter has echoed are passed over, and are no garbage.
 */
bool imagenex_parser_next(struct imagenex_parser *p, const uint8_t **bytes, size_t *n, uint64_t now_ns,
                          struct imagenex_frame *out);

/**
 * imagenex_parser_give_up - the unfinished frame held, if its last byte came no later than then_ns, will not be
 * completed: look behind its start. Frames found there come from imagenex_parser_next, even without new bytes.
 */
void imagenex_parser_give_up(struct imagenex_parser *p, uint64_t then_ns);

/* One request. Values are the wire's; one that is FD, which only the end may be, is sent as FC. */
struct imagenex_switch {
    uint8_t head;
    uint8_t range_m;
    uint8_t gain_db;    /* 0..40 */
    uint8_t absorption; /* 0.01 dB/m */
    uint8_t train, sector, step;
    uint8_t pulse;
    uint8_t points; /* 25: 252, 50: 500 */
    uint8_t bits, baud_code;
    uint8_t frequency;
};

void imagenex_encode_switch(const struct imagenex_switch *s, uint8_t out[IMAGENEX_SWITCH_BYTES]);

/** imagenex_encode_reply - the whole frame of f with n_data bytes of f->data; its length, 0 when size has no room. */
size_t imagenex_encode_reply(uint8_t *out, size_t size, const struct imagenex_frame *f);

/** imagenex_decode_switch - false when out of the IMAGENEX_SWITCH_BYTES no request can be read. */
bool imagenex_decode_switch(const uint8_t in[IMAGENEX_SWITCH_BYTES], struct imagenex_switch *s);

#endif
