/* SPDX-License-Identifier: MIT */
/*
 * velocity_doubt - a velocity of exactly zero while the vehicle moves. A DVL without a bottom to lock on sends zeros as
 * if they were measured; a measured velocity at rest is some millimetres per second and never exactly zero along three
 * axes. A vehicle that is taken to stand still while it moves sees free water where there is a wall, so zeros that
 * attitude, depth or position contradict are not believed, until a velocity comes that is not exactly zero, or none has
 * come for ten seconds: then there is nothing left to doubt.
 *
 * Zeros that nothing contradicts are believed: a vehicle may stand still, and a simulation says so exactly. A turn
 * contradicts them as well, although a vehicle can turn on the spot: a DVL beside the axis of the turn measures it.
 * Pure.
 */
#ifndef SONARD_VELOCITY_DOUBT_H
#define SONARD_VELOCITY_DOUBT_H

#include <stdbool.h>
#include <stdint.h>

#include "grid/geometry.h"

#define VELOCITY_DOUBT_ZEROS    5 /* so many in a row, and */
#define VELOCITY_DOUBT_TURN_RAD 0.17453292519943295
#define VELOCITY_DOUBT_SINK_M   0.5
#define VELOCITY_DOUBT_MOVE_M   1.0 /* a position at rest wanders by less */
#define VELOCITY_DOUBT_OVER_NS  10000000000u

#define VELOCITY_DOUBT_TEXT "the velocity is exactly 0 while the vehicle moves: not used"

/* Zeroed at first. */
struct velocity_doubt {
    unsigned zeros;      /* in a row, counted up to VELOCITY_DOUBT_ZEROS */
    struct pose since;   /* the parts as they were when the zeros began */
    bool moved, doubted; /* has a part changed since by more than a vehicle at rest? is the velocity left out? */
    uint64_t t_zero_ns;  /* of the newest zeros */
    uint64_t left_out;   /* velocities */
};

/**
 * velocity_doubt_take - a pose with any parts, in the order in which they come. Takes POSE_VELOCITY out of pose->has
 * where the velocity is not believed. True once for each time that it begins to be doubted.
 */
bool velocity_doubt_take(struct velocity_doubt *doubt, struct pose *pose);

#endif
