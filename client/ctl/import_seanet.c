/* SPDX-License-Identifier: MIT */
/*
 * import_seanet - the bytes of a SeaNet line (Tritech heads): raw, as a serial logger keeps them, or as a relay's log
 * of UDP datagrams, one per line, frames cut anywhere:
 *
 *   2017.11.02 08.58.46.723;10.3.0.40;4002;0F 11 0F ... (date and time; sender; port; bytes in hexadecimal)
 *
 * Other ports of the same log hold other things; the sonar's is the one whose bytes hold the head of a frame.
 */
#include "import.h"
#include "import_clock.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "drivers/devices/seanet_frame.h"

#define LOOKED_AT    16384 /* bytes in which a raw recording must show a frame */
#define DATE_CHARS   11
#define CLOCK_CHARS  12
#define DATAGRAM_MAX 2048
#define SECOND_NS    1000000000u
#define TICK_NS      640u

static int hex_digit(uint8_t c)
{
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
                                  : -1;
}

/* '@', four hexadecimal digits, and the same number in binary. */
static bool is_head(const uint8_t *b)
{
    unsigned length = 0;
    for (int i = 1; i < 5; i++) {
        if (hex_digit(b[i]) < 0)
            return false;
        length = length << 4 | (unsigned)hex_digit(b[i]);
    }
    return b[0] == '@' && length >= SEANET_OVERHEAD - 6 && length == seanet_u16(b + 5);
}

static bool holds_head(const uint8_t *b, size_t n)
{
    for (size_t i = 0; i + 7 <= n; i++)
        if (is_head(b + i))
            return true;
    return false;
}

/* ---- datagrams ---- */

struct datagram {
    uint64_t t_ns; /* since 1970, its date and time taken as UTC */
    const uint8_t *port;
    size_t port_n;
    size_t n;
    uint8_t bytes[DATAGRAM_MAX];
};

/* The field behind the next ';' of (*p, end); its length. */
static const uint8_t *next_field(const uint8_t **p, const uint8_t *end, size_t *n)
{
    const uint8_t *start = memchr(*p, ';', (size_t)(end - *p));
    if (!start)
        return NULL;
    start++;
    const uint8_t *stop = memchr(start, ';', (size_t)(end - start));
    *p = stop ? stop : end;
    *n = (size_t)(*p - start);
    return start;
}

/* Pairs of digits with a space between; false at anything else. */
static bool read_hex(const uint8_t *p, const uint8_t *end, struct datagram *out)
{
    out->n = 0;
    while (end > p && (end[-1] == '\r' || end[-1] == ' '))
        end--;
    for (; end - p >= 2; p += end - p > 2 ? 3 : 2) {
        int high = hex_digit(p[0]), low = hex_digit(p[1]);
        if (high < 0 || low < 0 || (end - p > 2 && p[2] != ' ') || out->n == sizeof(out->bytes))
            return false;
        out->bytes[out->n++] = (uint8_t)(high << 4 | low);
    }
    return p == end;
}

/* "yyyy.mm.dd", from 1970 to 2199, as the midnight that it begins with. */
static bool read_date(const uint8_t *p, uint64_t *out_ns)
{
    int digit[DATE_CHARS - 1];

    for (int i = 0; i < DATE_CHARS - 1; i++) {
        digit[i] = p[i] - '0';
        if (i == 4 || i == 7 ? p[i] != '.' : digit[i] < 0 || digit[i] > 9)
            return false;
    }
    const int year = 1000 * digit[0] + 100 * digit[1] + 10 * digit[2] + digit[3], month = 10 * digit[5] + digit[6],
              day = 10 * digit[8] + digit[9];
    if (year < 1970 || year > 2199 || month < 1 || month > 12 || day < 1 || day > 31)
        return false;
    *out_ns =
        (uint64_t)timegm(&(struct tm){.tm_year = year - 1900, .tm_mon = month - 1, .tm_mday = day}) * SECOND_NS;
    return true;
}

static bool read_line(const uint8_t *p, const uint8_t *end, struct datagram *out)
{
    uint32_t clock[CLOCK_CHARS];
    uint64_t date_ns, clock_ns;
    size_t n;
    if (end - p <= DATE_CHARS + CLOCK_CHARS || p[DATE_CHARS - 1] != ' ' || !read_date(p, &date_ns))
        return false;
    for (int i = 0; i < CLOCK_CHARS; i++)
        clock[i] = p[DATE_CHARS + i];
    const uint8_t *at = p + DATE_CHARS + CLOCK_CHARS;
    if (!import_clock(clock, CLOCK_CHARS, &clock_ns) || *at != ';' || !next_field(&at, end, &n) ||
        !(out->port = next_field(&at, end, &out->port_n)))
        return false;
    out->t_ns = date_ns + clock_ns;
    const uint8_t *hex = next_field(&at, end, &n);
    return hex && read_hex(hex, hex + n, out);
}

