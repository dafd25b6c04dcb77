/* SPDX-License-Identifier: MIT */
/*
 * ping_frame - see ping_frame.h. The parser holds at most one unfinished frame: buf[at] is always a 'B' that may
 * begin one. Whatever turns out not to be a frame is left one byte at a time, so no byte is judged only once.
 */
#include "ping_frame.h"

#include <stdio.h>
#include <string.h>

#include "ping_bytes.h"

#define HEADER_BYTES 8

static uint16_t checksum(const uint8_t *b, size_t n)
{
    unsigned sum = 0;
    for (size_t i = 0; i < n; i++)
        sum += b[i];
    return (uint16_t)sum;
}

void ping_parser_init(struct ping_parser *p, size_t payload_max)
{
    p->payload_max = payload_max < PING_PAYLOAD_LIMIT ? payload_max : PING_PAYLOAD_LIMIT;
    p->at = p->n = p->taken = 0;
    p->sum = 0;
    p->frames = p->garbage_bytes = p->cut_bytes = p->bad_checksum = 0;
}

static void drop_bytes(struct ping_parser *p, size_t count)
{
    p->at += count;
    p->n -= count;
}

static void drop_taken(struct ping_parser *p)
{
    drop_bytes(p, p->taken);
    p->taken = 0;
}

void ping_parser_reset(struct ping_parser *p)
{
    drop_taken(p);
    p->cut_bytes += p->n;
    p->n = 0;
}

/* Can the n >= 1 bytes at b begin a frame? */
static bool may_begin(const struct ping_parser *p, const uint8_t *b, size_t n)
{
    return b[0] == 'B' && (n < 2 || b[1] == 'R') && (n < 4 || get_u16(b + 2) <= p->payload_max);
}

/* Leave `from` bytes and all behind them that cannot begin a frame. */
static void skip_garbage(struct ping_parser *p, size_t from)
{
    size_t i = from;
    while (i < p->n && !may_begin(p, p->buf + p->at + i, p->n - i))
        i++;
    if (i > 0) {
        p->garbage_bytes += i;
        drop_bytes(p, i);
    }
}

void ping_parser_give_up(struct ping_parser *p, uint64_t then_ns)
{
    drop_taken(p);
    if (p->n > 0 && p->t_ns[p->at + p->n - 1] <= then_ns)
        skip_garbage(p, 1);
}

/* The whole frame at buf[at], of `total` bytes: hand it out when its sum is right, else leave its first byte. */
static bool finish_frame(struct ping_parser *p, size_t total, struct ping_frame *out)
{
    const uint8_t *b = p->buf + p->at;
    const uint16_t sum = (uint16_t)(p->sum_before[p->at + total - 2] - p->sum_before[p->at]);
    if (sum != get_u16(b + total - 2)) {
        p->bad_checksum++;
        skip_garbage(p, 1);
        return false;
    }
    p->frames++;
    p->taken = total;
    *out = (struct ping_frame){
        .id = get_u16(b + 4),
        .src = b[6],
        .dst = b[7],
        .length = get_u16(b + 2),
        .payload = b + HEADER_BYTES,
        .t_first_ns = p->t_ns[p->at],
        .t_last_ns = p->t_ns[p->at + total - 1],
    };
    return true;
}

static void move_to_front(struct ping_parser *p)
{
    memmove(p->buf, p->buf + p->at, p->n);
    memmove(p->sum_before, p->sum_before + p->at, p->n * sizeof p->sum_before[0]);
    memmove(p->t_ns, p->t_ns + p->at, p->n * sizeof p->t_ns[0]);
    p->at = 0;
}

/* No more of them than a frame of the largest size has room for. */
static void append(struct ping_parser *p, const uint8_t *bytes, size_t n, uint64_t now_ns)
{
    if (p->n == 0 || n > PING_PARSER_ROOM - p->at - p->n)
        move_to_front(p);
    for (size_t i = 0, to = p->at + p->n; i < n; i++, to++) {
        p->buf[to] = bytes[i];
        p->sum_before[to] = p->sum;
        p->t_ns[to] = now_ns;
        p->sum = (uint16_t)(p->sum + bytes[i]);
    }
    p->n += n;
}

