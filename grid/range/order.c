/* SPDX-License-Identifier: MIT */
#include "order.h"

/* 0: an echo; 1: no range at all, which is worse than 2: nothing was received. */
static int kind_of(const struct ping_beam *b)
{
    return order_is_range(b) ? 0 : b->range_m != 0.0f ? 1 : 2;
}

/* Of one direction. Of two echoes at the same range the one comes first that may begin nearer. */
static bool echo_before(const struct ping_beam *a, const struct ping_beam *b)
{
    if (kind_of(a) != kind_of(b))
        return kind_of(a) < kind_of(b);
    if (a->range_m != b->range_m)
        return a->range_m < b->range_m;
    return a->range_sd_m != b->range_sd_m ? a->range_sd_m > b->range_sd_m : a->confidence > b->confidence;
}

static bool same_direction(const struct order_entry *a, const struct order_entry *b)
{
    return a->az_rad == b->az_rad && a->beam->el_rad == b->beam->el_rad;
}

static bool before(const struct order_entry *a, const struct order_entry *b)
{
    if (a->beam->el_rad != b->beam->el_rad)
        return a->beam->el_rad < b->beam->el_rad;
    return a->az_rad != b->az_rad ? a->az_rad < b->az_rad : echo_before(a->beam, b->beam);
}

void order_ranges(const struct ping *ping, struct order *out)
{
    const uint16_t n = ping->n_beams < PING_MAX_BEAMS ? ping->n_beams : PING_MAX_BEAMS;
    struct order_entry *entry = out->entry;
    out->n = n;
    for (uint16_t i = 0; i < n; i++)
        entry[i] = (struct order_entry){&ping->beam[i], geo_wrap_pi((double)ping->beam[i].az_rad)};
    const bool falls = n > 1 && before(&entry[n - 1], &entry[0]);
    for (uint16_t i = 0; i < n / 2 && falls; i++) { /* a fan that is mounted upside down costs no more */
        const struct order_entry first = entry[i];
        entry[i] = entry[n - 1 - i];
        entry[n - 1 - i] = first;
    }
    for (uint16_t i = 1; i < n; i++) {
        const struct order_entry now = entry[i];
        uint16_t at = i;
        for (; at > 0 && before(&now, &entry[at - 1]); at--)
            entry[at] = entry[at - 1];
        entry[at] = now;
    }
}

uint16_t order_of_beam(const struct order *order, uint16_t first)
{
    uint16_t n = 1;
    while (first + n < order->n && same_direction(&order->entry[first], &order->entry[first + n]))
        n++;
    return n;
}
