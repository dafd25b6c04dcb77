/* SPDX-License-Identifier: MIT */
/* web_metrics - the result of the method stats as Prometheus has it (text exposition format 0.0.4). Pure. */
#ifndef SONARD_WEB_METRICS_H
#define SONARD_WEB_METRICS_H

#include <jansson.h>
#include <stdio.h>

/** web_metrics_print - what is not as stats has it is left out. */
void web_metrics_print(FILE *out, const json_t *stats);

#endif
