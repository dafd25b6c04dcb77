/* SPDX-License-Identifier: MIT */
#include "spread.h"

#include <math.h>

#include "gauss.h"

#define REACH_STEP 0.05

static double cells(double reach, double sd, double cell)
{
    return 2 * ceil(reach * sd / cell) + 1;
}

struct spread spread_of(double sd_m, double half_az, double half_el, double reach, const struct spread_cell *cell,
                        bool midpoint)
{
    struct spread s = {.sd_m = sd_m,
                       .sd_az = half_az / SPREAD_HALF_POWER,
                       .sd_el = half_el / SPREAD_HALF_POWER,
                       .reach = reach,
                       .midpoint = midpoint};
    while (s.reach > SPREAD_HALF_POWER && cells(s.reach, sd_m, cell->deep_m) *
                                                  cells(s.reach, s.sd_az, cell->wide_rad) *
                                                  cells(s.reach, s.sd_el, cell->high_rad) >
                                              SPREAD_CELLS_MOST)
        s.reach = fmax(SPREAD_HALF_POWER, s.reach - REACH_STEP);
    return s;
}

static double share(const struct spread *s, double from, double to, double sd)
{
    return s->midpoint ? gauss_midpoint(from, to, 0, sd) : gauss_between(from, to, 0, sd);
}

#define ALL_BEFORE_HALF_TURN 0.08 /* with a standard deviation this small nothing comes round the circle */

static double share_az(const struct spread *s, double from, double to)
{
    return s->midpoint || s->sd_az < ALL_BEFORE_HALF_TURN ? share(s, from, to, s->sd_az)
                                                          : gauss_around(from, to, 0, s->sd_az);
}

double spread_across(const struct spread *s, double off_az, double off_el, double wide, double high)
{
    if (fabs(off_az) > s->reach * s->sd_az + wide / 2 || fabs(off_el) > s->reach * s->sd_el + high / 2)
        return 0;
    double here = share_az(s, off_az - wide / 2, off_az + wide / 2) *
                  share(s, off_el - high / 2, off_el + high / 2, s->sd_el);
    return here / (share_az(s, -wide / 2, wide / 2) * share(s, -high / 2, high / 2, s->sd_el));
}

double spread_along(const struct spread *s, double from_m, double to_m, double range_m)
{
    return share(s, from_m - range_m, to_m - range_m, s->sd_m);
}
