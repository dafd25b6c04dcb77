/* SPDX-License-Identifier: MIT */
#include "ring_down.h"

#include <math.h>

#define SETTLE_BINS 3
#define ALIKE       2 /* a cell at most so many times (3 dB) the quietest is no louder than its speckle makes it */

/*
 * Downhill from a cell: to the first length that is not louder than the next one, or not louder than the floor; and
 * on to the quietest cell of the two, since the next one may have been lifted by a wall; and back over the cells before
 * it that are as quiet, or the water that an echo's contrast is measured against would be lost.
 */
static uint32_t level_settles(const struct profile *p, uint32_t from, uint32_t length)
{
    const uint64_t *cell = p->cell;
    const uint32_t n = p->axis->n;
    uint64_t here = 0, next = 0;
    if (n < 2 * length || from > n - 2 * length)
        return from;
    for (uint32_t k = 0; k < length; k++) {
        here += cell[from + k];
        next += cell[from + length + k];
    }
    uint32_t at = from;
    for (; at + 2 * length < n && next < here && here > p->floor_power * length; at++) {
        here += cell[at + length] - cell[at];
        next += cell[at + 2 * length] - cell[at + length];
    }
    uint32_t quietest = at;
    for (uint32_t i = at + 1; i < at + 2 * length; i++)
        if (cell[i] < cell[quietest])
            quietest = i;
    const uint64_t quiet = cell[quietest] > p->floor_power ? cell[quietest] : p->floor_power;
    while (quietest > from && cell[quietest - 1] <= ALIKE * quiet)
        quietest--;
    return quietest;
}

static uint32_t past_saturation(const struct profile *p, uint32_t at)
{
    while (at < p->axis->n && profile_saturated(p, at))
        at++;
    return at;
}

/*
 * On some heads the ringing drives the receiver to a limit below full scale: the same again and again, but not all
 * along the beam (whose last cells are cut), and nothing in it is louder.
 */
static uint32_t past_limit(const struct profile *p, uint32_t from)
{
    const uint32_t n = p->axis->n;
    uint32_t at = from;
    while (at + 1 < n && p->cell[at] > p->floor_power && p->cell[at + 1] == p->cell[at])
        at++;
    if (at == from || profile_next_above(p, at + 1, n, p->cell[at]) < n)
        return from;
    return at + p->axis->half + 1 < n ? at : from;
}

uint32_t ring_down_found(const struct profile *p)
{
    const uint32_t n = p->axis->n, length = p->axis->guard > SETTLE_BINS ? p->axis->guard : SETTLE_BINS;
    uint32_t at = 0;
    for (uint32_t i = 1; i < n && i < 3 * length; i++)
        if (p->cell[i] > p->cell[at])
            at = i;
    return level_settles(p, past_saturation(p, past_limit(p, at)), length);
}

uint32_t ring_down_at(const struct profile *p, double end_m)
{
    const double bins = ceil(fmax(end_m - p->axis->r0, 0.0) / p->axis->dr - 1e-6);
    return past_saturation(p, (uint32_t)fmin(bins, PING_MAX_BINS)) + p->axis->half;
}
