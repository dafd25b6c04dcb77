/* SPDX-License-Identifier: MIT */
/*
 * beam - the geometry of one beam of a ping in the grid's axes: what of a ray from the grid's centre lies in it, how it
 * sees a place, which directions can have to do with it at all. The sensor may sit anywhere. Knows no cell and no claim.
 */
#ifndef SONARD_BEAM_H
#define SONARD_BEAM_H

#include <stdbool.h>

#include "../echoes.h"
#include "claim.h"

struct beam {
    const struct echoes *ping;
    const struct beam_echoes *heard;
    double origin_m[3];             /* of the sensor, from the grid's centre */
    double lever_m;                 /* its length */
    double axis[3], side[3], up[3]; /* of the beam: along it, to its right, upward */
    double ahead[3], down[3];       /* of the sensor: level, at the beam's azimuth; along its z */
    double half_az, half_el;
    double tan_az, sin_el; /* of half_az; of the axis' elevation in the sensor frame */
};

/** beam_of - beam `index` of a ping whose sensor is turned and placed so in the grid's axes. */
void beam_of(struct beam *b, const struct echoes *ping, uint16_t index, const double turn[4],
             const double origin_m[3]);

/** beam_meet - where the ray from the centre along unit vector u is range_m away from the sensor; negative: nowhere. */
double beam_meet(const struct beam *b, const double u[3], double range_m);

/** beam_range - distance of a place (from the centre) from the sensor. */
double beam_range(const struct beam *b, const double place_m[3]);

/**
 * beam_sees - offsets of a place (from the centre) from the axis, in azimuth and elevation of the sensor. False, without
 * the cost of finding them, for most places whose offsets are greater than most_az or most_el; never for others.
 */
bool beam_sees(const struct beam *b, const double place_m[3], double most_az, double most_el, double *off_az,
               double *off_el);

/** beam_share - share [0, 1] of a cell of the given width, centred `off` from the axis, that half width `half` covers. */
double beam_share(double off, double half, double width);

/**
 * beam_stretch - the stretch of the ray along u that lies between near_m and far_m from the sensor and in the beam,
 * whose sides are flat here: |y| <= tan(az) x, |z| <= tan(el) x. width and height are those of the direction's cell.
 * False when there is none.
 *
 * A direction is in the beam when its centre is. In elevation its whole cell must be, where beams are wide and no
 * neighbour helps. A beam narrower than a cell frees the one that holds its axis, unless that is over twice as wide. A
 * level row is never narrower than its beam's fan: only all of it counts.
 */
bool beam_stretch(const struct beam *b, const double u[3], double width_rad, double height_rad, bool level,
                  double near_m, double far_m, struct stretch *out);

/* A sieve for directions, as seen from the grid's centre: all of the beam at some range and beyond passes it. */
struct beam_sieve {
    double cos_axis; /* least cosine to the beam's axis */
    double sin_side; /* greatest sine of the angle out of the plane of its axis and height */
};

/** beam_sieve - opening, a cell of cell_rad, and the parallax of a sensor that does not sit in the centre. */
struct beam_sieve beam_sieve(const struct beam *b, double range_m, double cell_rad);

static inline bool beam_sieve_passes(const struct beam_sieve *sieve, double along, double aside)
{
    return along >= sieve->cos_axis && (aside < 0 ? -aside : aside) <= sieve->sin_side;
}

#endif
