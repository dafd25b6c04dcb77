/* SPDX-License-Identifier: MIT */
#include "profile.h"

#include <math.h>
#include <string.h>

#include "cfar.h"
#include "variants.h"

#define MIN_WINDOW_CELLS 8 /* independent cells on each side: fewer make the threshold a lottery */

static uint32_t bins_for(double metres, double dr)
{
    return (uint32_t)fmin(ceil(metres / dr - 1e-6), PING_MAX_BINS);
}

bool profile_axis_of(struct profile_axis *axis, const struct ping *ping, double window_m, double guard_m,
                     uint32_t max_bins)
{
    const double dr = (double)ping->dr_m, pulse = (double)ping->pulse_m, r0 = (double)ping->r0_m;
    const double deaf_m = (double)ping->deaf_m;
    if (ping->n_bins == 0 || ping->n_bins > max_bins || !(dr >= 1e-6 && dr <= 100.0) ||
        !(pulse >= 0.0 && pulse <= 1e3) || !(deaf_m >= 0.0 && deaf_m <= 1e3) || !(r0 >= 0.0 && r0 <= 1e5))
        return false;
    *axis = (struct profile_axis){.n = ping->n_bins, .r0 = r0, .dr = dr};
    axis->resolution_bins = fmin(fmax(pulse / dr, 1.0), PING_MAX_BINS);
    axis->half = (uint32_t)(axis->resolution_bins / 2.0);

    axis->deaf = bins_for(fmax(fmax(pulse, deaf_m) - r0, 0.0), dr);

    const uint32_t pulse_bins = bins_for(pulse, dr);
    axis->guard = bins_for(guard_m, dr);
    if (axis->guard < pulse_bins)
        axis->guard = pulse_bins;
    const double least = ceil(MIN_WINDOW_CELLS * axis->resolution_bins);
    axis->window = (uint32_t)fmin(fmax(bins_for(window_m, dr), least), PING_MAX_BINS);
    return true;
}

#define BLOCK PROFILE_BLOCK

/* Returns the bits of the cells. */
INLINE uint64_t subtract_block(const uint64_t *restrict hi, const uint64_t *restrict lo, unsigned shift,
                               uint64_t *restrict cell)
{
    uint64_t bits = 0;
#pragma GCC unroll 8
    for (int j = 0; j < BLOCK; j++) {
        cell[j] = (hi[j] - lo[j]) >> shift;
        bits |= cell[j];
    }
    return bits;
}

/*
 * Power of the resolution cell around every bin, cut at the ends of the beam and divided by 2^shift; sum[i] is the
 * power of the first i bins.
 */
INLINE void fill_cells_body(const uint64_t *sum, const struct profile *p)
{
    const uint32_t n = p->axis->n, half = p->axis->half;
    for (uint32_t i = 0; i < n; i += BLOCK) {
        uint64_t *bits = &p->bits[i / BLOCK];
        if (i >= half && i + BLOCK + half <= n) {
            *bits = subtract_block(sum + i + half + 1, sum + i - half, p->shift, p->cell + i);
            continue;
        }
        uint64_t any = 0;
        for (uint32_t k = i; k < n && k < i + BLOCK; k++)
            any |= p->cell[k] = (sum[k + half < n ? k + half + 1 : n] - sum[k > half ? k - half : 0]) >> p->shift;
        *bits = any;
    }
}

VARIANTS(static, void, fill_cells, (const uint64_t *sum, const struct profile *p), (sum, p))

void profile_sum(struct profile *p, const struct amplitude *law, const void *counts, uint32_t floor_counts,
                 uint64_t *work)
{
    const struct profile_axis *a = p->axis;
    const uint64_t bins = 2 * (uint64_t)a->half + 1;
    unsigned shift = 0;
    amplitude_sums(law, counts, a->n, work);
    while (work[a->n] >> shift > CFAR_MAX_SUM / bins)
        shift++;
    p->sum = work;
    p->shift = shift;
    p->floor_power = bins * amplitude_of(law, floor_counts) >> shift;
    p->full_power = amplitude_of(law, law->max_count) >> shift;
    fill_cells(work, p);
}

uint32_t profile_next_saturated(const struct profile *p, uint32_t from)
{
    const uint32_t n = p->axis->n;
    uint32_t i = from;
    if (p->amplitude->sample_bytes == 1 && from < n) {
        const uint8_t *counts = p->samples, *at = memchr(counts + from, 0xff, n - from);
        return at ? (uint32_t)(at - counts) : n;
    }
    while (i < n && !profile_saturated(p, i))
        i++;
    return i;
}

uint32_t profile_next_above(const struct profile *p, uint32_t from, uint32_t end, uint64_t power)
{
    uint32_t i = from;
    if (i < end && p->cell[i] > power)
        return i;
    while (i < end) {
        const uint32_t next = (i / BLOCK + 1) * BLOCK, stop = next < end ? next : end;
        if (p->bits[i / BLOCK] > power)
            while (i < stop && p->cell[i] <= power)
                i++;
        else
            i = stop;
        if (i < stop)
            return i;
    }
    return end;
}
