/* SPDX-License-Identifier: MIT */
/*
 * plan_show - the plan of a configuration with its memory, as a table for people and as JSON for programs: the same
 * numbers. Knows no process.
 */
#ifndef SONARD_PLAN_SHOW_H
#define SONARD_PLAN_SHOW_H

#include <jansson.h>
#include <stdio.h>

#include "config/conf.h"

/** plan_print - one line for each stage of a checked configuration, then the sum of those that are in. */
void plan_print(const struct conf *conf, FILE *out);

/** plan_json - as the method `plan` answers, sonard-protocol(7). */
json_t *plan_json(const struct conf *conf);

#endif
