/* SPDX-License-Identifier: MIT */
/* overlap - which of the sectors around the vehicle a cell of the grid reaches into. Pure geometry. */
#ifndef SONARD_OVERLAP_H
#define SONARD_OVERLAP_H

#include <stdbool.h>
#include <stddef.h>

/* A band of elevations, in `count` sectors of equal width; sector 0 is centred on azimuth 0. Where width_rad is above 0
 * they share what reaches clockwise from from_rad, and sector 0 is the first of that. */
struct overlap_band {
    double lo_rad, hi_rad;
    double from_rad, width_rad; /* below 2 pi */
    size_t count;
};

/* A cell, in the band's axes: its middle and how far it reaches to its sides. */
struct overlap_cell {
    double v[3];           /* of the middle; used while its angles are not exact */
    double az_rad, el_rad; /* exact, or wrong by less than GEO_ROUGH_RAD */
    double level;          /* cosine of the elevation */
    double half_az_rad, half_el_rad;
    bool exact;
};

/* The sectors at, at + 1, ... at + n - 1, past the last one too; at < count. */
struct overlap_run {
    size_t at, n;
};

/** overlap_middle - sets a cell's middle to where the unit vector v points. */
void overlap_middle(struct overlap_cell *cell, const double v[3]);

/**
 * overlap_run - the sectors that the cell touches when it is seen from up to `aside_rad` beside. An exact common
 * edge is no touch. Mostly arithmetic alone: the angles are computed exactly, and kept in the cell, where that decides.
 */
struct overlap_run overlap_run(const struct overlap_band *band, struct overlap_cell *cell, double aside_rad);

#endif
