/* SPDX-License-Identifier: MIT */
#include "gauss.h"

#include <math.h>

#include "grid/geometry.h"

#define NARROW 1e-3 /* in standard deviations: below, the difference of two tails would cancel */

static double density(double m)
{
    return exp(-m * m / 2) / sqrt(GEO_TURN);
}

double gauss_between(double from, double to, double mean, double sd)
{
    double h = (to - from) / sd;
    if (h < NARROW) {
        double m = ((from - mean) + (to - mean)) / 2 / sd;
        return density(m) * h * (1 + (m * m - 1) * h * h / 24);
    }
    double u = (from - mean) / (sd * sqrt(2)), v = (to - mean) / (sd * sqrt(2));
    if (u >= 0)
        return (erfc(u) - erfc(v)) / 2;
    if (v <= 0)
        return (erfc(-v) - erfc(-u)) / 2;
    return (erf(v) - erf(u)) / 2;
}

double gauss_around(double from, double to, double mean, double sd)
{
    int turns = 1 + (int)(6 * sd / GEO_PI);
    double p = 0;
    for (int k = -turns; k <= turns; k++)
        p += gauss_between(from + k * GEO_TURN, to + k * GEO_TURN, mean, sd);
    return p;
}

double gauss_midpoint(double from, double to, double mean, double sd)
{
    return density(((from - mean) + (to - mean)) / 2 / sd) * (to - from) / sd;
}
