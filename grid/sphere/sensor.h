/* SPDX-License-Identifier: MIT */
/*
 * sensor - what one beam's echoes and silence do to the cells of the directions that it may concern.
 */
#ifndef SONARD_SENSOR_H
#define SONARD_SENSOR_H

#include "beam.h"
#include "state.h"

/**
 * sensor_enter - all beams of a ping whose sensor is turned and placed so in the grid's axes. Cost: directions within
 * the beams' openings, lever arm's parallax included.
 */
void sensor_enter(struct sphere *s, const struct echoes *e, const double turn[4], const double origin_m[3]);

#endif
