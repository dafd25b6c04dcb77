/* SPDX-License-Identifier: MIT */
/*
 * import_ping_viewer - Ping-Viewer's sensor log, version 1: a Qt data stream (big-endian). Head: the text
 * "PingViewer sensor log file", i32 version, five texts about the build, i32 sensor family and type. Then records
 * until the end: the time as text, u32 length and bytes. A text is a u32 length in bytes and UTF-16; length
 * ffffffff is none.
 */
#include "import.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#define NONE          UINT32_MAX
#define CLOCK_BYTES   64 /* more than any "hh:mm:ss.zzz" in UTF-16 */
#define BUILD_TEXTS   5
#define HALF_A_DAY_NS 43200000000000u

struct cursor {
    const uint8_t *p, *end;
    bool bad;
};

static const uint8_t *take(struct cursor *c, size_t n)
{
    if (c->bad || (size_t)(c->end - c->p) < n) {
        c->bad = true;
        return NULL;
    }
    const uint8_t *p = c->p;
    c->p += n;
    return p;
}

static uint32_t take_u32(struct cursor *c)
{
    const uint8_t *p = take(c, 4);
    return p ? (uint32_t)p[0] << 24 | (uint32_t)p[1] << 16 | (uint32_t)p[2] << 8 | p[3] : 0;
}

/* A length and as many bytes. */
static struct cursor take_sized(struct cursor *c)
{
    uint32_t n = take_u32(c);
    if (n == NONE)
        n = 0;
    const uint8_t *p = take(c, n);
    return (struct cursor){p, p ? p + n : p, c->bad};
}

static size_t decode_utf16(struct cursor text, uint32_t *out, size_t max)
{
    size_t n = 0;
    while (text.end - text.p >= 2 && n < max) {
        uint32_t unit = (uint32_t)text.p[0] << 8 | text.p[1];
        text.p += 2;
        if (unit >> 10 == 0xdc00 >> 10 && n > 0 && out[n - 1] >> 10 == 0xd800 >> 10)
            out[n - 1] = 0x10000 + ((out[n - 1] & 0x3ff) << 10 | (unit & 0x3ff));
        else
            out[n++] = unit;
    }
    return n;
}

static bool skip_head(struct cursor *c)
{
    take_sized(c); /* the first text, which import_kind has seen */
    uint32_t version = take_u32(c);
    for (int i = 0; i < BUILD_TEXTS; i++)
        take_sized(c);
    take_u32(c);
    take_u32(c);
    return !c->bad && version == 1;
}

/* Time stamps as a clock that neither goes back nor forgets the day. */
struct times {
    uint64_t day_ns, last_ns;
    uint64_t unreadable;
};

static uint64_t next_time(struct times *times, struct cursor stamp)
{
    uint32_t text[CLOCK_BYTES / 2];
    uint64_t t;
    if (!import_clock(text, decode_utf16(stamp, text, CLOCK_BYTES / 2), &t)) {
        times->unreadable++;
        return times->last_ns;
    }
    if (times->day_ns + t + HALF_A_DAY_NS < times->last_ns)
        times->day_ns += 2 * HALF_A_DAY_NS;
    if (times->day_ns + t > times->last_ns)
        times->last_ns = times->day_ns + t;
    return times->last_ns;
}

bool import_ping_viewer(const uint8_t *data, size_t size, const struct import_sink *sink,
                        struct import_result *out)
{
    struct cursor c = {data, data + size, false};
    struct times times = {0};
    char sentence[160];
    *out = (struct import_result){0};
    if (!skip_head(&c))
        return false;
    while (c.p < c.end && !out->stopped) {
        const uint8_t *start = c.p;
        struct cursor stamp = take_sized(&c), bytes = take_sized(&c);
        if (c.bad || stamp.end - stamp.p > CLOCK_BYTES) {
            out->left_out_bytes = (uint64_t)(c.end - start);
            snprintf(sentence, sizeof sentence,
                     "offset %td: no whole record; the last %" PRIu64 " bytes are left out", start - data,
                     out->left_out_bytes);
            sink->problem(sink->ctx, sentence);
            break;
        }
        out->stopped = !sink->bytes(sink->ctx, next_time(&times, stamp), bytes.p, (size_t)(bytes.end - bytes.p));
        out->records++;
    }
    if (times.unreadable) {
        snprintf(sentence, sizeof sentence,
                 "%" PRIu64 " records without a readable time have that of the one before", times.unreadable);
        sink->problem(sink->ctx, sentence);
    }
    return true;
}
