/* SPDX-License-Identifier: MIT */
/*
 * imagenex_frame - see imagenex_frame.h.
 */
#include "imagenex_frame.h"

#include <string.h>

#define HEADER_BYTES 12
#define REPLY_END    0xfc
#define SWITCH_END   0xfd

/* Bytes of switch data that carry a setting. */
enum {
    AT_HEAD = 2,
    AT_RANGE = 3,
    AT_CONTROL = 6,
    AT_GAIN = 8,
    AT_ABSORPTION = 10,
    AT_TRAIN = 11,
    AT_SECTOR = 12,
    AT_STEP = 13,
    AT_PULSE = 14,
    AT_POINTS = 19,
    AT_BITS = 20,
    AT_BAUD = 21,
    AT_FREQUENCY = 25,
};

#define CONTROL 0x43 /* transmit, send data, set */

/* ---- replies ---- */

static uint16_t unpack(uint8_t low, uint8_t high)
{
    return (uint16_t)((high & 0x7f) << 7 | (low & 0x7f));
}

static bool is_head(uint8_t id)
{
    return id >= 0x10 && id <= 0x15;
}

static uint16_t points_of(uint8_t letter)
{
    return letter == 'M' ? 252 : letter == 'G' ? 500 : 0;
}

static bool known_letter(uint8_t letter)
{
    return letter == 'M' || letter == 'G' || letter == 'P';
}

/*
 * Length of the frame that begins with the n > 0 bytes at b, as far as they tell; 0: none begins so. Replies and
 * echoed switch data.
 */
static size_t frame_length(const uint8_t *b, size_t n)
{
    if (b[0] == 0xfe)
        return n < 2 || b[1] == 0x44 ? IMAGENEX_SWITCH_BYTES : 0;
    if (b[0] != 'I' || (n > 1 && !known_letter(b[1])) || (n > 2 && b[2] != 'X') || (n > 3 && !is_head(b[3])))
        return 0;
    if (n < HEADER_BYTES)
        return HEADER_BYTES + 1;
    const size_t data = unpack(b[10], b[11]), points = points_of(b[1]);
    if (2 * data != points && data != points && data != 2 * points)
        return 0;
    return IMAGENEX_OVERHEAD + data;
}

/* Throw away the first `skip` bytes, then those with which no frame can begin. */
static void look_behind(struct imagenex_parser *p, size_t skip)
{
    while (skip < p->n && frame_length(p->buf + skip, p->n - skip) == 0) {
        p->garbage_bytes++;
        skip++;
    }
    p->n -= skip;
    memmove(p->buf, p->buf + skip, p->n);
    memmove(p->t_ns, p->t_ns + skip, p->n * sizeof p->t_ns[0]);
}

static void false_start(struct imagenex_parser *p)
{
    p->garbage_bytes++;
    look_behind(p, 1);
}

static void describe_frame(struct imagenex_parser *p, size_t length, struct imagenex_frame *out)
{
    const uint8_t *b = p->buf;
    *out = (struct imagenex_frame){
        .head = b[3],
        .status = b[4],
        .position = unpack(b[5], b[6] & 0x3f),
        .clockwise = b[6] & 0x40,
        .range_m = b[7],
        .profile = unpack(b[8], b[9]),
        .n_points = points_of(b[1]),
        .n_data = (uint16_t)(length - IMAGENEX_OVERHEAD),
        .data = b + HEADER_BYTES,
        .t_first_ns = p->t_ns[0],
        .t_last_ns = p->t_ns[length - 1],
    };
    p->frames++;
    p->taken = length;
}

/* A reply among the bytes held? */
static bool find_frame(struct imagenex_parser *p, struct imagenex_frame *out)
{
    while (p->n > 0) {
        const size_t length = frame_length(p->buf, p->n);
        if (length > p->n)
            return false;
        const bool echo = p->buf[0] == 0xfe;
        if (p->buf[length - 1] != (echo ? SWITCH_END : REPLY_END)) {
            p->bad_end += !echo;
            false_start(p);
        } else if (echo) {
            look_behind(p, length);
        } else {
            describe_frame(p, length, out);
            return true;
        }
    }
    return false;
}

