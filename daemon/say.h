/* SPDX-License-Identifier: MIT */
/*
 * say - numbers as answers tell them, rounded for people: a hundredth of a millimetre, degree or second is beyond any
 * sonar. say_*: new references, as jansson's own. write_*: behind what is in a text.
 */
#ifndef SONARD_SAY_H
#define SONARD_SAY_H

#include <jansson.h>
#include <math.h>

#include "../grid/geometry.h"
#include "text.h"

#define SAY_METRES  1e4 /* told per metre, ... */
#define SAY_DEGREES 1e4 /* ... per degree */
#define SAY_AGE     1e3 /* ... and per second */

static inline double say_rounded(double v, double per_unit)
{
    return round(v * per_unit) / per_unit;
}

static inline json_t *say_real(double v, double per_unit)
{
    return json_real(say_rounded(v, per_unit));
}

static inline json_t *say_metres(double m)
{
    return say_real(m, SAY_METRES);
}

static inline json_t *say_metres3(const double m[3])
{
    return json_pack("[o, o, o]", say_metres(m[0]), say_metres(m[1]), say_metres(m[2]));
}

static inline json_t *say_degrees(double rad)
{
    return say_real(geo_deg(rad), SAY_DEGREES);
}

/* Negative: never, which is null. */
static inline json_t *say_age(double s)
{
    return s < 0 ? json_null() : say_real(s, SAY_AGE);
}

static inline void write_real(struct text *t, const char *name, double v, double per_unit)
{
    text_name(t, name);
    text_real(t, say_rounded(v, per_unit));
}

static inline void write_metres(struct text *t, const char *name, double m)
{
    write_real(t, name, m, SAY_METRES);
}

static inline void write_degrees(struct text *t, const char *name, double rad)
{
    write_real(t, name, geo_deg(rad), SAY_DEGREES);
}

static inline void write_null(struct text *t, const char *name)
{
    text_name(t, name);
    text_null(t);
}

static inline void write_known(struct text *t, const char *name, bool known, double v, double per_unit)
{
    if (known)
        write_real(t, name, v, per_unit);
    else
        write_null(t, name);
}

static inline void write_word(struct text *t, const char *name, const char *word)
{
    text_name(t, name);
    text_word(t, word);
}

static inline void write_metres3(struct text *t, const char *name, const double m[3])
{
    text_name(t, name);
    text_open(t, '[');
    for (int i = 0; i < 3; i++)
        text_real(t, say_rounded(m[i], SAY_METRES));
    text_close(t, ']');
}

static inline void write_age(struct text *t, const char *name, double s)
{
    text_name(t, name);
    if (s < 0)
        text_null(t);
    else
        text_real(t, say_rounded(s, SAY_AGE));
}

#endif
