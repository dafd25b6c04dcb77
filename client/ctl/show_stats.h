/* SPDX-License-Identifier: MIT */
/*
 * show_stats - the result of `stats`: for people, and in the text format that Prometheus scrapes. What is missing or of
 * the wrong kind is left out. Knows no socket.
 */
#ifndef SONARD_SHOW_STATS_H
#define SONARD_SHOW_STATS_H

#include <jansson.h>
#include <stdio.h>

/** show_stats - a line for each number that is not zero, and for each histogram. */
void show_stats(FILE *out, const json_t *result);

/** show_stats_prometheus - the text exposition format 0.0.4, with HELP and TYPE. */
void show_stats_prometheus(FILE *out, const json_t *result);

#endif
