/* SPDX-License-Identifier: MIT */
/*
 * order - the order of a ping's beams. A device reports ready ranges in the order in which it found them; the stages
 * behind the extraction look for a beam's neighbours beside it in the list.
 */
#ifndef SONARD_ORDER_H
#define SONARD_ORDER_H

#include "grid/ping.h"

/* Entries of a ping in order. */
struct order {
    uint16_t n;
    struct order_entry {
        const struct ping_beam *beam;
        double az_rad; /* its azimuth from -pi to pi */
    } entry[PING_MAX_BEAMS];
};

/** order_is_range - the entry has an echo. */
static inline bool order_is_range(const struct ping_beam *beam)
{
    return beam->range_m > 0.0f && beam->range_m < 1e5f;
}

/**
 * order_ranges - the entries of a ping with ready ranges (the first PING_MAX_BEAMS): by elevation, then by azimuth from
 * -pi to pi, then by range, those that have none last. The order in the ping does not matter, but for entries that are
 * not numbers. O(n) when they are sorted already, either way; O(n^2) at worst.
 */
void order_ranges(const struct ping *ping, struct order *out);

/** order_of_beam - how many entries from `first` on have its direction (the very same azimuth and elevation). */
uint16_t order_of_beam(const struct order *order, uint16_t first);

#endif
