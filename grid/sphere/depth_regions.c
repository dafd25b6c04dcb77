/* SPDX-License-Identifier: MIT */
#include "depth_regions.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

/* Positions of a window whose ranges, times the sign, rise from the head on: the head is the least (most, sign -1). */
struct deque {
    const double *range_m;
    uint32_t n;
    double sign;
    uint32_t head, tail;
    uint16_t at[2 * DEPTH_REGIONS_MAX]; /* positions run over two turns, and each enters once */
};

static double range_at(const struct deque *d, uint32_t position)
{
    return d->range_m[position % d->n];
}

/* The extreme of the window and the position after it. */
static double with(const struct deque *d, uint32_t position)
{
    const double x = range_at(d, position);
    if (d->head == d->tail)
        return x;
    const double held = range_at(d, d->at[d->head]);
    return d->sign * held < d->sign * x ? held : x;
}

static void enter(struct deque *d, uint32_t position)
{
    while (d->tail > d->head && d->sign * range_at(d, d->at[d->tail - 1]) >= d->sign * range_at(d, position))
        d->tail--;
    d->at[d->tail++] = (uint16_t)position;
}

static void leave(struct deque *d, uint32_t position)
{
    if (d->head < d->tail && d->at[d->head] == position)
        d->head++;
}

/* For every bearing how many the longest run has that begins there; a run ends at the latest where it began. */
static void longest_runs(const double *range_m, uint32_t n, double window_m, uint16_t *length)
{
    struct deque least = {.range_m = range_m, .n = n, .sign = 1}, most = {.range_m = range_m, .n = n, .sign = -1};
    uint32_t end = 0;
    for (uint32_t start = 0; start < n; start++) {
        end = end > start ? end : start;
        for (; end < start + n && isfinite(range_m[end % n]); end++) {
            if (with(&most, end) - with(&least, end) > window_m)
                break;
            enter(&least, end);
            enter(&most, end);
        }
        length[start] = (uint16_t)(end - start);
        leave(&least, start);
        leave(&most, start);
    }
}

static bool is_free(const bool *taken, uint32_t n, uint32_t first, uint32_t count)
{
    for (uint32_t k = 0; k < count; k++)
        if (taken[(first + k) % n])
            return false;
    return true;
}

/* The run of `count` bearings as a region; they are taken. */
static struct depth_region take_region(const double *range_m, uint32_t n, bool *taken, uint32_t first,
                                       uint32_t count)
{
    struct depth_region region = {.first = first, .n = count, .least_m = INFINITY, .most_m = 0};
    for (uint32_t k = 0; k < count; k++) {
        const uint32_t i = (first + k) % n;
        taken[i] = true;
        region.least_m = fmin(region.least_m, range_m[i]);
        region.most_m = fmax(region.most_m, range_m[i]);
    }
    return region;
}

uint32_t depth_regions(const double *range_m, uint32_t n, double window_m, uint32_t least_n,
                       struct depth_region *region, uint32_t room)
{
    uint16_t length[DEPTH_REGIONS_MAX];
    bool taken[DEPTH_REGIONS_MAX];
    uint32_t found = 0;
    memset(taken, 0, n);
    longest_runs(range_m, n, window_m, length);
    for (;;) {
        uint32_t best = n;
        for (uint32_t i = 0; i < n; i++)
            if (length[i] >= least_n && (best == n || length[i] > length[best]))
                best = i;
        if (best == n)
            return found;
        if (is_free(taken, n, best, length[best])) {
            const struct depth_region r = take_region(range_m, n, taken, best, length[best]);
            if (found < room)
                region[found] = r;
            found++;
        }
        length[best] = 0;
    }
}
