/* SPDX-License-Identifier: MIT */
/*
 * show - results of the daemon's methods for people: aligned, with units and rounded ages. What is missing or of the
 * wrong kind is shown as "-"; text of the daemon cannot move the cursor. Knows no socket.
 */
#ifndef SONARD_SHOW_H
#define SONARD_SHOW_H

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>

/** show_result - the result of `method`; indented JSON for methods that have no form of their own here. */
void show_result(FILE *out, const char *method, const json_t *result, bool colour);

#endif
