/* SPDX-License-Identifier: MIT */
/*
 * reflection - from the cells that a detector let through to echoes: groups of them, the position and its deviation,
 * how far they stand out. Knows no ring-down and no free water.
 */
#ifndef SONARD_REFLECTION_H
#define SONARD_REFLECTION_H

#include "../echoes.h"
#include "cfar.h"
#include "profile.h"

/* What the detector said of a profile: cells from p->first on are set. */
struct detection {
    struct cfar cfar;
    struct cfar_profile cells; /* those from p->first on */
    uint8_t *mask;             /* [n] 1: stands out */
};

/* Cells begin .. last, gaps of at most the guard included; near: the first that may belong to it, masked or not, or begin. */
struct reflection {
    uint32_t near, begin, last;
    double contrast;  /* of its peak over the reference, a ratio of powers; INFINITY: saturated */
    double power;     /* of its loudest cell */
    double threshold; /* power that a cell had to exceed where the reference was the quietest one of the group */
    bool lowest_only; /* all of it lies in the lowest class of the cleaned image */
    struct echo echo;
};

/**
 * detection_add_saturated - nothing can exceed a threshold above full scale: saturated bins stand out whatever the
 * detector says, unless they are blind.
 */
void detection_add_saturated(const struct profile *p, struct detection *d);

/**
 * reflection_next - the first reflection that begins at cell `from` or later; false when there is none. echo.near_m
 * goes back over blind cells right before `begin`, where the reflection may have begun.
 */
bool reflection_next(const struct profile *p, const struct detection *d, uint32_t from, struct reflection *out);

/**
 * reflection_reach_back - the nearest reflection of a beam also has the cells before `begin` that exceed its threshold, with
 * gaps of at most the guard: `near` and echo.near_m go back to the first of them. An echo that is longer than the guard stands
 * in the window behind its own first cells and hides them where no quiet window counts: next to the ring-down, where the
 * one before is not complete, and under detectors other than SOCA. Where SOCA had both windows, nothing changes.
 */
void reflection_reach_back(const struct profile *p, const struct detection *d, struct reflection *r);

#endif
