/* SPDX-License-Identifier: MIT */
/*
 * verdict_body - the verdict about a body that moves: how far `near` holds around it, then its way.
 */
#ifndef SONARD_VERDICT_BODY_H
#define SONARD_VERDICT_BODY_H

#include "verdict.h"

/** verdict_look_around - begins to ask how far `near` holds, or the way itself. */
void verdict_look_around(struct verdict *v);

/** verdict_step_way - some of the work; false: v->corridor is the answer. */
bool verdict_step_way(struct verdict *v);

#endif
