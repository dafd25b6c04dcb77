/* SPDX-License-Identifier: MIT */
#include "reflection.h"

#include <math.h>
#include <string.h>

/* An echo whose peak is so many times (13 dB) its reference is believed by half. */
#define EVEN 20.0

void detection_add_saturated(const struct profile *p, struct detection *d)
{
    const uint32_t n = p->axis->n;

    for (uint32_t i = profile_next_saturated(p, p->first); i < n; i = profile_next_saturated(p, i + 1))
        d->mask[i] = !profile_blind(p, i);
}

/* The last cell of the group that begins at `begin`. */
static uint32_t group_end(const struct profile *p, const struct detection *d, uint32_t begin)
{
    const struct profile_axis *a = p->axis;
    uint32_t last = begin;

    for (uint32_t i = begin + 1; i < a->n && i - last <= a->guard + 1; i++)
        if (d->mask[i])
            last = i;
    return last;
}

/* Position of the peak in bins (centre of bin 0: 0.5): middle of a flat top, else the top of a parabola. */
static double peak_position(const uint64_t *cell, uint32_t n, uint32_t peak)
{
    uint32_t last = peak;

    while (last + 1 < n && cell[last + 1] == cell[peak])
        last++;
    if (last > peak || peak == 0 || last + 1 == n)
        return ((double)peak + last + 1.0) / 2.0;
    const double left = (double)cell[peak - 1], mid = (double)cell[peak], right = (double)cell[peak + 1];
    const double bend = left - 2.0 * mid + right;
    return peak + 0.5 + (bend < 0.0 ? fmax(-0.5, fmin(0.5, 0.5 * (left - right) / bend)) : 0.0);
}

/* Bins around the peak in which the level is at least half of the peak's. */
static double half_power_width(const uint64_t *cell, uint32_t n, uint32_t peak)
{
    uint32_t begin = peak, end = peak + 1;

    while (begin > 0 && cell[begin - 1] >= cell[peak] / 2)
        begin--;
    while (end < n && cell[end] >= cell[peak] / 2)
        end++;
    return end - begin;
}

/* The first cell that may belong to a reflection which begins at `begin`. */
static uint32_t near_cell(const struct profile *p, uint32_t begin)
{
    while (begin > p->first && profile_blind(p, begin - 1))
        begin--;
    return begin;
}

static void measure(const struct profile *p, const struct detection *d, struct reflection *r)
{
    const struct profile_axis *a = p->axis;
    uint32_t peak = r->begin;
    double strength = 1.0, risen = 0.0, threshold = INFINITY;

    r->contrast = 0.0;
    r->lowest_only = p->clean != NULL;
    for (uint32_t i = r->begin; i <= r->last; i++) {
        if (profile_blind(p, i))
            continue;
        const struct cfar_reference ref = cfar_reference_at(&d->cfar, &d->cells, i - p->first);
        const uint64_t alpha_q16 = ref.one_sided ? d->cfar.alpha_one_q16 : d->cfar.alpha_q16;
        const double ratio = (double)p->cell[i] * ref.cells / fmax((double)ref.sum, 1.0);
        const bool saturated = profile_saturated(p, i);
        r->contrast = fmax(r->contrast, saturated ? INFINITY : ratio);
        strength = fmax(strength, ratio * 65536.0 / (double)alpha_q16);
        risen = fmax(risen, ratio);
        if (ref.cells > 0)
            threshold = fmin(threshold, (double)ref.sum / ref.cells * ((double)alpha_q16 / 65536.0));
        if (saturated || (p->clean && p->clean[i] > p->lowest))
            r->lowest_only = false;
        if (p->cell[i] > p->cell[peak])
            peak = i;
    }
    r->near = near_cell(p, r->begin);
    r->power = (double)p->cell[peak];
    r->threshold = threshold;
    r->echo = (struct echo){
        .range_m = (float)fmax(profile_m(p, peak_position(p->cell, a->n, peak)), profile_m(p, p->first)),
        .near_m = (float)profile_m(p, r->near),
        .sd_m = (float)(half_power_width(p->cell, a->n, peak) * a->dr / sqrt(12.0)),
        .strength = (float)strength,
        .confidence = (float)(risen / (EVEN + risen)),
    };
}

bool reflection_next(const struct profile *p, const struct detection *d, uint32_t from, struct reflection *out)
{
    const uint8_t *at = from < p->axis->n ? memchr(d->mask + from, 1, p->axis->n - from) : NULL;

    if (!at)
        return false;
    const uint32_t begin = (uint32_t)(at - d->mask);
    *out = (struct reflection){.begin = begin, .last = group_end(p, d, begin)};
    measure(p, d, out);
    return true;
}

void reflection_reach_back(const struct profile *p, const struct detection *d, struct reflection *r)
{
    const uint32_t complete = p->first + d->cfar.guard + d->cfar.n_side; /* from here on, with the window before it */
    uint32_t near = r->near;

    for (uint32_t i = near; i-- > p->first && near - i <= p->axis->guard + 1;)
        if (!profile_blind(p, i) && (double)p->cell[i] > r->threshold)
            near = i;
    if (d->cfar.detector == CFAR_SOCA && near >= complete)
        return;
    r->near = near_cell(p, near);
    r->echo.near_m = (float)profile_m(p, r->near);
}
