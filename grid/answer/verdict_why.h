/* SPDX-License-Identifier: MIT */
/*
 * verdict_why - why the water is not free any farther, and how old what an answer rests on is.
 */
#ifndef SONARD_VERDICT_WHY_H
#define SONARD_VERDICT_WHY_H

#include "verdict.h"

#define VERDICT_LOOK_RAD 1e-3 /* half of what a look along a line takes in */

/** verdict_draw_in - a tile reaches beyond the question, and its middle may be there: moves `at` to the nearest
 * direction of the question at that range, as far as its axes may be turned. */
void verdict_draw_in(const struct verdict *v, double range_m, double at[3]);

/** verdict_as_told - as poses have it, whatever they leave uncertain. */
struct water_view verdict_as_told(const struct water_view *view);

/** verdict_count_age - the answer is as old as the oldest record that it could rest on. */
void verdict_count_age(struct verdict_part *part, const struct water_record *r);

/** verdict_reason - why the water of the part ends in end_at at end_m: the gravest of the reasons for which records by
 * which it would go on do not count. */
enum answer_reason verdict_reason(struct verdict *v, struct verdict_part *part);

#endif
