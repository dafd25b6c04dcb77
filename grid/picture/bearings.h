/* SPDX-License-Identifier: MIT */
/*
 * bearings - at which level bearings of the vehicle its sonars look. `near` in [vehicle] is a promise about what no
 * beam shows, so it does not cover a bearing that a sonar has yet to look at.
 */
#ifndef SONARD_BEARINGS_H
#define SONARD_BEARINGS_H

#include <stdbool.h>
#include <stdint.h>

#include "grid/echoes.h"

#define BEARINGS         64 /* a bit each: bit k is azimuth k to k + 1 of so many parts of the body's circle */
#define BEARINGS_SENSORS 16

/* What the sonars look at, for the picture. */
struct bearings_looks {
    uint64_t bearings; /* a sonar looks there, or may yet */
    double level_rad;  /* so far above and below the body's level plane they hear at all these bearings */
    double gap_rad;    /* so wide a gap between two beams is a sonar's own, not a lost ping's; 0: none is */
    bool first_turns;  /* some head has not been everywhere twice, so that a ping it lost may have left a gap */
};

struct bearings_sensor {
    float first_rad, last_rad; /* azimuth in the body of the first and last level beam of its last ping with one */
    float step_rad;            /* the least from one level beam to the next; 0: unknown */
    float wide_rad;            /* of its last ping's beams */
    uint8_t pings;             /* with a level beam, up to 2 */
    uint8_t turns;             /* begun, up to 3: before the first it may have begun in the middle of one */
    bool level;                /* its last beam was */
    bool moves;                /* its pings begin at more than one bearing */
};

struct bearings {
    double level_rad; /* as in bearings_looks */
    uint64_t seen;    /* a level beam was there, or its head passed there between two pings */
    struct bearings_sensor sensor[BEARINGS_SENSORS];
};

/** bearings_enter - a ping of a sensor with that mount. A head passes from one bearing to the next the shorter way. */
void bearings_enter(struct bearings *b, const struct echoes *e, const struct mount *mount);

/** bearings_tell - all bearings while a head is in its first turn: nobody knows yet where it will look. In its first
 * turns only a step that is wider than the beam leaves a gap; later the vehicle has turned as well. */
void bearings_tell(const struct bearings *b, struct bearings_looks *out);

/** bearings_has - does the set hold an azimuth of the body, and a part to either side? At its edge nobody may look. */
static inline bool bearings_has(uint64_t set, double az_rad)
{
    const unsigned k = (unsigned)(geo_wrap(az_rad) / GEO_TURN * BEARINGS) % BEARINGS;
    return set >> k & set >> (k + 1) % BEARINGS & set >> (k + BEARINGS - 1) % BEARINGS & 1;
}

#endif
