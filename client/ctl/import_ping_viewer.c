/* SPDX-License-Identifier: MIT */
/*
 * import_ping_viewer - Ping-Viewer's sensor log, version 1: a Qt data stream (big-endian). Head: the text
 * "PingViewer sensor log file", i32 version, five texts about the build, i32 sensor family and type. Then records
 * until the end: the time as text, u32 length and bytes. A text is a u32 length in bytes and UTF-16; length
 * ffffffff is none. Nothing marks a record: what tells it is a time of day, and that another one follows.
 */
#include "import.h"
#include "import_clock.h"

#include <inttypes.h>
#include <stdarg.h>
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

static const uint8_t *cursor_take(struct cursor *c, size_t n)
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
    const uint8_t *p = cursor_take(c, 4);
    return p ? (uint32_t)p[0] << 24 | (uint32_t)p[1] << 16 | (uint32_t)p[2] << 8 | p[3] : 0;
}

/* A length and as many bytes. */
static struct cursor take_sized(struct cursor *c)
{
    uint32_t n = take_u32(c);
    if (n == NONE)
        n = 0;
    const uint8_t *p = cursor_take(c, n);
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

static bool read_clock(struct cursor stamp, uint64_t *t_ns)
{
    uint32_t text[CLOCK_BYTES / 2];
    const ptrdiff_t n = stamp.end - stamp.p;
    return n % 2 == 0 && n <= CLOCK_BYTES && import_clock(text, decode_utf16(stamp, text, CLOCK_BYTES / 2), t_ns);
}

static uint64_t next_time(struct times *times, struct cursor stamp)
{
    uint64_t t;
    if (!read_clock(stamp, &t)) {
        times->unreadable++;
        return times->last_ns;
    }
    if (times->day_ns + t + HALF_A_DAY_NS < times->last_ns)
        times->day_ns += 2 * HALF_A_DAY_NS;
    if (times->day_ns + t > times->last_ns)
        times->last_ns = times->day_ns + t;
    return times->last_ns;
}

struct record {
    struct cursor stamp, bytes;
    bool timed; /* a time of day and a length are there */
    bool whole; /* so are its bytes */
};

static struct record record_at(const uint8_t *p, const uint8_t *end)
{
    struct cursor c = {p, end, false};
    struct record r = {.stamp = take_sized(&c)};
    uint64_t t;
    r.timed = !c.bad && end - c.p >= 4 && read_clock(r.stamp, &t);
    r.bytes = take_sized(&c);
    r.whole = !c.bad && r.stamp.end - r.stamp.p <= CLOCK_BYTES;
    return r;
}

/* The first record with a time of day that begins at or behind p and is whole; `end`: there is none. */
static const uint8_t *find_record(const uint8_t *p, const uint8_t *end)
{
    for (; p < end; p++) {
        if (*p != 0) /* of a length up to CLOCK_BYTES */
            continue;
        const struct record r = record_at(p, end);
        if (r.timed && r.whole)
            return p;
    }
    return end;
}

/* Does a record begin at p, or the log end? One without a readable time counts when one with a time follows it. */
static bool is_followed(const uint8_t *p, const uint8_t *end)
{
    const struct record r = p < end ? record_at(p, end) : (struct record){0};
    return p == end || r.timed || (r.whole && (r.bytes.end == end || record_at(r.bytes.end, end).timed));
}

/* What is read of a log. */
struct viewer {
    const uint8_t *start, *p, *end;
    bool no_other; /* with a time of day from here on */
    struct times times;
    const struct import_sink *sink;
    struct import_result *out;
};

static __attribute__((format(printf, 2, 3))) void tell(const struct viewer *v, const char *fmt, ...)
{
    char sentence[160];
    va_list ap;
    va_start(ap, fmt);
    vsnprintf(sentence, sizeof sentence, fmt, ap);
    va_end(ap);
    v->sink->problem(v->sink->ctx, sentence);
}

/* No record at v->p of which anything is of use: on to `next`. */
static void leave_out(struct viewer *v, const uint8_t *next)
{
    if (next == v->end)
        tell(v, "offset %td: no whole record; the last %td bytes are left out", v->p - v->start, next - v->p);
    else
        tell(v, "offset %td: no whole record; %td bytes up to the next one are left out", v->p - v->start,
             next - v->p);
    v->out->left_out_bytes += (uint64_t)(next - v->p);
    v->p = next;
}

/*
 * The record at v->p, and v->p behind it. A length that leads to no other record is wrong, or a record behind it is
 * broken: then all bytes up to the next whole record are its own, for frames have checksums. False: left out.
 */
static bool take_record(struct viewer *v, struct record *r)
{
    *r = record_at(v->p, v->end);
    if (!r->whole || (!v->no_other && !is_followed(r->bytes.end, v->end))) {
        const uint8_t *next = find_record(v->p + 1, v->end);
        v->no_other = next == v->end;
        if (r->whole && v->no_other) {
            v->p = r->bytes.end;
            return true;
        }
        if (v->no_other || !(r->whole || r->timed) || next - r->stamp.end < 4) {
            leave_out(v, next);
            return false;
        }
        tell(v, "offset %td: the length of a record leads to no other; its bytes are those up to the next one",
             v->p - v->start);
        r->bytes = (struct cursor){r->stamp.end + 4, next, false};
    }
    v->p = r->bytes.end;
    return true;
}

bool import_ping_viewer(const uint8_t *data, size_t size, const struct import_sink *sink,
                        struct import_result *out)
{
    struct cursor c = {data, data + size, false};
    struct viewer v = {.start = data, .end = data + size, .sink = sink, .out = out};
    struct record r;
    *out = (struct import_result){0};
    if (!skip_head(&c))
        return false;
    for (v.p = c.p; v.p < v.end && !out->stopped;) {
        if (!take_record(&v, &r))
            continue;
        out->stopped =
            !sink->bytes(sink->ctx, next_time(&v.times, r.stamp), r.bytes.p, (size_t)(r.bytes.end - r.bytes.p));
        out->records++;
    }
    if (v.times.unreadable)
        tell(&v, "%" PRIu64 " records without a readable time have that of the one before", v.times.unreadable);
    return true;
}
