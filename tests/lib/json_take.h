/* SPDX-License-Identifier: MIT */
/* json_take.h - a method's result from a value of jansson, for methods of tests. */
#ifndef SONARD_TESTS_JSON_TAKE_H
#define SONARD_TESTS_JSON_TAKE_H

#include "daemon/rpc/json_out.h"

/** json_out_take - a whole value, which is used up; false: it is NULL, and nothing was written. */
static inline bool json_out_take(struct json_out *t, json_t *value)
{
    if (value)
        json_out_value(t, value);
    json_decref(value);
    return value != NULL;
}

#endif
