/* SPDX-License-Identifier: MIT */
/*
 * cfar_factor - how far above its neighbours a cell must stand: the exact false-alarm probability of the CFAR
 * detectors in exponential (square-law) clutter, and its inverse. Knows no samples and no windows, only their sizes.
 */
#ifndef SONARD_CFAR_FACTOR_H
#define SONARD_CFAR_FACTOR_H

#include <stdbool.h>
#include <stdint.h>

enum cfar_detector {
    CFAR_CA,   /* mean of all reference cells */
    CFAR_GOCA, /* greater of the two side means */
    CFAR_SOCA, /* smaller of the two side means */
    CFAR_OS,   /* k-th smallest of all reference cells */
};

#define CFAR_MAX_CELLS 8192 /* on one side */

/**
 * cfar_ln_pfa - ln P(cell > alpha * reference) for independent exponential cells of equal mean.
 *
 * n_lead, n_lag: reference cells on either side, 0..CFAR_MAX_CELLS, not both 0; with one side missing CA, GOCA and
 * SOCA are the same detector. k: 1..n_lead + n_lag for OS, ignored otherwise. alpha: finite, >= 0; the multiplier of
 * the mean (of a side for GOCA and SOCA) or of the k-th smallest cell.
 * False, *ln_pfa untouched, when an argument is outside. Exact to about 1e-12 relative; does not underflow.
 *
 * Source: Gandhi and Kassam 1988, generalised to unequal sides with the regularised incomplete beta function.
 */
bool cfar_ln_pfa(enum cfar_detector detector, uint32_t n_lead, uint32_t n_lag, uint32_t k, double alpha,
                 double *ln_pfa);

/**
 * cfar_alpha - the alpha for which the probability above is pfa, 0 < pfa < 1.
 * False, *alpha untouched, when an argument is outside. About 1e-12 relative.
 */
bool cfar_alpha(enum cfar_detector detector, uint32_t n_lead, uint32_t n_lag, uint32_t k, double pfa,
                double *alpha);

#endif
