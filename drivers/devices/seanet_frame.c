/* SPDX-License-Identifier: MIT */
/*
 * seanet_frame - see seanet_frame.h. The parser holds at most one unfinished frame: buf[0] is always an '@' that may
 * begin one. Whatever turns out not to be a frame is left one byte at a time, so no byte is judged only once.
 */
#include "seanet_frame.h"

#include <string.h>

#define LENGTH_AT   5 /* of the binary length; the ASCII one stands before it */
#define SENDER_AT   7
#define RECEIVER_AT 8
#define COUNT_AT    9
#define ID_AT       10
#define PACKET_AT   11
#define NODE_AT     12
#define OUTSIDE     6 /* bytes of a frame that its length does not count */
#define LF          0x0a

/* Bytes of the whole frame by message; what is not listed may have any. */
static const struct limits {
    uint8_t id;
    uint16_t least, most;
} limits[] = {
    {SEANET_VERSION_DATA, 25, 25},
    {SEANET_HEAD_DATA, SEANET_OVERHEAD, SEANET_OVERHEAD + SEANET_DATA_AT + SEANET_DATA_MAX},
    {SEANET_ALIVE, 22, 22},
    {SEANET_USER_DATA, 175, 264},
};

static bool within_limits(uint8_t id, size_t total)
{
    for (size_t i = 0; i < sizeof limits / sizeof limits[0]; i++)
        if (limits[i].id == id)
            return total >= limits[i].least && total <= limits[i].most;
    return true;
}

void seanet_parser_init(struct seanet_parser *p)
{
    memset(p, 0, sizeof *p);
}

static void drop_bytes(struct seanet_parser *p, size_t count)
{
    p->n -= count;
    memmove(p->buf, p->buf + count, p->n);
    memmove(p->t_ns, p->t_ns + count, p->n * sizeof p->t_ns[0]);
}

static void drop_taken(struct seanet_parser *p)
{
    drop_bytes(p, p->taken);
    p->taken = 0;
}

void seanet_parser_reset(struct seanet_parser *p)
{
    drop_taken(p);
    p->cut_bytes += p->n;
    p->n = 0;
}

