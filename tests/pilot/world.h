/* SPDX-License-Identifier: MIT */
/*
 * world - a place drawn at random through which a vehicle is to be steered: what stands in it, for the virtual sonars
 * (tests/sim/lib/scene.h) and for the truth, and the way that somebody with a chart would take.
 *
 * Coordinates are metres, NED. The vehicle starts at the origin, the goal lies to the north of it.
 */
#ifndef SONARD_PILOT_WORLD_H
#define SONARD_PILOT_WORLD_H

#include <stdbool.h>
#include <stdint.h>

#include "tests/sim/lib/scene.h"

enum pilot_place {
    PILOT_OPEN,     /* a pile or two */
    PILOT_HARBOUR,  /* a quay, piles, nets with free edges, beams across below and above, a bed */
    PILOT_SHAFT,    /* of a dam: four walls with ledges */
    PILOT_BASIN,    /* thin posts and nets within four walls */
    PILOT_DEAD_END, /* between the start and the goal */
    PILOT_DIVER,    /* somebody crosses the way */
    PILOT_PLACES,
};

extern const char *const pilot_place_name[PILOT_PLACES];

#define PILOT_SOLIDS_MAX 28
#define PILOT_ROUTE_MAX  64

struct pilot_solid {
    bool upright; /* p: x, y, radius and, per second, x, y; otherwise a box, p: x, x, y, y, z, z */
    double p[6];
};

struct pilot_world {
    struct pilot_solid solid[PILOT_SOLIDS_MAX];
    int solids;
    bool walled;
    double room[6]; /* as a box, around all */
    double goal_m[2];
    struct scene scene;
};

/** The upright cylinder that the vehicle is. */
struct pilot_hull {
    double radius_m, half_height_m;
};

/**
 * pilot_world_draw - nothing is within `free_m` of the hull at the start, nor is the goal within anything. Not every
 * world has a way to the goal (pilot_world_route).
 */
void pilot_world_draw(struct pilot_world *w, enum pilot_place place, uint64_t seed, const struct pilot_hull *hull,
                      double free_m);

/** pilot_world_clearance - from the hull at a place to what is nearest at time t_s; negative: within it. */
double pilot_world_clearance(const struct pilot_world *w, const double place_m[3], const struct pilot_hull *hull,
                             double t_s);

/** pilot_solid_swims - does it move? */
bool pilot_solid_swims(const struct pilot_solid *s);

/** pilot_world_still - the same without what moves. out->scene is not set. */
void pilot_world_still(const struct pilot_world *w, struct pilot_world *out);

/**
 * pilot_world_route - corners of a short way from the start to the goal that keeps off_m from all that does not move.
 * Returns their number, 0: there is none.
 */
int pilot_world_route(const struct pilot_world *w, const struct pilot_hull *hull, double off_m,
                      double route_m[PILOT_ROUTE_MAX][2]);

#endif
