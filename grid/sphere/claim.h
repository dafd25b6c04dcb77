/* SPDX-License-Identifier: MIT */
/*
 * claim - what the pings say of one direction's water: free from here to there, as of then. Knows no beam and no cell.
 *
 * Seen from the grid's centre, one ping of a sensor that sits elsewhere frees only a stretch of a ray: nearer or
 * farther the ray leaves the beam. The stretches that a turning head adds within a few beams are joined; what the
 * turn before had said stands beside until it is too old.
 */
#ifndef SONARD_CLAIM_H
#define SONARD_CLAIM_H

#include <stdbool.h>
#include <stdint.h>

#include "rings.h"

/* A head passes the few directions over which a lever arm spreads one ray within this time. */
#define CLAIM_CHAIN_NS 5000000000u

struct claim {
    uint64_t t_ping_ns; /* of the oldest ping it rests on; 0: no claim */
    double path_m;      /* way driven by then */
    float from_m, to_m; /* free water; to_m <= from_m: looked at, and nothing can be said */
    uint64_t sensors;   /* set of the sensors it rests on */
};

enum { CLAIM_NOW, CLAIM_BEFORE, CLAIMS };

/* A new stretch, and whether its ends are where the ray enters and leaves the beam at its side. */
struct stretch {
    double from_m, to_m;
    bool enters_aside, leaves_aside;
};

/** claim_add - what a ping heard of a direction (claims[CLAIMS]): takes the place of all before, or joins what its own turn has said. */
void claim_add(struct claim *claims, const struct stretch *stretch, uint64_t t_ns, double path_m, uint32_t sensor);

/** claim_withdraw - a ping looked there and heard nothing usable: what was claimed before stands no longer. */
void claim_withdraw(struct claim *claims, uint64_t t_ns, double path_m, uint32_t sensor);

/**
 * claim_join - both claims as one where they overlap or touch, else the longer: a ring-down that is longer in one beam
 * than in the next leaves scraps of free water nearer than what the claim is about.
 */
struct claim claim_join(const struct claim *a, const struct claim *b);

/** claim_meet - what both claims say: free where both are, as of the older ping; none where one is none. */
struct claim claim_meet(const struct claim *a, const struct claim *b);

/**
 * claim_moved - the claim of direction d after the grid's centre has moved by step_m (in the grid's axes), from the
 * joined claims `old` of all directions before. The new ray crosses old directions, the more the nearer: it is free
 * as far inward as each of them in turn says so. axis: [rings->n] unit vectors.
 */
struct claim claim_moved(const struct rings *rings, const double (*axis)[3], const struct claim *old, uint32_t d,
                         const double step_m[3]);

#endif
