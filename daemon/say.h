/* SPDX-License-Identifier: MIT */
/*
 * say - numbers as answers tell them, rounded for people: a hundredth of a millimetre, degree or second is beyond any
 * sonar. New references, as jansson's own.
 */
#ifndef SONARD_SAY_H
#define SONARD_SAY_H

#include <jansson.h>
#include <math.h>

#include "../grid/geometry.h"

static inline json_t *say_real(double v, double per_unit)
{
    return json_real(round(v * per_unit) / per_unit);
}

static inline json_t *say_metres(double m)
{
    return say_real(m, 1e4);
}

static inline json_t *say_metres3(const double m[3])
{
    return json_pack("[o, o, o]", say_metres(m[0]), say_metres(m[1]), say_metres(m[2]));
}

static inline json_t *say_degrees(double rad)
{
    return say_real(geo_deg(rad), 1e4);
}

/* Negative: never, which is null. */
static inline json_t *say_age(double s)
{
    return s < 0 ? json_null() : say_real(s, 1e3);
}

#endif
