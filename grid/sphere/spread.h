/* SPDX-License-Identifier: MIT */
/*
 * spread - how an echo's evidence is shared out among cells: the polar Gaussian of eq. (1) in range and both angles.
 *
 * Angles are those that the beam sees, off its own axis: there the product of two normal distributions holds wherever
 * the beam points in the grid, at its poles as well. A weight is relative to the cell that the axis goes through, so
 * that a fine grid is not starved of evidence.
 */
#ifndef SONARD_SPREAD_H
#define SONARD_SPREAD_H

#include <stdbool.h>

#define SPREAD_CELLS_MOST 343 /* cells that an echo is spread over, unless its opening alone holds more */

/* sqrt(2 ln 2): where a normal distribution has fallen to half, in standard deviations; half a beam's opening. */
#define SPREAD_HALF_POWER 1.1774100225154747

/* What the spread is made for: standard deviations and widths of cells at the echo, in range, azimuth and elevation. */
struct spread {
    double sd_m, sd_az, sd_el;
    double reach; /* in standard deviations */
    bool midpoint;
};

/* How large the grid's cells are where the echo is. */
struct spread_cell {
    double deep_m, wide_rad, high_rad;
};

/**
 * spread_of - az, el: half the opening of the beam (at half power); reach in standard deviations, at least
 * SPREAD_HALF_POWER. The reach is less where it would be more than SPREAD_CELLS_MOST cells; the
 * whole opening is in it always, and all sides alike.
 */
struct spread spread_of(double sd_m, double half_az, double half_el, double reach, const struct spread_cell *cell,
                        bool midpoint);

/** spread_across - relative weight [0, 1] of a direction's cell centred so far off the axis; 0: out of reach. */
double spread_across(const struct spread *s, double off_az, double off_el, double wide, double high);

/** spread_along - share [0, 1] of an echo at range_m in a layer. */
double spread_along(const struct spread *s, double from_m, double to_m, double range_m);

#endif
