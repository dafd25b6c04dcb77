/* SPDX-License-Identifier: MIT */
/*
 * hearing - does a ping show that its receiver hears? A receiver that hears nothing returns what open water returns:
 * no echo. So a ping frees water only if its own samples show what a working receiver cannot avoid: it hears its own
 * transmission ring down, its noise is not far below what it was, and its samples vary. Learnt for one range axis and
 * gain of one sensor. Knows no echo, no map, and no ping but by what it has learnt.
 */
#ifndef SONARD_HEARING_H
#define SONARD_HEARING_H

#include <stdbool.h>
#include <stdint.h>

#include "profile.h"

#define HEARING_PARTS 32  /* of the axis near the head, each half a guard length long */
#define HEARING_LEAST 16  /* beams before a ring-down is known; pings before doubt is an alarm */
#define HEARING_OFTEN 24  /* pings of 64 before doubt is an alarm */
#define HEARING_TURN  400 /* beams before a ring-down that is quieter than usual is missing: a turn of most heads */

/* What a ping lacks. */
enum hearing_doubt {
    HEARING_HEARS,
    HEARING_NOT_LEARNT, /* it has a ring-down, as too few had yet: it frees nothing, and is no alarm */
    HEARING_FAINT,      /* its noise is far below what it was */
    HEARING_NO_RING,    /* its own pulse's ring-down is missing, or far below what it was */
    HEARING_CONSTANT,   /* its samples do not vary */
    HEARING_FROZEN,     /* its samples are those of an earlier ping */
    HEARING_LOST,       /* what it showed is gone in many directions at once (lost_echo.h) */
    HEARING_AIR,        /* depth and mount say that the head is out of the water (immersion.h) */
};

/* What one ping shows, the mean of its beams: powers of a bin under the amplitude law. */
struct hearing_levels {
    double part[HEARING_PARTS];
    uint32_t parts, beams; /* beams that were looked at */
    uint32_t
        behind_pulse; /* the part from which a ring-down shows that it is more than the transmission; 0: none */
    double noise;     /* of the quieter windows behind the parts; negative: too few bins */
    double least;     /* the receiver's own floor: a part that is quieter counts as so loud */
    double count;     /* of one count: what is quieter cannot be told from silence */
    uint64_t print;   /* of the samples: others have another; 0: too few differ to tell pings apart */
    bool hidden;      /* the ring-down may lie before the first bin, or in the lock-out: it is not asked for */
    bool varies;
    bool repeats; /* hearing_repeats */
};

/* Of a sensor: the prints of its last pings. A receiver with two buffers may send the old ones in turn. */
struct hearing_prints {
    uint64_t last[2];
};

/* Of one setting. */
struct hearing {
    double mean[HEARING_PARTS]; /* of the pings that had a ring-down */
    double ring[HEARING_PARTS]; /* an eighth of them is quieter: at other bearings something near rings with it */
    double
        worst[HEARING_PARTS]; /* after HEARING_TURN beams: one that grows slowly quieter is usual down to here */
    double noise_now;         /* an eighth of the pings has less noise */
    double noise;             /* the least that this ever was: it never rises */
    uint32_t rings, noises;   /* pings learnt from */
    uint32_t faint;           /* pings in a row whose noise is lost */
    uint32_t proofs;          /* pings doubted since the last that was right that had an echo all the same */
    bool shown;               /* the ring-down is known */
    bool refused;             /* it is not: the last HEARING_LEAST beams had the transmission alone */
};

/** hearing_clear - nothing is usual: another setting. */
void hearing_clear(struct hearing *h);

/**
 * hearing_levels_of - of n_beams x axis->n samples, at most 16 of the beams. deaf_m: so far the receiver is locked out
 * (0: it is not). floor_counts: the receiver's own noise, at most. O(bins) for each beam.
 */
struct hearing_levels hearing_levels_of(const struct profile_axis *axis, const struct amplitude *law,
                                        const void *samples, uint32_t n_beams, double deaf_m,
                                        uint32_t floor_counts);

/** hearing_varies - do the samples of one beam vary from bin `from` on? Real ones do, but where nearly all are zero.
 * O(bins) at most. */
bool hearing_varies(const struct amplitude *law, const void *samples, uint32_t from, uint32_t n);

/** hearing_repeats - has one of the last two pings the same samples? Noise never repeats. Enters this one's print. */
bool hearing_repeats(struct hearing_prints *prints, uint64_t print);

/**
 * hearing_take - what a ping with these levels lacks, by the pings before it; and learn from it. A doubted ping teaches
 * nothing, or deafness would become usual.
 */
enum hearing_doubt hearing_take(struct hearing *h, const struct hearing_levels *levels);

/**
 * hearing_prove - the last ping, which was doubted, has a strong echo. 16 of them without one that was right between
 * them, each with a ring-down of its own, show that the receiver hears, if otherwise than before: all is learnt anew.
 */
void hearing_prove(struct hearing *h, const struct hearing_levels *levels);

/* Of a sensor: whether its pings are doubted lately. */
struct hearing_alarm {
    enum hearing_doubt doubt; /* that a person should know of; HEARING_HEARS: none */
    enum hearing_doubt last;  /* of the last ping that was doubted */
    uint64_t doubted;         /* of the last 64 pings, the newest in bit 0 */
};

/**
 * hearing_alarm_take - one more ping. HEARING_LEAST doubted ones in a row raise the alarm, or HEARING_OFTEN of the last
 * 64, as of a receiver that hears every second one. HEARING_LEAST right ones in a row end it.
 */
void hearing_alarm_take(struct hearing_alarm *alarm, enum hearing_doubt doubt);

/** hearing_doubt_text - a sentence for people; NULL: there is nothing to say. */
const char *hearing_doubt_text(enum hearing_doubt doubt);

#endif
