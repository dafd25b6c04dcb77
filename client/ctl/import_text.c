/* SPDX-License-Identifier: MIT */
/*
 * import_text - text dumps of Ping360 device_data messages: a line for every field,
 *
 *   timestamp: '00:00:02.103'            (not in every dump)
 *   ID: 2300 - device_data
 *   Header: ... payload_length: 1214 ... src_device_id: 2 ...
 *     - angle: 150                       (and the other fields)
 *     - data: ['0x4c', '0x98', ...]
 *   Checksum: 17245 ...
 *
 * The frame is built anew; that its checksum is the dumped one shows that nothing was lost.
 */
#include "import.h"
#include "import_clock.h"

#include <ctype.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/devices/ping_frame.h"

#define LINE_MAX_BYTES 256 /* of a line that is looked at; the data line is read in place */
#define SAMPLES_MAX    (PING_PAYLOAD_MAX - 14)
#define TICK_NS        25u

enum field { MODE, GAIN, ANGLE, TRANSMIT_US, SAMPLE_PERIOD, FREQUENCY_KHZ, N_SAMPLES, DATA_LENGTH, N_FIELDS };

static const char *const field_name[N_FIELDS] = {
    [MODE] = "- mode: ",
    [GAIN] = "- gain_setting: ",
    [ANGLE] = "- angle: ",
    [TRANSMIT_US] = "- transmit_duration: ",
    [SAMPLE_PERIOD] = "- sample_period: ",
    [FREQUENCY_KHZ] = "- transmit_frequency: ",
    [N_SAMPLES] = "- number_of_samples: ",
    [DATA_LENGTH] = "- data_length: ",
};

/* The message whose lines are being read. */
struct message {
    bool open;    /* its ID line was met, its checksum not yet */
    unsigned has; /* set of 1 << enum field */
    uint16_t value[N_FIELDS];
    uint8_t src;
    uint8_t data[SAMPLES_MAX];
    size_t n_data;
    bool has_data;
    size_t offset; /* of its ID line */
};

struct dump {
    const uint8_t *start;
    const struct import_sink *sink;
    struct import_result *result;
    struct message message;
    bool has_time;
    uint64_t t_ns;
    uint64_t others; /* messages that are not device_data */
};

/* A decimal number at s, at most `max`. */
static bool number(const char *s, unsigned long max, unsigned long *out)
{
    char *end;
    if (!isdigit((unsigned char)*s))
        return false;
    *out = strtoul(s, &end, 10);
    return *out <= max;
}

static void take_field(struct message *m, const char *line)
{
    for (unsigned f = 0; f < N_FIELDS; f++) {
        size_t n = strlen(field_name[f]);
        unsigned long v;
        if (strncmp(line, field_name[f], n) == 0 && number(line + n, f <= GAIN ? UINT8_MAX : UINT16_MAX, &v)) {
            m->value[f] = (uint16_t)v;
            m->has |= 1u << f;
        }
    }
}

static int hex_digit(uint8_t c)
{
    return isdigit(c) ? c - '0' : isxdigit(c) ? tolower(c) - 'a' + 10 : -1;
}

/* All "0xNN" of the line; more than a frame can hold make the message unusable. */
static void take_data(struct message *m, const uint8_t *p, const uint8_t *end)
{
    m->has_data = true;
    for (m->n_data = 0; end - p >= 4; p++) {
        int high, low;
        if (p[0] != '0' || p[1] != 'x' || (high = hex_digit(p[2])) < 0)
            continue;
        low = hex_digit(p[3]);
        if (m->n_data == SAMPLES_MAX) {
            m->has_data = false;
            return;
        }
        m->data[m->n_data++] = (uint8_t)(low < 0 ? high : high << 4 | low);
    }
}

/* 'hh:mm:ss.zzz', each character perhaps behind a \x00 (UTF-16 that was printed byte by byte). */
static void take_time(struct dump *d, const char *s)
{
    uint32_t text[16];
    size_t n = 0;
    uint64_t t;
    s += strspn(s, " '");
    while (*s && *s != '\'' && n < 16) {
        if (strncmp(s, "\\x00", 4) == 0)
            s += 4;
        else
            text[n++] = (unsigned char)*s++;
    }
    if (import_clock(text, n, &t)) {
        d->has_time = true;
        if (t > d->t_ns)
            d->t_ns = t;
    }
}

static void leave_out(struct dump *d, const uint8_t *end, const char *why)
{
    char sentence[160];
    size_t n = (size_t)(end - d->start) - d->message.offset;
    snprintf(sentence, sizeof sentence, "message at offset %zu is left out (%zu bytes): %s", d->message.offset, n,
             why);
    d->sink->problem(d->sink->ctx, sentence);
    d->result->left_out_bytes += n;
    d->message.open = false;
}

