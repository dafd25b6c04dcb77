/* SPDX-License-Identifier: MIT */
/*
 * publish - from cells to the picture that readers see.
 */
#ifndef SONARD_PUBLISH_H
#define SONARD_PUBLISH_H

#include "state.h"

/** publish_ping - all directions marked since the last time, and the frame as of this ping. */
void publish_ping(struct sphere *s, const struct echoes *e);

/** publish_changes - the directions alone, as of t_ns: what was changed without a ping. */
void publish_changes(struct sphere *s, uint64_t t_ns);

#endif
