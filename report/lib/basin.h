/* SPDX-License-Identifier: MIT */
/*
 * basin - a made-up basin for the spherical grid: four walls and some posts, alike at all depths, a vehicle that drives
 * through it and a scanning head that hears them. What a direction truly holds is known in closed form. Knows no grid.
 */
#ifndef SONARD_REPORT_BASIN_H
#define SONARD_REPORT_BASIN_H

#include "grid/echoes.h"
#include "tests/water/places.h"

#define BASIN_BEAMS  400 /* of a turn */
#define BASIN_TURNS  6
#define BASIN_AZ_DEG 2.0
#define BASIN_EL_DEG 20.0

struct basin {
    struct place place; /* posts are its shapes from 1 on */
    unsigned seed;
};

/** basin_make - the basin of a seed. */
void basin_make(struct basin *basin, unsigned seed);

/** basin_place - where the vehicle is in a turn: it stands still within each. */
void basin_place(const struct basin *basin, unsigned turn, double place[2]);

/** basin_range - the nearest surface from a place along an azimuth; *shape: whose, 0 of a wall. May be NULL. */
double basin_range(const struct basin *basin, const double place[2], double az_rad, int *shape);

/** basin_nearest - the nearest surface within half_rad of an azimuth. */
double basin_nearest(const struct basin *basin, const double place[2], double az_rad, double half_rad);

/** basin_listen - one beam of a turn, with noise in range; e->beam[0] is filled. still:
 * the vehicle stays where it begins. */
void basin_listen(const struct basin *basin, unsigned turn, unsigned beam, bool still, struct echoes *e);

#endif
