/* SPDX-License-Identifier: MIT */
/*
 * verdict_bars - what else than obstacles and records says that water is not free, or that nobody promises it: the
 * bottom, and what beams showed elsewhere that may have come. Both are asked by the tiles of the question.
 */
#ifndef SONARD_VERDICT_BARS_H
#define SONARD_VERDICT_BARS_H

#include "verdict.h"

/** verdict_heed_bottom - where each part of that question meets the bottom, from the vehicle on: bottom_m and
 * bottom_at. */
void verdict_heed_bottom(struct verdict *v, const struct ask_question *asked);

/** verdict_heed_shown - how far `near` is promised to a vehicle that drifts: promised_m of each part. */
void verdict_heed_shown(struct verdict *v);

#endif
