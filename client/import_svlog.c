/* SPDX-License-Identifier: MIT */
/*
 * import_svlog - Cerulean's .svlog files: frames of the Ping protocol one after the other, the first with a text in
 * JSON about the recording. Time is that of the Surveyor's pings, milliseconds since it was switched on.
 */
#include <string.h>

#include "../drivers/ping_frame.h"
#include "import.h"

#define JSON_WRAPPER 10
#define HOUR_MS      3600000u /* a longer step between two pings is a restart */

bool import_is_svlog(const uint8_t *data, size_t size)
{
    return size >= PING_OVERHEAD && data[0] == 'B' && data[1] == 'R' && data[4] == JSON_WRAPPER && data[5] == 0;
}

struct times {
    bool known;
    uint32_t last_ms;
    uint64_t t_ns;
};

static void follow(struct times *times, const struct ping_frame *f)
{
    if (f->id != SURVEYOR_ATOF_POINTS || f->length < 4)
        return;
    uint32_t ms = f->payload[0] | (uint32_t)f->payload[1] << 8 | (uint32_t)f->payload[2] << 16 |
                  (uint32_t)f->payload[3] << 24;
    uint32_t step_ms = ms - times->last_ms;
    if (times->known && step_ms < HOUR_MS)
        times->t_ns += step_ms * 1000000ull;
    times->known = true;
    times->last_ms = ms;
}

void import_svlog(const uint8_t *data, size_t size, const struct import_sink *sink, struct import_result *out)
{
    static struct ping_parser parser;
    struct times times = {0};
    struct ping_frame frame;
    const uint8_t *at = data, *begin = data;
    size_t left = size;

    *out = (struct import_result){0};
    ping_parser_init(&parser, PING_PAYLOAD_LIMIT);
    while (!out->stopped && ping_parser_next(&parser, &at, &left, 0, &frame)) {
        follow(&times, &frame);
        if (at == begin)
            continue; /* it was found in bytes that were handed out with the frame before it */
        out->stopped = !sink->bytes(sink->ctx, times.t_ns, begin, (size_t)(at - begin));
        out->records++;
        begin = at;
    }
    if (!out->stopped && begin < data + size) {
        out->stopped = !sink->bytes(sink->ctx, times.t_ns, begin, (size_t)(data + size - begin));
        out->records++;
    }
}
