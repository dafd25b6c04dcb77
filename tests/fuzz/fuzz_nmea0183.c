/* SPDX-License-Identifier: MIT */
/*
 * fuzz_nmea0183 - any bytes, cut anywhere: values are in range, counters add up, and any split gives the same. The
 * first byte chooses the cuts and whether a checksum is required.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/nmea/nmea0183.h"
#include "grid/geometry.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static volatile double sink;

static void must(bool fact)
{
    if (!fact)
        abort();
}

static void check(const struct nmea_value *v)
{
    must(v->has == NMEA_DEPTH || v->has == NMEA_TRUE || v->has == NMEA_MAGNETIC || v->has == NMEA_NO_DEPTH);
    must(strlen(v->name) == 5 && fabs(v->below_m) <= 12000 && fabs(v->depth_m) <= 13000 && v->heading_rad >= 0 &&
         v->heading_rad < GEO_TURN);
    sink = sink + v->depth_m + v->heading_rad;
}

static uint64_t run(struct nmea_parser *p, const uint8_t *data, size_t size, size_t step)
{
    struct nmea_value v;
    uint64_t found = 0;
    for (size_t at = 0; at < size; at += step) {
        const uint8_t *b = data + at;
        size_t n = step < size - at ? step : size - at;
        for (; nmea_parser_next(p, &b, &n, &v); found++)
            check(&v);
        must(n == 0);
    }
    return found;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct nmea_parser whole, cut;
    if (size < 1)
        return 0;
    nmea_parser_init(&whole, data[0] & 1);
    nmea_parser_init(&cut, data[0] & 1);
    must(run(&whole, data + 1, size - 1, size) == run(&cut, data + 1, size - 1, 1 + data[0] / 2));
    const struct nmea_counts *c = &whole.counts;
    must(c->sentences == c->values + c->not_available + c->other + c->bad_sentence);
    must(c->garbage_bytes <= size && c->values == cut.counts.values &&
         c->garbage_bytes == cut.counts.garbage_bytes);
    return 0;
}
