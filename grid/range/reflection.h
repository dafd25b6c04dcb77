/* SPDX-License-Identifier: MIT */
/*
 * reflection - from the cells that a detector let through to echoes: groups of them, the position and its
 * deviation, how far they stand out. Knows no ring-down and no free water.
 */
#ifndef SONARD_REFLECTION_H
#define SONARD_REFLECTION_H

#include "grid/echoes.h"
#include "baseline.h"
#include "cfar.h"
#include "profile.h"

/* What the detector said of a profile: cells from p->first on are set. */
struct detection {
    struct cfar cfar;
    struct cfar_profile cells;       /* those from p->first on */
    uint8_t *mask;                   /* [n] 1: stands out */
    const struct baseline *baseline; /* NULL: not known */
    double loud;                     /* power of what is as loud as the weakest obstacle that must not be missed */
    double wall;                     /* power that the weakest wall exceeds, whatever this sonar has shown */
    bool raised;                     /* the noise of this beam is, above the baseline: that tells no echo */
    const uint64_t *one_q16;         /* [factors] one-sided factor, times 65536, for i + 1 independent cells */
    uint32_t factors;
};

/* Cells begin .. last, gaps of at most the guard included; near: the first that may belong to it,
 * masked or not, or begin. */
struct reflection {
    uint32_t near, begin, last;
    double contrast;  /* of its peak over the reference, a ratio of powers; INFINITY: saturated */
    double risen;     /* the same, saturated or not */
    double strength;  /* of its peak over the threshold, a ratio of powers, at least 1 */
    double power;     /* of its loudest cell */
    double threshold; /* power that a cell had to exceed where the reference was the quietest one of the group */
    bool lowest_only; /* all of it lies in the lowest class of the cleaned image */
    struct echo echo;
};

/**
 * detection_add_saturated - nothing can exceed a threshold above full scale: saturated bins stand out whatever the
 * detector says, unless they are blind, or noise that usually is as loud as `loud` may have saturated them.
 */
void detection_add_saturated(const struct profile *p, struct detection *d);

/**
 * detection_add_loud - where the baseline is known: what is as loud as `loud` and stands `ratio` above the baseline
 * is an echo, whatever is beside it in the beam: a wall that rises over metres, or the edge of a long echo. And what
 * does not stand 6 dB above a baseline that is quieter than `loud` is none: a ripple of the ring-down. After cfar_run.
 */
void detection_add_loud(const struct profile *p, struct detection *d, double ratio);

/**
 * detection_add_edges - next to the ring-down the window before a cell is not complete, and a long echo fills
 * the one behind it. There a cell also stands out if it exceeds the water between the ring-down and itself,
 * be that only five resolution cells, by the factor for so few. Returns the first cell that is `ratio` times
 * that water, be it only one resolution cell: behind it nothing is free. n: there is none. After cfar_run.
 */
uint32_t detection_add_edges(const struct profile *p, struct detection *d, double ratio);

/**
 * reflection_next - the first reflection that begins at cell `from` or later; false when there is none.
 * echo.near_m goes back over blind cells right before `begin`, where the reflection may have started.
 */
bool reflection_next(const struct profile *p, const struct detection *d, uint32_t from, struct reflection *out);

/**
 * reflection_reach_back - the nearest reflection of a beam also has the cells before `begin` that exceed its
 * threshold, with gaps of at most the guard: `near` and echo.near_m go back to the first of them. An echo
 * that is longer than the guard stands in the window behind its own first cells and hides them where no quiet
 * window counts: next to the ring-down, where the one before is not complete, and under detectors other than
 * SOCA. Where SOCA had both windows, nothing changes.
 */
void reflection_reach_back(const struct profile *p, const struct detection *d, struct reflection *r);

#endif
