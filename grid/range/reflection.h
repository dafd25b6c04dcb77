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

/* Cells begin .. last, gaps of at most the guard included; near: the first masked one right before them, else begin. */
struct reflection {
    uint32_t near, begin, last;
    double contrast;  /* of its peak over the reference, a ratio of powers; INFINITY: saturated */
    double power;     /* of its loudest cell */
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

#endif
