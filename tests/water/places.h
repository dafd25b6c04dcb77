/* SPDX-License-Identifier: MIT */
/* places - the places that there are: those with a name, and those that are drawn by chance. */
#ifndef SONARD_WATER_PLACES_H
#define SONARD_WATER_PLACES_H

#include <stdint.h>

#include "place.h"

extern const struct place places[];
extern const unsigned places_n;

/** place_named - ends the program when there is no such. */
const struct place *place_named(const char *name);

/**
 * place_drawn - one that no rule was chosen on: a shaft with a wall that leans (even seeds) or a sloping bottom before
 * a quay, with piles and a line (odd), its sizes, angles and the softness of what lies level drawn. The vehicle's way
 * keeps PLACE_DRAWN_CLEAR_M from everything.
 */
#define PLACE_DRAWN_CLEAR_M 0.6
struct place place_drawn(uint64_t seed);

#define PLACE_BASIN_POSTS 6

/** place_basin - four walls, alike at all depths, and behind that shape posts of 20 cm, clear of its middle. */
struct place place_basin(uint64_t seed);

/** place_tank - a box of which the origin keeps clear_m at least; *heading_rad: a vehicle's in it. */
struct place place_tank(uint64_t seed, double clear_m, double *heading_rad);

/* Through these a vehicle is steered from the origin to a goal in the north. */
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

/**
 * place_of_pilot - nothing is within `free_m` of the hull at the start, nor is the goal within anything. Not every one
 * has a way to the goal (tests/pilot/route.h).
 */
struct place place_of_pilot(enum pilot_place place, uint64_t seed, const struct place_hull *hull, double free_m);

#endif
