/* SPDX-License-Identifier: MIT */
/*
 * free_water - how far a beam shows that the water is free: as far as an obstacle of the reference strength would
 * have been detected, and no farther. docs/extract.md derives it. Knows no earlier beam but by the baseline.
 */
#ifndef SONARD_FREE_WATER_H
#define SONARD_FREE_WATER_H

#include "baseline.h"

/* How far the water counts as free where no echo was found. */
enum extract_no_echo {
    EXTRACT_MINIMUM, /* to minimum_range_m at most, as the paper has it */
    EXTRACT_HEARD,   /* as far as the reference target would have been detected */
    EXTRACT_RANGE,   /* to the end of the beam or the first doubtful cell, whatever is masked there */
};

/**
 * free_water_detectable - the power, as a share of full scale, that a target exceeds with a probability of 0.99: its
 * mean level at the most unfavourable range, less what speckle takes away. gain_db: of the receiver, against the
 * device's normal setting. below_wall_db: how much less than the weakest wall the target returns; 0: that wall.
 */
double free_water_detectable(enum amplitude_law law, double gain_db, double below_wall_db);

/**
 * free_water_bottom_over_wall - what a bottom returns where it begins, on average over many cells, over what the wall
 * exceeds in each cell: free_water_detectable allows for speckle, which a mean of many has none of.
 */
double free_water_bottom_over_wall(double below_wall_db);

/** free_water_is_dumb - every bin from p->first on at full scale, or every bin at zero: the receiver said nothing. */
bool free_water_is_dumb(const struct profile *p);

/**
 * free_water_begin - the first cell behind the loudest one near the head whose baseline would not hide `detectable`
 * (3 dB below it); p->first where it would everywhere.
 */
uint32_t free_water_begin(const struct profile *p, const struct baseline *b, double detectable);

/**
 * free_water_rings_on - the ring-down before cell `end` is 6 dB above the baseline and above the vehicle's own echoes
 * somewhere: something near answers with the head, and may hide what is behind.
 */
bool free_water_rings_on(const struct profile *p, const struct baseline *b, uint32_t end);

/** free_water_stands_out - cell i is `contrast` times the baseline there, or the floor where that is louder. */
bool free_water_stands_out(const struct profile *p, const struct baseline *b, uint32_t i, double contrast);

/* Cells begin .. end - 1; begin >= end: none. */
struct free_water {
    uint32_t begin, end;
};

/**
 * free_water_find - from cell `begin` on, past cells that the baseline explains and that are not saturated, to the
 * first cell as loud as `detectable` or `contrast` times the baseline (or the floor). Where an echo at cell `passed`
 * shows that sound passed, it begins behind the last masked cell before that; else it ends at the first masked one.
 * passed: 0: none. Baseline unknown: NULL.
 */
struct free_water free_water_find(const struct profile *p, const struct baseline *b, uint32_t begin,
                                  double detectable, double contrast, uint32_t passed);

/**
 * free_water_before_surface - the part of w before a reference window (or all of w, where that is shorter) that is
 * louder on average than `power`: what has no edge, such as a soft bottom, answers weakly and for long. A window that
 * the end of the ring-down raises is passed, unless that takes more cells than it has.
 */
struct free_water free_water_before_surface(const struct profile *p, struct free_water w, double power);

/* Of the water that is free on a beam's axis, what is free off it, where the two-way pattern weakens all echoes. */
struct free_water_aside {
    uint32_t side_end;         /* where the pattern has taken 3 dB: up to that cell */
    struct free_water edge;    /* at the edge (half power each way) ... */
    struct free_water surface; /* ... and of that, where a surface that the edge grazes would be detected */
};

/**
 * free_water_aside - within cells w.begin .. w.end - 1, which free_water_find found free for `detectable`. The side
 * ends at what is as loud as half of that, the edge at a quarter. For a surface it ends where the next reference window
 * of cells has on average a 40th as well: what the edge meets at a grazing angle answers weakly and for long. That
 * begins at most one such window behind the edge, or is empty.
 */
struct free_water_aside free_water_aside(const struct profile *p, const struct baseline *b, struct free_water w,
                                         double detectable, double contrast);

#endif
