/* SPDX-License-Identifier: MIT */
/*
 * micron_scan - a Micron's full circle in stretches, so that passes over what it is steered to fit in between:
 * each is a
 * sector that the head is sent, done when its two ends were reached. Knows limits and bearings, and sends nothing.
 */
#ifndef SONARD_MICRON_SCAN_H
#define SONARD_MICRON_SCAN_H

#include "steer.h"

struct micron_scan {
    struct steer steer;
    unsigned step;                 /* units */
    unsigned steer_first, steer_n; /* bearings of a pass, a step apart; 0: it is not steered */
    unsigned at, done;             /* where the plain scan goes on; units of the circle it has done */
    unsigned left, n;              /* present stretch; n = 0: round and round */
    bool pass, only, saw_left, saw_right;
    unsigned pings; /* of the stretch */
    unsigned plain; /* bearings of the plain scan since the last pass */
};

/** micron_scan_init - step in [1, 255] units; circle_ns as in steer.h. */
void micron_scan_init(struct micron_scan *scan, unsigned step, uint64_t circle_ns);

/** micron_scan_steer - pass over the azimuths from `from_rad` clockwise to `to_rad`; equal: no longer. only: over
 * nothing else, pass after pass. */
void micron_scan_steer(struct micron_scan *scan, double from_rad, double to_rad, bool only);

/** micron_scan_ping - a ping from a bearing. True: another stretch begins, micron_scan_limits says which. */
bool micron_scan_ping(struct micron_scan *scan, unsigned bearing, uint64_t now_ns);

/** micron_scan_limits - of the present stretch, clockwise; false: the full circle, round and round. */
bool micron_scan_limits(const struct micron_scan *scan, unsigned *left, unsigned *right);

#endif
