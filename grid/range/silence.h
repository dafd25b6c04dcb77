/* SPDX-License-Identifier: MIT */
/*
 * silence - what a beam says of the water where it found nothing. Silence is evidence only where the receiver was
 * heard to be alive and nothing stood in its way. Knows no echoes.
 */
#ifndef SONARD_SILENCE_H
#define SONARD_SILENCE_H

#include "profile.h"

/* How far the water counts as free where nothing was found. */
enum extract_no_echo {
    EXTRACT_MINIMUM, /* to minimum_range_m, but not where the receiver sends nothing but zeros */
    EXTRACT_HEARD,   /* as far as the receiver is heard to be alive: to the first window of nothing but zeros */
    EXTRACT_RANGE,   /* to the end of the beam, if the receiver is heard at all behind the ring-down */
};

/** silence_is_dumb - every bin from p->first on at full scale, or every bin at zero: the receiver said nothing. */
bool silence_is_dumb(const struct profile *p);

/**
 * silence_free_m - how far from the sensor the water is free by the rule, where no echo was found. Not beyond cell
 * `judged`: what is masked there casts a shadow.
 */
double silence_free_m(const struct profile *p, uint32_t judged, enum extract_no_echo rule, double minimum_range_m);

/* Levels behind the ring-down. */
struct silence {
    uint64_t floor;   /* mean power of the quietest reference window, at least the floor's */
    uint32_t drowned; /* cell from which on a reflector may drown in what the water sends back; n: none */
    uint32_t quiet;   /* cell from which on none does; p->first when none does anywhere */
};

/**
 * silence_levels - the floor, and where the first window begins that is louder than `ratio` times the quietest one
 * behind it; whole windows side by side from p->first on. A level that falls with range is reverberation, and hides a
 * reflector that would stand out of the quiet water behind. One that rises hides nothing before it; what it says of the
 * water from there on is silence_calm's business.
 */
struct silence silence_levels(const struct profile *p, double ratio);

/**
 * silence_hidden - up to which cell before `until` a reflector of this power may be hidden: the end of the last masked cell,
 * or of the last window behind that (whole ones, side by side) that is so loud that it would not stand out by `ratio`;
 * p->first: nowhere.
 */
uint32_t silence_hidden(const struct profile *p, uint32_t until, double power, double ratio);

/* Where the level behind the ring-down rises for good; both n where it does not. */
struct calm {
    uint32_t
        until; /* cell up to which the water sends back hardly more than where it is quietest, nearer the head */
    uint32_t risen; /* end of the stretch that shows it */
};

/**
 * silence_calm - where the level rises 9 dB above the quietest nearer stretch. Something diffuse returns from there on: a soft
 * bottom, a slope at grazing incidence. No detector finds it, for it is its own reference. (Or the receiver's gain raises its
 * noise; a beam does not say which.) Stretches with a masked cell are left out. Before the detector has run.
 */
struct calm silence_calm(const struct profile *p);

#endif
