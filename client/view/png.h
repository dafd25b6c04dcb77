/* SPDX-License-Identifier: MIT */
/* png - a picture of at most 16 colours as a PNG file. Source: the PNG specification (W3C), third edition. */
#ifndef SONARD_PNG_H
#define SONARD_PNG_H

#include "bytes.h"

#define PNG_COLOURS 16

/**
 * png_write - width * height pixels, each a number of a colour (0 to 15), line by line from the top; width is even.
 * colours: red, green, blue of each. Without memory, out has failed.
 */
void png_write(struct bytes *out, const uint8_t *pixels, uint32_t width, uint32_t height,
               const uint8_t colours[PNG_COLOURS][3]);

#endif
