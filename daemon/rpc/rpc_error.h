/* SPDX-License-Identifier: MIT */
/*
 * rpc_error - why a request is refused: a code of JSON-RPC and a sentence. Knows no request.
 */
#ifndef SONARD_RPC_ERROR_H
#define SONARD_RPC_ERROR_H

#include <stdbool.h>

enum rpc_code {
    RPC_PARSE_ERROR = -32700,
    RPC_INVALID_REQUEST = -32600,
    RPC_METHOD_NOT_FOUND = -32601,
    RPC_INVALID_PARAMS = -32602,
    RPC_INTERNAL_ERROR = -32603,
    RPC_FORBIDDEN = -32001, /* this client may ask but not change */
    RPC_LIMIT = -32000,     /* a limit of the server was reached; the message says which */
};

struct rpc_error {
    int code;          /* 0: none */
    char message[640]; /* one sentence: what, which parameter, what would be right */
};

/** rpc_refuse - fill *error with a sentence (bytes that JSON or a terminal would mind are replaced); returns false. */
bool rpc_refuse(struct rpc_error *error, int code, const char *fmt, ...) __attribute__((format(printf, 3, 4)));

#endif
