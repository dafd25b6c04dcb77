/* SPDX-License-Identifier: MIT */
/*
 * json_units - numbers as answers give them, rounded for people: a hundredth of a millimetre, degree or second is
 * beyond any sonar. json_member_*: a member of an object that is being written.
 */
#ifndef SONARD_JSON_UNITS_H
#define SONARD_JSON_UNITS_H

#include <jansson.h>
#include <stdlib.h>
#include <string.h>

#include "core/readable.h"
#include "grid/geometry.h"
#include "daemon/rpc/json_out.h"

#define PER_METRES  1e4 /* reported per metre, ... */
#define PER_DEGREES 1e4 /* ... per degree */
#define PER_AGE     1e3 /* ... and per second */

static inline void json_member_real(struct json_out *t, const char *name, double v, double per_unit)
{
    json_out_name(t, name);
    json_out_rounded(t, v, per_unit);
}

static inline void json_member_metres(struct json_out *t, const char *name, double m)
{
    json_member_real(t, name, m, PER_METRES);
}

static inline void json_member_degrees(struct json_out *t, const char *name, double rad)
{
    json_member_real(t, name, geo_deg(rad), PER_DEGREES);
}

static inline void json_member_null(struct json_out *t, const char *name)
{
    json_out_name(t, name);
    json_out_null(t);
}

static inline void json_member_known(struct json_out *t, const char *name, bool known, double v, double per_unit)
{
    if (known)
        json_member_real(t, name, v, per_unit);
    else
        json_member_null(t, name);
}

static inline void json_member_word(struct json_out *t, const char *name, const char *word)
{
    json_out_name(t, name);
    json_out_word(t, word);
}

static inline void json_member_metres3(struct json_out *t, const char *name, const double m[3])
{
    json_out_name(t, name);
    json_out_open(t, '[');
    for (int i = 0; i < 3; i++)
        json_out_rounded(t, m[i], PER_METRES);
    json_out_close(t, ']');
}

static inline void json_member_age(struct json_out *t, const char *name, double s)
{
    json_out_name(t, name);
    if (s < 0)
        json_out_null(t);
    else
        json_out_rounded(t, s, PER_AGE);
}

static inline void json_member_text(struct json_out *t, const char *name, const char *text)
{
    json_out_name(t, name);
    json_out_text(t, text);
}

/* Text from outside, as a path is. */
static inline void json_member_outside(struct json_out *t, const char *name, const char *outside)
{
    char *text = strdup(outside);
    if (!text) {
        t->failed = true;
        return;
    }
    readable(text);
    json_member_text(t, name, text);
    free(text);
}

static inline void json_member_count(struct json_out *t, const char *name, uint64_t n)
{
    json_out_name(t, name);
    json_out_integer(t, (int64_t)n);
}

static inline void json_member_flag(struct json_out *t, const char *name, bool value)
{
    json_out_name(t, name);
    json_out_flag(t, value);
}

/* A member that is an object or an array: one of { [. */
static inline void json_member_open(struct json_out *t, const char *name, char bracket)
{
    json_out_name(t, name);
    json_out_open(t, bracket);
}

#endif
