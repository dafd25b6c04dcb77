/* SPDX-License-Identifier: MIT */
/*
 * rover - a virtual BlueROV2 (tests/lib/rov.h) that is steered by the speed that it shall go through the water, and the
 * bound of its speed as sonard-mavlink has it from its thrusters.
 */
#ifndef SONARD_PILOT_ROVER_H
#define SONARD_PILOT_ROVER_H

#include "rov_bound.h"
#include "tests/lib/rov.h"

struct rover {
    struct rov rov;
    struct rov_sticks sticks;
    struct rov_bound bound;
    double mps[2], push_n[2]; /* of the newest sample: the bound, level and vertical; forward and right */
    double steer_s, sample_s; /* since then */
};

/** rover_start - it lies at the origin, and has kept its place in the water for so long that the bound no longer
 * remembers the time before. The water goes by current_mps (north, east), along the tether by most_mps or less. */
void rover_start(struct rover *r, uint64_t seed, const double current_mps[2], double most_mps);

/** rover_step - command_mps (north, east) and the heading that are wanted. True: there is another sample. */
bool rover_step(struct rover *r, const double command_mps[2], double wanted_rad, double dt_s);

/** rover_heading - its heading. */
double rover_heading(const struct rover *r);

#endif
