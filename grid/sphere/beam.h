/* SPDX-License-Identifier: MIT */
/*
 * beam - the geometry of one beam of a ping in the grid's axes: how it sees a place, which directions can have to do
 * with it at all. The sensor may sit anywhere. Knows no cell.
 */
#ifndef SONARD_BEAM_H
#define SONARD_BEAM_H

#include <math.h>
#include <stdbool.h>

#include "grid/echoes.h"

/* What is alike for all beams of a ping. */
struct beam_opening {
    double half_az, half_el;
    double sin_az, cos_az; /* of half_az */
    double aside, upward;  /* components that a unit vector in the beam has to its side and up, at most */
    double off_rad;        /* and an angle to the axis; pi: no bound */
    double tan_az, tan_el; /* of half_az and half_el, or of 83 degrees where these are wider */
};

/** beam_opening - of beams that are so wide and high. */
struct beam_opening beam_opening(double az_rad, double el_rad);

struct beam {
    const struct echoes *ping;
    const struct beam_echoes *heard;
    const struct beam_opening *opening;
    double origin_m[3];             /* of the sensor, from the grid's centre */
    double lever_m;                 /* its length */
    double offset_m[3];             /* its components along axis, side and up */
    double axis[3], side[3], up[3]; /* of the beam: along it, to its right, upward */
    double ahead[3], down[3];       /* of the sensor: level, at the beam's azimuth; along its z */
    double sin_el;                  /* of the axis' elevation in the sensor frame */
    double sin_low, sin_high;       /* of the elevations where the opening ends */
    double left[3], right[3];       /* normals of the planes that end it in azimuth, inward */
};

/** beam_place - the geometry alone of a beam in this direction of a sensor that is turned and placed
 * so in the grid's axes. */
void beam_place(struct beam *b, double az_rad, double el_rad, const struct beam_opening *opening,
                const double turn[4], const double origin_m[3]);

/** beam_of - beam `index` of a ping, placed likewise. */
void beam_of(struct beam *b, const struct echoes *ping, uint16_t index, const struct beam_opening *opening,
             const double turn[4], const double origin_m[3]);

/* A ray from the grid's centre: the direction of a cell's middle; its components along the beam's axis, side and up. */
struct beam_ray {
    const double *u;
    double along, aside, upward;
};

static inline struct beam_ray beam_ray(const struct beam *b, const double u[3])
{
    return (struct beam_ray){.u = u,
                             .along = u[0] * b->axis[0] + u[1] * b->axis[1] + u[2] * b->axis[2],
                             .aside = u[0] * b->side[0] + u[1] * b->side[1] + u[2] * b->side[2],
                             .upward = u[0] * b->up[0] + u[1] * b->up[1] + u[2] * b->up[2]};
}

/** beam_meet - where the ray from the centre along unit vector u is range_m away from the sensor; negative: nowhere. */
double beam_meet(const struct beam *b, const double u[3], double range_m);

/* What is alike for all cells of one ring of the grid. */
struct beam_cell {
    double across_rad; /* their width, seen from the centre */
    double tan_across; /* of half of it */
    double per_level;  /* 1 / cosine of the middle's elevation */
    /* a unit vector in a cell is at most so far from its middle: along the ring, up and down, back along the middle */
    double aside, upward, inward;
    double across; /* the first two together */
};

/** beam_cell_of - the cells of a ring, so wide in azimuth, so high, and with their middle at this elevation. */
struct beam_cell beam_cell_of(double width_rad, double height_rad, double el_rad);

/** beam_range - from the sensor to a place that is given from the centre. */
static inline double beam_range(const struct beam *b, const double place_m[3])
{
    const double x = place_m[0] - b->origin_m[0], y = place_m[1] - b->origin_m[1], z = place_m[2] - b->origin_m[2];
    return sqrt(x * x + y * y + z * z);
}

/* A cell as the sensor sees it: the place's offsets from the axis; widths, those of a box around the cell. */
struct beam_view {
    double off_az, off_el;
    double wide_rad, high_rad;
};

/* A place in a direction of the grid. */
struct beam_spot {
    const double *u;       /* [3]: the direction's middle */
    const double *place_m; /* [3]: from the centre */
    double range_m;        /* beam_range of it */
};

/**
 * beam_sees - how the cell of the ring is seen that holds the spot. False, at little cost, for most cells that lie
 * wholly farther off the axis than most_az or most_el; never for others.
 */
bool beam_sees(const struct beam *b, const struct beam_cell *cell, const struct beam_spot *spot, double most_az,
               double most_el, struct beam_view *view);

/** beam_share - share [0, 1] of a cell of the given width, centred `off` from the axis,
 * that half width `half` covers. */
double beam_share(double off, double half, double width);

/**
 * beam_holds - some of the cell of the ring whose middle is u is in the beam's opening, as far from the sensor as the
 * place `at_m` along u is. True as well for a few cells that only nearly are: for a corner of the box around one.
 */
bool beam_holds(const struct beam *b, const struct beam_cell *cell, const double u[3], double at_m);

/*
 * A sieve for directions: bounds of their components along the beam's side and up, and along what is square to both the
 * axis and the sensor's offset, where there is no parallax. All that the beam holds at some range and beyond, as seen
 * from the grid's centre, passes it.
 */
struct beam_sieve {
    double from[2], to[2];
    double square[2]; /* that vector's components along side and up */
    double most;      /* along it, to either side */
    double off_rad;   /* from the axis to the corners of the opening, at most; pi and more: no bound */
};

/** beam_sieve - of this opening (the beam's own or a wider one) and the parallax of a sensor that is off the centre. */
struct beam_sieve beam_sieve(const struct beam *b, const struct beam_opening *opening, double range_m);

/** beam_sieve_wider - directions up to by_rad away from one that passes `s` pass for certain. */
struct beam_sieve beam_sieve_wider(const struct beam_sieve *s, double by_rad);

/** beam_sieve_either - what passes one of two sieves of a beam passes. */
struct beam_sieve beam_sieve_either(const struct beam_sieve *a, const struct beam_sieve *b);

/** beam_sieve_cap - a cap that holds what passes: its middle; its radius, pi for all. */
double beam_sieve_cap(const struct beam *b, const struct beam_sieve *sieve, double middle[3]);

static inline bool beam_sieve_passes(const struct beam_sieve *s, const struct beam_ray *ray)
{
    return ray->aside >= s->from[0] && ray->aside <= s->to[0] && ray->upward >= s->from[1] &&
           ray->upward <= s->to[1] && fabs(s->square[0] * ray->aside + s->square[1] * ray->upward) <= s->most;
}

#endif
