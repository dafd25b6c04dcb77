/* SPDX-License-Identifier: MIT */
/*
 * view - cells of the spherical grid as seen from outside: what is known of each. Changes nothing. Of the owner's
 * thread.
 */
#ifndef SONARD_SPHERE_VIEW_H
#define SONARD_SPHERE_VIEW_H

#include <stdbool.h>
#include <stdint.h>

struct sphere;

/* A cell as seen from outside. */
struct sphere_cell {
    double from_m, to_m;            /* its layer */
    double point_m[3];              /* of its echo, from the grid's centre, in NED or the body's axes */
    double near_m;                  /* nearest edge of what reflects, from the grid's centre */
    double ball_m;                  /* standard deviation of that point, along each axis */
    double logodds;                 /* at the time asked about */
    uint64_t t_first_ns, t_echo_ns; /* its first echo (to 1 ms; after 12 days perhaps a later one); its last */
    uint32_t seq;                   /* of the last ping that hit or missed it ... */
    uint16_t sensor;                /* ... which this sensor sent */
    uint16_t echoes;                /* so many, or more when 65535 */
    uint16_t layer;                 /* its number */
    uint8_t misses;                 /* beams since its last echo that passed it without one; or more when 15 */
    bool pending;                   /* its one echo does not block until a second one confirms it */
    unsigned flags;                 /* set of enum sphere_cell_flag */
};

/* What happened to a cell in the present turn of the sensor that touched it last (PING_NEW_TURN begins one). */
enum sphere_cell_flag {
    SPHERE_NEW = 1,     /* its first echo */
    SPHERE_UPDATED = 2, /* another echo */
    SPHERE_MISSED = 4,  /* beams passed it, no echo */
    SPHERE_GONE = 8,    /* and so often that it is no more */
    SPHERE_LOCKED = 16,
};

/** sphere_cell - the k-th nearest cell of a direction as of t_ns; false: there are fewer. */
bool sphere_cell(const struct sphere *s, uint32_t direction, uint32_t k, uint64_t t_ns, struct sphere_cell *out);

/** sphere_pinged - time of the newest ping that looked in a direction; 0: never pinged. */
uint64_t sphere_pinged(const struct sphere *s, uint32_t direction);

/** sphere_passed - the same, if that heard as far as range_m; else 0. */
uint64_t sphere_passed(const struct sphere *s, uint32_t direction, double range_m);

/** sphere_cluster_relaxation - conf.cluster_relaxation. */
double sphere_cluster_relaxation(const struct sphere *s);

/** sphere_centre - place of the grid's centre, NED. sphere_reach - range of the last layer's end. */
void sphere_centre(const struct sphere *s, double centre_m[3]);
double sphere_reach(const struct sphere *s);

/** sphere_axes - azimuth, in NED, of the directions' azimuth 0.
 * sphere_holding - the direction that holds v (NED) != 0. */
double sphere_axes(const struct sphere *s);
uint32_t sphere_holding(const struct sphere *s, const double v[3]);

/**
 * sphere_gone - walks the cells that went in the present turns, the newest first: *at is 0 before the first. False: no
 * more. Its limits in range are as of then; its point is where it stood, seen from where the grid is now.
 */
bool sphere_gone(const struct sphere *s, uint32_t *at, uint64_t t_ns, struct sphere_cell *out);

#endif
