/* SPDX-License-Identifier: MIT */
/*
 * cast - which voxels a beam covers (Oliveira, Ferreira and Cruz 2023, section III-D), as runs along the vertical.
 * Knows beams and the lattice; stores nothing, counts nothing.
 *
 * A voxel belongs to a beam when its centre does: cast_slack() >= 0 is the definition, and cast_run() gives exactly
 * those voxels, each once. It need not ask each of them. Per column it computes two intervals, one that is surely
 * within the beam and one that the beam is surely within, with bounds on the rounding of both; only voxels between the
 * two are asked. So the same voxels come out on any CPU, at any vector width.
 *
 * The beam's frame: x along its axis, y to the right, z down, the apex at 0. With half apertures a and b (section 5.1
 * of many texts on sonar has them the other way round: here a is azimuth, b elevation):
 *   wedge    |azimuth| <= a and |latitude| <= b: what a turning head or one beam of a fan hears
 *   pyramid  |azimuth| <= a and |z| <= x tan b
 *   cone     at most a off the axis
 * and near <= distance <= far. Pings of a fan: a voxel is raised once per range measurement, that is per beam. For once
 * per ping, beams must not overlap: give them half their spacing for a.
 */
#ifndef SONARD_CAST_H
#define SONARD_CAST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/fault.h"
#include "lattice.h"

enum cast_shape { CAST_WEDGE, CAST_PYRAMID, CAST_CONE };

/* What all beams of a sensor share. */
struct cast_opening {
    enum cast_shape shape;
    double half_az_rad, half_el_rad;
    /* Outward shift of the side faces, in metres, for the paper's "tolerance"; 0 is safe. The range face has none: a
     * wall would be entered as water over all its area. */
    double tolerance_m;
    double sin_az, cos_az, sin_el, cos_el; /* set by cast_opening_init */
};

/* One beam, in voxels. */
struct cast_beam {
    const struct cast_opening *opening;
    struct lattice_place apex;
    double axis[3][3]; /* the beam's x, y, z as unit vectors in the world */
    double near, far;
    double tolerance;
};

/* Runs of cells side by side, as they are computed and entered: n[s] cells from (i[s], j[s], k[s]) downward, counted
 * from the box's first cell, for s < runs; where n[s] <= 0, none. Up to the next whole number of lanes, which is at
 * most CAST_SPANS, n is 0, the rest anything. */
#define CAST_LANES 8
#define CAST_SPANS 272
struct cast_spans {
    int runs;
    const int32_t *i, *j, *k, *n;
    int32_t first_k, last_k; /* no cell of the whole beam lies above or below these levels */
};

typedef void cast_take(void *context, const struct cast_spans *spans);

#define CAST_MAX_VOXELS 30000.0 /* longest beam that is cast, in voxels */

/**
 * cast_opening_init - half apertures in radians: wedge az (0, pi], el (0, pi/2]; pyramid both (0, pi/2); cone
 * az (0, pi], el ignored. tolerance_m >= 0. False, with a sentence in fault, when out of range.
 */
bool cast_opening_init(struct cast_opening *o, enum cast_shape shape, double half_az_rad, double half_el_rad,
                       double tolerance_m, struct fault *fault);

/* Where a beam looks: from apex, of a sensor turned by attitude (unit quaternion, sensor to world), az and el as in
 * struct ping_beam; near_m, far_m: what of its water is free. */
struct cast_look {
    const struct lattice_place *apex;
    const double *attitude;
    double az_rad, el_rad;
    double near_m, far_m;
    double voxel_m;
};

/**
 * cast_aim - the beam of a look. False: nothing is free (far_m <= 0 or < near_m, a number that is not finite), or
 * farther than CAST_MAX_VOXELS.
 */
bool cast_aim(struct cast_beam *b, const struct cast_opening *o, const struct cast_look *look);

/** cast_slack - how far inside the beam the centre of a cell lies, in voxels: the least distance to any face. */
double cast_slack(const struct cast_beam *b, const int64_t cell[3]);

/**
 * cast_run - all cells of the box that the beam covers, each in one span. False when some of the beam may lie outside
 * the box (its bounding box does). Cost: columns covered, and a voxel test where rounding leaves a doubt.
 */
bool cast_run(const struct cast_beam *b, const struct lattice_box *box, cast_take *take, void *context);

#endif
