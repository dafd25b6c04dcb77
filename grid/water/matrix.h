/* SPDX-License-Identifier: MIT */
/*
 * matrix - the image of a ping whose beams have several elevations: one for all of them, so that what lies across two
 * rows of beams is free by both. Rows that lack some beams, or whose beams stand between those of others, are told no
 * farther than their beams reach.
 */
#ifndef SONARD_WATER_MATRIX_H
#define SONARD_WATER_MATRIX_H

#include "beams.h"

/* Directions of beams along one angle, growing, and the parts of the image along it. */
struct matrix_line {
    double beam_rad[BEAMS_MAX];
    int beams;
    double end_rad[ROW_ENDS_MOST]; /* of parts: [parts + 1] */
    int parts;
    uint16_t from_of[BEAMS_MAX], to_of[BEAMS_MAX]; /* the parts that are own ones of beams in that direction */
};

struct matrix {
    struct matrix_line az, el;
};

/**
 * matrix_write - all beams of a ping within 80 degrees, in what is a beam's own: halfway to its neighbours on all
 * sides, or up to its edge where those leave a gap; in gaps nothing is said. Where beams detect less off their axes
 * what is their own is divided as finely as there is room, and each part is free as far as in the worst of it. Of two
 * in one direction the worse counts. What is no beam's own ends at the echoes of all whose openings touch it. The image
 * is as large as that of a row of as many beams at most (row_columns): beams whose directions would make it larger are
 * left out. False: nothing is left. *m is scratch. O(beams log beams) where their directions make a grid, O(beams^2) at
 * the worst; where it has gaps the cells in the openings of all beams with echoes besides.
 */
bool matrix_write(const struct echoes *e, const struct beams_deaf *deaf, struct matrix *m,
                  struct water_record *record, struct row_room *room);

#endif
