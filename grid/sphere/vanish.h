/* SPDX-License-Identifier: MIT */
/*
 * vanish - why something that stood in the grid stands there no more: that an echo is gone is evidence, too. Knows
 * places, not clusters. Pure.
 */
#ifndef SONARD_VANISH_H
#define SONARD_VANISH_H

#include "sphere.h"

enum vanish_why {
    VANISH_NOT,    /* cells with evidence are still there: it has joined something */
    VANISH_SEEN,   /* beams have passed the place since, without an echo */
    VANISH_HIDDEN, /* something nearer stands before it now, as when the vehicle rounds a corner */
    VANISH_FAR,    /* the vehicle has moved away: it is beyond the grid */
    VANISH_AGED,   /* nobody has looked there since */
};

/**
 * vanish_why - of something at place_m (from the grid's centre, NED or the body's) whose last echo was at t_echo_ns.
 * member_logodds: from where on a cell counts; blocked_logodds: from where on it hides what is behind.
 */
enum vanish_why vanish_why(const struct sphere *s, const double place_m[3], uint64_t t_echo_ns, uint64_t now_ns,
                           double member_logodds, double blocked_logodds);

const char *vanish_word(enum vanish_why why);

#endif
