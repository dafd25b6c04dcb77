/* SPDX-License-Identifier: MIT */
/*
 * beam - the geometry of one beam of a ping in the grid's axes: what of a ray from the grid's centre lies in it, how it
 * sees a place, which directions can have to do with it at all. The sensor may sit anywhere. Knows no cell.
 */
#ifndef SONARD_BEAM_H
#define SONARD_BEAM_H

#include <math.h>
#include <stdbool.h>

#include "grid/echoes.h"
#include "grid/picture/free_interval.h"

/* Parts of a beam in which it detects more than at its edge: up to BEAM_AXIS_SHARE and BEAM_SIDE_SHARE of its opening.
 * Each is an ellipse about the axis, for what the pattern takes to the side and what it takes upward add up. */
enum beam_part { BEAM_AXIS, BEAM_SIDE, BEAM_PARTS };

/*
 * How the beams stand side by side of which a beam is one. What lies between the axes of two neighbours is no farther
 * from the nearer one than their seam, halfway: there the row detects least. So a cell that is not wholly in a part of
 * one beam is in that part of the row if the seams are.
 */
struct beam_row {
    float half_az_rad, half_el_rad; /* half of what each of its beams is wide and high */
    float left_rad, right_rad; /* it reaches so far from the axis; 0: no beam that freed water is on that side */
    float seam_rad;            /* from the nearest axis, at most; 0: the beam has no neighbours */
    bool several;              /* the axis is the middle of several beams, and none of its own */
};

/* A rectangle within a part; tan_el <= 0: none. */
struct beam_patch {
    double tan_left, tan_right, tan_el;
};

/* What is alike for all beams of a ping. */
struct beam_opening {
    double half_az, half_el;
    double sin_az, cos_az; /* of half_az */
    double aside, upward;  /* components that a unit vector in the beam has to its side and up, at most */
    double off_rad;        /* and an angle to the axis; pi: no bound */
    double tan_az, tan_el; /* a ray of the grid is in the beam where |y| <= tan_az x, |z| <= tan_el x */
    double tan_high;       /* of all of half_el: tan_el leaves out half a cell */
    double widest_rad;     /* a cell that is wider is never in the beam */
    struct beam_patch patch[BEAM_PARTS]; /* what the row fills */
    double axes[2]; /* of the beam's own pattern, half its width and height; 0: of a row of several */
    double less[2]; /* and so much less to each side and upward is in it */
};

/* Half of a part's axes, as a share of half of the beam's width and height. */
extern const double beam_part_share[BEAM_PARTS];

/* What lies at the left or right edge of a beam but for rounding, of azimuths in float, is within so much of half the
 * beam's width, relative to it. */
#define BEAM_EDGE 1e-4

/** beam_opening_freed - the bounds alone of an opening in which lie all rays with a beam_stretch,
 * in cells up to so wide, and those at its edge. */
struct beam_opening beam_opening_freed(const struct beam_opening *own, double cell_width_rad);

/**
 * beam_opening - of beams that are so wide and high, in a grid with cells so high; level: it has a single row. A
 * direction is in the beam when its centre is. In elevation its whole cell must be, where beams are wide and no
 * neighbour helps. A beam narrower than a cell frees the one that holds its axis, unless that is over twice as wide. A
 * level row is never narrower than its beam's fan: only all of it counts.
 */
struct beam_opening beam_opening(double az_rad, double el_rad, double cell_height_rad, bool level);

/** beam_row_open - the parts of the beams of that row, in place of those of a single beam that beam_opening has. Where
 * it points is uncertain by so much. */
void beam_row_open(struct beam_opening *o, const struct beam_row *row, double less_az_rad, double less_el_rad);

/* How far the water of a beam is free, from its sensor: in its parts and at its edge, as struct beam_echoes has it. */
struct beam_water {
    double from_m, to_m;
    double side_to_m, edge_from_m, edge_to_m;
    bool nested; /* it is known how much less the beam detects off its axis */
};

/** beam_water_alike - as much is free in all of the beam. */
static inline struct beam_water beam_water_alike(double from_m, double to_m)
{
    return (struct beam_water){from_m, to_m, to_m, from_m, to_m, false};
}

