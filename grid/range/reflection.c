/* SPDX-License-Identifier: MIT */
#include "reflection.h"

#include <math.h>
#include <string.h>

/* An echo whose peak is so many times (13 dB) its reference is believed by half. */
#define EVEN 20.0

/* An echo is so many times its baseline at least. */
#define OVER_BASELINE 4.0

/*
 * Nothing can exceed a threshold above full scale, so a saturated bin is an echo whatever the detector says. But where
 * what is usual hides the target, noise or reverberation may saturate the receiver with its peaks: there it must stand
 * out of that like any echo, and for a whole pulse. What does not may still be an echo to the detector.
 */
static bool saturated_by_echo(const struct profile *p, const struct detection *d, uint32_t i)
{
    const uint32_t half = p->axis->half, n = p->axis->n;
    if (!profile_saturated(p, i))
        return false;
    if (!d->baseline || d->baseline->level[i] < d->loud)
        return true;
    if ((double)p->cell[i] < OVER_BASELINE * baseline_usual(d->baseline, p, i))
        return false;
    for (uint32_t k = i > half ? i - half : 0; k < n && k <= i + half; k++)
        if (!profile_saturated(p, k))
            return false;
    return true;
}

void detection_add_saturated(const struct profile *p, struct detection *d)
{
    const uint32_t n = p->axis->n;
    for (uint32_t i = profile_next_saturated(p, p->first); i < n; i = profile_next_saturated(p, i + 1))
        d->mask[i] |= !profile_blind(p, i) && saturated_by_echo(p, d, i);
}

/* A cell's power over the baseline there, or over the floor; 0: the baseline is not known, or the cell not loud. */
static double over_baseline(const struct profile *p, const struct detection *d, uint32_t i)
{
    const double unit = (double)(UINT64_C(1) << p->shift);
    if (!d->baseline || d->raised || (double)p->cell[i] * unit < d->loud)
        return 0.0;
    return (double)p->cell[i] / baseline_usual(d->baseline, p, i);
}

/* More than half of the cells begin .. end - 1 are `ratio` times the baseline; one of each resolution cell tells it. */
static bool mostly_raised(const struct profile *p, const struct detection *d, uint32_t begin, uint32_t end,
                          double ratio)
{
    const uint32_t step = 2 * p->axis->half + 1;
    uint32_t cells = 0, raised = 0;
    for (uint32_t i = begin; i < end; i += step, cells++)
        raised += (double)p->cell[i] >= ratio * baseline_usual(d->baseline, p, i);
    return 2 * raised > cells;
}

/*
 * The noise of this beam is raised, which is no echo: more than half of it stands out; or what stands out first, from
 * the first loud cell on, has unusually loud water before it as well as behind it, which no reflector has. quiet:
 * power of the loudest quiet cell.
 */
static bool is_raised(const struct profile *p, const struct detection *d, uint32_t loud, uint64_t quiet,
                      double ratio)
{
    const uint32_t n = p->axis->n;
    uint32_t i = loud;
    while (i < n && over_baseline(p, d, i) < ratio)
        i = profile_next_above(p, i + 1, n, quiet);
    return i < n && (mostly_raised(p, d, p->first, n, ratio) || (mostly_raised(p, d, p->first, i, OVER_BASELINE) &&
                                                                 mostly_raised(p, d, i, n, OVER_BASELINE)));
}

/* What stands out for the detector, but not of a baseline that would not hide the target. */
static void drop_usual(const struct profile *p, struct detection *d)
{
    const double unit = (double)(UINT64_C(1) << p->shift);
    const uint32_t n = p->axis->n;
    for (uint32_t i = p->first; i < n; i++) {
        const uint8_t *at = memchr(d->mask + i, 1, n - i);
        if (!at)
            return;
        i = (uint32_t)(at - d->mask);
        if ((d->raised || d->baseline->level[i] < d->loud) &&
            (double)p->cell[i] * unit < OVER_BASELINE * d->baseline->level[i])
            d->mask[i] = 0;
    }
}

void detection_add_loud(const struct profile *p, struct detection *d, double ratio)
{
    const uint64_t quiet = profile_below(p, d->loud);
    const uint32_t n = p->axis->n;
    if (!d->baseline)
        return;
    const uint32_t loud = profile_next_above(p, p->first, n, quiet);
    d->raised = is_raised(p, d, loud, quiet, ratio);
    drop_usual(p, d);
    for (uint32_t i = loud; !d->raised && i < n; i = profile_next_above(p, i + 1, n, quiet))
        if (over_baseline(p, d, i) >= ratio)
            d->mask[i] = !profile_blind(p, i);
}

/*
 * An echo needs water before it of so many resolution cells. From three on the factor for so few cells (14.3 dB at the
 * default false alarm) is hardly more than the contrast that an echo needs anyway. Fewer do not show whether they are
 * quiet water or a dip that the search for the ring-down's end has picked out: enough to doubt what is behind, not
 * enough to block.
 */
#define LEAD_LEAST 3.0

/* Cells between the water before a cell and the cell itself: the pulse's. */
static uint32_t lead_gap(const struct profile *p)
{
    return 2 * p->axis->half + 1;
}

/* Cells from here on have the detector's window before them, or something masked. */
static uint32_t lead_end(const struct profile *p, const struct detection *d)
{
    const uint32_t complete = p->first + d->cfar.guard + d->cfar.n_side;
    const uint32_t end = complete < p->axis->n ? complete : p->axis->n;
    const uint8_t *masked = p->blind ? memchr(p->blind + p->first, 1, end - p->first) : NULL;
    return masked ? (uint32_t)(masked - p->blind) : end;
}

