/* SPDX-License-Identifier: MIT */
/*
 * otsu - where a histogram of 8-bit counts is best cut into two or three classes: the partition with the greatest
 * variance between its classes (Otsu 1979), exact in integers. Knows no image and no sonar.
 */
#ifndef SONARD_OTSU_H
#define SONARD_OTSU_H

#include <stdbool.h>
#include <stdint.h>

#define OTSU_MAX_TOTAL ((uint64_t)1 << 42) /* pixels: products of three class sizes stay below 2^126 */

/**
 * otsu_two - the threshold t of the classes v <= t and v > t: of all exact maxima the smallest populated value.
 * count[256], at most OTSU_MAX_TOTAL in all. False, *t untouched, with fewer than two different values.
 */
bool otsu_two(const uint64_t count[256], uint8_t *t);

/**
 * otsu_three - thresholds t[0] < t[1] of the classes v <= t[0], v <= t[1] and v > t[1], none empty: of all exact
 * maxima the lexicographically smallest populated pair. False, t untouched, with fewer than three different values.
 * The best first threshold for a given second one never falls as that one rises, so O(256 log 256) partitions are
 * looked at instead of all 32 640.
 */
bool otsu_three(const uint64_t count[256], uint8_t t[2]);

#endif
