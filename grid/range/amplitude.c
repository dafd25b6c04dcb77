/* SPDX-License-Identifier: MIT */
/*
 * amplitude - counts to power: a table for 8-bit counts; 16-bit counts are worked out, decibels as the product of a
 * high-byte and a low-byte ratio. Knows no detector and no ping.
 */
#include "amplitude.h"

#include <math.h>
#include <string.h>

/*
 * 10^(db/10) to a few units of the last place, db in [-100, AMPLITUDE_MAX_DB + 1]: whole decades and the series of the
 * exponential. Only steps that every machine rounds alike: the last bit of pow() is each library's own.
 */
static double ratio_of(double db)
{
    const double decades = floor(db / 10.0), y = (db - 10.0 * decades) * 0.23025850929940457; /* ln(10) / 10 */
    double ratio = 1.0;
    for (int k = 30; k > 0; k--)
        ratio = 1.0 + ratio * y / k;
    for (int k = 0; k < (int)decades; k++)
        ratio *= 10.0;
    for (int k = 0; k > (int)decades; k--)
        ratio /= 10.0;
    return ratio;
}

uint64_t amplitude_from_db(double db)
{
    return db < -100.0 ? 0 : (uint64_t)(256.0 * ratio_of(db) + 0.5);
}

static uint64_t power_of_byte(enum amplitude_law law, uint64_t v, double db_per_count)
{
    switch (law) {
    case AMPLITUDE_LINEAR:
        return v * v;
    case AMPLITUDE_POWER:
        return v;
    case AMPLITUDE_SQRT:
        return v * v * v * v;
    case AMPLITUDE_LOG:
        return amplitude_from_db((double)v * db_per_count);
    }
    return 0;
}

static uint64_t power_of_word(const struct amplitude *a, uint64_t v)
{
    switch (a->law) {
    case AMPLITUDE_LINEAR:
        return v * v;
    case AMPLITUDE_POWER:
        return v;
    case AMPLITUDE_SQRT: {
        /* v^4 / 2^16 without losing the top bits of v^4 */
        const uint64_t square = v * v;
        return (square >> 16) * square + (((square & 0xffff) * square + 0x8000) >> 16);
    }
    case AMPLITUDE_LOG:
        return (uint64_t)(a->coarse[v >> 8] * a->fine[v & 0xff] + 0.5);
    }
    return 0;
}

bool amplitude_init(struct amplitude *a, enum amplitude_law law, unsigned sample_bytes, double db_per_count)
{
    if (sample_bytes < 1 || sample_bytes > 2 || law < AMPLITUDE_LINEAR || law > AMPLITUDE_LOG)
        return false;
    const uint32_t max_count = sample_bytes == 1 ? 0xff : 0xffff;
    /* A float of the ping: its last bit may carry full scale just past the limit. */
    if (law == AMPLITUDE_LOG && !(db_per_count > 0.0 && db_per_count * max_count <= AMPLITUDE_MAX_DB + 0.01))
        return false;

    memset(a, 0, sizeof *a);
    a->law = law;
    a->sample_bytes = sample_bytes;
    a->max_count = max_count;
    for (uint32_t v = 0; v < 256; v++) {
        if (sample_bytes == 1) {
            a->table[v] = power_of_byte(law, v, db_per_count);
        } else if (law == AMPLITUDE_LOG) {
            a->fine[v] = ratio_of(v * db_per_count);
            a->coarse[v] = 256.0 * ratio_of(v * 256.0 * db_per_count);
        }
    }
    return true;
}

uint64_t amplitude_of_word(const struct amplitude *a, uint32_t count)
{
    return power_of_word(a, count);
}

void amplitude_sums(const struct amplitude *a, const void *samples, uint32_t n, uint64_t *sum)
{
    uint64_t power = 0;
    sum[0] = 0;
    if (a->sample_bytes == 1) {
        const uint8_t *v = samples;
#pragma GCC unroll 8 /* three instructions a bin in place of six */
        for (uint32_t i = 0; i < n; i++)
            sum[i + 1] = power += a->table[v[i]];
    } else {
        const uint16_t *v = samples;
        for (uint32_t i = 0; i < n; i++)
            sum[i + 1] = power += power_of_word(a, v[i]);
    }
}