/*
 * What a complete window would show of the water next to the ring-down, of which `cells` cells sum up to
 * `sum`: a mean of few needs a greater factor, so it is raised by the ratio of the factors; and the floor is
 * there at least.
 */
static inline double lead_level(const struct profile *p, const struct detection *d, uint32_t cells, uint64_t sum)
{
    const double whole = cells / p->axis->resolution_bins;
    const uint32_t independent = whole < d->factors ? (uint32_t)whole : d->factors;
    if (independent == 0)
        return INFINITY;
    const double raised = (double)d->one_q16[independent - 1] / (double)d->cfar.alpha_one_q16;
    const double level = (double)sum / cells * raised, floor = profile_floor(p);
    return level > floor ? level : floor;
}

uint32_t detection_add_edges(const struct profile *p, struct detection *d, double ratio)
{
    const uint32_t begin = p->first + lead_gap(p), end = lead_end(p, d);
    const double alpha = (double)d->cfar.alpha_one_q16 / 65536.0;
    uint32_t doubtful = p->axis->n;
    uint64_t sum = 0;
    for (uint32_t i = begin; i < end; sum += p->cell[i++ - lead_gap(p)]) {
        const double over = (double)p->cell[i] / lead_level(p, d, i - begin, sum);
        d->mask[i] |= over > alpha && i - begin >= LEAD_LEAST * p->axis->resolution_bins;
        if (over > ratio && doubtful == p->axis->n)
            doubtful = i;
    }
    return doubtful;
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

/* An instruction each, where fmax and fmin are calls that look for NaNs; `a` is kept beside one. */
static double larger(double a, double b)
{
    return b > a ? b : a;
}

static double smaller(double a, double b)
{
    return b < a ? b : a;
}

/* The same over the water next to the ring-down, where the detector's window is not complete. */
static void measure_lead(const struct profile *p, const struct detection *d, struct reflection *r)
{
    const uint32_t begin = p->first + lead_gap(p), end = lead_end(p, d);
    const double alpha = (double)d->cfar.alpha_one_q16 / 65536.0;
    uint64_t sum = 0;
    for (uint32_t i = begin; i < end && i <= r->last; sum += p->cell[i++ - lead_gap(p)]) {
        if (i < r->begin || i - begin < LEAD_LEAST * p->axis->resolution_bins)
            continue;
        const double level = lead_level(p, d, i - begin, sum), over = (double)p->cell[i] / level;
        r->contrast = larger(r->contrast, over);
        r->risen = larger(r->risen, over);
        r->strength = larger(r->strength, over / alpha);
        r->threshold = smaller(r->threshold, level * alpha);
    }
}

static void measure_reflection(const struct profile *p, const struct detection *d, struct reflection *r)
{
    const struct profile_axis *a = p->axis;
    uint32_t peak = r->begin;
    *r = (struct reflection){.begin = r->begin, .last = r->last, .strength = 1.0, .threshold = INFINITY};
    r->lowest_only = p->clean != NULL;
    for (uint32_t i = r->begin; i <= r->last; i++) {
        if (profile_blind(p, i))
            continue;
        const struct cfar_reference ref = cfar_reference_at(&d->cfar, &d->cells, i - p->first);
        const uint64_t alpha_q16 = ref.one_sided ? d->cfar.alpha_one_q16 : d->cfar.alpha_q16;
        const double ratio = (double)p->cell[i] * ref.cells / larger((double)ref.sum, 1.0);
        const double risen = over_baseline(p, d, i);
        const bool saturated = saturated_by_echo(p, d, i);
        r->contrast = larger(r->contrast, saturated ? INFINITY : ratio);
        r->strength = larger(r->strength, ratio * 65536.0 / (double)alpha_q16);
        r->risen = larger(r->risen, larger(ratio, risen));
        r->contrast = larger(r->contrast, risen);
        if (ref.cells > 0)
            r->threshold = smaller(r->threshold, (double)ref.sum / ref.cells * ((double)alpha_q16 / 65536.0));
        if (saturated || (p->clean && p->clean[i] > p->lowest))
            r->lowest_only = false;
        if (p->cell[i] > p->cell[peak])
            peak = i;
    }
    measure_lead(p, d, r);
    r->near = near_cell(p, r->begin);
    r->power = (double)p->cell[peak];
    r->echo = (struct echo){
        .range_m = (float)fmax(profile_m(p, peak_position(p->cell, a->n, peak)), profile_m(p, p->first)),
        .near_m = (float)profile_m(p, r->near),
        .sd_m = (float)(half_power_width(p->cell, a->n, peak) * a->dr / sqrt(12.0)),
        .strength = (float)r->strength,
        .confidence = (float)(r->risen / (EVEN + r->risen)),
    };
}

bool reflection_next(const struct profile *p, const struct detection *d, uint32_t from, struct reflection *out)
{
    const uint8_t *at = from < p->axis->n ? memchr(d->mask + from, 1, p->axis->n - from) : NULL;
    if (!at)
        return false;
    const uint32_t begin = (uint32_t)(at - d->mask);
    *out = (struct reflection){.begin = begin, .last = group_end(p, d, begin)};
    measure_reflection(p, d, out);
    return true;
}

void reflection_reach_back(const struct profile *p, const struct detection *d, struct reflection *r)
{
    const uint32_t complete =
        p->first + d->cfar.guard + d->cfar.n_side; /* from here on, with the window before it */
    uint32_t near = r->near;

    for (uint32_t i = near; i-- > p->first && near - i <= p->axis->guard + 1;)
        if (!profile_blind(p, i) && (double)p->cell[i] > r->threshold)
            near = i;
    if (d->cfar.detector == CFAR_SOCA && near >= complete)
        return;
    r->near = near_cell(p, near);
    r->echo.near_m = (float)profile_m(p, r->near);
}
