/* SPDX-License-Identifier: MIT */
/*
 * world - the truth that voxel maps are held against: water and what stands in it, as a distance to the nearest
 * surface, and by it the first range of a beam over its whole aperture, without sampling rays.
 * Knows no sound and no map.
 *
 * A world is a list of shapes, applied in order: water is added, solids are taken away. The clearance that comes out is
 * positive in water and never more than the distance to the nearest surface (it is 1-Lipschitz); in a single shape's
 * neighbourhood it is that distance. Coordinates are metres, NED, from origin_m: a world at 1e7 m is the same world.
 */
#ifndef SONARD_REPORT_WORLD_H
#define SONARD_REPORT_WORLD_H

#include <stdint.h>

#define WORLD_MAX_SHAPES 12

enum world_kind {
    WORLD_END,     /* of the list */
    WORLD_BOX,     /* p: low and high corner */
    WORLD_TUBE,    /* p: x, y, top, bottom, radius; upright */
    WORLD_CAPSULE, /* p: two ends; and thickness_m, its radius */
    WORLD_HALF,    /* only the cut */
};

struct world_shape {
    enum world_kind kind;
    double p[6];
    double thickness_m;
    double cut[4]; /* unit normal n and offset c: only what has n p <= c; all 0: everything */
    double v[3];   /* moves so many metres per second */
};

struct world {
    const char *name, *what;
    double origin_m[3];
    double low[3], high[3]; /* the part that is looked at, from the origin */
    double from[3], to[3];  /* the vehicle's way through it */
    double level_db;        /* <= 0: so much weaker than the others the surfaces that lie level answer */
    struct world_shape water[3], solid[WORLD_MAX_SHAPES];
};

extern const struct world worlds[];
extern const unsigned worlds_n;

/** world_named - ends the program when there is no such. */
const struct world *world_named(const char *name);

/**
 * world_drawn - one that no rule was chosen on: a shaft with a wall that leans (even seeds) or a sloping bottom before
 * a quay, with piles and a line (odd), its sizes, angles and the softness of what lies level drawn. The vehicle's way
 * keeps WORLD_DRAWN_CLEAR_M from everything.
 */
#define WORLD_DRAWN_CLEAR_M 0.6
struct world world_drawn(uint64_t seed);

/** world_clearance - at p (from the origin) at time t_s; <= 0 in a solid. */
double world_clearance(const struct world *w, const double p[3], double t_s);

/** world_ray - along a unit direction to the first surface, or max_m. */
double world_ray(const struct world *w, const double from[3], const double direction[3], double max_m, double t_s);

/**
 * world_first - to the nearest surface that a wedge-shaped beam meets (|azimuth| <= half_az, |latitude| <= half_el in
 * the frame axis[3], its x, y, z in the world), or max_m. Never beyond it, and at most 12 mm short of it: the aperture
 * is divided until a patch is surely clear or surely close.
 */
double world_first(const struct world *w, const double from[3], const double axis[3][3], double half_az_rad,
                   double half_el_rad, double max_m, double t_s);

#endif
