/* SPDX-License-Identifier: MIT */
/* cell_methods - the method that locks cells of the grid; sonard-protocol(7) has every shape. */
#ifndef SONARD_CELL_METHODS_H
#define SONARD_CELL_METHODS_H

#include "rpc.h"

/** cell_method_lock - `grid_lock`: the cells of a cone, within a range, neither change nor fade, or do again. */
json_t *cell_method_lock(const struct rpc_call *call, json_t *params, struct rpc_error *error);

#endif
