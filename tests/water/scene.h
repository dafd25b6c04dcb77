/* SPDX-License-Identifier: MIT */
/*
 * scene - a place (place.h) as text.
 *
 * One shape per line, # begins a comment. World frame: north, east, down in metres.
 *
 *   box XMIN XMAX YMIN YMAX ZMIN ZMAX    walls of a room around the sonar, or a block seen from outside
 *   cylinder X Y RADIUS                  vertical pile, or a round tank around the sonar
 *   slope DISTANCE AZIMUTH ELEVATION     plane; its point nearest to the origin lies there (degrees, + is up)
 *   pile X Y RADIUS VX VY                vertical cylinder that moves, metres per second
 */
#ifndef SONARD_WATER_SCENE_H
#define SONARD_WATER_SCENE_H

#include <stdio.h>

#include "core/fault.h"
#include "place.h"

/** scene_parse - read a scene's text; `name` stands for it in messages. False with a sentence in fault. */
bool scene_parse(struct place *place, const char *name, const char *text, struct fault *fault);

/** scene_load - a built-in scene's name, or a file. False with a sentence in fault. */
bool scene_load(struct place *place, const char *name_or_file, struct fault *fault);

/** scene_print_builtin - one line per built-in scene. */
void scene_print_builtin(FILE *out);

#endif
