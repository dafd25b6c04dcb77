/* SPDX-License-Identifier: MIT */
/*
 * background_learn - makes a background template from pings: the median of the first K of each row, cell by cell. A
 * row takes a ping only when the vehicle has moved since the one before it, so that the surroundings change and the
 * vehicle's own echoes stay. Exact; the K counts of a cell are kept sorted, K bytes per cell, none thrown away.
 *
 * Method: temporal median of Oliveira, Ferreira and Cruz 2023, equation (1); with an even number the lower one.
 */
#ifndef SONARD_BACKGROUND_LEARN_H
#define SONARD_BACKGROUND_LEARN_H

#include "background.h"

#define BACKGROUND_MOVED_BINS   4  /* travelled since the row's last ping ... */
#define BACKGROUND_MOVED_WIDTHS 2  /* ... or so many beam widths of turn */
#define BACKGROUND_STRAY        16 /* one of so many rows is not waited for: a head angle that came once in error */

struct background_learn_conf {
    uint32_t pings; /* K of each row, [1, BACKGROUND_LEARNT_MAX] */
    bool standing;  /* take pings although the vehicle has not moved */
};

struct background_progress {
    uint32_t rows_seen;  /* rows that have had a ping */
    uint32_t rows_full;  /* of these, with all they need */
    uint32_t least;      /* pings of the row that has the fewest, of those seen */
    uint64_t taken;      /* rows' pings that count */
    uint64_t unmoved;    /* not taken: the vehicle had not moved */
    uint64_t no_pose;    /* taken although it was not known whether it had moved */
    uint64_t other_bins; /* not taken: another range, other bins or another head than at the beginning */
    bool done;           /* nothing more is needed */
};

struct background_learn;

/** background_learn_size - bytes of memory; pings as in the configuration. */
size_t background_learn_size(const struct background_shape *shape, uint32_t pings);

/** background_learn_init - begin, in mem (aligned to max_align_t). mount: of the sonar. */
struct background_learn *background_learn_init(void *mem, const struct background_shape *shape,
                                               const struct background_learn_conf *conf,
                                               const struct mount *mount);

/**
 * background_learn_take - look at a ping, with its pose. A row is full with K pings; learning is done when a full row
 * comes again and of the rows that were ever seen at most one in BACKGROUND_STRAY lacks any: a whole turn, sector or
 * fan has come round. Several pings of a turning head in one row on end count as one.
 *
 * Moved: the place (POSE_POSITION) by BACKGROUND_MOVED_BINS bins, or the level direction of the beam's axis
 * (POSE_ATTITUDE) by BACKGROUND_MOVED_WIDTHS beam widths. With neither known the ping counts, in no_pose.
 * O(K * bins), allocates nothing.
 */
void background_learn_take(struct background_learn *learn, const struct ping *ping);

/** background_learn_shape - of the pings that it takes. */
const struct background_shape *background_learn_shape(const struct background_learn *learn);

void background_learn_progress(const struct background_learn *learn, struct background_progress *out);

/**
 * background_learn_finish - the medians of what was taken, into an empty template of the same shape. Rows with fewer
 * than `least` pings are left out. Rows left out that lie within one beam width of learnt ones take the louder of the
 * nearest on both sides: a head that steps over some angles has covered them all the same.
 */
void background_learn_finish(const struct background_learn *learn, uint32_t least, struct background *out);

#endif
