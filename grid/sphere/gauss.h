/* SPDX-License-Identifier: MIT */
/*
 * gauss - integrals of the normal distribution over cells (Auran and Silven, eq. (1), which gives only the density).
 */
#ifndef SONARD_GAUSS_H
#define SONARD_GAUSS_H

/** gauss_between - probability of N(mean, sd) in [from, to], sd > 0:
 * to full relative accuracy wherever it is a number. */
double gauss_between(double from, double to, double mean, double sd);

/** gauss_around - the same of an angle, which may come round the circle; sd up to a few radians. */
double gauss_around(double from, double to, double mean, double sd);

/** gauss_midpoint - the cheap variant: width times density at the middle.
 * Good to 3 % in the centre for cells up to one sd. */
double gauss_midpoint(double from, double to, double mean, double sd);

#endif
