/* SPDX-License-Identifier: MIT */
/*
 * top_ring - sectors as a ring of letters around a plan of dots: B blocked, c clear, ? unknown. Letters tell what
 * colours tell.
 */
#ifndef SONARD_TOP_RING_H
#define SONARD_TOP_RING_H

#include <jansson.h>

#include "canvas.h"

/**
 * top_ring_draw - the result of `sectors` (NULL: nothing is known) in a square of `rows` rows and twice as many
 * columns, its upper left corner at (column, row); the edge is at range_m. Inside, the water known to be free is
 * dotted, and each obstacle is a line across its sector.
 */
void top_ring_draw(struct canvas *canvas, const json_t *sectors, double range_m, int column, int row, int rows);

#endif
