/* SPDX-License-Identifier: MIT */
/*
 * rov_bound - the bound of a virtual BlueROV2's speed, as sonard-mavlink makes it of the autopilot's messages: the
 * pulses of its thrusters 20 times a second, its attitude and VFR_HUD's climb. A full battery, no coasting test.
 */
#ifndef SONARD_PILOT_ROV_BOUND_H
#define SONARD_PILOT_ROV_BOUND_H

#include "client/mavlink/speed_bound.h"

#define ROV_BOUND_S 0.05 /* from one sample to the next */

struct rov;

struct rov_bound {
    struct speed_bound bound;
    int last_us[THRUST_MOTORS];
    double last_down[3], last_yaw_rad, climb_mps;
};

/** rov_bound_start - nothing is known of the time before; r has frame 1 or, heavy, 2. */
void rov_bound_start(struct rov_bound *b, const struct rov *r);

/** rov_bound_sample - another ROV_BOUND_S has passed: level and vertical it went no faster than mps meanwhile, and
 * its thrusters push by push_n, forward and to the right. */
void rov_bound_sample(struct rov_bound *b, const struct rov *r, double mps[2], double push_n[2]);

#endif
