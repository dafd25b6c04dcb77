/* SPDX-License-Identifier: MIT */
/* picture - the image of a sonar as it lies in the plane: the vehicle in the middle, forward up, starboard right. */
#ifndef SONARD_PICTURE_H
#define SONARD_PICTURE_H

#include "bytes.h"
#include "view_rows.h"

#define PICTURE_SIDE 320 /* pixels */

/** picture_range_m - from its middle to the middle of a side: the farthest of the rows. 0: there are none. */
double picture_range_m(const struct view_rows *rows);

/** picture_draw - as numbers: 0 where nothing was received, else 1 to 15, the loudest of what a pixel covers. */
void picture_draw(const struct view_rows *rows, uint8_t pixels[PICTURE_SIDE * PICTURE_SIDE]);

/** picture_png - as a file, from dark to light. */
void picture_png(const struct view_rows *rows, struct bytes *out);

#endif
