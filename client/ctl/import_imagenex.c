/* SPDX-License-Identifier: MIT */
/*
 * import_imagenex - the .852 files of Imagenex's own program: blocks of one ping each, 128, 384 or 640 bytes by what
 * the head was asked for. A block: "852", a kind; u16 bytes of the block, u16 bytes of the reply (big-endian); date
 * "dd-Mmm-yyyy" and time "hh:mm:ss" as texts, hundredths ".hh"; settings; from byte 100 on the reply of the head.
 * Some loggers write other things into the time.
 */
#include "import.h"
#include "import_clock.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#define HEADER_BYTES  100
#define AT_DATE       8
#define DATE_CHARS    11
#define AT_TIME       20
#define AT_HUNDREDTHS 29
#define DAY_NS        86400000000000u
#define HALF_A_DAY_NS (DAY_NS / 2)
#define REPLY_LEAST   13 /* one without samples */
#define RANGE_AT      (HEADER_BYTES + 7)
#define PACE_NS       50000000u /* request and 513 bytes at 115200 baud */

static unsigned u16be(const uint8_t *b)
{
    return (unsigned)b[0] << 8 | b[1];
}

/* Bytes of the block and of its reply; false when there is no block of n bytes at b. */
static bool block_at(const uint8_t *b, size_t n, size_t *block, size_t *reply)
{
    if (n < HEADER_BYTES || memcmp(b, "852", 3) != 0)
        return false;
    *block = u16be(b + 4);
    *reply = u16be(b + 6);
    return *block <= n && *reply >= REPLY_LEAST && *reply + HEADER_BYTES <= *block;
}

bool import_is_imagenex(const uint8_t *data, size_t size)
{
    size_t block, reply;
    return block_at(data, size, &block, &reply) && data[HEADER_BYTES] == 'I' && data[HEADER_BYTES + 2] == 'X';
}

/* Time of day of a block; false when something else stands there. */
static bool time_of(const uint8_t *b, uint64_t *t_ns)
{
    uint32_t text[12]; /* "hh:mm:ss.zzz" */
    for (size_t i = 0; i < 8; i++)
        text[i] = b[AT_TIME + i];
    for (size_t i = 0; i < 3; i++)
        text[8 + i] = b[AT_HUNDREDTHS + i];
    text[11] = '0';
    return import_clock(text, 12, t_ns);
}

/* "dd-Mmm-yyyy" of a block, from 1970 to 2199, as its midnight since 1970. */
static bool date_of(const uint8_t *b, uint64_t *t_ns)
{
    static const char months[] = "JanFebMarAprMayJunJulAugSepOctNovDec";
    static const uint8_t place[] = {0, 1, 7, 8, 9, 10};
    const char *text = (const char *)b + AT_DATE;
    int digit[sizeof place], month = 0;

    for (size_t i = 0; i < sizeof place; i++) {
        digit[i] = text[place[i]] - '0';
        if (digit[i] < 0 || digit[i] > 9)
            return false;
    }
    while (month < 12 && memcmp(months + 3 * month, text + 3, 3) != 0)
        month++;
    const int day = 10 * digit[0] + digit[1];
    const int year = 1000 * digit[2] + 100 * digit[3] + 10 * digit[4] + digit[5];
    if (text[2] != '-' || text[6] != '-' || month == 12 || day < 1 || day > 31 || year < 1970 || year > 2199)
        return false;
    *t_ns = (uint64_t)timegm(&(struct tm){.tm_year = year - 1900, .tm_mon = month, .tm_mday = day}) * 1000000000u;
    return true;
}

bool import_imagenex_start(const uint8_t *data, size_t size, uint64_t *t_ns)
{
    uint64_t clock_ns, day_ns;

    if (!import_is_imagenex(data, size) || !date_of(data, &day_ns) || !time_of(data, &clock_ns))
        return false;
    *t_ns = day_ns + clock_ns;
    return true;
}

/* The first whole block from `from` to `to`; `to`: there is none. */
static size_t find_block(const uint8_t *data, size_t size, size_t from, size_t to)
{
    while (from < to && !import_is_imagenex(data + from, size - from))
        from++;
    return from;
}

/* How far the block at `at` goes: as far as it says, unless that leads to no other and past the beginning of one. */
static size_t block_end(const uint8_t *data, size_t size, size_t at, size_t block)
{
    const size_t end = at + block;
    if (end == size || import_is_imagenex(data + end, size - end))
        return end;
    return find_block(data, size, at + 1, end);
}

/* No block at `at`: the offset of the next one, or the end. */
static size_t leave_out(const uint8_t *data, size_t size, size_t at, const struct import_sink *sink,
                        struct import_result *out)
{
    const size_t next = find_block(data, size, at + 1, size);
    char sentence[96];
    snprintf(sentence, sizeof sentence, "no block at offset %zu: %s left out (%zu bytes)", at,
             next == size ? "the rest is" : "all up to the next one is", next - at);
    sink->problem(sink->ctx, sentence);
    out->left_out_bytes += next - at;
    return next;
}

void import_imagenex(const uint8_t *data, size_t size, const struct import_sink *sink, struct import_result *out)
{
    uint64_t t_ns = 0, clock_ns, last_clock_ns = 0;
    bool has_clock = false;
    size_t block, reply;

    import_imagenex_start(data, size, &t_ns);
    *out = (struct import_result){0};
    for (size_t at = 0; at < size;) {
        if (!block_at(data + at, size - at, &block, &reply)) {
            at = leave_out(data, size, at, sink, out);
            continue;
        }
        if (time_of(data + at, &clock_ns)) {
            const uint64_t step_ns = (clock_ns + DAY_NS - last_clock_ns) % DAY_NS;
            if (has_clock && step_ns < HALF_A_DAY_NS) /* else it was set back: time stands */
                t_ns += step_ns;
            has_clock = true;
            last_clock_ns = clock_ns;
        } else {
            out->times_made_up = true;
            t_ns += PACE_NS + data[at + RANGE_AT] * 2000000000ull / 1500u;
        }
        if (!sink->bytes(sink->ctx, t_ns, data + at + HEADER_BYTES, reply)) {
            out->stopped = true;
            return;
        }
        out->records++;
        at = block_end(data, size, at, block);
    }
}
