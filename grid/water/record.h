/* SPDX-License-Identifier: MIT */
/*
 * record - what one ping of a sonar says of the water, in the frame in which it was observed: an image of ranges with
 * a pyramid of the least and greatest of them along each of its rows, and along each 16 rows together. A fan is a row
 * of columns, and the last beams of a turning head are a row as well. Written once, never resampled. Knows no question
 * and no map.
 *
 * A column is as wide as the part of the water that is the beam's own: halfway to its neighbours, and the whole beam at
 * the ends. Off its axis a beam detects less, so each beam is several rows of the image: axis, side and edge (struct
 * beam_echoes). In a cell the water is free from its near range to its far one. From an echo on what older records
 * found free is so no more, and between the two, or without an echo, nothing is said.
 *
 * Azimuths and elevations are kept as tangents in the sensor's frame: no library's trigonometry decides an answer.
 */
#ifndef SONARD_WATER_RECORD_H
#define SONARD_WATER_RECORD_H

#include <stdbool.h>
#include <stdint.h>

#define WATER_COLUMNS 520
#define WATER_UNIT_M  0.01 /* of ranges, which are rounded down */
#define WATER_NO_END  UINT16_MAX
#define WATER_THIN_M  0.03 /* a beam that passes no farther beside a post than this meets it */

/* Of a part of the image, in units: in all of it the water is free from `from` to `least`, in none of it farther than
 * to `most`, and nearer than `ends` no echo ends what is older. */
struct water_cell {
    uint16_t from, least, most;
    uint16_t ends; /* WATER_NO_END: none does */
};

struct water_image {
    uint16_t columns, rows;
    uint8_t parts;  /* so many rows, one above the other, are of one elevation and end at the same echoes */
    uint8_t levels; /* of the pyramid; 0 is the image, the last one a column: rows differ, and stay apart ... */
    const double *tan_az, *tan_el; /* [columns + 1], [rows + 1]: where they begin and end, growing */
    double near_m;                 /* nearer it is free nowhere */
    const struct water_cell *cell; /* level by level, row by row, ... and behind these what each 16 say together */
};

struct water_record {
    uint64_t t_ns;      /* of the oldest beam ... */
    uint64_t newest_ns; /* ... and of the newest */
    uint32_t sensor, seq;
    uint32_t sweep;     /* it is a part of the sweep that began with the ping of this number, ... */
    int sense;          /* ... clockwise: 1, or -1; 0: of none */
    double path_m;      /* distance travelled by then */
    double drift_m[2];  /* of the vehicle by then: struct pose */
    double place_m[3];  /* of the sensor, NED */
    double axis[3][3];  /* ahead, right and down of the sensor, in NED */
    double lever_m;     /* its distance from the body's origin */
    double uncertain_m; /* its place may be so far from place_m ... */
    double tilt_rad;    /* ... and its beams turned so far against the axes */
    double spread_m[3]; /* they were sent so far beside place_m, but for what ranges allow for: along, aside, up */
    double ahead_m;     /* no farther ahead of its place any was sent */
    double gap_m; /* nearer than this a post may stand between two of them, for they were sent from so far apart */
    bool echoes;  /* some cell ends at one */
    struct water_image image;
};

/* Cells from (column[0], row[0]) to (column[1], row[1]). */
struct water_part {
    int column[2], row[2];
};

/** water_image_cells - cells of an image so large with its pyramid. */
uint32_t water_image_cells(uint32_t columns, uint32_t rows);

/** water_image_fill - level 0 of cell is filled: works out the others and the number of levels. */
void water_image_fill(struct water_image *image, struct water_cell *cell);

/** water_cell_join - what is free by either of two cells in one direction: one stretch where they touch, and otherwise
 * the longer one. It ends what is older at the nearer of both ends. */
struct water_cell water_cell_join(struct water_cell a, struct water_cell b);

/** water_image_find - the last of n parts that begins at or before x: between[n + 1] are their ends, growing. Within
 * 0 .. n - 1 for any x. */
int water_image_find(const double *between, int n, double x);

/** water_image_of - what is said of at least that part, in its rows alone: of up to 8 columns of
 * a level, whose rows are taken 16 by 16 where they may. */
struct water_cell water_image_of(const struct water_image *image, const struct water_part *part);

#endif
