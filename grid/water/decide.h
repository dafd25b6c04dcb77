/* SPDX-License-Identifier: MIT */
/*
 * decide - what a record says of a tile: all the water in a cone of directions from where the vehicle is now, between
 * two ranges, larger by all that is uncertain. The one place where a record's water is judged.
 *
 * Free is what lies in the image wholly, nearer than the range of every cell that it may touch; of a head that drifts,
 * in the images of rows that follow each other. Ended is what may touch a cell at or beyond its echo. Of anything else
 * the record says nothing. What is uncertain makes free water smaller and ended water larger, by the same margin.
 *
 * Ranges are divided at multiples of WATER_GRID_M alone, the roundest first. So the answer about a stretch is never
 * worse than that about a longer one: clear to d is clear to every shorter distance.
 */
#ifndef SONARD_WATER_DECIDE_H
#define SONARD_WATER_DECIDE_H

#include "record.h"

#define WATER_GRID_M 0.0625
#define WATER_PIECES 48

enum water_says { WATER_NOTHING, WATER_FREE, WATER_ENDED };

/* A stretch of ranges from the vehicle. */
struct water_piece {
    double from_m, to_m;
    enum water_says says;
    bool mixed; /* a smaller tile may be told otherwise */
};

/* In order of range, without gaps; the last one is ended, or reaches as far as was asked. */
struct water_pieces {
    struct water_piece piece[WATER_PIECES];
    int n;
    int judged; /* stretches that were looked at for it */
};

/* A record as a question sees it. What drift makes uncertain is level: as high as before, nearer or farther. */
struct water_view {
    const struct water_record *record;
    double at_m[3];    /* the vehicle, from the sensor, in its axes */
    double margin_m;   /* so far may the vehicle be from there: ... */
    double level_m;    /* ... by its drift no farther than this, level, ... */
    double lift_m;     /* ... and in all no farther than this up and down in the sensor's axes */
    double margin_rad; /* and directions turned so far, ... */
    double lift_rad;   /* ... up and down in the sensor's axes no farther than this */
    double keeps_m;    /* what stands farther from the sensor is forgotten: nothing is free there; 0: no limit */
    bool lost;         /* nothing is heard of its sonar: it ends water, and frees none */
    const struct water_view *next; /* the row in which a head's sweep goes on: decide.c; NULL: in none */
};

/* Directions within half_rad (below 0.2) of the unit vector v, NED. */
struct water_tile {
    double v[3];
    double half_rad;
};

/** water_touches - shortens the stretch to what of the tile may lie between the left and the right side of the image,
 * and says of the rest nothing. False: none of it. */
bool water_touches(const struct water_view *view, const struct water_tile *tile, double *from_m, double *to_m);

/** water_covers - may the image hold some of the tile at that range, whatever it says of it? */
bool water_covers(const struct water_view *view, const struct water_tile *tile, double at_m);

/* What stands upright: a beam reaches as far up and down as it does high_m away. It is sought no farther beside a beam
 * than within_rad, or than it is thick. */
struct water_sought {
    double high_m, within_rad, radius_m;
};

/** water_looks - was that place in a beam, as poses have it: nearer than its echo, or than where it would have heard
 * one? v: a unit vector, NED; at_m: above 0. */
bool water_looks(const struct water_view *view, const double v[3], double at_m, const struct water_sought *sought);

/** water_decide - the tile from from_m (>= 0) to to_m; *out is emptied first. O(cells met x log range). */
void water_decide(const struct water_view *view, const struct water_tile *tile, double from_m, double to_m,
                  struct water_pieces *out);

#endif
