/* SPDX-License-Identifier: MIT */
/*
 * wiring - from the configuration to what the stages want to know. The only place where names of the configuration
 * and names of the stages meet. Which stages there are is in plan.h.
 */
#ifndef SONARD_WIRING_H
#define SONARD_WIRING_H

#include "config/conf.h"
#include "daemon/input/pose_log.h"
#include "daemon/pipeline/pipeline.h"
#include "plan.h"

/** wiring_drift - what the vehicle is taken to do while nobody tells position or velocity, and its heading. */
void wiring_drift(const struct conf *conf, struct pose_drift *out);

/** wiring_pose_delay - how late poses are. */
void wiring_pose_delay(const struct conf *conf, struct pose_log *poses);

/** wiring_grid - how a grid is set that `grid` describes. */
void wiring_grid(const struct conf *conf, const struct conf_grid *grid, struct grid_setting *out);

/** wiring_pipeline - stages, mounts and buffer sizes for a checked configuration and its plan. */
void wiring_pipeline(const struct conf *conf, const struct plan *plan, bool patient, struct pipeline_conf *out);

/** wiring_grids_fit - may all grids together take so many bytes? False with a sentence about `name` in fault. */
bool wiring_grids_fit(const struct conf *conf, const char *name, double bytes, struct fault *fault);

/**
 * wiring_check - the grids of a pipeline fit into [grids] memory, and its map can be made. False with a sentence in
 * fault, which begins with the key: what --check says, and what the start says.
 */
bool wiring_check(const struct conf *conf, const struct pipeline_conf *pipeline, struct fault *fault);

/** wiring_cleanup - the steps that a configuration asks for; plan.h says of which sonars. */
void wiring_cleanup(const struct conf_extract *conf, struct cleanup_conf *out);

/** wiring_extract - the extraction of one sonar for a checked configuration. */
void wiring_extract(const struct conf *conf, int i, struct extract_conf *e);

#endif
