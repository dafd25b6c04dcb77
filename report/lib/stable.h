/* SPDX-License-Identifier: MIT */
/*
 * stable - the catalogue of stiff and extreme inputs, case by case: what a naive method does with it, written out
 * beside, and what the product's modules do. Every case measures one number that must not exceed
 * its bound. Knows no report.
 */
#ifndef SONARD_REPORT_STABLE_H
#define SONARD_REPORT_STABLE_H

#include <stdbool.h>
#include <stddef.h>

/* What was measured, the same number of both. NAN: the method gives no number; INFINITY:
 * it never ends or has no bound. */
struct stable_found {
    double naive, ours;
    bool derived; /* the naive figure follows from the input, without running the method */
};

struct stable_case {
    const char *id;           /* of the catalogue */
    const char *input;        /* what is fed */
    const char *measure;      /* what the number is */
    const char *naive_method; /* in a few words */
    double bound;             /* ours must not exceed it; NaN always does */
    void (*run)(bool quick, struct stable_found *found);
};

/* By what they are about; the last of each list has no id. */
extern const struct stable_case stable_cfar[];   /* C: detectors */
extern const struct stable_case stable_image[];  /* I: thresholds, images */
extern const struct stable_case stable_cells[];  /* G: layers, directions, shares of cells */
extern const struct stable_case stable_grid[];   /* G: evidence over time and on the move */
extern const struct stable_case stable_shapes[]; /* G: what cells form together */
extern const struct stable_case stable_voxel[];  /* V: the voxel map */
extern const struct stable_case stable_asked[];  /* Q: questions */
extern const struct stable_case stable_time[];   /* P: poses, clocks, depth */
extern const struct stable_case stable_whole[];  /* E: everything at once */

/** stable_memory - n bytes that are not zero, or the end of the program. Of the heap, 64-aligned. */
void *stable_memory(size_t n);

/** stable_worse - the greater of two; NaN when either is. */
static inline double stable_worse(double a, double b)
{
    return a != a || a > b ? a : b;
}

#endif
