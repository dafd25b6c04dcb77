/* SPDX-License-Identifier: MIT */
/*
 * sonars - the virtual sonars of a vehicle that is steered: two turning heads with the sound of tests/sim/lib/water.h,
 * and a fan that picks ranges itself. Pings are made as their devices make them.
 */
#ifndef SONARD_PILOT_SONARS_H
#define SONARD_PILOT_SONARS_H

#include "grid/ping.h"
#include "world.h"

enum pilot_sonar { PILOT_PING360, PILOT_MICRON, PILOT_FAN, PILOT_SONARS };

extern const char *const pilot_sonar_name[PILOT_SONARS];

/** pilot_sonar_conf - its section of the configuration, named `front`. */
const char *pilot_sonar_conf(enum pilot_sonar sonar);

/** pilot_sonar_period_ns - from one ping to the next. pilot_sonar_turn_s - until all has been pinged once. */
uint64_t pilot_sonar_period_ns(enum pilot_sonar sonar);
double pilot_sonar_turn_s(enum pilot_sonar sonar);

/**
 * pilot_sonar_hear - ping `number` (from 1), sent at t_s of the world from place_m, the sonar level and looking to
 * heading_rad. Its time and pose are the caller's.
 */
void pilot_sonar_hear(enum pilot_sonar sonar, const struct pilot_world *w, uint64_t seed, const double place_m[3],
                      double heading_rad, double t_s, uint32_t number, struct ping *ping);

#endif
