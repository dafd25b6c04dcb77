/* SPDX-License-Identifier: MIT */
/*
 * bottom - how far water can be free above a bottom of which the altitude is known. Pure geometry; knows no picture.
 *
 * No beam need have heard the bottom: mud returns little, and what a beam grazes returns less. The altitude says where
 * it is below the vehicle. Beside that it may rise by BOTTOM_SLOPE in every direction. From BOTTOM_SLOPE above it on
 * nothing is free, whatever beams found there.
 */
#ifndef SONARD_BOTTOM_H
#define SONARD_BOTTOM_H

/* An altitude is so much less, at most: sound that is 1 % slower or faster, an altimeter's own 0.5 %, and a vehicle
 * that is tilted by a few degrees; the rest is where on the vehicle the altimeter sits, and ripples of sand. */
#define BOTTOM_ALTITUDE_SHARE 0.02
#define BOTTOM_ALTITUDE_M     0.1

/* Steeper bottoms are heard better, for beams graze them less: grid.md has the curve. */
#define BOTTOM_SLOPE_DEG 10.0

/* As seen from one place. */
struct bottom {
    double least_m; /* it is no nearer */
};

/** bottom_below - from a place that is above_m higher than where the altitude is of, or as much lower, and beside_m
 * away from there. altitude_m >= 0. */
struct bottom bottom_below(double altitude_m, double above_m, double beside_m);

/** bottom_reach_m - along a unit vector whose third component, `down`, is positive downward: INFINITY, never. */
double bottom_reach_m(const struct bottom *b, double down);

#endif
