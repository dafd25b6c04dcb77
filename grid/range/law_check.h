/* SPDX-License-Identifier: MIT */
/*
 * law_check - do a sensor's counts look as its amplitude law says? Speckle scatters in proportion to its level. Counts
 * proportional to pressure or power keep that: twice the level, twice the scatter. Decibels do not: their scatter is
 * the same at every level. Counts of a root should keep it, but those of real devices lie in between, so that nothing
 * is said of them; nor of counts taken as power, whose speckle reaches from zero to full scale at any level. Knows no
 * detector and no units of range.
 */
#ifndef SONARD_LAW_CHECK_H
#define SONARD_LAW_CHECK_H

#include <stdint.h>

#include "profile.h"

#define LAW_CHECK_LEVELS 4  /* octaves of the mean count, from 8 on */
#define LAW_CHECK_STEPS  72 /* eighths of an octave of the scatter, from a quarter of a count on */

/* What speaks against the configured law. */
enum law_doubt {
    LAW_FITS,             /* or it is not known */
    LAW_LOOKS_COMPRESSED, /* taken as linear or as power, and the scatter does not grow with the level */
    LAW_LOOKS_LINEAR,     /* taken as decibels, and the scatter grows with the level */
};

struct law_check {
    uint32_t windows;                                    /* looked at, for the choice of the next one */
    uint16_t n[LAW_CHECK_LEVELS];                        /* of a level */
    uint16_t scatter[LAW_CHECK_LEVELS][LAW_CHECK_STEPS]; /* how often which */
};

/** law_check_clear - no ping yet: a new law. */
void law_check_clear(struct law_check *check);

/** law_check_add - look at one reference window of a beam, the next one each time.
 * 8-bit counts only; others add nothing. */
void law_check_add(struct law_check *check, const struct profile *p);

/** law_check_slope - by which power of the level the scatter grows;
 * NAN before two octaves of level were received often. */
double law_check_slope(const struct law_check *check);

/** law_check_doubt - the message for counts that are taken as `law`. */
enum law_doubt law_check_doubt(const struct law_check *check, enum amplitude_law law);

/** law_doubt_text - a sentence for people; NULL: there is no doubt. */
const char *law_doubt_text(enum law_doubt doubt);

#endif
