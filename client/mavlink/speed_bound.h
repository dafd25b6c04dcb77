/* SPDX-License-Identifier: MIT */
/*
 * speed_bound - how fast a vehicle can be, at most, by what its thrusters have pushed: level, and up or down, through
 * the water. Pure: pushes and the time that they lasted go in.
 *
 * What is bounded is the momentum of the vehicle and the water that moves with it, in axes that do not turn. Turning
 * the vehicle, however it does that, changes it by nothing; only forces do. With v the momentum by a mass, each
 * equation has the shape
 *
 *     m v' <= F - D(v)
 *
 * F: the most that the thrusters push. D: the lowest drag of all published models of a BlueROV2. m: the mass that is
 * worse, small while the vehicle is driven, great while it coasts. An equation whose right side is never less than the
 * truth's stays above the truth. Several are kept, and the least of what they say counts:
 *
 * - all of the momentum; this one needs no attitude.
 * - what of it lies along the level, and what up or down. Drag along one that a tilt turns into a push along the other
 *   is part of F. The level momentum may point anywhere in the body, and has the least drag of all ways.
 * - what of the level lies ahead, and what to the side. Each has the drag of its own way, but a turn takes momentum
 *   from one to the other: by the heading's rate.
 *
 * Assumed: the vehicle is a BlueROV2 or is moved less easily; its propellers push within THRUST_LEAST and THRUST_MOST
 * of the T200's curve, but one of them may be gone; thrust follows the pulse within 0.3 s; roll and pitch are right to
 * 2 degrees; it weighs no more than 3 N in the water, up or down; nobody pulls it. The water that carries it is for who
 * takes the bound to add.
 */
#ifndef SONARD_MAVLINK_SPEED_BOUND_H
#define SONARD_MAVLINK_SPEED_BOUND_H

#include <stdbool.h>

#include "thrust.h"

/* As fast as no such vehicle is by its own thrusters: where nothing is known. */
#define SPEED_BOUND_CAP_MPS 3.0

/* Beside what the model knows: the tether, which swings on when the vehicle stops. */
#define SPEED_BOUND_TETHER_MPS 0.02

struct speed_bound_conf {
    double linear_nspm, square_ns2pm2; /* drag of surge, as measured; both 0: the lowest published */
};

enum speed_bound_way {
    SPEED_BOUND_AHEAD, /* ... and back: along the level where the body points */
    SPEED_BOUND_ASIDE,
    SPEED_BOUND_LEVEL,
    SPEED_BOUND_VERTICAL,
    SPEED_BOUND_ALL,
    SPEED_BOUND_WAYS,
};

struct speed_bound {
    struct speed_bound_conf conf;
    struct thrust_range thrust[THRUST_MOTORS]; /* what it can be by now, of each motor */
    double up_n,
        down_n; /* what has pushed it up and down in its own axes lately: drag pushes back with no more, ... */
    double drag_n[2];             /* ... and with no more than its climb allows: against a way up, and down */
    double along_n;               /* likewise along the level */
    double mps[SPEED_BOUND_WAYS]; /* momentum by mass */
    double sin_tilt;              /* 0: level and vertical are not told apart */
};

/* What the motors did, between two samples. */
struct speed_bound_push {
    const struct thrust_frame *frame;
    struct thrust_range thrust[THRUST_MOTORS]; /* all that either sample allows */
    bool tilt_known;
    double down[2][3]; /* where down was in the body's axes (unit vectors), before and after */
    double turned_rad; /* how far the heading turned meanwhile */
    bool climb_known;
    double climb_mps; /* it goes up or down no faster, on the average of some seconds */
};

/** speed_bound_start - nothing is known of the time before. */
void speed_bound_start(struct speed_bound *b, const struct speed_bound_conf *conf);

/** speed_bound_step - it was pushed so for dt_s seconds, [0, 10]. */
void speed_bound_step(struct speed_bound *b, const struct speed_bound_push *push, double dt_s);

/** speed_bound_mps - no more than this by now: level, and up or down. */
void speed_bound_mps(const struct speed_bound *b, double mps[2]);

#endif
