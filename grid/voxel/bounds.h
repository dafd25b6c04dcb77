/* SPDX-License-Identifier: MIT */
/*
 * bounds - per column of voxels, an interval that is surely within a beam and one that the beam is surely within,
 * computed in single precision, eight columns at a time, with bounds on every rounding. Knows no map; decides nothing
 * where the two differ.
 *
 * Every face of a beam bounds a vertical line at plan position (u, v) from the apex: a plane at an affine function of u
 * and v, a cone and the sphere at that plus a square root. The lower ends' maximum and the upper ends' minimum are the
 * interval; its error is the sum of what rounding can do. A wedge's upper and lower face, cones of latitude, lie so
 * close to planes in a narrow beam that the planes between are taken, and what the cones are off counts as rounding;
 * without tolerance both cones share one root, which is exact and costs less than the planes.
 *
 * An upright face (a side of a level beam, an end of one that lies on its side) bounds no vertical line, but the plan:
 * it is a line there, with a fringe of columns next to it of which nothing is known.
 */
#ifndef SONARD_BOUNDS_H
#define SONARD_BOUNDS_H

#include "cast.h"

#define BOUNDS_BLOCK CAST_LANES /* columns at a time */

/* What rounding leaves open of a column: whether its first or its last cell is within, or, at the sphere's rim or over
 * the ball around the apex, all. */
enum bounds_doubt { BOUNDS_FIRST = 1, BOUNDS_LAST = 2, BOUNDS_RIM = 4 };

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

/* Both faces of a wedge: t = l W +- (k sqrt(W^2 + a (u^2 + v^2)) + open), W = wu u + wv v; `open` is 0, or large where
 * there is no such pair. */
struct bounds_bow {
    float wu, wv, a, l, k, open, error;
};

/* In the plan the beam lies where m u + n v + c >= 0; where that is less than `fringe`, columns are to be asked. */
struct bounds_line {
    double m, n, c, fringe;
};

struct bounds {
    bool walk;        /* not one interval per column, or not well bounded: no planes and no roots, ask the cells */
    int inner, outer; /* axes of the world: u along which a row of columns runs, v */
    struct bounds_plane lo[6], hi[6];
    struct bounds_root lo_root[2], hi_root[2];
    int n_lo, n_hi, n_lo_root, n_hi_root;
    struct bounds_bow bow;
    int32_t apex[3], last;           /* the apex's cell, and the last of a column */
    float offset[3];                 /* of the apex from the middle of its cell: along u, v, and the vertical */
    float far2, far2_error, t_error; /* of the sphere */
    bool quick;                      /* bounds_quick may be asked */
    float error;                     /* of every face ... */
    float far2_least;                /* ... and of the sphere where |far^2 - u^2 - v^2| is at least this */
    float near2;                     /* nearer in the plan, the ball around the apex has to do with a column */
    double low[3], high[3];          /* all of the beam lies in this box, by the world's axes */
    struct bounds_line line[2];
    int n_lines;
};

/* Of eight columns: surely no cell outside lo_out..hi_out, and surely all of lo_in..hi_in. */
struct bounds_block {
    int32_t lo_out[BOUNDS_BLOCK], lo_in[BOUNDS_BLOCK], hi_in[BOUNDS_BLOCK], hi_out[BOUNDS_BLOCK];
};

/**
 * bounds_of - sets up for a beam as cast_aim accepts it, in a box in which its apex lies in the cell `apex` (or would),
 * and columns are cells 0..last. The ball that is `near` is left out of the plan only: columns go on from the apex to
 * `far`.
 */
void bounds_of(struct bounds *s, const struct cast_beam *b, const int32_t apex[3], int32_t last);

/* n columns, and up to the next whole block, at these cells of the box along `inner` and `outer`. */
struct bounds_columns {
    const int32_t *inner, *outer;
    int n;
};

/**
 * bounds_quick - of columns: the first cell and how many, <= 0 for none, and what is in doubt (enum bounds_doubt; where
 * it is the rim, cells say nothing: ask bounds_block). False: some are in doubt. Only where `quick`.
 */
bool bounds_quick(const struct bounds *restrict s, const struct bounds_columns *columns, int32_t *restrict k,
                  int32_t *restrict cells, int32_t *restrict doubt);

/** bounds_block - for eight columns at these cells: both intervals, kept within 0..last. */
void bounds_block(const struct bounds *s, const int32_t *inner, const int32_t *outer, struct bounds_block *out);

#endif
