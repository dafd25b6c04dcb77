/* SPDX-License-Identifier: MIT */
/* surface - how far the surface of a map lies off: distances to the nearest marked cell,
 * and how they spread. Knows no map. */
#ifndef SONARD_REPORT_SURFACE_H
#define SONARD_REPORT_SURFACE_H

#include <stddef.h>
#include <stdint.h>

#include "grid/voxel/lattice.h"

#define SURFACE_SEARCH_M 1.0 /* what is farther counts as so far */

struct surface_spread {
    double mean_m, p95_m, max_m;
};

/** surface_index - of a cell of a box whose cells are stored in order, the last axis fastest. */
static inline size_t surface_index(const struct lattice_box *box, const int64_t cell[3])
{
    return (size_t)(((cell[0] - box->first[0]) * box->size[1] + cell[1] - box->first[1]) * box->size[2] + cell[2] -
                    box->first[2]);
}

/** surface_to_marked - from a place to the centre of the nearest of the box's cells whose mark is not 0. */
double surface_to_marked(const struct lattice_box *box, const uint8_t *mark, double voxel_m,
                         const struct lattice_place *at);

/** surface_spread_of - sorts d[n]; all 0 when there is none. */
struct surface_spread surface_spread_of(double *d, size_t n);

#endif
