/* SPDX-License-Identifier: MIT */
/*
 * beams - from the echoes of a ping to beams of a row, and to the rows of fans and of the last beams of turning heads.
 * Knows no pool.
 */
#ifndef SONARD_WATER_BEAMS_H
#define SONARD_WATER_BEAMS_H

#include "grid/echoes.h"
#include "grid/geometry.h"
#include "row.h"

#define BEAMS_MAX        512 /* of a ping */
#define BEAMS_WIDEST_RAD (80 * GEO_PI / 180)

/* Of one beam of a sensor, or all of its last ping: what received nothing usable is believed the second time. */
struct beams_deaf {
    uint64_t beam[BEAMS_MAX / 64]; /* set of those that were deaf in the last ping */
    uint16_t n;                    /* it had so many */
};

/** beams_begin - what all rows of a ping have in common, for a sensor at that mount; axis and place are those of the
 * sensor, in NED, or the body's axes while the pose has no attitude. */
void beams_begin(struct water_record *record, const struct echoes *e, const struct mount *mount);

/** beams_az_rad - the azimuth of a beam, within half a turn of 0. */
double beams_az_rad(const struct beam_echoes *beam);

/** beams_one - what the beam of that number says. */
struct row_beam beams_one(const struct echoes *e, const struct beams_deaf *deaf, uint16_t i);

/** beams_echo_m - from there on the beam of that number shows an echo, or is deaf again and may hide one; INFINITY: it
 * does not. What another beam of the ping sees there as well is not free behind it, though the ping may be too loose to
 * end what older ones found. */
double beams_echo_m(const struct echoes *e, const struct beams_deaf *deaf, uint16_t i);

/** beams_are_level - have all the same elevation? */
bool beams_are_level(const struct echoes *e);

/* The beams of a ping at one elevation, in order of azimuth. */
struct beams_row {
    struct row_beam beam[BEAMS_MAX];
    size_t n;
    struct row_shape shape;
};

/** beams_read - the beams of a ping whose beams are level. What is more than 80 degrees to a side is left out. False:
 * nothing is left. */
bool beams_read(const struct echoes *e, const struct beams_deaf *deaf, struct beams_row *out);

/** beams_listen - after all rows of a ping: which of its beams were deaf. */
void beams_listen(struct beams_deaf *deaf, const struct echoes *e);

#endif
