/* SPDX-License-Identifier: MIT */
/*
 * scope - which directions of a grid a question about a cone or a corridor asks, and how far along the rays of each, as
 * seen from where the vehicle may be: wider than the question where that is uncertain. Knows no evidence.
 */
#ifndef SONARD_SCOPE_H
#define SONARD_SCOPE_H

#include "cell_edge.h"
#include "sight.h"

/* An angle, or the place of a direction against the axis. */
struct scope_bearing {
    double cos, sin;
};

/* The cells of a ring against a question. */
struct scope_edge {
    struct cell_edge cell;
    double reach;               /* sine of how far their edge lies from their middle */
    struct scope_bearing apart; /* the angle between two of a cell's rays, at the most */
    /* the angle from the axis up to which rays are within the cone, or on a corridor's axis */
    struct scope_bearing wall;
};

/* A question, turned into the grid's axes. */
struct scope {
    struct answer_query query;
    struct sight_place place;
    const struct rings *rings;
    double axis[3];
    double around_rad;         /* no direction farther from the axis is asked */
    double lo_rad, hi_rad;     /* elevations of the cone or corridor */
    double turned_rad;         /* the axis may be turned so far from where it is taken */
    double beside_m;           /* nearer than this nothing is answered: too much of it may lie beside */
    double cos_wall, sin_wall; /* of the angle between the axis and the question's wall */
    double ahead_m, across_m;  /* the vehicle's place off the centre, along the axis and across it */
    double sure_cos; /* what is within that cosine of the axis is surely in the cone; INFINITY: nothing is */
    uint32_t ring;   /* that `edge` is of */
    struct scope_edge edge;
};

/* One direction against the question: how far along its rays that reaches, 0: not at all. */
struct scope_share {
    double need_m;
    bool side;   /* it leaves a corridor through its side */
    bool beside; /* it is no direction of the cone */
};

/* Who asks from where. */
struct scope_view {
    const struct picture_frame *frame;
    const struct answer_now *now;
    const struct sight_place *place;
};

/** scope_begin - false: the axis is not among the directions that the grid keeps. Rings must live as long as *s. */
bool scope_begin(struct scope *s, const struct rings *rings, const struct scope_view *by,
                 const struct answer_query *query);

/** scope_share - of the direction with that middle, a unit vector in the grid's axes, in that ring.
 * scope_share_near - the same, but slow for most of a wide cone's. */
struct scope_share scope_share_near(struct scope *s, const double middle[3], uint32_t ring);

static inline struct scope_share scope_share(struct scope *s, const double middle[3], uint32_t ring)
{
    if (geo_dot(middle, s->axis) >= s->sure_cos)
        return (struct scope_share){.need_m = s->query.distance_m};
    return scope_share_near(s, middle, ring);
}

#endif
