/* SPDX-License-Identifier: MIT */
/*
 * place - made-up water and what stands in it, for all virtual sonars and for the truth that answers are held against:
 * how far it is to the nearest surface, along a ray, and within a beam. Knows no sound and no map.
 *
 * A place is a list of convex shapes: first those of water, together all the water there is (none: water is
 * everywhere), then what stands in it. Coordinates are metres, NED, from origin_m: a place at 1e7 m is the same place.
 */
#ifndef SONARD_WATER_PLACE_H
#define SONARD_WATER_PLACE_H

#include <stdbool.h>

#define PLACE_MAX_SHAPES 32

enum place_kind {
    PLACE_END,     /* of the list */
    PLACE_BOX,     /* p: low and high x, y, z */
    PLACE_TUBE,    /* p: x, y, radius, top, bottom; upright */
    PLACE_CAPSULE, /* p: two ends; and thickness_m, its radius */
    PLACE_HALF,    /* only the cut */
};

struct place_shape {
    enum place_kind kind;
    bool water;
    double p[6];
    double thickness_m;
    double cut[4]; /* unit normal n and offset c: only what has n p <= c; all 0: everything */
    double v[3];   /* moves so many metres per second */
};

struct place {
    const char *name, *what;
    double origin_m[3];
    double low[3], high[3]; /* the part that is looked at, from the origin */
    double from[3], to[3];  /* the vehicle's way through it, or its start and goal */
    double level_db;        /* <= 0: so much weaker than the others the surfaces that lie level answer */
    struct place_shape shape[PLACE_MAX_SHAPES + 1];
};

/* An upright cylinder. */
struct place_hull {
    double radius_m, half_height_m;
};

struct place_hit {
    double range_m;
    double cos_incidence; /* between the ray and the surface's normal, 0..1 */
    double ghost_m;       /* apparent range of the echo's second bounce */
    bool level;           /* the surface lies level rather than upright */
    int shape;            /* whose surface it is */
};

/** place_add - false: it is full. */
bool place_add(struct place *place, const struct place_shape *shape);

/** place_moves - does the shape move? place_still - the place without those that do. */
bool place_moves(const struct place_shape *shape);
struct place place_still(const struct place *place);

/**
 * place_clearance - from a hull (NULL: a point) at `at` to what is nearest at time t_s; negative: within it. Never more
 * than the distance to the nearest surface, and in a single shape's neighbourhood that distance (of a hull from a
 * capsule: of the ball around the hull).
 */
double place_clearance(const struct place *place, const double at[3], const struct place_hull *hull, double t_s);

/** place_shape_clearance - the same to one shape that stands in the water. */
double place_shape_clearance(const struct place_shape *shape, const double at[3], const struct place_hull *hull,
                             double t_s);

/**
 * place_cast - the nearest surface along a ray in the unit direction; a shape's from inside, too, where a ray begins
 * there. False when the ray meets nothing.
 */
bool place_cast(const struct place *place, const double from[3], const double direction[3], double t_s,
                struct place_hit *hit);

/** place_ray - the same: its range, or max_m. */
double place_ray(const struct place *place, const double from[3], const double direction[3], double max_m,
                 double t_s);

/* A fan of rays around a direction, those at its edges among them. */
struct place_fan {
    double az_rad, el_rad, half_az_rad, half_el_rad;
    int n_az, n_el;
};

/** place_nearest - of a fan's rays; INFINITY: none meets anything. */
double place_nearest(const struct place *place, const double from[3], const struct place_fan *fan, double t_s);

/**
 * place_first - to the nearest surface that a wedge-shaped beam meets (|azimuth| <= half_az, |latitude| <= half_el in
 * the frame axis[3], its x, y, z in the world), or max_m. Never beyond it, and at most 12 mm short of it: the aperture
 * is divided until a patch is surely clear or surely close.
 */
double place_first(const struct place *place, const double from[3], const double axis[3][3], double half_az_rad,
                   double half_el_rad, double max_m, double t_s);

#endif
