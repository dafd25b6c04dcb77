/* SPDX-License-Identifier: MIT */
#include "params.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *params_kind(const json_t *value)
{
    switch (json_typeof(value)) {
    case JSON_OBJECT:
        return "an object";
    case JSON_ARRAY:
        return "an array";
    case JSON_STRING:
        return "a string";
    case JSON_INTEGER:
    case JSON_REAL:
        return "a number";
    case JSON_TRUE:
    case JSON_FALSE:
        return "true or false";
    default:
        return "null";
    }
}

/* ---- refusals ---- */

#define LIST_BYTES 160

static void list_name(char list[LIST_BYTES], const char *name)
{
    const size_t used = strlen(list);
    snprintf(list + used, LIST_BYTES - used, "%s%s", used ? ", " : "", name);
}

static bool refuse_name(const char *name, const char *allowed, struct rpc_error *error)
{
    return rpc_refuse(error, RPC_INVALID_PARAMS, "'%.40s' is not known here, allowed: %s", name,
                      allowed[0] ? allowed : "no parameters");
}

bool params_refuse_other(json_t *object, const char *const *names, struct rpc_error *error)
{
    char allowed[LIST_BYTES] = "";
    const char *name;
    json_t *value;
    json_object_foreach(object, name, value)
    {
        int i = 0;
        while (names[i] && strcmp(names[i], name) != 0)
            i++;
        if (names[i])
            continue;
        for (i = 0; names[i]; i++)
            list_name(allowed, names[i]);
        return refuse_name(name, allowed, error);
    }
    return true;
}

static bool refuse_unknown(const struct protocol_param *rows, json_t *params, struct rpc_error *error)
{
    char allowed[LIST_BYTES] = "";
    const char *name;
    json_t *value;
    json_object_foreach(params, name, value)
    {
        const struct protocol_param *row = rows;
        while (row->name && strcmp(row->name, name) != 0)
            row++;
        if (row->name)
            continue;
        for (row = rows; row->name; row++)
            list_name(allowed, row->name);
        return refuse_name(name, allowed, error);
    }
    return true;
}

static bool refuse_kind(const char *label, const json_t *value, const char *wanted, struct rpc_error *error)
{
    return rpc_refuse(error, RPC_INVALID_PARAMS, "parameter '%s' is %s, expected %s", label, params_kind(value),
                      wanted);
}

/* ---- one value ---- */

const char *params_number_text(double number, char text[PARAMS_NUMBER_SIZE])
{
    for (int digits = 6; digits <= 17; digits++) {
        snprintf(text, PARAMS_NUMBER_SIZE, "%.*g", digits, number);
        if (strtod(text, NULL) == number)
            break;
    }
    return text;
}

static bool check_number(const struct protocol_param *row, const char *label, const json_t *value,
                         struct rpc_error *error)
{
    char wanted[64], text[PARAMS_NUMBER_SIZE];
    snprintf(wanted, sizeof wanted, "a number from %g to %g", row->lo, row->hi);
    if (!json_is_number(value))
        return refuse_kind(label, value, wanted, error);
    const double number = json_number_value(value);
    return (number >= row->lo && number <= row->hi) ||
           rpc_refuse(error, RPC_INVALID_PARAMS, "parameter '%s' is %s, expected %s", label,
                      params_number_text(number, text), wanted);
}

static bool check_integer(const struct protocol_param *row, const json_t *value, struct rpc_error *error)
{
    const long long lo = (long long)row->lo, hi = (long long)row->hi, number = json_integer_value(value);
    char wanted[80];
    snprintf(wanted, sizeof wanted, "a whole number from %lld to %lld", lo, hi);
    if (json_is_real(value))
        return rpc_refuse(error, RPC_INVALID_PARAMS, "parameter '%s' is not whole, expected %s", row->name,
                          wanted);
    if (!json_is_integer(value))
        return refuse_kind(row->name, value, wanted, error);
    return (number >= lo && number <= hi) ||
           rpc_refuse(error, RPC_INVALID_PARAMS, "parameter '%s' is %lld, expected %s", row->name, number, wanted);
}

/* n numbers; label: the array's name in messages. */
static bool check_numbers(const struct protocol_param *row, const char *label, const json_t *value, size_t n,
                          struct rpc_error *error)
{
    char one[64];
    snprintf(one, sizeof one, "an array of %zu numbers", n);
    if (!json_is_array(value))
        return refuse_kind(label, value, one, error);
    if (json_array_size(value) != n)
        return rpc_refuse(error, RPC_INVALID_PARAMS, "parameter '%s' has %zu elements, expected %zu numbers",
                          label, json_array_size(value), n);
    for (size_t i = 0; i < n; i++) {
        snprintf(one, sizeof one, "%s[%zu]", label, i);
        if (!check_number(row, one, json_array_get(value, i), error))
            return false;
    }
    return true;
}

static bool check_band(const struct protocol_param *row, const json_t *value, struct rpc_error *error)
{
    if (!check_numbers(row, row->name, value, 2, error))
        return false;
    const double lo = json_number_value(json_array_get(value, 0)),
                 hi = json_number_value(json_array_get(value, 1));
    char from[PARAMS_NUMBER_SIZE], to[PARAMS_NUMBER_SIZE];
    return lo < hi || rpc_refuse(error, RPC_INVALID_PARAMS, "%s is [%s, %s]: the first must be below the second",
                                 row->name, params_number_text(lo, from), params_number_text(hi, to));
}

