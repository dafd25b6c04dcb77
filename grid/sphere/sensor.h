/* SPDX-License-Identifier: MIT */
/*
 * sensor - what one beam's echoes and silence do to the cells and free intervals of the directions that it may concern.
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

/**
 * sensor_free_again - the free intervals of all directions anew, from the wedges of free water: the grid's centre has
 * moved or its axes have turned; all directions with intervals or cells are marked. As of t_ns; path_m: travelled by
 * then. Cost: that of entering all wedges without their echoes.
 */
void sensor_free_again(struct sphere *s, uint64_t t_ns, double path_m);

#endif
