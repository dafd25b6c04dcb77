/* SPDX-License-Identifier: MIT */
/*
 * web_query - the parameters of a URL as those of a method, by the table of methods (protocol/). Checks forms only; the
 * ranges are the daemon's. Pure.
 */
#ifndef SONARD_WEB_QUERY_H
#define SONARD_WEB_QUERY_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

#include "core/fault.h"
#include "protocol/protocol.h"

#define WEB_QUERY_VALUE_MAX 8192 /* bytes of a parameter */

/** web_query_method - the row of a method that only asks and can be called alone (not watch, unwatch), or NULL. */
const struct protocol_method *web_query_method(const char *name);

/**
 * web_query_is_cheap - whatever its parameters are, the daemon has answered it soon; any page may have a browser ask
 * it. The others want WEB_QUERY_HEADER, which a page of another site cannot have a browser send.
 */
bool web_query_is_cheap(const struct protocol_method *method);

#define WEB_QUERY_HEADER "x-sonard"

/**
 * web_query_add - add "name=value" of n bytes, already decoded, to params, an object. Numbers of an array are separated
 * by commas; places are a JSON array of arrays, and so is an object JSON. False with a sentence in fault.
 */
bool web_query_add(const struct protocol_method *method, json_t *params, const char *text, size_t n,
                   struct fault *fault);

#endif