static bool check_places(const struct protocol_param *row, const json_t *value, struct rpc_error *error)
{
    const size_t n = json_array_size(value);
    char label[64];
    if (n < 1 || n > row->count)
        return rpc_refuse(error, RPC_INVALID_PARAMS, "%s must be an array of 1 to %u places", row->name,
                          row->count);
    for (size_t i = 0; i < n; i++) {
        snprintf(label, sizeof label, "%s[%zu]", row->name, i);
        if (!check_numbers(row, label, json_array_get(value, i), 3, error))
            return false;
    }
    return true;
}

static bool check_word(const struct protocol_param *row, const json_t *value, struct rpc_error *error)
{
    const char *word = json_string_value(value);
    char allowed[LIST_BYTES] = "";
    for (int i = 0; row->words[i]; i++) {
        if (word && strcmp(word, row->words[i]) == 0)
            return true;
        list_name(allowed, row->words[i]);
    }
    return rpc_refuse(error, RPC_INVALID_PARAMS, "parameter '%s' is %.40s, expected one of: %s", row->name,
                      word ? word : params_kind(value), allowed);
}

static bool check(const struct protocol_param *row, const json_t *value, struct rpc_error *error)
{
    switch (row->type) {
    case PROTOCOL_NUMBER:
        return check_number(row, row->name, value, error);
    case PROTOCOL_INTEGER:
        return check_integer(row, value, error);
    case PROTOCOL_NUMBERS:
        return check_numbers(row, row->name, value, row->count, error);
    case PROTOCOL_BAND:
        return check_band(row, value, error);
    case PROTOCOL_PLACES:
        return check_places(row, value, error);
    case PROTOCOL_WORD:
        return check_word(row, value, error);
    case PROTOCOL_FLAG:
        return json_is_boolean(value) || refuse_kind(row->name, value, "true or false", error);
    case PROTOCOL_OBJECT:
        return json_is_object(value) || refuse_kind(row->name, value, "an object", error);
    case PROTOCOL_CURSOR:
        return json_is_string(value) || json_is_null(value) ||
               refuse_kind(row->name, value, "a string or null", error);
    default:
        return json_is_string(value) || refuse_kind(row->name, value, "a string", error);
    }
}

/* ---- defaults ---- */

static json_t *initial(const struct protocol_param *row)
{
    switch (row->type) {
    case PROTOCOL_NUMBER:
        return json_real(row->initial[0]);
    case PROTOCOL_INTEGER:
        return json_integer((json_int_t)row->initial[0]);
    case PROTOCOL_WORD:
        return json_string(row->words[(int)row->initial[0]]);
    case PROTOCOL_FLAG:
        return json_boolean(row->initial[0] != 0);
    case PROTOCOL_BAND:
        return json_pack("[f, f]", row->initial[0], row->initial[1]);
    default:
        return NULL; /* the others have none */
    }
}

/* The parameter that was given in its place, or NULL. */
static const struct protocol_param *given_instead(const struct protocol_param *rows, const char *name,
                                                  const json_t *params)
{
    for (const struct protocol_param *row = rows; row->name; row++)
        if (row->instead_of && strcmp(row->instead_of, name) == 0 && json_object_get(params, row->name))
            return row;
    return NULL;
}

bool params_take(const struct protocol_param *rows, json_t *params, struct rpc_error *error)
{
    if (!refuse_unknown(rows, params, error))
        return false;
    for (const struct protocol_param *row = rows; row->name; row++) {
        const json_t *value = json_object_get(params, row->name);
        const struct protocol_param *instead = given_instead(rows, row->name, params);
        if (!value && row->need == PROTOCOL_REQUIRED)
            return rpc_refuse(error, RPC_INVALID_PARAMS, "parameter '%s' is missing", row->name);
        if (value && !check(row, value, error))
            return false;
        if (value && instead)
            return rpc_refuse(error, RPC_INVALID_PARAMS, "%s and %s exclude each other: give only one", row->name,
                              instead->name);
        if (!value && !instead && row->need == PROTOCOL_DEFAULT &&
            json_object_set_new(params, row->name, initial(row)) != 0)
            return rpc_refuse(error, RPC_INTERNAL_ERROR, "out of memory");
    }
    return true;
}

/* ---- reading ---- */

bool params_has(const json_t *params, const char *name)
{
    return json_object_get(params, name) != NULL;
}

double params_number(const json_t *params, const char *name)
{
    return json_number_value(json_object_get(params, name));
}

int64_t params_integer(const json_t *params, const char *name)
{
    return json_integer_value(json_object_get(params, name));
}

bool params_flag(const json_t *params, const char *name)
{
    return json_is_true(json_object_get(params, name));
}

const char *params_text(const json_t *params, const char *name)
{
    return json_string_value(json_object_get(params, name));
}

bool params_is(const json_t *params, const char *name, const char *word)
{
    const char *text = params_text(params, name);
    return text && strcmp(text, word) == 0;
}

bool params_numbers(const json_t *params, const char *name, double *out)
{
    const json_t *value = json_object_get(params, name);
    for (size_t i = 0; i < json_array_size(value); i++)
        out[i] = json_number_value(json_array_get(value, i));
    return value != NULL;
}

unsigned params_places(const json_t *params, const char *name, double out[][3])
{
    const json_t *value = json_object_get(params, name);
    const size_t n = json_array_size(value);
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < 3; k++)
            out[i][k] = json_number_value(json_array_get(json_array_get(value, i), k));
    return (unsigned)n;
}
