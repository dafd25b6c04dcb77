/* SPDX-License-Identifier: MIT */
/*
 * drift_words - in words: how far a vehicle of unknown position may drift, and which promise or sensor would make that
 * less, and by how much. Status, the page, sonarctl and the autopilot's pilot all get this sentence. Knows no JSON.
 */
#ifndef SONARD_DRIFT_WORDS_H
#define SONARD_DRIFT_WORDS_H

#include "daemon/methods/query_context.h"

/** drift_bound_doubt - why no bound of the speed counts although a client sends, or sent, one; empty: one does, or
 * nobody ever did. Constant text. */
const char *drift_bound_doubt(const struct methods_env *d);

/**
 * drift_sentence - of poses without position and velocity: how far the vehicle may drift in a turn of the head, and
 * what would change that, with the metres that it would leave where they can be told: those are of the same turn, at
 * the speed of the newest bound. Empty while poses have a position or a velocity, while station_keeping promises the
 * drift, and where the sonar counts as fixed. Returns text.
 */
const char *drift_sentence(const struct methods_env *d, char text[QUERY_REASON_SIZE]);

/** drift_why_not_clear - of a ring, in NED or not, in which no direction is clear: why that is; empty: each
 * direction has a cause of its own. Returns text. */
const char *drift_why_not_clear(const struct methods_env *d, const struct picture_frame *frame, bool ned,
                                char text[QUERY_REASON_SIZE]);

#endif
