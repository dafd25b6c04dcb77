/* SPDX-License-Identifier: MIT */
/*
 * attention - where a sonar that can be steered shall look more often: in the sector that is most worth a look
 * (grid/answer/next_look) while the vehicle moves. Knows no device.
 */
#ifndef SONARD_ATTENTION_H
#define SONARD_ATTENTION_H

#include <stdbool.h>
#include <stdint.h>

#include "../grid/answer/picture.h"
#include "../grid/geometry.h"

#define ATTENTION_TICK_NS 500000000u

/**
 * attention_sector - the azimuths in the frame of a sensor at `mount` to attend to, clockwise, with what is known of
 * the pose now. False: none: the grid's axes are not NED, no attitude or velocity is known, or all was just looked at.
 */
bool attention_sector(struct picture *picture, uint64_t now_ns, double stale_s, const struct pose *pose,
                      const struct mount *mount, double *from_rad, double *to_rad);

#endif
