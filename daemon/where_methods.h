/* SPDX-License-Identifier: MIT */
/*
 * where_methods - is a place, a box or a path free? What a client may ask of the map of places about where it wants to go.
 * A large question is answered in steps, between which pings and other clients have their turn. sonard-protocol(7) has
 * every shape.
 */
#ifndef SONARD_WHERE_METHODS_H
#define SONARD_WHERE_METHODS_H

#include "rpc.h"

json_t *where_method_point(const struct rpc_call *call, json_t *params, struct rpc_error *error);
json_t *where_method_box(const struct rpc_call *call, json_t *params, struct rpc_error *error);
json_t *where_method_path(const struct rpc_call *call, json_t *params, struct rpc_error *error);

#endif