/** beam_water_less - it begins and ends so much nearer to its middle. */
struct beam_water beam_water_less(const struct beam_water *w, double by_m);

struct beam {
    const struct echoes *ping;
    const struct beam_echoes *heard;
    const struct beam_opening *opening;
    double origin_m[3];             /* of the sensor, from the grid's centre */
    double lever_m;                 /* its length */
    double margin_m;                /* its flat sides are so much farther in; for beam_stretch alone */
    double margin_el_m;             /* and its upper and lower side by so much more */
    double blur_m[3];               /* as of a pose, in the grid's axes: the sides are farther in by it as well */
    double offset_m[3];             /* its components along axis, side and up */
    double axis[3], side[3], up[3]; /* of the beam: along it, to its right, upward */
    double ahead[3], down[3];       /* of the sensor: level, at the beam's azimuth; along its z */
    double sin_el;                  /* of the axis' elevation in the sensor frame */
    double sin_low, sin_high;       /* of the elevations where the opening ends */
    double left[3], right[3];       /* normals of the planes that end it in azimuth, inward */
};

/** beam_place - the geometry alone of a beam in this direction of a sensor that is turned and placed
 * so in the grid's axes. */
void beam_place(struct beam *b, double az_rad, double el_rad, const struct beam_opening *opening,
                const double turn[4], const double origin_m[3]);

/** beam_of - beam `index` of a ping, placed likewise. */
void beam_of(struct beam *b, const struct echoes *ping, uint16_t index, const struct beam_opening *opening,
             const double turn[4], const double origin_m[3]);

/** beam_blur - of a placed beam: its sensor may be anywhere on the line by +-blur_m, or any_m from there. */
void beam_blur(struct beam *b, const double blur_m[3], double any_m);

/** beam_surely_free - of the water what is free wherever within its blur the sensor is. */
struct beam_water beam_surely_free(const struct beam *b, const struct beam_water *w);

/* A ray from the grid's centre: the direction of a cell's middle; its components along the beam's axis, side and up. */
struct beam_ray {
    const double *u;
    double along, aside, upward;
};

static inline struct beam_ray beam_ray(const struct beam *b, const double u[3])
{
    return (struct beam_ray){.u = u,
                             .along = u[0] * b->axis[0] + u[1] * b->axis[1] + u[2] * b->axis[2],
                             .aside = u[0] * b->side[0] + u[1] * b->side[1] + u[2] * b->side[2],
                             .upward = u[0] * b->up[0] + u[1] * b->up[1] + u[2] * b->up[2]};
}

/** beam_meet - where the ray from the centre along unit vector u is range_m away from the sensor; negative: nowhere. */
double beam_meet(const struct beam *b, const double u[3], double range_m);

/* What is alike for all cells of one ring of the grid. */
struct beam_cell {
    double across_rad; /* their width, seen from the centre */
    double tan_across; /* of half of it */
    double per_level;  /* 1 / cosine of the middle's elevation */
    /* a unit vector in a cell is at most so far from its middle: along the ring, up and down, back along the middle */
    double aside, upward, inward;
    double across;             /* the first two together */
    double cos_half, sin_half; /* of half the width in azimuth */
};

/** beam_cell_of - the cells of a ring, so wide in azimuth, so high, and with their middle at this elevation. */
struct beam_cell beam_cell_of(double width_rad, double height_rad, double el_rad);

/** beam_cell_side - the unit vector along a side of the cell of the ring whose middle is u: -1 the left one, 1 the
 * right one, at the same elevation. */
void beam_cell_side(const struct beam_cell *cell, const double u[3], int side, double out[3]);

/** beam_range - from the sensor to a place that is given from the centre. */
static inline double beam_range(const struct beam *b, const double place_m[3])
{
    const double x = place_m[0] - b->origin_m[0], y = place_m[1] - b->origin_m[1], z = place_m[2] - b->origin_m[2];
    return sqrt(x * x + y * y + z * z);
}

/* A cell as the sensor sees it: the place's offsets from the axis; widths, those of a box around the cell. */
struct beam_view {
    double off_az, off_el;
    double wide_rad, high_rad;
};

