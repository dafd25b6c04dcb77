/* SPDX-License-Identifier: MIT */
/*
 * sides - how far the water of a direction was seen from one side of its cell to the other. A beam frees the directions
 * whose middles it holds, and of one at its edge up to half lies in the next beam, or in none: beside the last beam of
 * a fan, ahead of a head in its first scan, or where a ping was lost. So the rays along the sides of cells are kept
 * like those along their middles, as far as beams that freed either neighbour had them. What is published of a
 * direction is free no farther than both its sides. An echo ends them for those neighbours alone whose middles its beam
 * had, until a newer look. Between beams that leave a gap, less than half a cell of it may be free.
 */
#ifndef SONARD_SIDES_H
#define SONARD_SIDES_H

#include "state.h"

/* A beam that heard so far looks at a direction, in this ring. */
struct side_look {
    const struct beam *beam;
    struct free_ping by;
    const struct beam_water *water;
    uint32_t direction, ring;
};

/** sides_see - it freed the stretch of the direction, and is the newest to do so. NULL: nothing of it, but may have
 * freed a side: where it points at one and is, but for rounding, no wider than a cell. */
void sides_see(struct sphere *s, const struct side_look *look, const struct stretch *stretch);

/** sides_fill - the same, and is older than all others so far: while free intervals are made anew. */
void sides_fill(struct sphere *s, const struct side_look *look, const struct stretch *stretch);

/** sides_withdraw - a look at t_ns took back what was free of direction d: nothing that is older counts for it. Looks
 * may be told from the newest to the oldest, too. */
void sides_withdraw(struct sphere *s, uint32_t d, uint64_t t_ns);

/** sides_mark - neighbours of what is to be published are, too, where that changes what is said of them. */
void sides_mark(struct sphere *s, uint64_t t_ns);

/** sides_cut - cuts free intervals of direction d (list[FREE_INTERVALS]) to what was seen of both sides by t_ns and not
 * longer ago than what is kept. Their times stay those of the middle. After sides_mark. */
void sides_cut(const struct sphere *s, uint32_t d, uint64_t t_ns, struct free_interval *list);

#endif
