/* SPDX-License-Identifier: MIT */
#include "web_query.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const struct protocol_method *web_query_method(const char *name)
{
    const struct protocol_method *method = protocol_find(name);
    if (!method || method->right != PROTOCOL_ASKS || method == &protocol_methods[PROTOCOL_watch] ||
        method == &protocol_methods[PROTOCOL_unwatch])
        return NULL;
    return method;
}

/* A new method costs until it is named here. */
bool web_query_is_cheap(const struct protocol_method *method)
{
    static const enum protocol_index cheap[] = {PROTOCOL_blocked, PROTOCOL_limit,    PROTOCOL_time_to_collision,
                                                PROTOCOL_point,   PROTOCOL_version,  PROTOCOL_status,
                                                PROTOCOL_sensors, PROTOCOL_stats,    PROTOCOL_plan,
                                                PROTOCOL_map,     PROTOCOL_grid_list};
    for (size_t i = 0; i < sizeof cheap / sizeof *cheap; i++)
        if (method == &protocol_methods[cheap[i]])
            return true;
    return false;
}

static const struct protocol_param *find_param(const struct protocol_method *method, const char *name, size_t n)
{
    for (const struct protocol_param *p = method->params; p->name; p++)
        if (strlen(p->name) == n && memcmp(p->name, name, n) == 0)
            return p;
    return NULL;
}

/* The decimal number that text begins with, and where it ends; NULL: none. */
static json_t *read_number(const char *text, bool whole, const char **end)
{
    char *stop;
    const double v = strtod(text, &stop);
    *end = stop;
    /* strtod also takes what is no number in JSON: words, hexadecimal digits, spaces before it */
    if (stop == text || !isfinite(v) || strspn(text, "+-.0123456789eE") < (size_t)(stop - text))
        return NULL;
    if (whole)
        return v == floor(v) && fabs(v) < 9e15 ? json_integer((json_int_t)v) : NULL;
    return json_real(v);
}

static json_t *read_one(const char *text, bool whole)
{
    const char *end;
    json_t *number = read_number(text, whole, &end);
    if (number && *end) {
        json_decref(number);
        return NULL;
    }
    return number;
}

static json_t *read_list(const char *text)
{
    json_t *list = json_array();
    for (const char *at = text;; at++) {
        json_t *number = read_number(at, false, &at);
        if (!number || json_array_append_new(list, number) < 0 || (*at && *at != ',')) {
            json_decref(list);
            return NULL;
        }
        if (!*at)
            return list;
    }
}

static json_t *read_value(const struct protocol_param *p, const char *text)
{
    switch (p->type) {
    case PROTOCOL_NUMBER:
        return read_one(text, false);
    case PROTOCOL_INTEGER:
        return read_one(text, true);
    case PROTOCOL_NUMBERS:
    case PROTOCOL_BAND:
        return read_list(text);
    case PROTOCOL_PLACES:
    case PROTOCOL_OBJECT:
        return json_loads(text, JSON_REJECT_DUPLICATES, NULL);
    case PROTOCOL_FLAG:
        return strcmp(text, "true") == 0 ? json_true() : strcmp(text, "false") == 0 ? json_false() : NULL;
    default:
        return json_string(text);
    }
}

static const char *wanted(const struct protocol_param *p)
{
    switch (p->type) {
    case PROTOCOL_NUMBER:
        return "a number";
    case PROTOCOL_INTEGER:
        return "a whole number";
    case PROTOCOL_NUMBERS:
    case PROTOCOL_BAND:
        return "numbers separated by commas";
    case PROTOCOL_PLACES:
        return "a JSON array of places, [[1,2,3],[4,5,6]]";
    case PROTOCOL_OBJECT:
        return "a JSON object";
    case PROTOCOL_FLAG:
        return "true or false";
    default:
        return "text in UTF-8";
    }
}

bool web_query_add(const struct protocol_method *method, json_t *params, const char *text, size_t n,
                   struct fault *fault)
{
    const char *equals = memchr(text, '=', n);
    const size_t name = equals ? (size_t)(equals - text) : n;
    const struct protocol_param *p = find_param(method, text, name);
    char value[WEB_QUERY_VALUE_MAX + 1];
    json_t *read;
    if (!p)
        return fault_set(fault, "%s has no parameter '%.*s'; see /api/openapi.json", method->name,
                         (int)(name < 64 ? name : 64), text);
    if (json_object_get(params, p->name))
        return fault_set(fault, "%s is given twice", p->name);
    if (!equals || n - name - 1 > WEB_QUERY_VALUE_MAX || memchr(equals, '\0', n - name))
        return fault_set(fault, "%s: expected %s=..., at most %d bytes", p->name, p->name, WEB_QUERY_VALUE_MAX);
    memcpy(value, equals + 1, n - name - 1);
    value[n - name - 1] = '\0';
    read = read_value(p, value);
    if (!read || json_object_set_new(params, p->name, read) < 0)
        return fault_set(fault, "%s=%.60s: expected %s", p->name, value, wanted(p));
    return true;
}
