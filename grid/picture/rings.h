/* SPDX-License-Identifier: MIT */
/*
 * rings - the angular division of the spherical grid: rings of equal height in elevation, each cut into as many
 * cells as keep the solid angle of a cell about the same, so that nothing degenerates at the poles. A scene with only
 * level sonars has a single ring of a stated height.
 *
 * A direction is a number 0..n-1: ring by ring from straight up, in each ring by azimuth from 0, clockwise.
 */
#ifndef SONARD_RINGS_H
#define SONARD_RINGS_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#define RINGS_MAX  720
#define RINGS_NONE UINT32_MAX

struct rings {
    uint32_t n_rings;
    uint32_t n;                    /* directions */
    double top_rad;                /* elevation of the upper edge of ring 0 */
    double height_rad;             /* of each ring */
    double tan_half;               /* of half the height */
    double step_rad;               /* wanted width of a cell; the real one is at most this at the equator */
    uint32_t start[RINGS_MAX + 1]; /* first direction of each ring */
    double sin_el[RINGS_MAX], cos_el[RINGS_MAX]; /* of the middles of each ring's cells */
    double sin_edge[RINGS_MAX + 1];              /* of the elevations where rings end */
    double tan_width[RINGS_MAX];                 /* of half the width of a cell; 0: a quarter turn and more */
};

/** rings_full - the whole sphere in ceil(pi / step) rings; step in [0.25 deg, 90 deg]. False when out of range. */
bool rings_full(struct rings *rings, double step_rad);

/** rings_level - one ring from -half to +half elevation (half in (0, pi/2]). False when out of range. */
bool rings_level(struct rings *rings, double step_rad, double half_rad);

/** rings_cells - cells of a ring of the full sphere with n_polar rings: max(1, ceil(solid angle / step^2)). */
uint32_t rings_cells(uint32_t ring, uint32_t n_polar, double step_rad);

/** rings_index - the direction that holds (azimuth, elevation); RINGS_NONE outside a level ring. Any finite angles. */
uint32_t rings_index(const struct rings *rings, double az_rad, double el_rad);

/**
 * rings_holding - rings_index of the angles of v != 0, at a fifth of its cost: they are estimated with arithmetic
 * alone, and computed in full only where the estimate is too near to an edge to tell.
 */
uint32_t rings_holding(const struct rings *rings, const double v[3]);

/** rings_keeps - v, so long, is surely in that cell of the ring, in whose middle u lies: at a third of the cost of
 * rings_holding, but false for what all but lies on an edge. */
static inline bool rings_keeps(const struct rings *rings, uint32_t ring, const double u[3], const double v[3],
                               double length)
{
    const double *edge = rings->sin_edge + ring, margin = 1e-9 * length;
    const double along = v[0] * u[0] + v[1] * u[1], across = v[1] * u[0] - v[0] * u[1];
    return -v[2] < edge[0] * length - margin && -v[2] > edge[1] * length + margin &&
           fabs(across) < rings->tan_width[ring] * along - margin;
}

/** rings_centre - azimuth and elevation of the middle of a direction. */
void rings_centre(const struct rings *rings, uint32_t direction, double *az_rad, double *el_rad);

/** rings_ring - the ring of a direction. */
uint32_t rings_ring(const struct rings *rings, uint32_t direction);

/** rings_aside - the direction beside d to the left (0) or right (1), in its ring; d itself where it is alone there. */
static inline uint32_t rings_aside(const struct rings *rings, uint32_t ring, uint32_t d, int side)
{
    const uint32_t first = rings->start[ring], last = rings->start[ring + 1] - 1;
    if (side)
        return d < last ? d + 1 : first;
    return d > first ? d - 1 : last;
}

/** rings_width - width of the cells of a ring in azimuth. */
double rings_width(const struct rings *rings, uint32_t ring);

/** rings_reach - the greatest angle between the middle of a cell and a corner of it, of all cells. */
double rings_reach(const struct rings *rings);

/** rings_turned - the direction that holds the middle of direction d after the axes have turned
 * clockwise by turn_rad. */
uint32_t rings_turned(const struct rings *rings, uint32_t direction, double turn_rad);

/* Neighbouring directions of one ring: cell `at` and the n - 1 after it, past azimuth 0 too. */
struct rings_run {
    uint32_t start, cells; /* of the ring */
    uint32_t at, n;
};

/** rings_in - direction k (0..n-1) of a run. */
static inline uint32_t rings_in(const struct rings_run *run, uint32_t k)
{
    uint32_t i = run->at + k;
    return run->start + (i < run->cells ? i : i - run->cells);
}

/** rings_holds - is direction d in the run? */
static inline bool rings_holds(const struct rings_run *run, uint32_t d)
{
    const uint32_t i = d - run->start; /* wraps below the ring */
    return i < run->cells && (i >= run->at ? i - run->at : i + run->cells - run->at) < run->n;
}

/*
 * Visits the directions whose centre lies within `radius` of an axis, each once;
 * at the very edge perhaps one more. Use:
 *   struct rings_visit v = rings_visit(rings, axis, radius);
 *   while (rings_next(&v)) use(v.direction);
 */
struct rings_visit {
    const struct rings *rings;
    double az_rad, sin_el, cos_el, cos_radius;
    uint32_t ring, last_ring;
    struct rings_run run;
    uint32_t k;         /* of the run, the next */
    uint32_t direction; /* that is visited, in `ring` */
};

/** rings_visit - axis: a unit vector. */
struct rings_visit rings_visit(const struct rings *rings, const double axis[3], double radius_rad);

/** rings_next_ring - on to the next ring and the run of directions to be visited there, perhaps none;
 * false: it was the last. */
bool rings_next_ring(struct rings_visit *v);

static inline bool rings_next(struct rings_visit *v)
{
    while (v->k == v->run.n)
        if (!rings_next_ring(v))
            return false;
    v->direction = rings_in(&v->run, v->k++);
    return true;
}

/**
 * rings_touching - the directions whose closed cells share a point with that of direction d, itself included, each
 * once, in up to three runs; returns how many. The cells of a ring that ends in a pole share that pole.
 */
unsigned rings_touching(const struct rings *rings, uint32_t d, struct rings_run run[3]);

#endif