bool ping_parser_next(struct ping_parser *p, const uint8_t **bytes, size_t *n, uint64_t now_ns,
                      struct ping_frame *out)
{
    drop_taken(p);
    skip_garbage(p, 0);
    for (;;) {
        size_t total = p->n < 4 ? 0 : (size_t)PING_OVERHEAD + get_u16(p->buf + p->at + 2);
        if (total > 0 && p->n >= total) {
            if (finish_frame(p, total, out))
                return true;
            continue;
        }
        if (*n == 0)
            return false;
        size_t want = (total > 0 ? total : 4) - p->n;
        size_t take = want < *n ? want : *n;
        append(p, *bytes, take, now_ns);
        *bytes += take;
        *n -= take;
        skip_garbage(p, 0);
    }
}

size_t ping_frame_build(uint8_t *out, size_t size, uint16_t id, uint8_t src, const void *payload, size_t length)
{
    if (length > UINT16_MAX || size < PING_OVERHEAD + length)
        return 0;
    out[0] = 'B';
    out[1] = 'R';
    put_u16(out + 2, (unsigned)length);
    put_u16(out + 4, id);
    out[6] = src;
    out[7] = 0;
    if (length > 0)
        memcpy(out + HEADER_BYTES, payload, length);
    put_u16(out + HEADER_BYTES + length, checksum(out, HEADER_BYTES + length));
    return PING_OVERHEAD + length;
}

size_t ping_frame_bytes(const struct ping_frame *f)
{
    return (size_t)PING_OVERHEAD + f->length;
}

bool ping_count_is_new(struct ping_count *c, uint32_t number, uint64_t *lost)
{
    const uint32_t restart = 1000;
    uint32_t way = number - c->last;
    bool known = c->known;
    *c = (struct ping_count){true, number};
    if (known && lost && way > 1 && way <= restart)
        *lost += way - 1;
    return !known || way != 0;
}

size_t ping_encode_request(uint8_t *out, size_t size, uint16_t id)
{
    uint8_t payload[2];
    put_u16(payload, id);
    return ping_frame_build(out, size, PING_GENERAL_REQUEST, 0, payload, sizeof payload);
}

/* The fields that every message with an angle begins with: 10 bytes. */
static void put_head(uint8_t *b, const struct ping360_settings *set)
{
    b[0] = set->mode;
    b[1] = set->gain;
    put_u16(b + 2, set->angle);
    put_u16(b + 4, set->transmit_us);
    put_u16(b + 6, set->sample_period);
    put_u16(b + 8, set->frequency_khz);
}

static void put_sweep(uint8_t *b, const struct ping360_sweep *sweep)
{
    put_u16(b, sweep->start);
    put_u16(b + 2, sweep->stop);
    b[4] = sweep->step;
    b[5] = sweep->delay_ms;
}

size_t ping360_encode_transducer(uint8_t *out, size_t size, const struct ping360_settings *set, bool transmit)
{
    uint8_t payload[14] = {0};
    put_head(payload, set);
    put_u16(payload + 10, set->n_samples);
    payload[12] = transmit;
    return ping_frame_build(out, size, PING360_TRANSDUCER, 0, payload, sizeof payload);
}

size_t ping360_encode_auto_transmit(uint8_t *out, size_t size, const struct ping360_settings *set,
                                    const struct ping360_sweep *sweep)
{
    uint8_t payload[16] = {set->mode, set->gain};
    put_u16(payload + 2, set->transmit_us);
    put_u16(payload + 4, set->sample_period);
    put_u16(payload + 6, set->frequency_khz);
    put_u16(payload + 8, set->n_samples);
    put_sweep(payload + 10, sweep);
    return ping_frame_build(out, size, PING360_AUTO_TRANSMIT, 0, payload, sizeof payload);
}

