/* SPDX-License-Identifier: MIT */
/*
 * mcap_format - what the MCAP writer and reader share: the format's constants, and laying bytes out and taking
 * them apart, little-endian. Nobody else includes this. Source: the MCAP specification, mcap.dev/spec.
 */
#ifndef SONARD_MCAP_FORMAT_H
#define SONARD_MCAP_FORMAT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define MCAP_RECORD_HEAD  9u                       /* opcode u8, length of the content u64 */
#define MCAP_MESSAGE_HEAD (MCAP_RECORD_HEAD + 22u) /* a message record up to its data */
#define MCAP_FOOTER_BYTES (MCAP_RECORD_HEAD + 20u)

static const uint8_t mcap_magic[8] = {0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};

enum mcap_opcode {
    MCAP_OP_HEADER = 0x01,
    MCAP_OP_FOOTER = 0x02,
    MCAP_OP_SCHEMA = 0x03,
    MCAP_OP_CHANNEL = 0x04,
    MCAP_OP_MESSAGE = 0x05,
    MCAP_OP_CHUNK = 0x06,
    MCAP_OP_MESSAGE_INDEX = 0x07,
    MCAP_OP_CHUNK_INDEX = 0x08,
    MCAP_OP_ATTACHMENT = 0x09,
    MCAP_OP_ATTACHMENT_INDEX = 0x0a,
    MCAP_OP_STATISTICS = 0x0b,
    MCAP_OP_METADATA = 0x0c,
    MCAP_OP_METADATA_INDEX = 0x0d,
    MCAP_OP_SUMMARY_OFFSET = 0x0e,
    MCAP_OP_DATA_END = 0x0f,
};

/* Bytes under construction. Room is the caller's care: every buffer is made for the worst case before. */
struct mcap_bytes {
    uint8_t *p;
    size_t n, cap;
};

static inline void mcap_put(struct mcap_bytes *b, const void *p, size_t n)
{
    if (n)
        memcpy(b->p + b->n, p, n);
    b->n += n;
}

static inline void mcap_put_int(struct mcap_bytes *b, uint64_t v, unsigned size)
{
    for (unsigned i = 0; i < size; i++)
        b->p[b->n++] = (uint8_t)(v >> 8 * i);
}

static inline void mcap_put_string(struct mcap_bytes *b, const char *s)
{
    size_t n = strlen(s);
    mcap_put_int(b, n, 4);
    mcap_put(b, s, n);
}

/* A record whose content is appended until mcap_end. */
static inline size_t mcap_begin(struct mcap_bytes *b, enum mcap_opcode opcode)
{
    size_t at = b->n;
    mcap_put_int(b, opcode, 1);
    mcap_put_int(b, 0, 8);
    return at;
}

static inline void mcap_end(struct mcap_bytes *b, size_t at)
{
    struct mcap_bytes length = {b->p, at + 1, b->cap};
    mcap_put_int(&length, b->n - at - MCAP_RECORD_HEAD, 8);
}

/* Bytes being read; `bad` once more was asked for than there is: everything is then zero or NULL. */
struct mcap_cursor {
    const uint8_t *p, *end;
    bool bad;
};

static inline const uint8_t *mcap_take(struct mcap_cursor *c, uint64_t n)
{
    if (c->bad || (uint64_t)(c->end - c->p) < n) {
        c->bad = true;
        return NULL;
    }
    const uint8_t *p = c->p;
    c->p += n;
    return p;
}

static inline uint64_t mcap_take_int(struct mcap_cursor *c, unsigned size)
{
    const uint8_t *p = mcap_take(c, size);
    uint64_t v = 0;
    for (unsigned i = 0; p && i < size; i++)
        v |= (uint64_t)p[i] << 8 * i;
    return v;
}

/* Something with a u32 byte length before it: a string, a map. */
static inline struct mcap_cursor mcap_take_sized(struct mcap_cursor *c)
{
    uint64_t n = mcap_take_int(c, 4);
    const uint8_t *p = mcap_take(c, n);
    return (struct mcap_cursor){p, p ? p + n : p, c->bad};
}

struct mcap_record {
    uint8_t opcode;
    struct mcap_cursor content;
    size_t size; /* with opcode and length */
};

/* Is there a whole record in the n bytes at p, which begins with the bytes of `head`? p itself is not read. */
static inline bool mcap_record_head(const uint8_t head[MCAP_RECORD_HEAD], const uint8_t *p, size_t n,
                                    struct mcap_record *out)
{
    struct mcap_cursor c = {head, head + MCAP_RECORD_HEAD, false};
    out->opcode = (uint8_t)mcap_take_int(&c, 1);
    uint64_t length = mcap_take_int(&c, 8);
    if (n < MCAP_RECORD_HEAD || length > n - MCAP_RECORD_HEAD || out->opcode == 0)
        return false;
    out->content = (struct mcap_cursor){p + MCAP_RECORD_HEAD, p + MCAP_RECORD_HEAD + length, false};
    out->size = MCAP_RECORD_HEAD + (size_t)length;
    return true;
}

/* Is there a whole record at p? */
static inline bool mcap_record_at(const uint8_t *p, size_t n, struct mcap_record *out)
{
    return n >= MCAP_RECORD_HEAD && mcap_record_head(p, p, n, out);
}

#endif
