/* SPDX-License-Identifier: MIT */
/*
 * grid_methods - the grids of a running daemon: the method that lists them, and which one a question means.
 * sonard-protocol(7) has every shape.
 */
#ifndef SONARD_GRID_METHODS_H
#define SONARD_GRID_METHODS_H

#include "core/fault.h"
#include "daemon/rpc/json_out.h"
#include "daemon/methods/environment.h"

/** grid_asked - the grid that the parameter `grid` names, the main one without it; NULL with *error set. */
struct grid *grid_asked(struct methods_env *d, const json_t *params, struct rpc_error *error);

/** grid_has_room - may all grids take so many bytes more by [grids] memory? False with a sentence
 * about `name` in fault. */
bool grid_has_room(struct methods_env *d, const char *name, size_t more_bytes, struct fault *fault);

/** grid_list_write - the member `grids`: all grids with their counters. */
void grid_list_write(struct json_out *out, struct methods_env *d);

/** grid_turn_word - of a cell's flags: what happened to it in the present turn of the sensor that touched it last. */
const char *grid_turn_word(unsigned flags);

/** grid_sensor_name - of the sonar that a cell or a ping names; "?" when the configuration has no such sonar. */
const char *grid_sensor_name(const struct methods_env *d, uint32_t sensor);

#endif
