/* SPDX-License-Identifier: MIT */
/*
 * clock_map - a device's own clock on the host's: takes pairs of a device counter and the host time at which the
 * frame with it came in, and tells when on the host's clock the device counted so far. Pure; knows no device.
 *
 * A frame is never received before it was stamped, so the true relation lies below all pairs. Of the lines below
 * them the one with the least total delay is taken: the edge of their lower convex hull over the mean device time.
 * It follows the drift of the device's clock and is untouched by frames that waited somewhere. What it cannot see
 * is the delay that no frame is without: that part belongs to the device and is to be subtracted by it.
 */
#ifndef SONARD_CLOCK_MAP_H
#define SONARD_CLOCK_MAP_H

#include <stdbool.h>
#include <stdint.h>

#define CLOCK_MAP_SAMPLES   512
#define CLOCK_MAP_WINDOW_NS 60000000000ll /* older pairs are forgotten */
#define CLOCK_MAP_DRIFT     500e-6        /* no real clock is further off */

/* A map in figures, for people. */
struct clock_report {
    bool running;      /* as a clock does, for long enough: its times are used */
    double offset_s;   /* the host's clock less the device's, now */
    double drift;      /* of the device's, > 0: slow */
    double jitter_s;   /* mean delay of the frames beyond the least */
    uint64_t restarts; /* jumps, and starts anew; only grows */
};

/* A pair, relative to the first one. */
struct clock_sample {
    int64_t device_ns;
    int64_t late_ns; /* how much further the host's clock has gone: delay and drift */
};

struct clock_map {
    uint64_t wrap, tick_ns;
    uint64_t last_count;   /* device counter ... */
    uint64_t last_host_ns; /* ... and arrival of the newest sample */
    int64_t last_ns;       /* device_ns of the newest sample */
    uint64_t first_host_ns;
    struct clock_sample sample[CLOCK_MAP_SAMPLES]; /* oldest first, device_ns growing */
    uint32_t n;
    uint64_t restarts, out_of_order; /* only grow */

    /* The line: late_ns = line.late_ns + drift * (device_ns - line.device_ns). */
    struct clock_sample line;
    double drift;
};

/**
 * clock_map_init - an empty map for a counter of ticks of tick_ns (1e6: milliseconds) that runs from 0 to wrap - 1
 * and then from 0 again (1 << 32, 86400000 for the milliseconds of a day). wrap >= 2, wrap * tick_ns < 2^62.
 */
void clock_map_init(struct clock_map *map, uint64_t wrap, uint64_t tick_ns);

/**
 * clock_map_put - a frame stamped `count` by the device was received at host_ns; returns when the device stamped it,
 * on the host's clock and never later than host_ns.
 *
 * Steps are unwrapped the shorter way round. A step that differs from the host's by more than 1 s and 5 % is a
 * device that was started anew, or a jump: the map starts over with this pair. So does a drift beyond
 * CLOCK_MAP_DRIFT that holds over 30 s; before that, it is taken for delays and limited. An older counter than the
 * newest, or the same once more, is placed by the line and not learned from. Any count is accepted, host_ns < 2^62.
 * O(CLOCK_MAP_SAMPLES).
 */
uint64_t clock_map_put(struct clock_map *map, uint64_t count, uint64_t host_ns);

/** clock_map_forget - begin anew with the next pair: nothing from before counts. */
void clock_map_forget(struct clock_map *map);

/**
 * clock_map_is_sure - the counter has kept the host's pace for 10 s without a restart. Else a counter that stands or
 * runs at another pace is not told from one that has delays, and what clock_map_put returns may be off by a second.
 * What is never told is a jump back by less than 1 s: until it is out of the window,
 * frames are placed early by as much.
 */
bool clock_map_is_sure(const struct clock_map *map);

void clock_map_report(const struct clock_map *map, struct clock_report *out);

#endif
