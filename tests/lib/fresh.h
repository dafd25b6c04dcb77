/* SPDX-License-Identifier: MIT */
/* fresh - made-up pings that are handed over again, as new ones: noise never repeats (hearing_repeats). */
#ifndef SONARD_TESTS_FRESH_H
#define SONARD_TESTS_FRESH_H

#include "grid/ping.h"

/** fresh_samples - changes the last sample by up to 3 counts, unless it is almost zero or saturated: of three
 * calls no two give the same. */
static inline void fresh_samples(const struct ping *ping)
{
    static unsigned calls;
    const size_t bytes = ping->n_beams * (size_t)ping->n_bins * ping->sample_bytes;
    if (bytes == 0 || ping->sample_bytes > 2)
        return;
    uint8_t *last = (uint8_t *)ping->samples + bytes - ping->sample_bytes; /* its low byte */
    if (*last >= 4 && *last < UINT8_MAX)
        *last = (uint8_t)((*last & ~3U) | calls++ % 3);
}

#endif
