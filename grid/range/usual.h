/* SPDX-License-Identifier: MIT */
/*
 * usual - what a number of a sensor's pings usually is: the lower median over the last USUAL_PINGS of them. Knows not
 * what the number means.
 */
#ifndef SONARD_USUAL_H
#define SONARD_USUAL_H

#include <stdbool.h>
#include <stdint.h>

#define USUAL_PINGS 64 /* the median follows a lasting change after half of them */
#define USUAL_LEAST 16 /* pings before anything is called usual */

struct usual {
    uint64_t last[USUAL_PINGS]; /* as they came */
    uint64_t sorted[USUAL_PINGS];
    uint32_t n, next; /* next: place of the oldest when full */
};

/** usual_clear - forget everything: the sensor has a new setting. */
void usual_clear(struct usual *u);

/** usual_add - the number of one more ping, O(USUAL_PINGS). */
void usual_add(struct usual *u, uint64_t value);

/** usual_get - the lower median; false before USUAL_LEAST pings. */
bool usual_get(const struct usual *u, uint64_t *value);

#endif
