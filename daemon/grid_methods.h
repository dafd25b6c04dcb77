/* SPDX-License-Identifier: MIT */
/*
 * grid_methods - the grids of a running daemon: those of the configuration, the methods that list, make and drop
 * them, and which one a question means. sonard-protocol(7) has every shape.
 */
#ifndef SONARD_GRID_METHODS_H
#define SONARD_GRID_METHODS_H

#include "daemon.h"

/** grid_start - make the grids of the configuration beside the main one; false with a sentence in err. */
bool grid_start(struct daemon *d, char *err, size_t err_size);

/** grid_asked - the grid that the parameter `grid` names, the main one without it; NULL with *error set. */
struct grid *grid_asked(struct daemon *d, json_t *params, struct rpc_error *error);

/** grid_has_room - may all grids take so many bytes more by [grids] memory? False with a sentence about `name` in err. */
bool grid_has_room(struct daemon *d, const char *name, size_t more_bytes, char *err, size_t err_size);

/** grid_list_json - all grids with their counters. */
json_t *grid_list_json(struct daemon *d);

json_t *grid_method_list(const struct rpc_call *call, json_t *params, struct rpc_error *error);
json_t *grid_method_create(const struct rpc_call *call, json_t *params, struct rpc_error *error);
json_t *grid_method_drop(const struct rpc_call *call, json_t *params, struct rpc_error *error);

#endif
