/* SPDX-License-Identifier: MIT */
/*
 * drift_log - how far a vehicle may have gone of which nobody tells position or velocity: metres since the start, level
 * and up or down, at every time of the last minutes. They never fall.
 *
 * They grow as fast as the configuration says. A client that knows better sends bounds (a bridge that sees what the
 * thrusters do): how fast the vehicle was at most through the water, since the bound before. To that comes the water
 * itself, by the configuration's promise. Of what no bound covers the configuration's speed counts.
 *
 * Behind the newest bound the vehicle goes on as that said for DRIFT_LOG_LATE_NS, and may speed up by
 * DRIFT_LOG_MPS2; after that nobody knows.
 */
#ifndef SONARD_DRIFT_LOG_H
#define SONARD_DRIFT_LOG_H

#include <stdbool.h>
#include <stdint.h>

#define DRIFT_LOG_BOUNDS  4096       /* 200 s of 20 a second; what is older drifted as the configuration says */
#define DRIFT_LOG_LATE_NS 300000000u /* a bound covers no longer a time before it, or behind it */
#define DRIFT_LOG_COMES_S 1.0        /* after the newest bound they count as coming still */
#define DRIFT_LOG_MPS2    15.0       /* no such vehicle speeds up by more */

enum { DRIFT_LEVEL, DRIFT_VERTICAL, DRIFT_WAYS };

/* What a vehicle is taken to do while nobody tells position or velocity, and what becomes of its heading. */
struct pose_drift {
    double mps;           /* it goes so fast, in any direction; 0: it keeps its place */
    bool from_pose;       /* only once a pose of any kind was given: before, it keeps its place */
    bool keeps_heading;   /* without an attitude it does not turn */
    bool bounded;         /* bounds that clients send are believed; the water ... */
    double water_mps;     /* ... goes no faster */
    double heading_radps; /* the heading of attitudes drifts so fast, either way; 0: it does not */
};

struct drift_log_mark {
    uint64_t t_ns;
    double m[DRIFT_WAYS];
};

struct drift_log {
    struct pose_drift set;
    double mps_before;                            /* set.mps until it was set last */
    uint64_t t_first_ns;                          /* the first pose came then; 0: none */
    struct drift_log_mark mark[DRIFT_LOG_BOUNDS]; /* a ring in order of time; between two it goes on evenly */
    uint32_t first, n;
    bool goes_on; /* behind the newest as its bound says: */
    double mps[DRIFT_WAYS];
    uint64_t t_bound_ns;         /* of the newest bound; 0: none came since the poses were withdrawn */
    double said_mps[DRIFT_WAYS]; /* by it, through the water, whether it is believed or not */
};

/** drift_log_set - from now_ns on; at first the vehicle keeps its place. */
void drift_log_set(struct drift_log *log, uint64_t now_ns, const struct pose_drift *drift);

/** drift_log_begin - the first pose came at t_ns, or (t_ns 0) all were withdrawn and drifts are no less than m. */
void drift_log_begin(struct drift_log *log, uint64_t t_ns);
void drift_log_withdraw(struct drift_log *log, uint64_t now_ns, const double m[DRIFT_WAYS]);

/**
 * drift_log_bound - from the bound before until t_ns, but no longer than DRIFT_LOG_LATE_NS, the vehicle went no
 * faster through the water than mps, level and up or down. False: it is not newer than the last.
 */
bool drift_log_bound(struct drift_log *log, uint64_t t_ns, const double mps[DRIFT_WAYS]);

/** drift_log_at - how far it may have gone by t_ns; below 0 where that was before the log began. */
void drift_log_at(const struct drift_log *log, uint64_t t_ns, double m[DRIFT_WAYS]);

/** drift_log_uncertain_m - how much farther it is by t_ns, at most, in the way in which it is the slower, if it sped up
 * since the newest bound. */
double drift_log_uncertain_m(const struct drift_log *log, uint64_t t_ns);

/** drift_log_gone - between two times the vehicle went no farther than m, level and up or down, by bounds of its speed
 * and what they leave uncertain; INFINITY where none is believed. */
void drift_log_gone(const struct drift_log *log, uint64_t from_ns, uint64_t to_ns, double m[DRIFT_WAYS]);

/** drift_log_comes - do bounds come, whether they are believed or not? */
bool drift_log_comes(const struct drift_log *log, uint64_t now_ns);

/** drift_log_in_use - does a bound hold at now_ns, and is it believed? */
bool drift_log_in_use(const struct drift_log *log, uint64_t now_ns);

#endif
