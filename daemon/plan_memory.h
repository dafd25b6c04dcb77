/* SPDX-License-Identifier: MIT */
/*
 * plan_memory - the bytes that each stage of a plan takes at the start, exactly; of a stage that is out, those that it
 * would take. What a stage takes of the processor is measured: `sonard --replay --measure`, `sonarctl stats`.
 */
#ifndef SONARD_PLAN_MEMORY_H
#define SONARD_PLAN_MEMORY_H

#include "plan.h"

/** plan_memory - bytes[k] is that of plan->stage[k], -1 where it has none of its own.
 * Returns the sum of those that are in. */
double plan_memory(const struct plan *plan, const struct conf *conf, double bytes[PLAN_STAGES_MAX]);

#endif