static const uint8_t *line_end(const uint8_t *p, const uint8_t *end)
{
    const uint8_t *newline = memchr(p, '\n', (size_t)(end - p));
    return newline ? newline : end;
}

static const uint8_t *behind(const uint8_t *stop, const uint8_t *end)
{
    return stop < end ? stop + 1 : end;
}

bool import_is_seanet_relay(const uint8_t *data, size_t size)
{
    struct datagram d;
    return size > 0 && read_line(data, line_end(data, data + size), &d);
}

bool import_is_seanet(const uint8_t *data, size_t size)
{
    return size > 0 && holds_head(data, size < LOOKED_AT ? size : LOOKED_AT);
}

/* The first datagram with the head of a frame; its port is the sonar's. */
static bool find_port(const uint8_t *data, const uint8_t *end, struct datagram *out)
{
    for (const uint8_t *p = data; p < end; p = behind(line_end(p, end), end))
        if (read_line(p, line_end(p, end), out) && holds_head(out->bytes, out->n))
            return true;
    return false;
}

bool import_seanet_relay(const uint8_t *data, size_t size, const struct import_sink *sink,
                         struct import_result *out)
{
    const uint8_t *end = data + size;
    struct datagram sonar, d;
    uint64_t last_ns = 0, others = 0, unreadable = 0;
    char sentence[160];

    *out = (struct import_result){0};
    if (size == 0 || !find_port(data, end, &sonar))
        return false;
    for (const uint8_t *p = data, *stop; p < end && !out->stopped; p = behind(stop, end)) {
        stop = line_end(p, end);
        if (!read_line(p, stop, &d)) {
            unreadable++;
            out->left_out_bytes += (uint64_t)(behind(stop, end) - p);
            continue;
        }
        if (d.port_n != sonar.port_n || memcmp(d.port, sonar.port, d.port_n) != 0) {
            others++;
            continue;
        }
        last_ns = d.t_ns > last_ns ? d.t_ns : last_ns;
        out->stopped = !sink->bytes(sink->ctx, last_ns, d.bytes, d.n);
        out->records++;
    }
    if (others) {
        snprintf(sentence, sizeof(sentence), "%" PRIu64 " datagrams of other ports are left out", others);
        sink->problem(sink->ctx, sentence);
    }
    if (unreadable) {
        snprintf(sentence, sizeof(sentence), "%" PRIu64 " lines are no datagram and left out", unreadable);
        sink->problem(sink->ctx, sentence);
    }
    return true;
}

/* ---- raw bytes ---- */

uint64_t import_listening_ns(const struct seanet_frame *f)
{
    if (f->id != SEANET_HEAD_DATA || f->packet != 0 || f->length < SEANET_DATA_AT)
        return 0;
    return (uint64_t)seanet_u16(f->payload + 20) * seanet_u16(f->payload + 29) * TICK_NS;
}

static uint64_t pace_ns(const struct seanet_frame *f)
{
    const uint64_t listening_ns = import_listening_ns(f);
    return listening_ns ? listening_ns + IMPORT_PACE_NS : 0;
}

void import_seanet(const uint8_t *data, size_t size, const struct import_sink *sink, struct import_result *out)
{
    static struct seanet_parser parser;
    struct seanet_frame frame;
    const uint8_t *at = data, *done = data;
    size_t left = size;
    uint64_t t_ns = 0;

    *out = (struct import_result){.times_made_up = true};
    seanet_parser_init(&parser);
    while (!out->stopped && seanet_parser_next(&parser, &at, &left, 0, &frame)) {
        /* What the parser still holds behind this frame belongs to the next record. */
        const uint8_t *stop = at - (parser.n - parser.taken);
        t_ns += pace_ns(&frame);
        out->stopped = !sink->bytes(sink->ctx, t_ns, done, (size_t)(stop - done));
        out->records++;
        done = stop;
    }
    if (!out->stopped && done < data + size) {
        out->stopped = !sink->bytes(sink->ctx, t_ns, done, (size_t)(data + size - done));
        out->records++;
    }
}
