/* SPDX-License-Identifier: MIT */
/*
 * follow - the grids' centres follow the vehicle's poses while no ping comes: each ping brings its own, but a sonar
 * drops out, or pings seldom. What an answer withholds grows with the distance from the centre.
 */
#ifndef SONARD_FOLLOW_H
#define SONARD_FOLLOW_H

#include "pipeline.h"

#define FOLLOW_AFTER_NS 200000000u /* without a ping */

/**
 * pipeline_follow - the vehicle's newest pose, as of its own time. Nothing is done unless it has an attitude and a
 * position, the newest ping is older than FOLLOW_AFTER_NS, and the vehicle has gone as far since as a grid's centre may
 * lie from it; nor with a pose that is older than the last followed, as of a sender who is later than another.
 * Otherwise the grids' owner does it between two pings. Loop thread.
 */
void pipeline_follow(struct pipeline *p, const struct pose *pose);

#endif
