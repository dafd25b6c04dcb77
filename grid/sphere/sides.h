/* SPDX-License-Identifier: MIT */
/*
 * sides - how far the water of a direction was seen from one side of its cell to the other. A beam frees the directions
 * whose middles it holds, and of one at its edge up to half lies in the next beam, or in none: beside the last beam of
 * a fan, or ahead of a head in its first scan. What is published of a direction is free no farther than both sides of
 * its cell were seen by beams that held its middle, or the middle of the neighbour on that side is free. Between beams
 * that leave gaps, a gap of up to a cell stays free.
 */
#ifndef SONARD_SIDES_H
#define SONARD_SIDES_H

#include "state.h"

/* A beam that heard from near_m to far_m at t_ns; from most_m on, seen from the grid's centre, an echo came since. */
struct side_look {
    const struct beam *beam;
    uint64_t t_ns;
    double near_m, far_m, most_m;
};

/** sides_see - it freed the stretch of direction d, in this ring. Looks may be entered from the newest to the oldest,
 * too. */
void sides_see(struct sphere *s, uint32_t d, uint32_t ring, const struct side_look *look,
               const struct stretch *stretch);

/** sides_end - an echo ended at to_m what was free in direction d. */
void sides_end(struct direction *d, float to_m);

/** sides_mark - neighbours of what is to be published are, too, where that changes what is said of them. */
void sides_mark(struct sphere *s, uint64_t t_ns);

/** sides_cut - cuts free intervals of direction d (list[FREE_INTERVALS]) to what was seen of both sides by t_ns and not
 * longer ago than what is kept. Their times stay those of the middle. After sides_mark. */
void sides_cut(const struct sphere *s, uint32_t d, uint64_t t_ns, struct free_interval *list);

#endif