static int hex_digit(uint8_t c)
{
    return c >= '0' && c <= '9' ? c - '0' : c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

/* Can the n >= 1 bytes at b begin a frame? Asks as much of its head as is there. */
static bool may_begin(const uint8_t *b, size_t n)
{
    unsigned length = 0;
    if (b[0] != '@')
        return false;
    for (size_t i = 1; i < LENGTH_AT && i < n; i++) {
        int digit = hex_digit(b[i]);
        if (digit < 0)
            return false;
        length = length << 4 | (unsigned)digit;
    }
    if (n < SENDER_AT)
        return true;
    size_t total = (size_t)length + OUTSIDE;
    if (length != seanet_u16(b + LENGTH_AT) || total < SEANET_OVERHEAD || total > SEANET_FRAME_MAX)
        return false;
    if (n < SEANET_PAYLOAD_AT)
        return true;
    /* A reply names its sender again; commands do not agree on what stands there. */
    return b[SENDER_AT] != b[RECEIVER_AT] && (b[SENDER_AT] == SEANET_HOST || b[NODE_AT] == b[SENDER_AT]) &&
           within_limits(b[ID_AT], total);
}

/* Leave `from` bytes and all behind them that cannot begin a frame. */
static void skip_garbage(struct seanet_parser *p, size_t from)
{
    size_t i = from;
    while (i < p->n && !may_begin(p->buf + i, p->n - i))
        i++;
    if (i > 0) {
        p->garbage_bytes += i;
        drop_bytes(p, i);
    }
}

static void leave_broken(struct seanet_parser *p)
{
    p->broken++;
    skip_garbage(p, 1);
}

void seanet_parser_give_up(struct seanet_parser *p, uint64_t then_ns)
{
    drop_taken(p);
    if (p->n > 0 && p->t_ns[p->n - 1] <= then_ns)
        p->n >= SEANET_PAYLOAD_AT ? leave_broken(p) : skip_garbage(p, 1);
}

/* Does the echo of a mtHeadData fill its frame? The first of several packets holds a part of it. */
static bool data_fits(const uint8_t *b, size_t total)
{
    size_t payload = total - SEANET_OVERHEAD;
    if (b[ID_AT] != SEANET_HEAD_DATA || (b[PACKET_AT] & ~SEANET_LAST_PACKET) != 0)
        return true;
    if (payload < SEANET_DATA_AT)
        return false;
    size_t whole = SEANET_DATA_AT + (size_t)seanet_u16(b + SEANET_PAYLOAD_AT + SEANET_DATA_AT - 2);
    return b[PACKET_AT] & SEANET_LAST_PACKET ? payload == whole : payload < whole;
}

/* Is there a whole head of another frame inside? Chance makes none in a million years of echoes. */
static bool holds_head(const uint8_t *b, size_t n)
{
    const uint8_t *end = b + n, *at = b + SEANET_PAYLOAD_AT;
    while ((at = memchr(at, '@', (size_t)(end - at))) != NULL) {
        if (end - at >= SEANET_PAYLOAD_AT && may_begin(at, (size_t)(end - at)))
            return true;
        at++;
    }
    return false;
}

/* The whole frame at buf[0], of `total` bytes: hand it out when it is good, else leave its first byte. */
static bool finish_frame(struct seanet_parser *p, size_t total, struct seanet_frame *out)
{
    const uint8_t *b = p->buf;
    if (b[total - 1] != LF || !data_fits(b, total) || holds_head(b, total)) {
        leave_broken(p);
        return false;
    }
    p->frames++;
    p->taken = total;
    *out = (struct seanet_frame){
        .sender = b[SENDER_AT],
        .receiver = b[RECEIVER_AT],
        .node = b[NODE_AT],
        .id = b[ID_AT],
        .packet = b[PACKET_AT] & (uint8_t)~SEANET_LAST_PACKET,
        .last = b[PACKET_AT] & SEANET_LAST_PACKET,
        .length = (uint16_t)(total - SEANET_OVERHEAD),
        .payload = b + SEANET_PAYLOAD_AT,
        .t_first_ns = p->t_ns[0],
        .t_last_ns = p->t_ns[total - 1],
    };
    return true;
}

bool seanet_parser_next(struct seanet_parser *p, const uint8_t **bytes, size_t *n, uint64_t now_ns,
                        struct seanet_frame *out)
{
    drop_taken(p);
    skip_garbage(p, 0);
    for (;;) {
        size_t total = p->n < SEANET_PAYLOAD_AT ? 0 : (size_t)seanet_u16(p->buf + LENGTH_AT) + OUTSIDE;
        if (total > 0 && p->n >= total) {
            if (finish_frame(p, total, out))
                return true;
            continue;
        }
        if (*n == 0)
            return false;
        size_t want = (total > 0 ? total : SEANET_PAYLOAD_AT) - p->n;
        size_t take = want < *n ? want : *n;
        memcpy(p->buf + p->n, *bytes, take);
        for (size_t i = 0; i < take; i++)
            p->t_ns[p->n + i] = now_ns;
        p->n += take;
        *bytes += take;
        *n -= take;
        skip_garbage(p, 0);
    }
}

size_t seanet_build(uint8_t *out, size_t size, struct seanet_head head, const void *payload, size_t length)
{
    static const char hex[] = "0123456789ABCDEF";
    size_t total = SEANET_OVERHEAD + length;
    if (length > SEANET_FRAME_MAX - SEANET_OVERHEAD || size < total)
        return 0;
    unsigned counted = (unsigned)(total - OUTSIDE);
    out[0] = '@';
    for (int i = 0; i < 4; i++)
        out[1 + i] = (uint8_t)hex[counted >> (12 - 4 * i) & 15];
    seanet_put_u16(out + LENGTH_AT, counted);
    out[SENDER_AT] = head.sender;
    out[RECEIVER_AT] = head.receiver;
    out[COUNT_AT] = (uint8_t)(counted > UINT8_MAX ? 0 : counted - LENGTH_AT);
    out[ID_AT] = head.id;
    out[PACKET_AT] = head.packet;
    out[NODE_AT] = head.sender == SEANET_HOST ? head.receiver : head.sender;
    if (length > 0)
        memcpy(out + SEANET_PAYLOAD_AT, payload, length);
    out[total - 1] = LF;
    return total;
}
