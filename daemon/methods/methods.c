/* SPDX-License-Identifier: MIT */
/* The table of JSON-RPC methods, from protocol/methods.def. */
#include "methods.h"

#include "daemon/methods/environment.h"

const struct rpc_method daemon_methods[] = {
#define METHOD(name, right, ...)          {#name, method_##name, RPC_##right, &protocol_methods[PROTOCOL_##name]},
#define CHECKING_METHOD(name, right, ...) {#name, method_##name, RPC_##right, NULL},
#define SERVER_METHOD(...)
#include "protocol/methods.def"
    {.name = NULL},
};