size_t ping360_encode_motor_off(uint8_t *out, size_t size)
{
    return ping_frame_build(out, size, PING360_MOTOR_OFF, 0, NULL, 0);
}

size_t ping360_encode_data(uint8_t *out, size_t size, uint8_t src, const struct ping360_data *d)
{
    uint8_t payload[PING_PAYLOAD_MAX];
    size_t at = d->automatic ? 16 : 10;
    if (at + 4 + d->n_data > sizeof payload)
        return 0;
    put_head(payload, &d->set);
    if (d->automatic)
        put_sweep(payload + 10, &d->sweep);
    put_u16(payload + at, d->set.n_samples);
    put_u16(payload + at + 2, d->data_length);
    if (d->n_data > 0)
        memcpy(payload + at + 4, d->data, d->n_data);
    return ping_frame_build(out, size, d->automatic ? PING360_AUTO_DEVICE_DATA : PING360_DEVICE_DATA, src, payload,
                            at + 4 + d->n_data);
}

bool ping_decode_ack(const struct ping_frame *f, uint16_t *acked_id)
{
    if (f->id != PING_ACK || f->length < 2)
        return false;
    *acked_id = get_u16(f->payload);
    return true;
}

bool ping_decode_nack(const struct ping_frame *f, uint16_t *nacked_id, const char **text, size_t *text_n)
{
    if (f->id != PING_NACK || f->length < 2)
        return false;
    *nacked_id = get_u16(f->payload);
    *text = (const char *)f->payload + 2;
    *text_n = (size_t)f->length - 2;
    return true;
}

bool ping_decode_device_information(const struct ping_frame *f, struct ping_device_information *out)
{
    if (f->id != PING_DEVICE_INFORMATION || f->length < 5)
        return false;
    out->type = f->payload[0];
    out->revision = f->payload[1];
    memcpy(out->firmware, f->payload + 2, sizeof out->firmware);
    return true;
}

bool ping_decode_protocol_version(const struct ping_frame *f, uint8_t version[3])
{
    if (f->id != PING_PROTOCOL_VERSION || f->length < 3)
        return false;
    memcpy(version, f->payload, 3);
    return true;
}

bool ping360_decode_data(const struct ping_frame *f, struct ping360_data *out)
{
    bool automatic = f->id == PING360_AUTO_DEVICE_DATA;
    size_t at = automatic ? 16 : 10; /* where number_of_samples stands; the samples begin 4 behind it */
    const uint8_t *b = f->payload;
    if ((!automatic && f->id != PING360_DEVICE_DATA) || f->length < at + 4)
        return false;
    *out = (struct ping360_data){
        .set = {.mode = b[0],
                .gain = b[1],
                .angle = get_u16(b + 2),
                .transmit_us = get_u16(b + 4),
                .sample_period = get_u16(b + 6),
                .frequency_khz = get_u16(b + 8),
                .n_samples = get_u16(b + at)},
        .automatic = automatic,
        .data_length = get_u16(b + at + 2),
        .data = b + at + 4,
    };
    if (automatic)
        out->sweep = (struct ping360_sweep){
            .start = get_u16(b + 10), .stop = get_u16(b + 12), .step = b[14], .delay_ms = b[15]};
    size_t n = f->length - (at + 4);
    if (n > out->data_length)
        n = out->data_length;
    if (n > out->set.n_samples)
        n = out->set.n_samples;
    out->n_data = (uint16_t)n;
    return true;
}

const char *ping_text(char *dst, size_t size, const char *text, size_t n)
{
    size_t used = 0;
    dst[0] = '\0';
    while (n > 0 && (text[n - 1] == '\0' || text[n - 1] == '\r' || text[n - 1] == '\n'))
        n--;
    for (size_t i = 0; i < n && used + 5 <= size; i++) {
        bool plain = text[i] >= ' ' && text[i] <= '~' && text[i] != '\\';
        used += (size_t)snprintf(dst + used, size - used, plain ? "%c" : "\\x%02x", (unsigned char)text[i]);
    }
    return dst;
}
