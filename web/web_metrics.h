/* SPDX-License-Identifier: MIT */
/*
 * web_metrics - what Prometheus reads (text exposition format 0.0.4): the metrics of the method stats, and as gauges
 * what two questions answer: how many sectors are clear, blocked and unknown, and how fast the vehicle may go ahead.
 * Pure.
 */
#ifndef SONARD_WEB_METRICS_H
#define SONARD_WEB_METRICS_H

#include <jansson.h>
#include <stdio.h>

#define WEB_METRICS_QUESTIONS 3

/* What the daemon is asked for them, one after the other. */
struct web_metrics_question {
    const char *method;
    const char *params; /* JSON; NULL: none */
};

extern const struct web_metrics_question web_metrics_question[WEB_METRICS_QUESTIONS];

/** web_metrics_print - the results, in the order of the questions. What is not as the methods have it is left out. */
void web_metrics_print(FILE *out, json_t *const result[WEB_METRICS_QUESTIONS]);

#endif
