/* SPDX-License-Identifier: MIT */
/*
 * setting - what is usual for a sensor under each of its latest range axes and gains: a head that takes turns between
 * ranges comes back to what it knew. Knows no echoes.
 */
#ifndef SONARD_SETTING_H
#define SONARD_SETTING_H

#include "baseline.h"
#include "hearing.h"
#include "profile.h"
#include "usual.h"

#define SETTINGS 4

struct setting {
    struct profile_axis axis;
    uint8_t gain; /* as in struct ping */
    struct baseline baseline;
    struct hearing hearing;
    struct usual ring_down;  /* a cell: its earliest end among a ping's beams */
    struct usual ring_power; /* its loudest cell, in the beam of a ping that has the quietest one */
    /* a cell: until where it is within 3 dB of that, in the beam of a ping where that is earliest */
    struct usual ring_loud;
    /* of pings with a choice, a bin: until where their near end is loud (choice.h), as an eighth of them have it, since
     * something near may be there most of the time */
    struct usual choice_ring;
    struct usual
        echo_power; /* of the loudest cell of the first echo, in the beam of a ping that has the loudest */
    uint64_t used;  /* which of the pings last had it, from 1; 0: it is free */
};

struct settings {
    struct setting setting[SETTINGS];
    uint64_t pings;
};

/** settings_bytes - memory for beams of max_bins, a multiple of 8. */
size_t settings_bytes(uint32_t max_bins);

/** settings_init - in that memory, 8-byte aligned; nothing is usual. */
void settings_init(struct settings *s, void *memory, uint32_t max_bins);

/** settings_clear - nothing is usual. */
void settings_clear(struct settings *s);

/** settings_for - the setting of one more ping with this axis and gain;
 * a new one takes the place of the one not used for longest. */
struct setting *settings_for(struct settings *s, const struct profile_axis *axis, uint8_t gain);

#endif
