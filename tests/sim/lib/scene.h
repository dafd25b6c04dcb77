/* SPDX-License-Identifier: MIT */
/*
 * scene - what stands in the water of a virtual sonar, and how far it is along a ray. Knows shapes; knows nothing
 * of sound.
 *
 * A scene is text, one shape per line, # begins a comment. World frame: north, east, down in metres.
 *
 *   box XMIN XMAX YMIN YMAX ZMIN ZMAX    walls of a room around the sonar, or a block seen from outside
 *   cylinder X Y RADIUS                  vertical pile, or a round tank around the sonar
 *   slope DISTANCE AZIMUTH ELEVATION     plane; its point nearest to the origin lies there (degrees, + is up)
 *   pile X Y RADIUS VX VY                vertical cylinder that moves, metres per second
 */
#ifndef SONARD_SIM_SCENE_H
#define SONARD_SIM_SCENE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#include "core/fault.h"

#define SCENE_MAX_SHAPES  32
#define SCENE_MAX_NUMBERS 6

struct scene_shape {
    const struct scene_kind *kind;
    double p[SCENE_MAX_NUMBERS]; /* as in the text; a slope: distance and unit normal */
};

struct scene {
    size_t n;
    struct scene_shape shape[SCENE_MAX_SHAPES];
};

struct scene_hit {
    double range_m;
    double cos_incidence; /* between the ray and the surface's normal, 0..1 */
    double ghost_m;       /* apparent range of the echo's second bounce */
};

/** scene_parse - read a scene's text; `name` stands for it in messages. False with a sentence in fault. */
bool scene_parse(struct scene *scene, const char *name, const char *text, struct fault *fault);

/** scene_load - a built-in scene's name, or a file. False with a sentence in fault. */
bool scene_load(struct scene *scene, const char *name_or_file, struct fault *fault);

/** scene_print_builtin - one line per built-in scene. */
void scene_print_builtin(FILE *out);

/**
 * scene_cast - the nearest surface along a ray from origin (NED, metres) in the unit direction at time t_s of the
 * scene. False when the ray meets nothing.
 */
bool scene_cast(const struct scene *scene, const double origin[3], const double direction[3], double t_s,
                struct scene_hit *hit);

#endif
