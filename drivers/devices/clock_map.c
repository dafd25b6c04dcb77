/* SPDX-License-Identifier: MIT */
/*
 * clock_map - see clock_map.h. All is kept relative to the first pair, so that differences are exact and small.
 */
#include "clock_map.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#define JUMP_NS    1e9
#define JUMP_SHARE 0.05
#define SURE_NS    10000000000ll   /* over so long a likely drift is believed ... */
#define SPAN_NS    (INT64_MAX / 8) /* of all steps together, 36 years: no sum of times overflows */
#define TELL_NS    30000000000ll   /* ... and an unlikely one is told from delays */

void clock_map_init(struct clock_map *map, uint64_t wrap, uint64_t tick_ns)
{
    *map = (struct clock_map){.wrap = wrap, .tick_ns = tick_ns};
}

static void restart(struct clock_map *map, uint64_t count, uint64_t host_ns)
{
    map->n = 1;
    map->sample[0] = (struct clock_sample){0, 0};
    map->first_host_ns = host_ns;
    map->last_count = count;
    map->last_host_ns = host_ns;
    map->last_ns = 0;
    map->line = map->sample[0];
    map->drift = 0.0;
}

/* From the newest pair to this one, on the device's clock: the shorter way round. */
static int64_t device_step_ns(const struct clock_map *map, uint64_t count)
{
    const uint64_t forward = (count + map->wrap - map->last_count) % map->wrap;
    if (forward <= map->wrap / 2)
        return (int64_t)(forward * map->tick_ns);
    return -(int64_t)((map->wrap - forward) * map->tick_ns);
}

static double host_step_ns(const struct clock_map *map, uint64_t host_ns)
{
    return host_ns >= map->last_host_ns ? (double)(host_ns - map->last_host_ns)
                                        : -(double)(map->last_host_ns - host_ns);
}

static void add(struct clock_map *map, struct clock_sample s)
{
    uint32_t old = map->n == CLOCK_MAP_SAMPLES;
    while (old < map->n && s.device_ns - map->sample[old].device_ns > CLOCK_MAP_WINDOW_NS)
        old++;
    memmove(map->sample, map->sample + old, (map->n - old) * sizeof map->sample[0]);
    map->n -= old;
    map->sample[map->n++] = s;
}

/* Does b lie on or above the line from a to c? */
static bool is_above(const struct clock_sample *a, const struct clock_sample *b, const struct clock_sample *c)
{
    return (double)(b->late_ns - a->late_ns) * (double)(c->device_ns - a->device_ns) >=
           (double)(c->late_ns - a->late_ns) * (double)(b->device_ns - a->device_ns);
}

/* Corners of the lower hull into out[CLOCK_MAP_SAMPLES]; their number. */
static uint32_t lower_hull(const struct clock_map *map, const struct clock_sample **out)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < map->n; i++) {
        while (n >= 2 && is_above(out[n - 2], out[n - 1], &map->sample[i]))
            n--;
        out[n++] = &map->sample[i];
    }
    return n;
}

static double mean_device_ns(const struct clock_map *map)
{
    double sum = 0.0;
    for (uint32_t i = 1; i < map->n; i++)
        sum += (double)(map->sample[i].device_ns - map->sample[0].device_ns);
    return sum / map->n;
}

/* A line of a given drift is held up by one corner of the hull. */
static struct clock_sample support(const struct clock_sample **hull, uint32_t n, double drift)
{
    const struct clock_sample *best = hull[0];
    for (uint32_t i = 1; i < n; i++)
        if ((double)(hull[i]->late_ns - best->late_ns) < drift * (double)(hull[i]->device_ns - best->device_ns))
            best = hull[i];
    return *best;
}

