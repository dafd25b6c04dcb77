/* SPDX-License-Identifier: MIT */
/*
 * mirror - port and starboard of a sensor swapped: for a head that counts its angles the other way round than its
 * device takes them (mirror = yes). What the device reports is mirrored, and so is what it is told to scan.
 */
#ifndef SONARD_MIRROR_H
#define SONARD_MIRROR_H

#include "device.h"

/**
 * mirror_ping - every beam at the azimuth of opposite sign, and the head at the angle mirrored at its zero, so that a
 * row of head units is still one azimuth. Elevations, ranges and samples stay.
 */
void mirror_ping(struct ping *ping);

/** mirror_arc - the arc clockwise from *from_rad to *to_rad, as the other side has it: clockwise again. */
void mirror_arc(double *from_rad, double *to_rad);

#endif
