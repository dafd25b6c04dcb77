/* SPDX-License-Identifier: MIT */
/*
 * shade - where a part of the vehicle rings with a turning head turn after turn, a beam that does not show it has not
 * seen through it: the part fades in one ping or another, and does not leave. Withdraws the free water of such a beam;
 * knows no samples, no map, no poses, for the part turns with the head's mount.
 */
#ifndef SONARD_SHADE_H
#define SONARD_SHADE_H

#include <stdbool.h>
#include <stdint.h>

#include "grid/echoes.h"

#define SHADE_ROWS 800 /* of a head's turn, half a step of the finest */

/* A bearing of the head. */
struct shade_row {
    bool looked;
    uint8_t rang;   /* looks that something rang in, since it was gone last; up to 6. 0: nothing is there */
    uint8_t missed; /* looks since that it should have rung in, and did not */
};

/* All zero: nothing was heard yet. */
struct shade {
    struct shade_row row[SHADE_ROWS];
    bool rings;     /* a beam of this pass rang no farther than 10 degrees from the newest, ... */
    float ring_rad; /* ... the last one here */
};

/**
 * shade_run - a ping of a head, a beam of which may ring (BEAM_HIDES_RING). One that does not frees nothing where the
 * last looks all rang, from 10 degrees before it to 10 behind, and a beam as near has just done so again; or where six
 * looks at this bearing did. The third such beam in a row shows that the part is gone. Fans: nothing. O(20 degrees).
 */
void shade_run(struct shade *s, struct echoes *echoes);

#endif
