/* SPDX-License-Identifier: MIT */
#include "rpc_error.h"

#include <stdarg.h>
#include <stdio.h>

#include "core/readable.h"

/* A message may quote what a client sent, cut anywhere: leave only what JSON and terminals take as it is. */
static void make_harmless(struct rpc_error *error)
{
    readable(error->message);
    for (char *c = error->message; *c; c++)
        if (*c == '"' || *c == '\\')
            *c = '\'';
}

bool rpc_refuse(struct rpc_error *error, int code, const char *fmt, ...)
{
    va_list args;
    error->code = code;
    va_start(args, fmt);
    vsnprintf(error->message, sizeof error->message, fmt, args);
    va_end(args);
    make_harmless(error);
    return false;
}
