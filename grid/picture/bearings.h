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
#include "grid/geometry.h"

#define BEARINGS         64  /* a bit each: bit k is azimuth k to k + 1 of so many parts of the body's circle */
#define BEARINGS_FINE    512 /* parts of the circle in which the beams of still sonars are told */
#define BEARINGS_SENSORS 8
#define BEARINGS_NEVER   UINT16_MAX
#define BEARINGS_AWAY_NS (UINT64_C(10) * 1000000000) /* from one ping to the next: the sonar was away */

/*
 * What a sonar that does not turn looks at: a set of directions of its own, whose azimuths and elevations are those of
 * its beams. Where that is in the water depends on its mount and on the body's tilt.
 */
struct bearings_still {
    uint64_t opens[BEARINGS_FINE / 64]; /* parts of its azimuth in which a beam is */
    double low_rad, high_rad;           /* between these elevations; equal: there is no such sonar */
    struct mount mount;
};

/* What the sonars look at, for the picture. */
struct bearings_looks {
    uint64_t t_ns; /* as of then, the newest ping */
    /* Where each head looks, or may yet, and how far above and below the body's level plane it hears at all of them */
    uint64_t bearings[BEARINGS_SENSORS];
    double level_rad[BEARINGS_SENSORS];
    uint64_t hears[BEARINGS_SENSORS];   /* where each head looks, or passes, and was not deaf at its last look */
    uint64_t last_ns[BEARINGS_SENSORS]; /* of each sonar, the last ping; 0: none */
    struct bearings_still still[BEARINGS_SENSORS];
    double place_m[BEARINGS_SENSORS][3]; /* of each sensor, in the body */
    double turn_s[BEARINGS_SENSORS];     /* how long its last turn took; 0: not known */
    /* Tenths of a second before t_ns, rounded up, BEARINGS_NEVER at most: when a head last heard there, and when the
     * sensor last came back after it had been away. */
    uint16_t heard_ds[BEARINGS_SENSORS][BEARINGS];
    uint16_t back_ds[BEARINGS_SENSORS];
    /* so wide a gap between two beams is that head's own, not a lost ping's; 0: none is */
    double gap_rad[BEARINGS_SENSORS];
    uint64_t first_turns; /* a whole word; 1: some head has not been everywhere twice */
};

struct bearings_sensor {
    uint64_t seen;               /* a level beam was there, or its head passed there between two pings */
    uint64_t deaf;               /* nothing usable was received there by a head's last pass */
    uint64_t deaf_before, heard; /* where a head's last beam was deaf; where its beam heard last */
    uint64_t heard_ns[BEARINGS]; /* when a beam of a head last heard there; 0: never */
    uint64_t last_ns;            /* of its last ping */
    uint64_t back_ns;            /* of the first after it had been away; 0: none */
    uint64_t shape;              /* of the beams that opened last, that they need not open again */
    struct bearings_still still; /* of one that does not turn; its mount is that of the last ping of any */
    double level_rad;            /* as in bearings_looks; 0: no beam was level yet */
    float last_rad;              /* azimuth in the body of a head's last level beam */
    float step_rad;              /* the least from one of them to the next; 0: unknown */
    float wide_rad, high_rad;    /* of its last ping's beams */
    uint8_t turns;               /* begun, up to 3: before the first it may have begun in the middle of one */
    bool level;                  /* its last beam was */
    bool moves;                  /* it is a head that turns, as its driver says */
};

struct bearings {
    uint64_t t_ns; /* of the newest ping */
    struct bearings_sensor sensor[BEARINGS_SENSORS];
};

/** bearings_enter - a ping of a sensor with that mount. A head passes from one bearing to the next the shorter way.
 * Which sensor is one its driver says (echoes.turns); one that keeps to a bearing is still to look at all the others.
 * With another mount, as after a reload, a sensor begins anew. */
void bearings_enter(struct bearings *b, const struct echoes *e, const struct mount *mount);

/** bearings_tell - as of the newest ping. A head looks at all bearings while it is in its first turn: nobody knows yet
 * where it will look. In its first turns only a step that is wider than the beam leaves a gap; later the vehicle has
 * turned as well. turn_ms: how long the last turn of each sensor took; 0: not known. */
void bearings_tell(const struct bearings *b, const uint32_t turn_ms[BEARINGS_SENSORS], struct bearings_looks *out);

/** bearings_counts - does it count at now_ns that the sensor looked at t_ns? For clear_for_s, or if those take longer
 * for 2.2 of its turns as long as it has not been away since; no longer than 6553 s before looks->t_ns. */
bool bearings_counts(const struct bearings_looks *looks, uint32_t sensor, uint64_t t_ns, uint64_t now_ns,
                     double clear_for_s);

/** bearings_of - at which bearings the heads of that set of sensors show what is there at now_ns: where they have
 * heard, by a look that counts. */
uint64_t bearings_of(const struct bearings_looks *looks, uint64_t sensors, uint64_t now_ns, double clear_for_s);

/** bearings_level - at which bearings heads look that hear so far above and below the body's level plane. One that does
 * not leaves to the others what they look at. */
uint64_t bearings_level(const struct bearings_looks *looks, double off_rad);

/** bearings_look - as bearings_level and bearings_have, of a place in the body's axes. Near by a head that is not in
 * the middle looks elsewhere than far away. */
bool bearings_look(const struct bearings_looks *looks, double off_rad, const double at_m[3]);

/** bearings_pass - does a head look at some place of the straight way from one place in the body's axes to another? */
bool bearings_pass(const struct bearings_looks *looks, double off_rad, const double from_m[3],
                   const double to_m[3]);

/** bearings_have - does the set hold all azimuths of the body within so much of one, and a part to either side? At its
 * edges nobody may look. within_rad: up to half a turn. */
bool bearings_have(uint64_t set, double az_rad, double within_rad);

/* From where still sonars are told, and of which water. */
struct bearings_view {
    double attitude[4]; /* of the body, in the axes that are asked about */
    double offset_m[3]; /* of the vehicle from the place that ranges are from, in these axes */
    double step_rad;    /* height of a cell */
};

/**
 * bearings_row - at which azimuths of a row of cells still sonars look, at some range up to near_m: a cell there lies
 * wholly between the upper and lower edge of what they cover together, or it touches that and none beside it, above or
 * below, does lie so. What stands there goes from the bottom to the surface: that a sonar is mounted higher or lower
 * makes no difference.
 */
void bearings_row(const struct bearings_looks *looks, const struct bearings_view *view, double el_rad,
                  double near_m, uint64_t row[BEARINGS_FINE / 64]);

/** bearings_still_look - do still sonars look at that level place, edge_rad to both sides, wholly at a cell there? */
bool bearings_still_look(const struct bearings_looks *looks, const struct bearings_view *view, double az_rad,
                         double range_m, double edge_rad);

/** bearings_inside - how far that azimuth lies in a row, beyond edge_rad from the end of what still sonars cover
 * together; 0: it does not. Where they cover no more than two such edges all of that counts, and it is INFINITY. */
double bearings_inside(const uint64_t row[BEARINGS_FINE / 64], double az_rad, double edge_rad);

#endif
