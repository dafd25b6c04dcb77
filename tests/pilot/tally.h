/* SPDX-License-Identifier: MIT */
/* tally - what came of many drives, by sonar, poses and setup, by place and by fault. */
#ifndef SONARD_PILOT_TALLY_H
#define SONARD_PILOT_TALLY_H

#include <stdio.h>

#include "run.h"

#define PILOT_KINDS     (PILOT_SONARS * PILOT_NAVS * PILOT_SETUPS)
#define PILOT_RATIO_MAX 2048

struct pilot_row {
    long drives, arrived, collided, struck, touched;
    double share[3];
    struct {
        int n;
        double of[PILOT_RATIO_MAX]; /* times, against a pilot who knows the world; infinite: did not arrive */
    } ratio[2];                     /* straight for the goal, with a chart */
};

struct pilot_tally {
    struct pilot_row kind[PILOT_KINDS], place[PILOT_PLACES], fault[PILOT_FAULTS], all;
};

/** pilot_tally_add - a drive; later ones than the first PILOT_RATIO_MAX of a row are not in its ratios. */
void pilot_tally_add(struct pilot_tally *t, const struct pilot_case *c, const struct pilot_result *r);

/** pilot_tally_print - tables for a person. pilot_tally_csv - one, whose column `by` tells the tables apart. */
void pilot_tally_print(struct pilot_tally *t, FILE *out);
void pilot_tally_csv(struct pilot_tally *t, FILE *out);

#endif
