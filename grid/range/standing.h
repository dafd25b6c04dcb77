/* SPDX-License-Identifier: MIT */
/*
 * standing - whether the vehicle is where it was, as surely as poses and the promise to keep station can tell: within
 * 0.3 m and 5 degrees.
 */
#ifndef SONARD_STANDING_H
#define SONARD_STANDING_H

#include <stdbool.h>
#include <stdint.h>

#include "grid/geometry.h"

/* All zero: nothing is known yet. */
struct standing {
    uint64_t since_ns; /* the vehicle has stood since then; 0: never */
    struct pose pose;
    double moved_m, turned_rad; /* and was at most so far from there */
};

/** standing_at - it has not moved or turned between the two poses, nor has its frame. */
bool standing_at(const struct pose *then, const struct pose *now);

/** standing_follow - what is known at t_ns, from its pose then. It begins anew when the vehicle has moved. */
void standing_follow(struct standing *s, uint64_t t_ns, const struct pose *now);

#endif
