/* SPDX-License-Identifier: MIT */
/*
 * free_interval - what the pings say of one direction's water: free from here to there, as of then. Knows no beam and
 * no cell.
 *
 * Seen from the grid's centre, one ping of a sensor that sits elsewhere frees only a stretch of a ray: nearer or
 * farther the ray leaves the beam. What earlier pings freed stands beside it, where newer ones did not look, each as of
 * its own ping, until it is too old. So a ring-down that ends one bin later makes one bin old, and not the direction.
 */
#ifndef SONARD_FREE_INTERVAL_H
#define SONARD_FREE_INTERVAL_H

#include <stdbool.h>
#include <stdint.h>

struct free_interval {
    uint64_t t_ping_ns; /* of the oldest ping it rests on; 0: none */
    double path_m;      /* distance travelled by then */
    float from_m, to_m; /* free water; to_m <= from_m: observed, and nothing can be said; to_m < 0: free_spend's */
    uint64_t sensors;   /* set of the sensors it rests on */
};

/*
 * Of a direction: [0] is what the last ping freed, the others are what is left of earlier ones. No two overlap. Where
 * there are more, two that touch are joined, as of the older one: the pair whose merge ages the least water,
 * mostly neighbours of one revolution. Where none touch, the shortest goes.
 */
#define FREE_INTERVALS 4

/* A new stretch: what of it is free, and where the beam looks at it, which may be farther. It ends where the ray enters
 * and leaves the beam at its side, or at an echo. */
struct stretch {
    double from_m, to_m; /* to_m <= from_m: nothing is free */
    double look_from_m, look_to_m;
    bool enters_aside, leaves_aside;
    bool ends_at_echo; /* look_to_m, where it is not aside */
};

/* The ping that freed it. */
struct free_ping {
    uint64_t t_ns;
    double path_m;
    uint32_t sensor;
};

/**
 * free_add - a ping freed a stretch of a direction (list[FREE_INTERVALS]). It takes the place of older evidence where
 * both overlap, and an echo where the beam ends takes back what was free beyond.
 * That the observation ends there, or what it shows to be free, takes back nothing.
 */
void free_add(struct free_interval *list, const struct stretch *stretch, const struct free_ping *ping);

/** free_withdraw - a ping observed the direction and received nothing usable: what was free before stands no longer. */
void free_withdraw(struct free_interval *list, const struct free_ping *ping);

/** free_spend - the same of a ping that showed water, of which the vehicle may have drifted out since. */
void free_spend(struct free_interval *list, const struct free_ping *ping);

/**
 * free_fill - the same the other way round, for intervals made anew: a ping that is older than all those in the list
 * adds what they leave. *limit_m, at first INFINITY: where the nearest of their echoes ended what is older; 0 once a
 * ping received nothing usable. Cheap where the list has it already.
 */
void free_fill(struct free_interval *list, const struct stretch *stretch, const struct free_ping *ping,
               float *limit_m);

/** free_none - no ping has observed the direction. */
void free_none(struct free_interval *list);

/**
 * free_longest - the longest run of water without a gap among n intervals (n <= FREE_INTERVALS + 1), as of its oldest
 * ping. t_ping_ns = 0 when none of them has any.
 */
struct free_interval free_longest(const struct free_interval *list, unsigned n);

/**
 * free_clear_for_s - the age limit of clear for heads that turn within turn_s (0: not known yet): one and a half
 * turns, so that a lost ping or a slower turn does no harm; at least 30 s, at most forget_s.
 */
double free_clear_for_s(double turn_s, double forget_s);

#endif
