/* SPDX-License-Identifier: MIT */
/*
 * hearable - how far a target would have been heard in a beam of a drawn world: from the mean powers that the
 * world is made of and the laws of speckle, and not from any detector. "Heard" means: with probability HEARABLE_P
 * it exceeds, by a step of the receiver's counts, what the background exceeds with probability HEARABLE_FALSE per
 * resolution cell.
 */
#ifndef SONARD_REPORT_HEARABLE_H
#define SONARD_REPORT_HEARABLE_H

#include "insonify.h"

#define HEARABLE_P     0.99
#define HEARABLE_FALSE 1e-4
#define HEARABLE_CELLS 200 /* that a range is told in */

struct hearable {
    /* Cells of range in which the reference target of each class would be heard, were it there: one bit a class.
     * */
    uint8_t cell[HEARABLE_CELLS];
    float over[HEARABLE_CELLS]; /* most of `over` at its beginning and middle, as in struct hearable_background */
    /* By which range what stands there is heard, if it is at least as strong as the reference; INFINITY: nothing.
     * */
    double target_m[DRAWN_CLASSES];
    /* The same for each target, whatever its strength; INFINITY: it is not heard. */
    double by_m[DRAWN_MAX_TARGETS];
    /* By which range the surface, bottom or slope that is nearest within half power is heard; INFINITY: it is not.
     * */
    double plane_m;
};

/* What follows from the laws of speckle alone. */
struct hearable_margins {
    double margin[DRAWN_CLASSES]; /* of the references' mean power over what it must exceed */
    double textured;              /* what K-distributed speckle hardly ever exceeds, over its mean */
};

/** hearable_margins_of - texture: shape of the world's K-distributed speckle; 0: Rayleigh. */
struct hearable_margins hearable_margins_of(int texture);

/** hearable_beam - raised: power of this ping's noise over what is usual. heard: false where the receiver sends
 * nothing at all. */
void hearable_beam(const struct insonify *in, const struct hearable_margins *margins,
                   const struct insonified *beam, double raised, bool heard, struct hearable *out);

/* Noise, water, planes and the vehicle at a bin, summed over the pulse that ends there. */
struct hearable_background {
    double mean,
        over; /* over: what it hardly ever exceeds, and a step of the counts above; INFINITY: there is none */
};

/** hearable_background_at - of a beam, in a ping whose noise is raised by a power. */
struct hearable_background hearable_background_at(const struct insonify *in,
                                                  const struct hearable_margins *margins,
                                                  const struct insonified *beam, uint32_t bin, double raised);

/** hearable_below - P(power <= x) of speckle of mean power `diffuse` around a coherent power. */
double hearable_below(double coherent, double diffuse, double x);

#endif
