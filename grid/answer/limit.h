/* SPDX-License-Identifier: MIT */
/*
 * limit - the speed at which a vehicle can still stop in the water that it knows. Pure arithmetic on a corridor; turns
 * no velocity, only makes it shorter.
 *
 * Theorem: with v = limit_speed(s), v * t + v^2 / (2 a) <= s for t = latency_s + stale_s: the distance travelled from
 * the time of the picture until the vehicle stands, when braking begins latency_s from now and takes a. Proof: v is the
 * positive root of v^2 / (2 a) + v t - s = 0 (0 for s <= 0), or less when less was asked for, and the left side grows
 * with v >= 0. So it stops within s = free - front: with body and margin in water that the corridor (corridor.h) holds
 * free, whatever its direction: the corridor lies along the velocity, sideways and down as well as ahead.
 *
 * What the vehicle does across that line meanwhile carries it off by limit_drift_m(), by which the corridor must be
 * wider (corridor.h): u * t until the braking of what goes across begins, and u^2 / (2 a) until it has ended. More of
 * it makes the corridor wider, never narrower, hence never more speed. What it does along the line now is part of the
 * pose uncertainty (geometry.h) and of the free interval: no command stops a vehicle that is faster than v now within
 * the distance that v takes.
 */
#ifndef SONARD_LIMIT_H
#define SONARD_LIMIT_H

#include "corridor.h"

enum limit_unknown {
    LIMIT_SLOW,   /* into unknown water at slow_mps, if nothing that blocks is too near for that */
    LIMIT_STOP,   /* not into unknown water */
    LIMIT_IGNORE, /* unknown water counts as free */
};

struct limit_conf {
    double braking_mps2; /* deceleration, > 0 */
    double latency_s;    /* from the answer to the moment when braking takes effect, >= 0 */
    enum limit_unknown unknown;
    double slow_mps; /* >= 0 */
};

enum limit_by { LIMIT_BY_NOTHING, LIMIT_BY_BLOCKED, LIMIT_BY_UNKNOWN };

struct limit {
    double speed_mps; /* [0, asked] */
    enum limit_by by; /* what makes it less than asked */
    bool unknown;     /* it stops in water that is not known to be free: the configuration allows that */
    double stop_m;    /* stopping distance from that speed */
    double stale_m;   /* and that it may have gone meanwhile without the picture knowing */
};

/** limit_speed - the highest speed from which the vehicle stands after at most way_m; t_s: until braking begins. */
double limit_speed(double braking_mps2, double t_s, double way_m);

/**
 * limit_of - of the speed asked for (>= 0), along a corridor that was looked at for that direction. stale_s: for so
 * long the vehicle may have moved at up to that speed without the picture knowing.
 * Monotone: more free water, less latency and harder braking never give less.
 */
void limit_of(const struct limit_conf *conf, const struct corridor *corridor, double asked_mps, double stale_s,
              struct limit *out);

/* What is known of the vehicle's place. */
enum limit_pose {
    LIMIT_POSE_PLACED, /* a fresh position */
    LIMIT_POSE_ADRIFT, /* poses without one: its drift is allowed for */
    LIMIT_POSE_NONE    /* nothing: it is taken to have kept its place until it goes as asked */
};

/** limit_remedy - what would lift it, for a person. Empty: nothing limits. */
const char *limit_remedy(enum limit_by by, enum answer_reason reason, enum limit_pose pose);

/** limit_drift_m - how far a speed across the line carries the vehicle off, until braking has ended it. */
double limit_drift_m(const struct limit_conf *conf, double across_mps, double stale_s);

/** limit_reach_m - how far a corridor must be looked at for a speed: beyond, nothing can limit it. */
double limit_reach_m(const struct limit_conf *conf, double front_m, double asked_mps, double stale_s);

const char *limit_word(enum limit_by by);

#endif
