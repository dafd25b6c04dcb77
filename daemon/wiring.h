/* SPDX-License-Identifier: MIT */
/*
 * wiring - from the configuration to what the stages want to know. The only place where names of the configuration
 * and names of the stages meet. Which stages there are is in plan.h.
 */
#ifndef SONARD_WIRING_H
#define SONARD_WIRING_H

#include "../config/conf.h"
#include "pipeline.h"
#include "plan.h"

/** wiring_grid - how a grid is set that `grid` describes. */
void wiring_grid(const struct conf *conf, const struct conf_grid *grid, struct grid_setting *out);

/** wiring_pipeline - stages, mounts and buffer sizes for a checked configuration and its plan. */
void wiring_pipeline(const struct conf *conf, const struct plan *plan, bool patient, struct pipeline_conf *out);

/** wiring_cleanup - the steps that a configuration asks for; plan.h says of which sonars. */
void wiring_cleanup(const struct conf_extract *conf, struct cleanup_conf *out);

/** wiring_extract - the extraction of one sonar for a checked configuration. */
void wiring_extract(const struct conf *conf, int i, struct extract_conf *e);

#endif
