/* SPDX-License-Identifier: MIT */
/*
 * verdict - what a detector said of beams of drawn worlds against what is true of them, counted, and the measures
 * that follow. What is dangerous is never averaged with what is merely useful. Knows no detector.
 */
#ifndef SONARD_REPORT_VERDICT_H
#define SONARD_REPORT_VERDICT_H

#include "drawn_sound.h"
#include "grid/echoes.h"

#define VERDICT_PAST_M  0.25 /* free water claimed so far behind a target would be driven into */
#define VERDICT_SECTORS 72

struct verdict {
    uint64_t beams, settled_beams; /* all; those after the first turn */
    double free_m[2][DRAWN_CLASSES],
        said_m[2][DRAWN_CLASSES];             /* [moving]: hearable and free; of that, said to be */
    uint64_t past[DRAWN_CLASSES], past_plane; /* beams with free water claimed behind what is heard */
    uint64_t nothing[CAUSES];                 /* first echoes of nothing, by what is loudest there */
    uint64_t nothing_unmarked;
    uint64_t something[2], something_marked[2];          /* first echoes of something, standing and moving */
    uint64_t there[DRAWN_CLASSES], found[DRAWN_CLASSES]; /* the nearest target that is heard, by its own class */
    uint64_t rising, rising_found, rising_past;          /* the same, of walls that rise slowly */
    uint64_t sectors, sectors_blocked; /* in worlds with one other sonar, in the last turn, by it */
    uint64_t worlds, worlds_free;      /* standing, with any free water that is hearable; with enough of it said */
};

/* Of one world. */
struct verdict_sectors {
    bool looked[VERDICT_SECTORS], blocked[VERDICT_SECTORS];
};

struct verdict_measure {
    const char *key, *name, *aim;
    bool worst_is_high; /* dangerous: the worst seed is told; else the middle one */
    double scale;
    double (*of)(const struct verdict *v, int what); /* NAN: nothing was there to be measured */
    int what;
};

extern const struct verdict_measure verdict_measures[];
extern const unsigned verdict_measures_n;

/** verdict_claims - is water beyond to_m claimed to be free? */
bool verdict_claims(const struct beam_echoes *found, double to_m);

/** verdict_beam - count what was found in a beam of the last ping. */
void verdict_beam(struct verdict *v, struct verdict_sectors *sectors, const struct drawn_sound *sound,
                  unsigned beam, const struct beam_echoes *found);

/** verdict_world - the world is over; before: the verdict when it began. */
void verdict_world(struct verdict *v, const struct verdict_sectors *sectors, const struct verdict *before);

/** verdict_add - of all beams of both. */
void verdict_add(struct verdict *sum, const struct verdict *v);

/** verdict_free - share of the free water that is said to be free, standing, where the reference wall is heard. */
double verdict_free(const struct verdict *v);

/** verdict_past - share of beams with free water claimed behind a target at least as strong as the reference wall.
 * */
double verdict_past(const struct verdict *v);

#endif
