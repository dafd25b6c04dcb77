/* SPDX-License-Identifier: MIT */
/*
 * publish - from cells and claims to the picture that readers see.
 */
#ifndef SONARD_PUBLISH_H
#define SONARD_PUBLISH_H

#include "state.h"

/** publish_picture - all directions marked since the last time, and the frame as of this ping. */
void publish_picture(struct sphere *s, const struct echoes *e);

#endif
