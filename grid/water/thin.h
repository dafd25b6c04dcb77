/* SPDX-License-Identifier: MIT */
/*
 * thin - which record of a fan says nothing that those before and behind it do not say: a fan pings so often that most
 * of them are alike. What pings from one place show off their axes differs by their noise: they are joined.
 */
#ifndef SONARD_WATER_THIN_H
#define SONARD_WATER_THIN_H

#include "row.h"

#define THIN_JOINED_NS UINT64_C(4000000000) /* from the oldest ping of a record to the newest, at most */

/** thin_is_still - were they sent from one place, with the same axes and columns and hardly any drift between, and
 * neither frees what ends at an echo of the older one? */
bool thin_is_still(const struct water_record *older, const struct water_record *newer);

/** thin_join - one record of two that thin_is_still says it of, as old as the older one and with its axes: in each
 * cell free as far as either has it. O(cells). */
void thin_join(const struct water_record *older, const struct water_record *newer, struct water_record *joined,
               struct row_room *room);

/**
 * thin_spares - is `middle` spared by the one before it and the newest? They are of the same size, sent from nearly the
 * same place and with nearly the same axes, in no longer than THIN_JOINED_NS, and each end of it at an echo is seen by
 * both, and by one of them in the very same beam. Cost: columns of the image times log of them.
 */
bool thin_spares(const struct water_record *before, const struct water_record *middle,
                 const struct water_record *newest);

#endif