/* A place in a direction of the grid. */
struct beam_spot {
    const double *u;       /* [3]: the direction's middle */
    const double *place_m; /* [3]: from the centre */
    double range_m;        /* beam_range of it */
};

/**
 * beam_sees - how the cell of the ring is seen that holds the spot. False, at little cost, for most cells that lie
 * wholly farther off the axis than most_az or most_el; never for others.
 */
bool beam_sees(const struct beam *b, const struct beam_cell *cell, const struct beam_spot *spot, double most_az,
               double most_el, struct beam_view *view);

/** beam_share - share [0, 1] of a cell of the given width, centred `off` from the axis,
 * that half width `half` covers. */
double beam_share(double off, double half, double width);

/**
 * beam_holds - some of the cell of the ring whose middle is u is in the beam's opening, as far from the sensor as the
 * place `at_m` along u is. True as well for a few cells that only nearly are: for a corner of the box around one.
 */
bool beam_holds(const struct beam *b, const struct beam_cell *cell, const double u[3], double at_m);

/**
 * beam_stretch - the stretch of the ray through the middle of a cell of the ring at which the beam looks, within the
 * range of its water, and what of that is free in the parts that it passes: the longest run. False when it does not
 * look at it at all. An echo ends where it looks, whatever is free. No place is free that is farther from the sensor
 * than its part reaches, though the ray may begin there.
 */
bool beam_stretch(const struct beam *b, const struct beam_cell *cell, const struct beam_ray *ray,
                  const struct beam_water *water, struct stretch *out);

/** beam_stretch_aside - what is free, of where st says that the beam looks along the side of a cell. */
void beam_stretch_aside(const struct beam *b, const struct beam_cell *cell, const struct beam_ray *side,
                        const struct beam_water *water, struct stretch *st);

/* The flat sides of a beam that frees cells of a ring; in_az, in_el: they are so much farther in than the opening's. */
struct beam_sides {
    double tan_az, tan_el, in_az, in_el;
};

/** beam_sides - false: the cells are too wide for the beam to free one. */
bool beam_sides(const struct beam *b, const struct beam_cell *cell, struct beam_sides *out);

/** beam_has - is the place range_m along the ray between the beam's sides? */
static inline bool beam_has(const struct beam *b, const struct beam_sides *sides, const struct beam_ray *ray,
                            double range_m)
{
    const double along_m = range_m * ray->along - b->offset_m[0];
    return fabs(range_m * ray->aside - b->offset_m[1]) + sides->in_az <= sides->tan_az * along_m &&
           fabs(range_m * ray->upward - b->offset_m[2]) + sides->in_el <= sides->tan_el * along_m;
}

/*
 * A sieve for directions: bounds of their components along the beam's side and up, and along what is square to both the
 * axis and the sensor's offset, where there is no parallax. All that the beam holds at some range and beyond, as seen
 * from the grid's centre, passes it.
 */
struct beam_sieve {
    double from[2], to[2];
    double square[2]; /* that vector's components along side and up */
    double most;      /* along it, to either side */
    double off_rad;   /* from the axis to the corners of the opening, at most; pi and more: no bound */
};

/** beam_sieve - of this opening (the beam's own or a wider one) and the parallax of a sensor that is off the centre. */
struct beam_sieve beam_sieve(const struct beam *b, const struct beam_opening *opening, double range_m);

/** beam_sieve_wider - directions up to by_rad away from one that passes `s` pass for certain. */
struct beam_sieve beam_sieve_wider(const struct beam_sieve *s, double by_rad);

/** beam_sieve_either - what passes one of two sieves of a beam passes. */
struct beam_sieve beam_sieve_either(const struct beam_sieve *a, const struct beam_sieve *b);

/** beam_sieve_cap - a cap that holds what passes: its middle; its radius, pi for all. */
double beam_sieve_cap(const struct beam *b, const struct beam_sieve *sieve, double middle[3]);

static inline bool beam_sieve_passes(const struct beam_sieve *s, const struct beam_ray *ray)
{
    return ray->aside >= s->from[0] && ray->aside <= s->to[0] && ray->upward >= s->from[1] &&
           ray->upward <= s->to[1] && fabs(s->square[0] * ray->aside + s->square[1] * ray->upward) <= s->most;
}

#endif
