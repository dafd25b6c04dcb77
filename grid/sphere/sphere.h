/* SPDX-License-Identifier: MIT */
/*
 * sphere - the vehicle-centred spherical occupancy grid (Auran and Silven 1996, section 3): sparse cells that exist
 * only where an echo was received, and for every direction when it was pinged last. What water is free it does not know
 * (grid/water). Pure; all memory comes from the caller; one thread owns it and publishes to a picture.
 *
 * Axes: the body's until a ping carries an attitude, NED from then on (what was stored before is dropped, since
 * nobody knows where the vehicle pointed). Rotation of the vehicle then costs nothing and drifts nowhere. With
 * SPHERE_COURSE the division into directions turns about the vertical, to the vehicle's course; places are reported and
 * kept in NED all the same. The grid's
 * centre follows the vehicle's position in steps of `recentre_m`; cells are sorted anew from their stored points,
 * never from cell centres, so no number of steps adds up to a drift. Between the steps the sensor's offset from the
 * centre is part of each beam's origin.
 *
 * Evidence: log-odds per cell, clamped, fading exponentially by the closed form from the last update (reading writes
 * nothing back), so fast that the surest obstacle blocks no more after forget_s. An echo is entered over the whole
 * opening of its beam, for nobody knows where in it the reflector lies; beams that pass through a cell with nothing
 * heard there lower it by the covered share of the cell.
 */
#ifndef SONARD_SPHERE_H
#define SONARD_SPHERE_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/fault.h"
#include "grid/picture/picture.h"
#include "grid/picture/rings.h"
#include "grid/echoes.h"
#include "layers.h"

/* Over which cells an echo is entered, and with which weight. */
enum sphere_model {
    SPHERE_OPENING,  /* all directions in the beam's opening alike, in the layer of its range */
    SPHERE_GAUSS,    /* eq. (1), integrated over each cell (spread.h) */
    SPHERE_MIDPOINT, /* eq. (1) at each cell's middle */
};

enum sphere_update {
    SPHERE_BAYES, /* the log-odds of echoes add up */
    SPHERE_MAX,   /* the strongest echo counts (Auran and Silven's first version) */
};

/* Where azimuth 0 of the directions points once there is an attitude. */
enum sphere_axes {
    SPHERE_NED,    /* north */
    SPHERE_COURSE, /* along the vehicle's course (course.h) */
};

#define SPHERE_SENSORS 64 /* told apart; a power of two */

struct sphere_conf {
    double angular_step_rad;
    bool level; /* one row of directions of height 2 * level_half_rad instead of the whole sphere */
    double level_half_rad;
    struct layers_conf layers;
    uint32_t max_cells;   /* [64, 2^24] */
    double forget_s;      /* an obstacle without another echo blocks for this long at most; > 0 */
    double forget_turns;  /* or, if that is longer, for so many turns of the slowest head; 0: forget_s alone */
    double blocked_above; /* probability above which a cell is an obstacle, (0.5, 0.99] */
    double recentre_m;    /* > 0 */
    enum sphere_model model;
    enum sphere_update update;
    enum sphere_axes axes;
    double range_error; /* standard deviation of a range as a share of it, [0, 0.1]; Gaussian models only */
    double mask_reach;  /* of an echo's mask, in standard deviations, [1.2, 4]; 0: 2; Gaussian models only */
    double relaxation;  /* how far cells are raised towards their neighbours (relax.h), [0, 1]; 0: they are not */
    double cluster_relaxation; /* the same for the cells that clusters are made of, [0, 1] */
};

struct sphere_stats {
    uint32_t cells;        /* in use */
    uint32_t directions;   /* of the grid */
    uint32_t pinged;       /* of these ever since the axes were set */
    uint64_t cells_lost;   /* reused while still in use, for want of room */
    uint64_t out_of_range; /* echoes beyond the last layer */
    uint64_t no_attitude;  /* pings not entered because they had no attitude while the grid's axes are NED */
    uint64_t recentred;
    uint64_t turned; /* times the axes followed the course */
};

struct sphere;

/** sphere_rings - the directions that it has; false: no such angular step. */
bool sphere_rings(const struct sphere_conf *conf, struct rings *rings);

/** sphere_forget_s - how long an obstacle blocks at most, with heads that turn within turn_s (0: not known yet). */
static inline double sphere_forget_s(const struct sphere_conf *conf, double turn_s)
{
    return fmax(conf->forget_s, conf->forget_turns * turn_s);
}

/** sphere_bytes - memory that sphere_init needs, or 0 with a sentence in fault when conf is out of range. */
size_t sphere_bytes(const struct sphere_conf *conf, struct fault *fault);

/** sphere_init - memory: sphere_bytes(conf), max_align_t-aligned; conf as accepted by sphere_bytes. */
struct sphere *sphere_init(void *memory, const struct sphere_conf *conf);

/** sphere_picture - the picture that sphere_enter publishes to; lives in the same memory. */
struct picture *sphere_picture(struct sphere *s);

/**
 * sphere_enter - one ping's echoes, received by a sensor at `mount`; publishes every direction that changed.
 * Cost: directions within the beam's opening (times 1 plus the lever arm's parallax), cells stored there.
 */
void sphere_enter(struct sphere *s, const struct echoes *e, const struct mount *mount);

/**
 * sphere_follow - no ping comes, and the vehicle is there at pose->t_ns, with an attitude and a position: the centre
 * follows as at a ping, and all directions are published when it does. Nothing is done before the first ping with an
 * attitude, nor when poses have jumped, were withdrawn or are farther than POSE_STEP_MOST_M from the centre since the
 * last ping: that is the next one's to judge. Nor with a pose from before the last ping, which has waited.
 */
void sphere_follow(struct sphere *s, const struct pose *pose);

/**
 * sphere_lock - freezes the cell of a direction at range_m, or lets it go: while locked it neither changes nor fades
 * nor makes room for others, but keeps its place in the world. The picture has it at once.
 * False when there is no such cell.
 */
bool sphere_lock(struct sphere *s, uint32_t direction, double range_m, bool locked);

void sphere_stats(const struct sphere *s, struct sphere_stats *out);

#endif
