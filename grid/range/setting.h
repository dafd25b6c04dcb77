/* SPDX-License-Identifier: MIT */
/*
 * setting - what is usual for a sensor under each of its latest range axes: a head that takes turns between ranges comes
 * back to what it knew. Knows neither samples nor echoes.
 */
#ifndef SONARD_SETTING_H
#define SONARD_SETTING_H

#include "profile.h"
#include "usual.h"

#define SETTINGS 4

struct setting {
    struct profile_axis axis;
    struct usual floor;      /* of a ping's quietest beam */
    struct usual ring_down;  /* a cell: its earliest end among a ping's beams */
    struct usual ring_power; /* its loudest cell, in the beam of a ping that has the quietest one */
    struct usual ring_loud;  /* a cell: until where it is within 3 dB of that, in the beam of a ping where that is earliest */
    uint64_t used;           /* which of the pings last had it, from 1; 0: it is free */
};

struct settings {
    struct setting setting[SETTINGS];
    uint64_t pings;
};

/** settings_clear - nothing is usual. All zeros is the same. */
void settings_clear(struct settings *s);

/** settings_for - the setting of one more ping with this axis; a new one takes the place of the one not used for longest. */
struct setting *settings_for(struct settings *s, const struct profile_axis *axis);

#endif
