/* SPDX-License-Identifier: MIT */
/*
 * course - the division into directions follows the vehicle's course: azimuth 0 of the grid is where it goes. Only the
 * division turns, about the vertical. Points stay where they are in NED, so a turn adds no doubt to them and no number
 * of turns adds up to a drift; cells are sorted anew from them. When a direction was looked at goes to the one that
 * holds its middle then.
 */
#ifndef SONARD_COURSE_H
#define SONARD_COURSE_H

#include "state.h"

/**
 * course_follow - turns the axes to the course of this pose (with an attitude) when they are off by more than 10
 * degrees and two of the grid's steps. The course is that over ground from 0.2 m/s on until less than 0.1 m/s, else the
 * heading; while the bow points more than 60 degrees up or down the axes stay. Cost of a turn:
 * all cells and all directions, once.
 */
void course_follow(struct sphere *s, const struct pose *pose);

/** course_end - azimuth 0 of the grid is as it was before the first pose; for a grid that holds nothing. */
void course_end(struct sphere *s);

#endif
