/* SPDX-License-Identifier: MIT */
/*
 * discontinuity - how far what poses say has jumped: the vehicle cannot have come, or turned, to there from where
 * it was. Then
 * poses count from another place or north, or are wrong. Where it can be follows what poses say no faster than it goes,
 * so a jump in many small steps is one, and noise is none. Jumps add up: those that take each other back leave nothing,
 * and how the vehicle moves between them changes nothing, for it moves the same wherever positions count from.
 * Pure; the loop owns them: the map's, and the pose log's for the view.
 */
#ifndef SONARD_DISCONTINUITY_H
#define SONARD_DISCONTINUITY_H

#include <stdbool.h>
#include <stdint.h>

#include "grid/geometry.h"

/* So far from where it can be the map takes for no jump yet, level or in depth: an acoustic fix or a bottom lock may
 * set a good position right by as much, and another compass a good heading. */
#define DISCONTINUITY_M   5.0
#define DISCONTINUITY_DEG 20.0

enum discontinuity_part { DISCONTINUITY_LEVEL, DISCONTINUITY_DEPTH, DISCONTINUITY_TURN, DISCONTINUITY_PARTS };

/* By how much all jumps up to some moment have moved and turned what poses say, in NED, and what of it the vehicle may
 * have done itself meanwhile, in metres and radians. */
struct discontinuity_sum {
    double shift_m[3];
    double turn[4];                  /* unit quaternion */
    double own[DISCONTINUITY_PARTS]; /* these only grow */
};

struct discontinuities {
    double least_rad;
    struct discontinuity_sum sum;
    struct pose can; /* be there; has: what poses have said so far */
    uint64_t said_ns[DISCONTINUITY_PARTS];
    double chased[DISCONTINUITY_PARTS]; /* so far it has followed what poses say without coming there */
};

/* How far a pose jumped, in metres and radians; 0: it did not. */
struct jump {
    double by[DISCONTINUITY_PARTS];
};

/** discontinuity_init - none so far. least_rad, > 0: to be turned no farther from where it can be is no jump. */
void discontinuity_init(struct discontinuities *j, double least_rad);

/**
 * discontinuity_take - the next pose; what is no newer in it than what was said before is left out. most_mps,
 * most_radps: the vehicle goes and turns no faster; 0: nobody says,
 * which counts as 10 m/s and a turn a second. True: it jumped.
 */
bool discontinuity_take(struct discontinuities *j, const struct pose *pose, double most_mps, double most_radps,
                        struct jump *jump);

/** discontinuity_same - do poses surely count from the same place and north after `now` as after `then`,
 * but for less than a jump? */
bool discontinuity_same(const struct discontinuity_sum *then, const struct discontinuity_sum *now);

#endif
