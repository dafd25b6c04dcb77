/* SPDX-License-Identifier: MIT */
/*
 * matrix - the image of a ping whose beams have several elevations: one raster for all of them, so that what lies
 * across two beams is free by both. Beams in rows and columns have cells of their own. Where directions make no such
 * grid (staggered rows, an array that is uniform in the sines of its angles, a fan that is rolled), a cell is what all
 * beams that see some of it say together.
 */
#ifndef SONARD_WATER_MATRIX_H
#define SONARD_WATER_MATRIX_H

#include "beams.h"

#define MATRIX_LOOKS 20000 /* at a beam, for all cells of a raster */

/* Directions of beams along one angle, growing, and the parts of the image along it. */
struct matrix_line {
    double beam_rad[BEAMS_MAX];
    int beams;
    double end_rad[ROW_ENDS_MOST]; /* of parts: [parts + 1] */
    int parts;
    bool full;                                     /* there was no room for all ends */
    uint16_t from_of[BEAMS_MAX], to_of[BEAMS_MAX]; /* the parts that are own ones of beams in that direction */
};

struct matrix_beam {
    struct row_beam is;
    double el_rad;
    uint16_t echo;                           /* beams_echo_m, in units */
    struct water_cell says[ROW_NOTHING + 1]; /* by part of its opening */
};

struct matrix {
    struct matrix_line az, el;
    struct matrix_beam beam[BEAMS_MAX]; /* within 80 degrees */
    int beams;
    const struct matrix_beam *by_az[BEAMS_MAX], *row[BEAMS_MAX];
};

/**
 * matrix_write - the image of all beams of a ping within 80 degrees.
 *
 * Grid: the beams look in more than half of the directions that their azimuths and elevations make together. Of two in
 * one direction the worse counts. A beam's own cells are those halfway to its neighbours on all sides, or up to its
 * edge where there is a gap. Where beams detect less off their axes, own cells are divided as finely as there is room,
 * and each is free as far as in the worst of it.
 *
 * No grid: the raster follows the edges of openings, as many as there is room for. Where beams detect less off their
 * axes these are the edges of squares within their ellipses. No cell is a beam's own.
 *
 * A cell that is no beam's own is free if one opening holds all of it, or some do together, as far as these beams say;
 * where several hold it, as water_cell_join has it. It is free no farther than to the first echo of all beams whose
 * openings touch it, even if the ping is too loose to end older water; a beam that merely hears less far takes nothing
 * from one that holds all of it. A cell that openings hold in part is free nowhere. Openings reach 0.5 mrad farther on
 * all sides, so that those that touch leave no gap; at the border of a hole or of the image, too.
 *
 * The image is as large as that of a row of as many beams at most (row_columns). False: no beam is within 80 degrees.
 * *m is scratch. O(cells + beams^2), as directions are sorted by insertion, if all cells are a beam's own. Others take
 * O(n) for the n beams about it, MATRIX_LOOKS in all or so, and O(n^3) if none holds all of it, n <= 16. With 512 beams
 * a ping takes 0.2 to 0.3 ms for staggered rows, 0.5 to 0.6 for inexact ones and about 1 ms for beams anyhow that hear
 * less off their axes (a core of 2 to 3 GHz).
 */
bool matrix_write(const struct echoes *e, const struct beams_deaf *deaf, struct matrix *m,
                  struct water_record *record, struct row_room *room);

#endif
