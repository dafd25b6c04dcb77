/* SPDX-License-Identifier: MIT */
/*
 * cluster_methods - the methods about what the grid's cells form together, and where to look next; sonard-protocol(7)
 * has every shape.
 */
#ifndef SONARD_CLUSTER_METHODS_H
#define SONARD_CLUSTER_METHODS_H

#include "rpc.h"

/** cluster_method_list - `clusters`: made when asked for, by the grid's owner; costs nothing before. */
bool cluster_method_list(const struct rpc_call *call, json_t *params, struct text *out, struct rpc_error *error);

/** cluster_method_next_look - `next_look`: which directions to look at next; made when asked for. */
json_t *cluster_method_next_look(const struct rpc_call *call, json_t *params, struct rpc_error *error);

#endif