/* The checksum line ends a message: make the frame and hand it on. */
static void finish_message(struct dump *d, const char *checksum, const uint8_t *end)
{
    struct message *m = &d->message;
    uint8_t frame[PING_FRAME_MAX];
    char sentence[160];
    unsigned long want;
    if (m->has != (1u << N_FIELDS) - 1 || !m->has_data) {
        leave_out(d, end, "a field is missing, not a number, or too large");
        return;
    }
    const struct ping360_data data = {
        .set = {.mode = (uint8_t)m->value[MODE],
                .gain = (uint8_t)m->value[GAIN],
                .angle = m->value[ANGLE],
                .transmit_us = m->value[TRANSMIT_US],
                .sample_period = m->value[SAMPLE_PERIOD],
                .frequency_khz = m->value[FREQUENCY_KHZ],
                .n_samples = m->value[N_SAMPLES]},
        .data_length = m->value[DATA_LENGTH],
        .n_data = (uint16_t)m->n_data,
        .data = m->data,
    };
    size_t n = ping360_encode_data(frame, sizeof frame, m->src, &data);
    if (n == 0) {
        leave_out(d, end, "it is longer than a frame can be");
        return;
    }
    if (number(checksum, UINT16_MAX, &want) && want != (unsigned)(frame[n - 2] | frame[n - 1] << 8)) {
        snprintf(sentence, sizeof sentence,
                 "message at offset %zu: the dump does not hold all its bytes, its checksum differs", m->offset);
        d->sink->problem(d->sink->ctx, sentence);
    }
    if (!d->has_time) {
        d->result->times_made_up = true;
        d->t_ns += (uint64_t)m->value[N_SAMPLES] * m->value[SAMPLE_PERIOD] * TICK_NS + IMPORT_PACE_NS;
    }
    m->open = false;
    d->result->stopped = !d->sink->bytes(d->sink->ctx, d->t_ns, frame, n);
    d->result->records++;
}

static const char *behind(const char *line, const char *word)
{
    const char *p = strstr(line, word);
    return p ? p + strlen(word) : NULL;
}

static void take_line(struct dump *d, const uint8_t *p, const uint8_t *end)
{
    char line[LINE_MAX_BYTES];
    struct message *m = &d->message;
    while (p < end && *p == ' ')
        p++;
    size_t n = (size_t)(end - p) < sizeof line - 1 ? (size_t)(end - p) : sizeof line - 1;
    memcpy(line, p, n);
    line[n] = '\0';

    unsigned long v;
    const char *rest;
    if (strncmp(line, "ID: ", 4) == 0) {
        if (m->open)
            leave_out(d, p, "it has no checksum line");
        *m = (struct message){.open = number(line + 4, UINT16_MAX, &v) && v == PING360_DEVICE_DATA,
                              .offset = (size_t)(p - d->start)};
        d->others += !m->open;
    } else if (strncmp(line, "timestamp: ", 11) == 0) {
        take_time(d, line + 11);
    } else if (!m->open) {
        return;
    } else if (strncmp(line, "- data: ", 8) == 0) {
        take_data(m, p + 8, end);
    } else if (strncmp(line, "- ", 2) == 0) {
        take_field(m, line);
    } else if (strncmp(line, "Header:", 7) == 0) {
        if ((rest = behind(line, "src_device_id: ")) != NULL && number(rest, UINT8_MAX, &v))
            m->src = (uint8_t)v;
    } else if (strncmp(line, "Checksum: ", 10) == 0) {
        finish_message(d, line + 10, end);
    }
}

void import_text(const uint8_t *data, size_t size, const struct import_sink *sink, struct import_result *out)
{
    struct dump d = {.start = data, .sink = sink, .result = out};
    const uint8_t *end = data + size;
    *out = (struct import_result){0};
    for (const uint8_t *p = data; p < end && !out->stopped;) {
        const uint8_t *newline = memchr(p, '\n', (size_t)(end - p));
        const uint8_t *line_end = newline ? newline : end;
        take_line(&d, p, line_end);
        p = newline ? newline + 1 : end;
    }
    if (d.message.open)
        leave_out(&d, end, "the file ends within it");
    if (d.others) {
        char sentence[96];
        snprintf(sentence, sizeof sentence, "%" PRIu64 " messages that are not device_data are left out",
                 d.others);
        sink->problem(sink->ctx, sentence);
    }
}
