/* SPDX-License-Identifier: MIT */
/*
 * sensor - what one beam's echoes and silence do to the cells and claims of the directions that it may concern.
 */
#ifndef SONARD_SENSOR_H
#define SONARD_SENSOR_H

#include "beam.h"
#include "state.h"

/** sensor_enter - one beam of a ping. Cost: directions within its opening, lever arm's parallax included. */
void sensor_enter(struct sphere *s, const struct beam *b);

#endif
