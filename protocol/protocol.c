/* SPDX-License-Identifier: MIT */
#include "protocol.h"

#include <stdio.h>
#include <string.h>

#define PARAMS(...)                                                                                               \
    (const struct protocol_param[])                                                                               \
    {                                                                                                             \
        __VA_ARGS__                                                                                               \
        {                                                                                                         \
            0                                                                                                     \
        }                                                                                                         \
    }

/* What holds without a parameter. */
#define REQUIRED     .need = PROTOCOL_REQUIRED, .absent = ""
#define DEFAULT(...) .need = PROTOCOL_DEFAULT, .absent = "", .initial = {__VA_ARGS__}
#define ELSE(what)   .need = PROTOCOL_OPTIONAL, .absent = what
#define INSTEAD(of)  .need = PROTOCOL_OPTIONAL, .absent = "", .instead_of = of

/* One parameter. */
#define ROW(row_name, row_type, row_help, ...) {.name = row_name, .type = row_type, .help = row_help, __VA_ARGS__},
#define NUMBER(name, unit_, lo_, hi_, help, ...)                                                                  \
    ROW(name, PROTOCOL_NUMBER, help, .unit = unit_, .lo = lo_, .hi = hi_, __VA_ARGS__)
#define INTEGER(name, lo_, hi_, help, ...)                                                                        \
    ROW(name, PROTOCOL_INTEGER, help, .unit = "", .lo = lo_, .hi = hi_, __VA_ARGS__)
#define NUMBERS(name, n, unit_, lo_, hi_, help, ...)                                                              \
    ROW(name, PROTOCOL_NUMBERS, help, .count = n, .unit = unit_, .lo = lo_, .hi = hi_, __VA_ARGS__)
#define BAND(name, help, ...)                                                                                     \
    ROW(name, PROTOCOL_BAND, help, .count = 2, .unit = "degrees", .lo = -90, .hi = 90, __VA_ARGS__)
#define PLACES(name, n, unit_, lo_, hi_, help, ...)                                                               \
    ROW(name, PROTOCOL_PLACES, help, .count = n, .unit = unit_, .lo = lo_, .hi = hi_, __VA_ARGS__)
#define WORD(name, list, help, ...) ROW(name, PROTOCOL_WORD, help, .unit = "", .words = list, __VA_ARGS__)
#define ONE_OF(...)                                                                                               \
    (const char *const[])                                                                                         \
    {                                                                                                             \
        __VA_ARGS__, NULL                                                                                         \
    }
#define FLAG(name, help, ...)        ROW(name, PROTOCOL_FLAG, help, .unit = "", __VA_ARGS__)
#define OTHER(name, type, help, ...) ROW(name, PROTOCOL_##type, help, .unit = "", __VA_ARGS__)

#define FIELDS(...)                                                                                               \
    (const struct protocol_field[])                                                                               \
    {                                                                                                             \
        __VA_ARGS__                                                                                               \
        {                                                                                                         \
            0                                                                                                     \
        }                                                                                                         \
    }
#define FIELD(name, type, ...) {name, type, "" __VA_ARGS__, false},
#define MAYBE(name, type, ...) {name, type, "" __VA_ARGS__, true},

/* What a method answers: fields of its own, or what a type says. */
#define RESULT(...) NULL, FIELDS(__VA_ARGS__)
#define SAME(type)  #type, NULL

const struct protocol_shape protocol_shapes[] = {
#define SHAPE(name, fields) {#name, fields},
#include "shapes.def"
    {.name = NULL},
};

const struct protocol_method protocol_methods[] = {
#define METHOD(name, right, help, params, ...) {#name, PROTOCOL_##right, help, params, __VA_ARGS__},
#define SERVER_METHOD                          METHOD
#define CHECKING_METHOD                        METHOD
#include "methods.def"
    {.name = NULL},
};

const struct protocol_method *protocol_find(const char *name)
{
    for (const struct protocol_method *m = protocol_methods; m->name; m++)
        if (strcmp(m->name, name) == 0)
            return m;
    return NULL;
}

void protocol_without(const struct protocol_param *param, char *text, size_t size)
{
    const double *initial = param->initial;
    if (param->need != PROTOCOL_DEFAULT)
        snprintf(text, size, "%s", param->absent);
    else if (param->type == PROTOCOL_WORD)
        snprintf(text, size, "%s", param->words[(int)initial[0]]);
    else if (param->type == PROTOCOL_FLAG)
        snprintf(text, size, "%s", initial[0] != 0 ? "true" : "false");
    else if (param->type == PROTOCOL_BAND)
        snprintf(text, size, "%g,%g", initial[0], initial[1]);
    else
        snprintf(text, size, "%g", initial[0]);
}
