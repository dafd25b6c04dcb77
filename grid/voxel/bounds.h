/* SPDX-License-Identifier: MIT */
/*
 * bounds - per column of voxels, an interval that is surely within a beam and one that the beam is surely within,
 * computed in single precision, eight columns at a time, with bounds on every rounding. Knows no map; decides nothing
 * where the two differ.
 *
 * Every face of a beam bounds a vertical line at plan position (u, v) from the apex: a plane at an affine function of u
 * and v, a cone and the sphere at that plus a square root. The lower ends' maximum and the upper ends' minimum are the
 * interval; its error is the sum of what rounding can do. A wedge's upper and lower face, cones of latitude, lie so close to planes
 * in a narrow beam that the planes between are taken, and what the cones are off counts as rounding.
 */
#ifndef SONARD_BOUNDS_H
#define SONARD_BOUNDS_H

#include "cast.h"

#define BOUNDS_BLOCK CAST_LANES /* columns at a time */

/* t = c0 + cu u + cv v bounds the line from one side; surely in beyond t by `in`, surely out before t by `out`. */
struct bounds_plane {
    float c0, cu, cv, in, out;
};

/* t = l0 + lu u + lv v + k sqrt((w0 + wu u + wv v)^2 + a (u^2 + v^2) - t2) */
struct bounds_root {
    float l0, lu, lv, w0, wu, wv, a, t2, k;
    float error_root, error_t; /* of what is under the root, of t */
    bool misses;               /* without a root the line misses the beam; else it is only not bounded */
};

struct bounds {
    bool walk;        /* not one interval per column, or not well bounded: no planes and no roots, ask the cells */
    int inner, outer; /* axes of the world: u along which a row of columns runs, v */
    struct bounds_plane lo[6], hi[6];
    struct bounds_root lo_root[2], hi_root[2];
    int n_lo, n_hi, n_lo_root, n_hi_root;
    float t0;                        /* of the middle of the apex's cell */
    float far2, far2_error, t_error; /* of the sphere */
    double low[3], high[3];          /* all of the beam lies in this box, by the world's axes ... */
    double line[2][3];               /* ... and where m u + n v + c >= 0 */
    int n_lines;
};

/* Of eight columns: surely no cell outside lo_out..hi_out, and surely all of lo_in..hi_in. */
struct bounds_block {
    int32_t lo_out[BOUNDS_BLOCK], lo_in[BOUNDS_BLOCK], hi_in[BOUNDS_BLOCK], hi_out[BOUNDS_BLOCK];
    int32_t doubt; /* 0: both are the same in all eight */
};

/** bounds_of - sets up for a beam as cast_aim accepts it. Nearness is left out: all from the apex to `far`. */
void bounds_of(struct bounds *s, const struct cast_beam *b);

/** bounds_block - for eight columns with these centres (voxels from the apex): cells kept within first..last (counted
 * from the apex's), with `shift` added to each. */
void bounds_block(const struct bounds *s, const float *u, const float *v, int32_t first, int32_t last,
                  int32_t shift, struct bounds_block *out);

#endif
