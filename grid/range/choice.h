/* SPDX-License-Identifier: MIT */
/*
 * choice - judges the range that an echosounder has chosen by the profile that it has chosen it in. Its gain is its own
 * and changes from ping to ping, so counts are compared within one profile only. An echo is as strong as the chosen one
 * from half of its counts on: it may be an obstacle, whatever the device prefers, and however sure it is. Keeps
 * nothing; knows no detector, no baseline, and no earlier ping but by the usual ring-down.
 *
 * The ring-down is what the profile begins with, falls, and ends where the transducer's does at the latest (deaf_m of
 * the ping). What is loud for longer is something near, from the first ping on, and is never learnt.
 */
#ifndef SONARD_CHOICE_H
#define SONARD_CHOICE_H

#include <stdbool.h>
#include <stdint.h>

#include "grid/ping.h"

/* What is known of the ring-down before this profile. */
struct choice_ring {
    bool learnt;
    uint64_t usual; /* with learnt: an eighth of the pings with these settings have `loud_until` below this */
    /* The configuration says that it ends here, before deaf_m or behind it; < 0: it says nothing. */
    double promised_m;
};

struct choice {
    bool heard; /* there is an echo where the device has chosen one; where it chose none, a loudest one */
    bool rings; /* something answers with the transducer, or right where the scan begins: nothing is free */
    /* Bin: until there the near end has half of its greatest count, whatever the gain; to be learnt, and so never
     * behind where a ring-down ends at the latest. */
    uint32_t loud_until;
    double from_m, to_m; /* water that the profile shows to be free; from >= to: none */
    /* The first echo that is as strong, before the chosen one or where none was chosen, and not before from_m: middle
     * of its loudest bin, and near edge. echo_m 0: there is none. */
    double echo_m, echo_near_m;
    bool weaker; /* than the chosen one, by up to half; or the chosen one is not there */
};

/**
 * choice_judge - beam b of a ping of the kind PING_CHOICE, whose range axis makes sense (profile_axis_of) and whose
 * samples have 1 or 2 bytes. range_m: the chosen range; 0: the device has chosen none.
 *
 * An echo is heard within 5 % of the range, the pulse and two bins around it (devices smooth what they report) when it
 * reaches a 16th of full scale, and 7/8 of the water before the first echo as strong are below a quarter of its counts.
 * More than four echoes as strong in one profile, itself among them, are noise. Without an echo there nothing is free,
 * but the profile's own loudest one is still looked for.
 *
 * Nothing is free either before a first echo nearer than twice from_m, which may be the second bounce off something
 * that is too near to be heard. O(bins).
 */
void choice_judge(const struct ping *ping, uint16_t b, double range_m, const struct choice_ring *ring,
                  struct choice *out);

/** choice_may_be_double - may an echo at range_m be the second bounce off something nearer than blind_m? Later ones are
 * not asked about: the second lies before them, and is louder. */
static inline bool choice_may_be_double(float range_m, float blind_m)
{
    return range_m < 2.0f * blind_m;
}

#endif