/* The line anew. False: these samples cannot come from one clock. */
static bool fit(struct clock_map *map)
{
    const struct clock_sample *hull[CLOCK_MAP_SAMPLES];
    const uint32_t n = lower_hull(map, hull);
    const double mean = mean_device_ns(map);
    uint32_t edge = 1; /* from corner edge - 1 to corner edge */
    while (edge + 1 < n && (double)(hull[edge]->device_ns - map->sample[0].device_ns) < mean)
        edge++;
    map->drift = 0.0;
    if (n >= 2)
        map->drift = (double)(hull[edge]->late_ns - hull[edge - 1]->late_ns) /
                     (double)(hull[edge]->device_ns - hull[edge - 1]->device_ns);
    if (!(fabs(map->drift) <= CLOCK_MAP_DRIFT)) {
        if (map->sample[map->n - 1].device_ns - map->sample[0].device_ns >= TELL_NS)
            return false;
        map->drift = copysign(CLOCK_MAP_DRIFT, map->drift);
    }
    map->line = support(hull, n, map->drift);
    return true;
}

/* The host's time of device_ns by the line, in 0 .. host_ns. */
static uint64_t by_line(const struct clock_map *map, int64_t device_ns, uint64_t host_ns)
{
    const double bend = map->drift * (double)(device_ns - map->line.device_ns);
    const int64_t since_ns = device_ns + map->line.late_ns + llrint(bend); /* the first pair; all below SPAN_NS */
    uint64_t t_ns;
    if (since_ns < 0)
        t_ns = map->first_host_ns > (uint64_t)-since_ns ? map->first_host_ns - (uint64_t)-since_ns : 0;
    else if (__builtin_add_overflow(map->first_host_ns, (uint64_t)since_ns, &t_ns))
        t_ns = UINT64_MAX;
    return t_ns < host_ns ? t_ns : host_ns;
}

uint64_t clock_map_put(struct clock_map *map, uint64_t count, uint64_t host_ns)
{
    count %= map->wrap;
    if (map->n == 0) {
        restart(map, count, host_ns);
        return host_ns;
    }

    const int64_t step_ns = device_step_ns(map, count);
    const double host_ns_step = host_step_ns(map, host_ns);
    if (fabs((double)step_ns - host_ns_step) > fmax(JUMP_NS, JUMP_SHARE * fabs(host_ns_step)) ||
        map->last_ns > SPAN_NS - llabs(step_ns)) {
        map->restarts++;
        restart(map, count, host_ns);
        return host_ns;
    }
    if (step_ns <= 0) {
        map->out_of_order++;
        return by_line(map, map->last_ns + step_ns, host_ns);
    }

    map->last_ns += step_ns;
    map->last_count = count;
    map->last_host_ns = host_ns;
    add(map, (struct clock_sample){map->last_ns, (int64_t)(host_ns - map->first_host_ns) - map->last_ns});
    if (!fit(map)) {
        map->restarts++;
        restart(map, count, host_ns);
        return host_ns;
    }
    return by_line(map, map->last_ns, host_ns);
}

void clock_map_forget(struct clock_map *map)
{
    map->n = 0;
}

bool clock_map_is_sure(const struct clock_map *map)
{
    return map->n > 1 && fabs(map->drift) < CLOCK_MAP_DRIFT &&
           map->sample[map->n - 1].device_ns - map->sample[0].device_ns >= SURE_NS;
}

void clock_map_report(const struct clock_map *map, struct clock_report *out)
{
    *out = (struct clock_report){.running = clock_map_is_sure(map), .restarts = map->restarts};
    if (!out->running)
        return;
    double late_s = 0.0;
    for (uint32_t i = 0; i < map->n; i++) {
        const struct clock_sample *s = &map->sample[i];
        late_s += 1e-9 * ((double)(s->late_ns - map->line.late_ns) -
                          map->drift * (double)(s->device_ns - map->line.device_ns));
    }
    out->jitter_s = late_s / map->n;
    out->drift = map->drift;
    out->offset_s =
        1e-9 * ((double)by_line(map, map->last_ns, UINT64_MAX) - (double)map->last_count * (double)map->tick_ns);
}
