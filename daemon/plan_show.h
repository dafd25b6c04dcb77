/* SPDX-License-Identifier: MIT */
/*
 * plan_show - the plan of a configuration with its memory, as a table for people and as JSON for programs: the same
 * numbers. Knows no process.
 */
#ifndef SONARD_PLAN_SHOW_H
#define SONARD_PLAN_SHOW_H

#include <stdio.h>

#include "config/conf.h"
#include "daemon/rpc/json_out.h"

/** plan_print - one line for each stage of a checked configuration, then the sum of those that are in. */
void plan_print(const struct conf *conf, FILE *out);

/** plan_write - as the method `plan` answers, sonard-protocol(7). */
void plan_write(const struct conf *conf, struct json_out *out);

#endif
