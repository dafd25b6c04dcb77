/* SPDX-License-Identifier: MIT */
/*
 * fit - settings that are allowed each, and with which next to nothing is ever clear: a sonar's beam against its steps,
 * the grid's directions and the vehicle. And a mount that cannot be, outside of the vehicle. What only the measured
 * water can tell is in the method `status`. Knows the configuration and the devices' table.
 */
#ifndef SONARD_FIT_H
#define SONARD_FIT_H

#include "config/conf.h"

typedef void (*fit_fn)(void *ctx, const char *sentence);

/** fit_judge - of a checked configuration: a sentence for each, which begins with the key that is to be changed. */
void fit_judge(const struct conf *conf, fit_fn tell, void *ctx);

/** fit_unchecked - a sentence for each sonar that sends ranges without the samples that they were chosen in. No setting
 * changes that. */
void fit_unchecked(const struct conf *conf, fit_fn tell, void *ctx);

/** fit_log - what fit_judge says as warnings, event misfit. */
void fit_log(const struct conf *conf);

#endif
