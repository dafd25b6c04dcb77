/* SPDX-License-Identifier: MIT */
/*
 * vehicle - how a vehicle moves that is steered, and what its navigation says of that. It has a lag, overshoots, and is
 * carried along by a current. What its instruments get wrong stays within what the daemon allows for (docs/design.md,
 * Sensors of the vehicle): 1 % of the way, 5 % of the speed and 0.02 m/s, a heading that drifts by 0.01 deg/s.
 */
#ifndef SONARD_PILOT_VEHICLE_H
#define SONARD_PILOT_VEHICLE_H

#include <stdbool.h>

#include "grid/geometry.h"
#include "tests/water/dice.h"

struct pilot_vehicle {
    double place_m[3], velocity_mps[2], thrust_mps2[2]; /* NED, over ground */
    double heading_rad;
    double current_mps[2];
    double command_mps[2]; /* north, east */
    double wanted_rad;     /* heading */
};

#define PILOT_THRUST_MPS2 0.3 /* at most; configured is what it can surely brake with */

/** pilot_vehicle_move - over ground where it knows its velocity, else the command is through the water. dt_s > 0. */
void pilot_vehicle_move(struct pilot_vehicle *v, bool over_ground, double dt_s);

/* How wrong the instruments are, beside their noise. */
struct pilot_instruments {
    double scale, bias_mps[2]; /* of position and velocity */
    double heading_radps;
    double jump_m[2]; /* the origin of positions has moved by */
    struct dice dice;
};

/** pilot_instruments_init - poor, 0..1: how much of what is allowed for they make use of. */
void pilot_instruments_init(struct pilot_instruments *n, double poor, struct dice dice);

/** pilot_instruments_read - the pose at t_s, with these parts (POSE_*). Its time is the caller's. */
void pilot_instruments_read(struct pilot_instruments *n, const struct pilot_vehicle *v, unsigned parts, double t_s,
                            struct pose *out, double *heading_rad);

#endif
