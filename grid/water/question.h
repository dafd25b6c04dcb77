/* SPDX-License-Identifier: MIT */
/*
 * question - which tiles a question asks, over which stretch of ranges, and what a tile's free water means for it: the
 * shapes of all questions about free water, as seen from where the vehicle is now. Knows no record.
 *
 * All bounds are those of the tile's cone, on the careful side, and grow with the question: more of the same asks all
 * that less of it asks. A question has one measure, in metres, of how far it is free: the range in a cone and in parts
 * of a band, the way along its line in a corridor, what the body may reach ahead as it moves, what is around it as it
 * stays. It may have many parts, each with an answer of its own.
 */
#ifndef SONARD_WATER_QUESTION_H
#define SONARD_WATER_QUESTION_H

#include <stddef.h>

#include "tiles.h"

#define ASK_PARTS 720
#define ASK_LEVEL 256 /* parts of the horizon, from north on */

enum ask_kind {
    ASK_CONE,     /* axis, half_rad */
    ASK_CORRIDOR, /* axis, radius_m: round, with flat ends */
    ASK_MOVE,     /* axis, body: what it sweeps along the axis */
    ASK_STAY,     /* body: so far around it */
    ASK_AROUND,   /* band */
};

/* An upright cylinder around the vehicle. */
struct ask_body {
    double up[3]; /* its axis, a unit vector, NED */
    double radius_m, half_height_m;
    double margin_m; /* of water on every side, >= 0 */
    double
        drift_m[3]; /* it may be carried off by as much as it moves; what of it is along the axis does not count */
};

/* A band of elevations. Part k of `parts` is the sector centred on k * 2 pi / parts, or where width_rad is above 0 the
 * k-th of so many that share what reaches clockwise from from_rad. */
struct ask_band {
    double attitude[4]; /* of the axes that the angles are in, in NED */
    double lo_rad, hi_rad;
    double from_rad, width_rad;
    size_t parts; /* 1..ASK_PARTS */
};

struct ask_question {
    enum ask_kind kind;
    double near_m; /* water nearer than this is not asked about; of a body 0: nor its own place */
    /* by parts of the horizon, so far from the vehicle's vertical axis: from there on, >= 0, if that is nearer; NULL:
     * no such. Not as far as a body stays above or below its own place. Stays until the end */
    const double *level_m;
    double to_m;      /* how far, in the question's measure, > near_m of a cone; at most 600 */
    bool stops;       /* is it free as far as that? How far it is free otherwise does not matter */
    int levels;       /* of tiles, 1..TILES_LEVELS; 0: all */
    double loose_rad; /* the axes that it is asked in may be turned so far, below 0.2 */
    double axis[3];   /* unit vector, NED */
    double half_rad;  /* [0, pi] */
    double radius_m;
    struct ask_body body;
    struct ask_band band;
};

struct ask_stretch {
    double from_m, to_m;
};

/* A question, made ready. */
struct question_shape {
    struct ask_question asked;
    size_t parts;
    double front_m;        /* of a body that moves: with its margin it reaches so far ahead */
    double bound_rad;      /* no tile farther from the axis is asked; of a band that is its middle ... */
    double az_rad, el_rad; /* ... and the axis is this, NED */
    /* of a body that moves: `up` is across the line, as nearly up in the body as may be */
    double side[3], up[3], half_width_m, half_height_m, drift_side_m, drift_up_m;
    double round_m, across, flat_m;
    double upright_m; /* so far along the line it stays above or below its own place */
    double tilt_rad;  /* of a band's axes */
};

/* Parts `at` to at + n - 1, past the last one from the first on. */
struct question_run {
    size_t at, n;
};

void question_begin(struct question_shape *q, const struct ask_question *asked);

/** question_columns - the columns of a row of roots that the question may touch: *n of them from the one that is
 * returned on, past the last one too. */
uint32_t question_columns(const struct question_shape *q, uint32_t row, uint32_t *n);

/** question_run - the parts that the tile may touch; n = 0: none. */
struct question_run question_run(const struct question_shape *q, const struct water_tile *tile);

/** question_probe - direction number i that is asked, into v: a few of each part, in the middle and at the rim. False:
 * there is no such number. */
bool question_probe(const struct question_shape *q, size_t i, double v[3]);

/** question_stretch - the ranges that are asked of it, for the question up to_m in its measure. False: none. */
bool question_stretch(const struct question_shape *q, const struct water_tile *tile, double to_m,
                      struct ask_stretch *stretch);

/** question_measure - how far the question is free, in its measure, where the tile is free to that range. */
double question_measure(const struct question_shape *q, const struct water_tile *tile, double free_m);

#endif
