/* SPDX-License-Identifier: MIT */
/*
 * motion - the grid's centre follows the vehicle: cells are sorted anew from their stored points. Every place comes
 * from the absolute position, so no number of steps adds up to a drift.
 */
#ifndef SONARD_MOTION_H
#define SONARD_MOTION_H

#include "state.h"

/** motion_follow - at t_ns the vehicle is at pose->position_m;
 * the centre moves when that is farther than conf.recentre_m. */
void motion_follow(struct sphere *s, const struct pose *pose, uint64_t t_ns);

/** motion_drifted - before a ping is entered: earlier echoes are nearer by the drift since, while poses have no
 * position. */
void motion_drifted(struct sphere *s, const struct pose *pose);

/** motion_reindex - the axes have turned: every live cell goes to the direction that holds its
 * point, in the same layer. */
void motion_reindex(struct sphere *s);

#endif
