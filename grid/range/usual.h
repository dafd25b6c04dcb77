/* SPDX-License-Identifier: MIT */
/*
 * usual - what a number of a sensor's pings usually is: an order statistic over the last of them. Knows not what the
 * number means.
 */
#ifndef SONARD_USUAL_H
#define SONARD_USUAL_H

#include <stdbool.h>
#include <stdint.h>

#define USUAL_MOST  512
#define USUAL_LEAST 16 /* pings before anything is called usual */

struct usual {
    uint64_t last[USUAL_MOST]; /* as they came */
    uint64_t sorted[USUAL_MOST];
    uint32_t pings, eighths;
    uint32_t n, next; /* next: place of the oldest when full */
};

/**
 * usual_init - nothing is usual yet. pings: how many are looked back on, at most USUAL_MOST; a lasting change is
 * followed after `eighths` of eight of them, and the usual number is the one above that share of
 * them: 4 is the lower median.
 */
void usual_init(struct usual *u, uint32_t pings, uint32_t eighths);

/** usual_add - the number of one more ping, O(pings). */
void usual_add(struct usual *u, uint64_t value);

/** usual_get - the usual number; false before USUAL_LEAST pings. */
bool usual_get(const struct usual *u, uint64_t *value);

#endif
