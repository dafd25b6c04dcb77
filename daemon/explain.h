/* SPDX-License-Identifier: MIT */
/*
 * explain - the plan of a configuration with its costs, as a table for people and as JSON for programs: the same
 * numbers. Knows no process.
 */
#ifndef SONARD_EXPLAIN_H
#define SONARD_EXPLAIN_H

#include <jansson.h>
#include <stdio.h>

#include "../config/conf.h"

/** explain_print - one line for each stage of a checked configuration, then the sum of those that are in. */
void explain_print(const struct conf *conf, FILE *out);

/** explain_json - as the method `plan` answers, sonard-protocol(7). */
json_t *explain_json(const struct conf *conf);

#endif
