/* SPDX-License-Identifier: MIT */
/*
 * cfar - which cells of a power profile stand out of their surroundings: sliding reference windows and the decision
 * of the four detectors, in integers and therefore the same everywhere. Knows no metres, no amplitude law, no pings.
 *
 *          n_side      guard     i     guard      n_side
 *      |-- lead ----|---------|  x  |---------|---- lag --|
 */
#ifndef SONARD_CFAR_H
#define SONARD_CFAR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "cfar_factor.h"

/* What happens where a window does not fit into the profile. */
enum cfar_edge {
    CFAR_SHRINK, /* use what is left of it */
    CFAR_FULL,   /* a side with fewer than n_side cells is not used */
    CFAR_BOTH,   /* no decision unless both sides are complete */
};

#define CFAR_MAX_SUM (((uint64_t)1 << 52) - 1) /* of the power of all cells of a profile: exact as a double, too */

struct cfar {
    enum cfar_detector detector;
    enum cfar_edge edge;
    uint32_t n_side;        /* reference cells on each side, >= 1 */
    uint32_t guard;         /* cells left out beside the cell under test, on each side */
    uint32_t rank;          /* OS: k of 2 * n_side cells; ceil(k * c / (2 * n_side)) where c are left */
    uint64_t alpha_q16;     /* threshold / reference, times 65536, with both sides */
    uint64_t alpha_one_q16; /* the same where one side is missing */
    uint64_t x_min;         /* cells below are never detected */
    uint64_t reference_min; /* a reference below this is taken as this; 0 for the plain detector */
};

/* The cells to decide about. */
struct cfar_profile {
    const uint64_t *x;       /* [n] power, together at most CFAR_MAX_SUM */
    const uint8_t *excluded; /* [n] 1: never detected and in no reference window; NULL: none */
    uint32_t n;              /* 0..8192 */
    void *work;              /* cfar_work_size(n) bytes, aligned to uint64_t; of this profile from cfar_run on */
};

/* What a cell was compared with. */
struct cfar_reference {
    uint64_t sum;   /* of the chosen cells; OS: the order statistic */
    uint32_t cells; /* that `sum` stands for; 0: no reference, no decision */
    bool one_sided;
};

/** cfar_work_size - bytes of working memory that profiles of up to n cells need. */
size_t cfar_work_size(uint32_t n);

/**
 * cfar_run - decide for every cell.
 *
 * mask[n]: 1 where   x >= x_min  and  x * 65536 * cells > alpha_q16 * sum     (strictly), else 0
 * with sum and cells as cfar_reference_at returns them. Excluded cells are left out of both; the edge rule looks at
 * where a window lies and not at how many of its cells are left. A cell without any reference is not detected: that
 * says nothing about it. Pure.
 */
void cfar_run(const struct cfar *cfar, const struct cfar_profile *profile, uint8_t *mask);

/**
 * cfar_reference_at - what cell i of the profile that cfar_run last went over was compared with, at least
 * reference_min per cell. CA: both sides; SOCA (GOCA): the side with the smaller (greater) mean, the lead side when
 * equal; the other side where one does not exist. For the few cells that matter: OS searches the window each time.
 */
struct cfar_reference cfar_reference_at(const struct cfar *cfar, const struct cfar_profile *profile, uint32_t i);

#endif
