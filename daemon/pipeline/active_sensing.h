/* SPDX-License-Identifier: MIT */
/*
 * active_sensing - where a sonar that can be steered shall look more often: in the sector that is most worth a look
 * (grid/answer/next_look) while the vehicle moves. Knows no device.
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
    const struct pose *pose;             /* what is known of the vehicle's now */
    const struct mount *mount;           /* of the head on the vehicle */
    struct next_look_features *features; /* at its last look; zeroed before the first; NULL: without */
};

/**
 * active_sensing_sector - the azimuths in the frame of the head to steer to, clockwise. False: none: the grid's axes
 * are not NED, no attitude or velocity is known, or all was just looked at.
 */
bool active_sensing_sector(struct picture *picture, uint64_t now_ns, double stale_s,
                           const struct active_sensing_head *head, double *from_rad, double *to_rad);

#endif
