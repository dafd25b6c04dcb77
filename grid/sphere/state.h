/* SPDX-License-Identifier: MIT */
/*
 * state - what the sphere consists of, shared by its modules and nobody else. They stand on it in this order: sensor
 * (beams are entered), motion and course (the vehicle is followed), view, relax and publish (the picture is written),
 * sphere.
 */
#ifndef SONARD_SPHERE_STATE_H
#define SONARD_SPHERE_STATE_H

#include "beam.h"
#include "grid/picture/bearings.h"
#include "cells.h"
#include "sphere.h"

struct relaxed;

/*
 * When a ping last looked at it: advice on where to look next, which answers nothing about water. So it stays with its
 * direction while the centre moves, though other water lies there by then; axes that turn take it along.
 */
struct direction {
    uint64_t t_look_ns; /* of the newest ping with a beam whose opening held the direction's middle; 0: none */
    float to_m;         /* it heard so far */
    uint16_t ring;      /* that it is in; of no ping */
    bool dirty;         /* on the list of directions to publish */
};

/* Bounds how long the past can outvote the present: a few turns. */
#define LOGODDS_MAX 6.0

struct sphere {
    struct sphere_conf conf;
    struct rings rings;
    struct layers layers;
    struct picture picture;
    struct picture_frame frame;
    double anchor_m[3];
    bool placed; /* a position was given: centre and anchor hold */
    struct cells cells;
    double nearest_m; /* no layer that begins nearer holds a cell */
    struct direction *direction;
    struct beam_cell *ring;    /* what the cells of each ring are like */
    double widest_rad;         /* across any cell */
    double widest;             /* so many half openings from the axis an echo is entered: conf.mask_reach */
    double reach_rad;          /* from the middle of any cell to its farthest corner, at most */
    double nearer_share;       /* a mean of points of a cell is no nearer than its layer times this */
    double (*axis)[3];         /* unit vector of each direction's centre, in NED or the body's axes */
    double axes_cos, axes_sin; /* of frame.axes_rad */
    bool drifts;               /* poses have no position, ... */
    double drifted_m[2];       /* the greatest drift of a ping's pose, level and in depth */
    double ahead_m;            /* ... and what the picture counts as its drift is so much more than at the ping */
    double heading_radps;      /* of the newest ping's pose */
    bool under_way;            /* fast enough to have a course over ground */
    uint64_t t_centre_ns;      /* of the newest pose that the centre has followed */
    struct direction *turned;  /* room for all of them, while the axes turn; NULL: they never do */
    struct relaxed *relax; /* [layers], of the direction in work, all zero between; NULL: there is no relaxation */
    uint32_t *dirty;
    uint32_t n_dirty;
    double blocked_logodds; /* conf.blocked_above as log-odds */
    double fade_s;       /* time constant of fading: from LOGODDS_MAX to blocked_logodds within sphere_forget_s */
    uint64_t t_start_ns; /* first ping since the axes were set */
    uint32_t turn_took_ms[SPHERE_SENSORS];
    uint32_t turn_ms[SPHERE_SENSORS]; /* each sensor's turn began so long after t_start_ns */
    uint64_t away_sensors; /* those that were silent in their present turn: it does not say how long one takes */
    struct bearings bearings;
    struct sphere_stats stats;
};

/** state_mark - direction d is to be published. */
static inline void state_mark(struct sphere *s, uint32_t d)
{
    if (!s->direction[d].dirty) {
        s->direction[d].dirty = true;
        s->dirty[s->n_dirty++] = d;
    }
}

/** state_logodds - of a cell at t_ns: fading is exponential; none before its last update, and none when locked. */
double state_logodds(const struct sphere *s, const struct cell *c, uint64_t t_ns);

/** state_blocks - is that more than what blocks? Most are told without the exponential: by fading log-odds lose no more
 * than their age as a share of the time constant. */
static inline bool state_blocks(const struct sphere *s, const struct cell *c, uint64_t t_ns)
{
    const double blocked = (double)s->picture.blocked_logodds, l = (double)c->logodds;
    const double age_s = t_ns > c->t_ref_ns ? (double)(t_ns - c->t_ref_ns) * 1e-9 : 0;
    return l > blocked &&
           (l * (s->fade_s - age_s) > blocked * s->fade_s * (1 + 1e-9) || state_logodds(s, c, t_ns) > blocked);
}

/** state_place - from the grid's centre to the cell's point. */
static inline void state_place(const struct sphere *s, const struct cell *c, double v[3])
{
    v[0] = (double)c->point_m[0] + s->anchor_m[0] - s->frame.centre_m[0];
    v[1] = (double)c->point_m[1] + s->anchor_m[1] - s->frame.centre_m[1];
    v[2] = (double)c->point_m[2] + s->anchor_m[2] - s->frame.centre_m[2];
}

/** state_vector - the same; its length. */
static inline double state_vector(const struct sphere *s, const struct cell *c, double v[3])
{
    state_place(s, c, v);
    return geo_length(v);
}

/** state_to_grid - v (NED or the body's) in the grid's axes, in which rings and the picture's axis[] are. */
void state_to_grid(const struct sphere *s, const double v[3], double out[3]);

/** state_ms - milliseconds from the grid's first ping to t_ns, within uint32_t. */
uint32_t state_ms(const struct sphere *s, uint64_t t_ns);

/** state_way_error_m - how far the vehicle may be off by after a way: by the error of its scale, and its heading, which
 * has drifted since then_ns. */
static inline double state_way_error_m(const struct sphere *s, double way_m, uint64_t then_ns, uint64_t t_ns)
{
    const bool turns = s->heading_radps > 0 && t_ns > then_ns;
    const double turned_rad = turns ? s->heading_radps * (double)(t_ns - then_ns) * 1e-9 : 0;
    return (POSE_WAY_ERROR + (turned_rad < 2 ? turned_rad : 2)) * way_m;
}

/** state_take - the cell of (direction, layer), made when it does not exist, of another one where there is no room.
 * NULL: there is none at all. */
struct cell *state_take(struct sphere *s, uint32_t direction, uint16_t layer);

#endif
