/* SPDX-License-Identifier: MIT */
/*
 * own_ring - how loud a beam is near the head when nothing but the vehicle is there: the baseline of all beams, and
 * what a template that is promised to hold the vehicle alone has at this bearing. Knows no echo and no free water.
 */
#ifndef SONARD_OWN_RING_H
#define SONARD_OWN_RING_H

#include "baseline.h"
#include "profile.h"

/** own_ring_cell - power of resolution cell i of the template, in the scale of p->cell; 0: there is no such template.
 * O(pulse). */
uint64_t own_ring_cell(const struct profile *p, uint32_t i);

/** own_ring_usual - as baseline_usual, or the vehicle's own echo in this beam where that is louder. */
double own_ring_usual(const struct profile *p, const struct baseline *b, uint32_t i);

/** own_ring_power - the loudest cell of the template's before p->first; 0: there is no such template. O(ring-down). */
uint64_t own_ring_power(const struct profile *p);

/** own_ring_loud_until - the cell behind the last one of those that is within 3 dB of that power; 0: as above. */
uint32_t own_ring_loud_until(const struct profile *p, uint64_t power);

#endif
