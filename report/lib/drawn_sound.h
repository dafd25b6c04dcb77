/* SPDX-License-Identifier: MIT */
/*
 * drawn_sound - the pings of a drawn world as its head sends them, one after the other over DRAWN_TURNS turns,
 * each with what is true of it. The same bytes for the same world. Knows no detector.
 */
#ifndef SONARD_REPORT_DRAWN_SOUND_H
#define SONARD_REPORT_DRAWN_SOUND_H

#include "tests/water/dice.h"
#include "hearable.h"

/* What is true of one beam. */
struct drawn_truth {
    struct hearable hearable;
    double solid_m, skirt_m; /* as in struct insonified */
    double near_m[DRAWN_MAX_TARGETS], far_m[DRAWN_MAX_TARGETS];
    double rise_m[DRAWN_MAX_TARGETS]; /* from the near edge to where it is loudest, */
    double peak[DRAWN_MAX_TARGETS],
        before[DRAWN_MAX_TARGETS]; /* its mean power there, and the water's before it */
    float power[DRAWN_MAX_BINS];   /* mean of what is loudest in each bin ... */
    uint8_t cause[DRAWN_MAX_BINS]; /* ... and what that is: enum insonify_cause */
};

/* Large; `ping` points into it, so it is not copied. */
struct drawn_sound {
    struct drawn_world world;
    struct insonify insonify;
    struct hearable_margins margins;
    struct insonified beam;
    struct dice dice, timing;
    double t_s;                       /* of the next ping */
    double other_s[DRAWN_MAX_OTHERS]; /* of each other sonar's next ping */
    unsigned turn;                    /* of the ping that came last */
    uint32_t pings;                   /* sent, lost ones too */
    struct ping ping;
    struct ping_beam axis[DRAWN_MAX_BEAMS];
    uint8_t samples[DRAWN_MAX_BEAMS][DRAWN_MAX_BINS];
    struct drawn_truth truth[DRAWN_MAX_BEAMS];
};

/** drawn_sound_begin - before the first ping of world `number` of a seed. */
void drawn_sound_begin(struct drawn_sound *sound, uint64_t seed, unsigned number);

/** drawn_sound_next - the next ping that is not lost; false: that was the last. */
bool drawn_sound_next(struct drawn_sound *sound);

/** drawn_sound_cause - what is loudest about a range of a beam. */
enum insonify_cause drawn_sound_cause(const struct drawn_sound *sound, unsigned beam, double range_m);

#endif
