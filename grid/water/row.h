/* SPDX-License-Identifier: MIT */
/*
 * row - writes the image of a row of beams: a fan's, or the last ones of a turning head.
 */
#ifndef SONARD_WATER_ROW_H
#define SONARD_WATER_ROW_H

#include <stddef.h>

#include "record.h"

#define ROW_TOUCH_RAD 1e-3 /* beams that are no farther apart touch: their bearings are rounded */
#define ROW_ROWS      5    /* of the image: edge, side, axis, side, edge */
#define ROW_ENDS_MOST 1024 /* of columns or rows that a ping's image has, be it a row or a matrix (matrix.h) */

/* Of a beam: so far is the water free on its axis, at its side and at its edge (struct beam_echoes); <= 0:
 * nothing is. */
struct row_beam {
    double az_rad; /* in the record's frame, within 80 degrees */
    double axis_m, side_m, edge_m;
    double near_m, edge_near_m; /* from there on; at its edge, no nearer */
    double ends_m;              /* from there on an echo ends older water; INFINITY: there is none */
    /* Of a row from many places: it was sent from so far ahead of the row's. The axis of a neighbour begins so far
     * aside of its own, away from it, and is tilted against it by that. */
    double along_m, aside_m, tilt_rad;
    bool apart; /* nothing is said between it and the next one, be they as near as they may */
};

/* Parts of the opening's height and width, from below to above: no row of the image reaches beyond. */
extern const double row_share[ROW_ROWS + 1];

/* What all beams of a row have in common. */
struct row_shape {
    double half_az_rad;
    double el_rad, half_el_rad; /* together within 80 degrees */
    /* Of each beam: from there on it leaves no gap to those beside it, by row of the image; NULL: none ever does. */
    const double (*join_m)[ROW_ROWS];
    double from_rad, to_rad; /* azimuths where the first one's own part begins and the last one's ends ... */
    double outer_rad[2];     /* ... and their openings: in between nothing ends what is older */
};

/* Room for a row; the record's image points into it. */
struct row_room {
    double tan_az[ROW_ENDS_MOST], tan_el[ROW_ENDS_MOST];
    struct water_cell cell[WATER_COLUMNS * 11];
};

#define ROW_ENDS 5 /* columns of a beam that has no neighbour on either side */

/* How far off its axis a part of a beam's opening is, at the most. */
enum row_part { ROW_AXIS, ROW_SIDE, ROW_EDGE, ROW_NOTHING };

/** row_is_nested - does it detect less off its axis: less far, or at its edge from farther on? */
static inline bool row_is_nested(const struct row_beam *beam)
{
    return beam->side_m < beam->axis_m || beam->edge_m < beam->axis_m || beam->edge_near_m > beam->near_m;
}

/** row_cell - where the beam is free in a part of it, not nearer than near_m, and ends what is older. */
struct water_cell row_cell(const struct row_beam *beam, enum row_part part, double near_m, double ends_m);

/** row_columns - at most, of so many beams that touch no other. */
uint32_t row_columns(uint32_t beams);

/** row_bytes - of an image so large: its ends, and its cells with their pyramid. A multiple of 8. */
size_t row_bytes(uint32_t columns, uint32_t rows);

/**
 * row_write - the image of n beams whose azimuths grow. Between two that are farther apart than they are wide nothing
 * is said. Off its axis a beam is free only as far as at its side and its edge, to the left and right as above and
 * below; where it ends halfway to a neighbour, too, which is farther off both axes the nearer they begin to diverge.
 * Of a row that would have too many columns for that each beam is free as far as in the worst of its own part.
 * 1 <= n, and n, the gaps and ROW_ENDS for each beam beside one and for the ends are at most WATER_COLUMNS.
 */
void row_write(struct water_record *record, struct row_room *room, const struct row_shape *shape,
               const struct row_beam *beam, size_t n);

#endif
