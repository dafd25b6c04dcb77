/* SPDX-License-Identifier: MIT */
/*
 * submap_methods - the map of places by its parts: its submaps and where they lie, a submap moved to where it has turned
 * out to be, and the surface of the free water page by page. sonard-protocol(7) has every shape.
 */
#ifndef SONARD_SUBMAP_METHODS_H
#define SONARD_SUBMAP_METHODS_H

#include "rpc.h"

json_t *submap_method_list(const struct rpc_call *call, json_t *params, struct rpc_error *error);
json_t *submap_method_move(const struct rpc_call *call, json_t *params, struct rpc_error *error);
bool submap_method_surface(const struct rpc_call *call, json_t *params, struct text *out, struct rpc_error *error);

#endif
