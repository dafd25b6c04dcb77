/* SPDX-License-Identifier: MIT */
/*
 * import_svlog - Cerulean's .svlog files: frames of the Ping protocol one after the other, the first with a text in
 * JSON about the recording, which holds the date it was started. Time goes on with the Surveyor's points, of either
 * form, which count milliseconds since it was switched on.
 */
#include <string.h>
#include <time.h>

#include "drivers/devices/ping_bytes.h"
#include "drivers/devices/ping_frame.h"
#include "import.h"

#define JSON_WRAPPER 10
#define HOUR_MS      3600000u /* a longer step between two pings is a restart */

bool import_is_svlog(const uint8_t *data, size_t size)
{
    return size >= PING_OVERHEAD && data[0] == 'B' && data[1] == 'R' && data[4] == JSON_WRAPPER && data[5] == 0;
}

/* Text of n bytes "yyyy-mm-ddThh:mm:ss", with a fraction perhaps, as UTC. */
static bool read_stamp(const char *p, size_t n, uint64_t *t_ns)
{
    static const char form[] = "dddd-dd-ddTdd:dd:dd";
    int value[6] = {0};
    uint64_t fraction_ns = 0, unit_ns = 100000000;

    if (n < sizeof form)
        return false;
    for (size_t i = 0, k = 0; form[i]; i++) {
        const bool digit = p[i] >= '0' && p[i] <= '9';

        if (form[i] == 'd' ? !digit : p[i] != form[i])
            return false;
        if (digit)
            value[k] = 10 * value[k] + p[i] - '0';
        else
            k++;
    }
    size_t at = sizeof form - 1;
    if (p[at] == '.')
        for (at++; at < n && p[at] >= '0' && p[at] <= '9'; at++, unit_ns /= 10)
            fraction_ns += unit_ns * (unsigned)(p[at] - '0');
    if (!(at < n && p[at] == 'Z') && !(n - at >= 6 && memcmp(p + at, "+00:00", 6) == 0))
        return false;
    if (value[0] < 1970 || value[0] > 2199 || value[1] < 1 || value[1] > 12 || value[2] < 1 || value[2] > 31 ||
        value[3] > 23 || value[4] > 59 || value[5] > 60)
        return false;
    *t_ns = (uint64_t)timegm(&(struct tm){.tm_year = value[0] - 1900,
                                          .tm_mon = value[1] - 1,
                                          .tm_mday = value[2],
                                          .tm_hour = value[3],
                                          .tm_min = value[4],
                                          .tm_sec = value[5]}) *
                1000000000u +
            fraction_ns;
    return true;
}

bool import_svlog_start(const uint8_t *data, size_t size, uint64_t *t_ns)
{
    static struct ping_parser parser;
    static const char key[] = "\"timestamp\"";
    struct ping_frame frame;

    ping_parser_init(&parser, PING_PAYLOAD_LIMIT);
    if (!import_is_svlog(data, size) || !ping_parser_next(&parser, &data, &size, 0, &frame) ||
        frame.id != JSON_WRAPPER)
        return false;
    const char *end = (const char *)frame.payload + frame.length;
    const char *at = memmem(frame.payload, frame.length, key, sizeof key - 1);
    if (!at)
        return false;
    for (at += sizeof key - 1; at < end && (*at == ' ' || *at == ':' || *at == '"'); at++) {
    }
    return read_stamp(at, (size_t)(end - at), t_ns);
}

static void follow_times(struct svlog_stream *s, const struct ping_frame *f)
{
    if ((f->id != SURVEYOR_ATOF_POINTS && f->id != SURVEYOR_YZ_POINTS) || f->length < 4)
        return;
    uint32_t ms = get_u32(f->payload); /* both forms of points begin with it */
    uint32_t step_ms = ms - s->last_ms;
    if (s->timed && step_ms < HOUR_MS)
        s->t_ns += step_ms * 1000000ull;
    s->timed = true;
    s->last_ms = ms;
}

static void sink_bytes(struct svlog_stream *s, const uint8_t *bytes, size_t n)
{
    s->out->stopped = s->out->stopped || !s->sink->bytes(s->sink->ctx, s->t_ns, bytes, n);
}

static bool hold(struct svlog_stream *s, const uint8_t *bytes, size_t n)
{
    if (n > sizeof s->held - s->n)
        return false;
    memcpy(s->held + s->n, bytes, n);
    s->n += n;
    return true;
}

/* What is held and these bytes, as one record where there is room for that. */
static void hand_on(struct svlog_stream *s, const uint8_t *bytes, size_t n)
{
    const bool apart = n > 0 && (s->n == 0 || !hold(s, bytes, n));
    if (s->n > 0)
        sink_bytes(s, s->held, s->n);
    if (apart)
        sink_bytes(s, bytes, n);
    s->n = 0;
    s->out->records++;
}

void import_svlog_begin(struct svlog_stream *s, const struct import_sink *sink, uint64_t start_ns,
                        struct import_result *out)
{
    *out = (struct import_result){0};
    s->sink = sink;
    s->out = out;
    s->timed = false;
    s->t_ns = start_ns;
    s->n = 0;
    ping_parser_init(&s->parser, PING_PAYLOAD_LIMIT);
}

bool import_svlog_take(struct svlog_stream *s, const uint8_t *bytes, size_t n)
{
    const uint8_t *at = bytes, *begin = bytes, *end = bytes + n;
    struct ping_frame frame;
    while (!s->out->stopped && ping_parser_next(&s->parser, &at, &n, 0, &frame)) {
        follow_times(s, &frame);
        if (at == begin)
            continue; /* it was found in bytes that were handed out with the frame before it */
        hand_on(s, begin, (size_t)(at - begin));
        begin = at;
    }
    if (!s->out->stopped && begin < end && !hold(s, begin, (size_t)(end - begin)))
        hand_on(s, begin, (size_t)(end - begin));
    return !s->out->stopped;
}

void import_svlog_end(struct svlog_stream *s)
{
    if (!s->out->stopped && s->n > 0)
        hand_on(s, NULL, 0);
}

void import_svlog(const uint8_t *data, size_t size, const struct import_sink *sink, struct import_result *out)
{
    static struct svlog_stream stream;
    uint64_t start_ns = 0;
    import_svlog_start(data, size, &start_ns);
    import_svlog_begin(&stream, sink, start_ns, out);
    import_svlog_take(&stream, data, size);
    import_svlog_end(&stream);
}
