/* SPDX-License-Identifier: MIT */
/*
 * active_sensing - where a sonar that can be steered shall look more often: in the sector that is most worth a look
 * (grid/answer/next_look) while the vehicle moves, or ahead. Knows no device.
 */
#ifndef SONARD_ACTIVE_SENSING_H
#define SONARD_ACTIVE_SENSING_H

#include <stdbool.h>
#include <stdint.h>

#include "grid/answer/next_look.h"
#include "grid/picture/picture.h"
#include "grid/geometry.h"

#define ACTIVE_SENSING_TICK_NS 500000000u

/* The head that is to be steered. */
struct active_sensing_head {
    const struct pose *pose;   /* what is known of the vehicle's now */
    const double *push;        /* which way its thrusters push, in its own axes; NULL: not known, or none */
    const struct mount *mount; /* of the head on the vehicle */
    struct next_look_features *features; /* at its last look; zeroed before the first; NULL: without */
};

/* The azimuths in the frame of the head to steer to, clockwise; only: and nowhere else. */
struct active_sensing_look {
    double from_rad, to_rad;
    bool only;
};

/**
 * active_sensing_sector - with a velocity the sector that is most worth a look. Of a vehicle that drifts, without
 * velocity and position, water is known for seconds only: it looks where the vehicle is pushed, and nowhere else.
 * False: nowhere more than elsewhere. The grid's axes are not NED, or no attitude is known, and it does not drift; all
 * was just looked at; it drifts, and is pushed nowhere.
 */
bool active_sensing_sector(struct picture *picture, uint64_t now_ns, double stale_s,
                           const struct active_sensing_head *head, struct active_sensing_look *look);

#endif
