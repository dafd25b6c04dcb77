/* SPDX-License-Identifier: MIT */
/*
 * show_map - results of the daemon's methods about places for people: an answer in a few lines, the map's state, and a
 * level slice of it as SVG or in characters. What is missing or of the wrong kind is left out. Knows no socket.
 */
#ifndef SONARD_SHOW_MAP_H
#define SONARD_SHOW_MAP_H

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>

/** show_map_place - the result of `point`, `box` or `path`. */
void show_map_place(FILE *out, const json_t *result, bool colour);

/** show_map_state - the result of `map` and of what changes it. */
void show_map_state(FILE *out, const json_t *result);

/** show_map_draw - the result of `map_slice` in characters, north up: . free, # occupied,
 * blank unknown, @ the vehicle. */
void show_map_draw(FILE *out, const json_t *result);

/** show_map_svg - the same as SVG, with a grid in metres. False when writing fails (errno). */
bool show_map_svg(FILE *out, const json_t *result);

#endif
