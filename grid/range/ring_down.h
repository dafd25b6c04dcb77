/* SPDX-License-Identifier: MIT */
/*
 * ring_down - where the head's own ringing ends in a beam. Knows no other beam and no detector.
 */
#ifndef SONARD_RING_DOWN_H
#define SONARD_RING_DOWN_H

#include "profile.h"

/**
 * ring_down_found - the first cell behind the ring-down: from the loudest cell near the head (the first bins may be
 * zero) over the saturated ones to where the level stops falling; it is looked at over a guard length, since speckle
 * has holes. A wall in the falling level is not found; but the end lies behind it, and so its place is not called
 * free. n at most; reads cell, samples and floor_power of the profile.
 */
uint32_t ring_down_found(const struct profile *p);

/** ring_down_at - the first cell behind end_m, or later if the receiver is still saturated there; may be beyond n. */
uint32_t ring_down_at(const struct profile *p, double end_m);

#endif
