/* SPDX-License-Identifier: MIT */
/*
 * cell_edge - how near the cells of a ring come to a line from the grid's centre. A cell is wide: a question that asks
 * for all that may touch it asks for much that does not. Knows no question and no picture.
 */
#ifndef SONARD_CELL_EDGE_H
#define SONARD_CELL_EDGE_H

#include <stdint.h>

#include "grid/picture/rings.h"

/* What is alike for all cells of a ring. */
struct cell_edge {
    double sin_top, cos_top, sin_bottom, cos_bottom; /* of the elevations where they end */
    double cos_el;                                   /* of their middles' */
    double sin_half, cos_half;                       /* of half their width in azimuth */
};

struct cell_edge cell_edge_of(const struct rings *rings, uint32_t ring);

/** cell_edge_nearest - cosine of the least angle between unit vector axis and any ray of the cell whose middle is v. */
double cell_edge_nearest(const struct cell_edge *cell, const double v[3], const double axis[3]);

#endif