bool imagenex_parser_next(struct imagenex_parser *p, const uint8_t **bytes, size_t *n, uint64_t now_ns,
                          struct imagenex_frame *out)
{
    if (p->taken > 0) {
        look_behind(p, p->taken);
        p->taken = 0;
    }
    while (!find_frame(p, out)) {
        if (*n == 0)
            return false;
        p->buf[p->n] = *(*bytes)++;
        p->t_ns[p->n++] = now_ns;
        --*n;
        if (frame_length(p->buf, p->n) == 0)
            false_start(p);
    }
    return true;
}

void imagenex_parser_give_up(struct imagenex_parser *p, uint64_t then_ns)
{
    if (p->n > p->taken && p->t_ns[p->n - 1] <= then_ns) {
        look_behind(p, p->taken);
        p->taken = 0;
        if (p->n > 0)
            false_start(p);
    }
}

void imagenex_parser_reset(struct imagenex_parser *p)
{
    p->cut_bytes += p->n - p->taken;
    p->n = p->taken = 0;
}

static void pack(uint16_t value, uint8_t *low, uint8_t *high)
{
    *low = value & 0x7f;
    *high = value >> 7 & 0x7f;
}

size_t imagenex_encode_reply(uint8_t *out, size_t size, const struct imagenex_frame *f)
{
    const size_t length = IMAGENEX_OVERHEAD + (size_t)f->n_data;
    if (length > size)
        return 0;
    out[0] = 'I';
    out[1] = f->n_points == 252 ? 'M' : f->n_points == 500 ? 'G' : 'P';
    out[2] = 'X';
    out[3] = f->head;
    out[4] = f->status;
    pack(f->position, &out[5], &out[6]);
    out[6] = (uint8_t)((out[6] & 0x3f) | (f->clockwise ? 0x40 : 0));
    out[7] = f->range_m;
    pack(f->profile, &out[8], &out[9]);
    pack(f->n_data, &out[10], &out[11]);
    if (f->n_data > 0)
        memcpy(out + HEADER_BYTES, f->data, f->n_data);
    out[length - 1] = REPLY_END;
    return length;
}

/* ---- switch data ---- */

void imagenex_encode_switch(const struct imagenex_switch *s, uint8_t out[IMAGENEX_SWITCH_BYTES])
{
    memset(out, 0, IMAGENEX_SWITCH_BYTES);
    out[AT_HEAD] = s->head;
    out[AT_RANGE] = s->range_m;
    out[AT_CONTROL] = CONTROL;
    out[AT_GAIN] = s->gain_db;
    out[AT_ABSORPTION] = s->absorption;
    out[AT_TRAIN] = s->train;
    out[AT_SECTOR] = s->sector;
    out[AT_STEP] = s->step;
    out[AT_PULSE] = s->pulse;
    out[AT_POINTS] = s->points;
    out[AT_BITS] = s->bits;
    out[AT_BAUD] = s->baud_code;
    out[AT_FREQUENCY] = s->frequency;
    for (int i = 0; i < IMAGENEX_SWITCH_BYTES; i++)
        if (out[i] == SWITCH_END)
            out[i] = SWITCH_END - 1;
    out[0] = 0xfe;
    out[1] = 0x44;
    out[IMAGENEX_SWITCH_BYTES - 1] = SWITCH_END;
}

bool imagenex_decode_switch(const uint8_t in[IMAGENEX_SWITCH_BYTES], struct imagenex_switch *s)
{
    if (in[0] != 0xfe || in[1] != 0x44 || in[IMAGENEX_SWITCH_BYTES - 1] != SWITCH_END)
        return false;
    *s = (struct imagenex_switch){
        .head = in[AT_HEAD],
        .range_m = in[AT_RANGE],
        .gain_db = in[AT_GAIN],
        .absorption = in[AT_ABSORPTION],
        .train = in[AT_TRAIN],
        .sector = in[AT_SECTOR],
        .step = in[AT_STEP],
        .pulse = in[AT_PULSE],
        .points = in[AT_POINTS],
        .bits = in[AT_BITS],
        .baud_code = in[AT_BAUD],
        .frequency = in[AT_FREQUENCY],
    };
    return true;
}
