/* SPDX-License-Identifier: MIT */
#include "silence.h"

#include <math.h>
#include <string.h>

/* A level is told from so many resolution cells: of their mean, chance alone makes no 9 dB. */
#define STRETCH_CELLS 16

/*
 * The level has risen when it is so many times (9 dB) the quietest nearer one; it is still calm at half of that, in dB.
 * Quieter than the floor by as much is as good as zeros: what has risen is louder than the floor, too.
 */
#define RISEN 8.0

bool silence_is_dumb(const struct profile *p)
{
    const uint32_t n = p->axis->n;
    uint32_t loud = p->first, silent = 0;

    while (loud < n && profile_saturated(p, loud))
        loud++;
    while (silent < n && profile_count(p, silent) == 0)
        silent++;
    return loud == n || silent == n;
}

/* End of the stretch behind the ring-down in which no window is without any sound. */
static uint32_t heard_until(const struct profile *p)
{
    const uint32_t n = p->axis->n, window = p->axis->window;
    uint32_t end = p->first, i;

    do { /* the last sound within a window from here, looked for from its far end */
        for (i = n - end < window ? n : end + window; i > end && profile_count(p, i - 1) == 0;)
            i--;
    } while (i > end && (end = i) < n);
    return end;
}

double silence_free_m(const struct profile *p, uint32_t judged, enum extract_no_echo rule, double minimum_range_m)
{
    const uint32_t heard = heard_until(p), end = rule == EXTRACT_RANGE && heard > p->first ? p->axis->n : heard;
    const double free_m = profile_m(p, end < judged ? end : judged);

    return rule == EXTRACT_MINIMUM ? fmin(minimum_range_m, free_m) : free_m;
}

struct silence silence_levels(const struct profile *p, double ratio)
{
    const uint32_t n = p->axis->n, window = p->axis->window;
    struct silence s = {.floor = UINT64_MAX, .drowned = n, .quiet = p->first};

    for (uint32_t k = (n - p->first) / window; k-- > 0;) {
        const uint32_t begin = p->first + k * window;
        const uint64_t level = profile_level(p, begin, window);
        const uint64_t mean = level > p->floor_power ? level : p->floor_power;
        s.floor = mean < s.floor ? mean : s.floor;
        if ((double)mean > ratio * (double)s.floor) {
            s.quiet = s.drowned == n ? begin + window : s.quiet;
            s.drowned = begin;
        }
    }
    if (s.floor == UINT64_MAX)
        s.floor = p->floor_power;
    return s;
}

struct calm silence_calm(const struct profile *p)
{
    const uint32_t n = p->axis->n, step = (uint32_t)ceil(STRETCH_CELLS / 4 * p->axis->resolution_bins);
    const uint32_t stretch = 4 * step;
    struct calm c = {.until = p->first};
    double quiet = INFINITY;

    for (uint32_t begin = p->first; begin + stretch <= n; begin += step) {
        if (p->blind && memchr(p->blind + begin, 1, stretch))
            continue;
        const double level = fmax((double)profile_level(p, begin, stretch), (double)p->floor_power / RISEN);
        quiet = fmin(quiet, level);
        c.risen = begin + stretch;
        if (level > RISEN * quiet)
            return c;
        if (level * level <= RISEN * quiet * quiet)
            c.until = begin + stretch - step; /* it may rise in the last quarter already */
    }
    return (struct calm){n, n};
}

uint32_t silence_hidden(const struct profile *p, uint32_t until, double power, double ratio)
{
    const uint32_t window = p->axis->window;
    uint32_t begin = p->blind ? until : p->first;

    while (begin > p->first && !profile_blind(p, begin - 1))
        begin--;
    for (uint32_t k = (until - begin) / window; k-- > 0;) {
        uint64_t sum = 0;
        for (uint32_t i = begin + k * window; i < begin + (k + 1) * window; i++)
            sum += p->cell[i];
        if ((double)sum / window * ratio > power)
            return begin + (k + 1) * window;
    }
    return begin;
}
