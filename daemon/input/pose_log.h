/* SPDX-License-Identifier: MIT */
/*
 * pose_log - where the vehicle was, for the last seconds: takes what its senders say of it, gives each ping the pose
 * at its own time, and says how old the newest is. Fixed size; one owner (the loop).
 *
 * A sample may carry only some parts (a depth sensor knows no attitude), and every part has a track of its own in
 * order of its own time: a depth that comes later than a newer attitude is as good. While nobody gives a position the
 * velocity carries it along; it is then not in `has`.
 *
 * An altitude is about the bottom, not about the vehicle: alone it is no pose, and no pose waits for one.
 *
 * Drift: how far the vehicle may have gone without anybody knowing. Where the velocity carries the position it grows by
 * the velocity's error. Where neither position nor velocity was ever given (of depth: nor depth) it grows with time, as
 * drift_log says. A position stops it.
 */
#ifndef SONARD_POSE_LOG_H
#define SONARD_POSE_LOG_H

#include <stdbool.h>
#include <stdint.h>

#include "grid/geometry.h"
#include "discontinuity.h"
#include "drift_log.h"

/* Pings are dated back by up to 4 s: a log of poses that come 400 times a second reaches so far. A ping from before the
 * log's first sample has no pose. */
#define POSE_LOG_SAMPLES 2048

/* Behind the newest sample a part goes on as it went between the last two, for so long and no longer than the time
 * between them. A ping is over within this time, so waiting for the sample behind it would gain little. */
#define POSE_LOG_AHEAD_NS 100000000u

/* To be turned so far from how the vehicle can have turned is no jump yet: a sender stamps its samples some hundredths
 * of a second off, and an attitude is noisy. */
#define POSE_LOG_JUMP_DEG 5.0

/* The distance travelled is that of something towed on a line of this length, or the noise of a place, of some
 * centimetres ten times a second, would add up to kilometres. */
#define POSE_LOG_LINE_M 0.1

enum {
    POSE_TRACK_ATTITUDE,
    POSE_TRACK_PLACE,
    POSE_TRACK_DEPTH,
    POSE_TRACK_VELOCITY,
    POSE_TRACK_ALTITUDE,
    POSE_TRACKS
};

/* What a velocity is off by, at most: this share of it, and this much even at rest. */
#define POSE_LOG_VELOCITY_SHARE 0.05
#define POSE_LOG_VELOCITY_MPS   0.02

struct pose_sample {
    uint64_t t_ns;
    double v[4];              /* quaternion; north, east, drift; down, drift; velocity; altitude */
    bool given;               /* false: carried along by the velocity */
    uint64_t discontinuities; /* of the attitude, with this sample; 0 of other parts */
};

#define POSE_LOG_GAPS 7 /* of which the middle one is usual: odd */

/*
 * max_age = auto: a part is stale after 1 s. Where max_speed and max_turn bound what the vehicle may do meanwhile, and
 * a part usually comes more rarely, it may be missing for three times as long as usual, but no longer than 10 s.
 */
#define POSE_LOG_AUTO          0
#define POSE_LOG_AUTO_LEAST_NS 1000000000u
#define POSE_LOG_AUTO_MOST_NS  10000000000u
#define POSE_LOG_AUTO_GAPS     3

struct pose_track {
    struct pose_sample sample[POSE_LOG_SAMPLES]; /* a ring in order of time */
    uint32_t first, n;
    uint64_t t_given_ns;            /* of the newest sample that somebody gave; 0: none */
    uint64_t gap_ns[POSE_LOG_GAPS]; /* between the last that were, a ring */
    uint32_t n_gaps;
    uint64_t usual_ns; /* the middle one of them; 0: not known yet */
};

struct pose_log {
    uint64_t max_age_ns;          /* POSE_LOG_AUTO: see there */
    double most_mps, most_radps;  /* the vehicle may be so fast at any time; 0: as fast as was last reported */
    struct discontinuities turns; /* of the attitude */
    uint64_t discontinuities;     /* it made */
    struct pose_track track[POSE_TRACKS]; /* in the order of the bits of enum pose_part */
    uint64_t delay_ns, doubt_ns;          /* pose_log_set_delay */
    struct drift_log unseen;              /* drift of what nobody tells */
    int no_bound;        /* why its bounds stopped: 1 + the word of no_speed_bound; 0: nobody said */
    uint64_t t_first_ns; /* first sample; 0: none */
    double path_m;       /* distance travelled so far: ... */
    double towed_m[3];   /* ... of what is towed, which is here */
    uint64_t t_newest_ns;
    uint64_t taken, refused, withdrawn;
    const char *sender[POSE_TRACKS]; /* of each part's newest sample; constant text; NULL: never given */
};

/** pose_log_init, pose_log_set_max_age - from now on older samples are stale; the samples stay. POSE_LOG_AUTO: by how
 * often they come. */
void pose_log_init(struct pose_log *log, uint64_t max_age_ns);
void pose_log_set_max_age(struct pose_log *log, uint64_t max_age_ns);

/** pose_log_max_age_ns - how old a part (a single POSE_*) may be, as it is in force. */
uint64_t pose_log_max_age_ns(const struct pose_log *log, unsigned part);

/** pose_log_set_most - the fastest that the vehicle goes and turns, [0, inf); 0: nobody says. */
void pose_log_set_most(struct pose_log *log, double most_mps, double most_radps);

/**
 * pose_log_set_delay - poses are older than the time that they come with, by delay_ns, give or take doubt_ns. The log
 * does not know by when a sample came: who puts one dates it by pose_log_dated. What the vehicle does within doubt_ns
 * is part of uncertain_m and uncertain_rad of every pose.
 */
void pose_log_set_delay(struct pose_log *log, uint64_t delay_ns, uint64_t doubt_ns);

/** pose_log_dated - when a pose was true that comes with the time t_ns. */
uint64_t pose_log_dated(const struct pose_log *log, uint64_t t_ns);

/** pose_log_set_drift - from now_ns on; at first the vehicle keeps its place. mps, heading_radps: [0, inf). */
void pose_log_set_drift(struct pose_log *log, uint64_t now_ns, const struct pose_drift *drift);

/** pose_log_moves - from t_ns on the sonar belongs to a vehicle, of which poses are to come: it counts as fixed no
 * longer, as after a pose. */
void pose_log_moves(struct pose_log *log, uint64_t t_ns);

/** pose_log_bound - as drift_log_bound: a pose of its own kind, which may be the first. False, counted: it is not newer
 * than the last. */
bool pose_log_bound(struct pose_log *log, uint64_t t_ns, const double mps[DRIFT_WAYS]);

/** pose_log_drift - how far the vehicle may have drifted by t_ns, level and up or down: drift_m of the pose then. */
void pose_log_drift(const struct pose_log *log, uint64_t t_ns, double m[DRIFT_WAYS]);

/**
 * pose_log_put - a sample; `given` holds the parts in given->has (attitude normalised by the caller).
 * False, counted: not one of its parts is newer than what there is of that part. Parts that are not are left out.
 */
bool pose_log_put(struct pose_log *log, const struct pose *given);

/**
 * pose_log_withdraw - as if no pose had been given until now_ns; poses before and after are told apart by `withdrawn`.
 * What the vehicle has drifted and its path stay: neither ever falls.
 */
void pose_log_withdraw(struct pose_log *log, uint64_t now_ns);

/** pose_log_sent_by - the newest samples of these parts (POSE_*) are from that sender: constant text. */
void pose_log_sent_by(struct pose_log *log, unsigned of_parts, const char *sender);

/**
 * pose_log_missing - for a pose that is not fresh: the part (POSE_*) that is missing, 0 when it is fresh. *age_s: how
 * old its newest sample is, negative when it was never given; *sender: who gave that, or NULL.
 */
unsigned pose_log_missing(const struct pose_log *log, uint64_t now_ns, double *age_s, const char **sender);

/**
 * pose_log_at - the pose at t_ns. Each part lies between the two samples around it when they are at most max_age
 * apart, or goes on from the last one before it while that is fresh; `has` tells which parts there are. A place that is
 * not fresh stays what it was, without being in `has`. path_m is the distance travelled until now. False with *out the
 * identity (has = 0) when no part is known.
 *
 * An attitude that the vehicle cannot have turned to has jumped (discontinuity.h; POSE_LOG_JUMP_DEG). `discontinuities`
 * tells how often it had by then, and nothing lies between the samples before and after: it is as the one before.
 *
 * uncertain_m, uncertain_rad: where a part went on from the last sample for longer than it could be continued, the
 * vehicle may have moved on all that time as fast as the velocity says (without one: as between samples at least 0.1 s
 * apart), or as fast as it ever does, whichever is more.
 *
 * altitude_m is less by how far the vehicle may have sunk since the altitude was measured: as for uncertain_m, and as
 * fast as altitudes fell where no velocity is known.
 *
 * drift_m, drift_mps, heading_adrift, heading_radps are set in any case.
 */
bool pose_log_at(const struct pose_log *log, uint64_t t_ns, struct pose *out);

/**
 * pose_log_blurred - the pose of a ping that was sent at t_ns, give or take by_ns: that at t_ns, with the parts that
 * are known all the while, and blur_m, blur_any_m and blur_rad that cover every pose in between. The drift is that of
 * the beginning, for what was observed may be as old. False as pose_log_at.
 */
bool pose_log_blurred(const struct pose_log *log, uint64_t t_ns, uint64_t by_ns, struct pose *out);

/**
 * pose_log_within - the pose of a time that is only known to lie from from_ns to to_ns: that at from_ns, with the parts
 * that are known all the while, and uncertain_m and uncertain_rad that cover every pose until to_ns. False as
 * pose_log_at.
 */
bool pose_log_within(const struct pose_log *log, uint64_t from_ns, uint64_t to_ns, struct pose *out);

/** pose_log_newest - the last sample of every part, as of the newest of them; has: those fresh then. False: none. */
bool pose_log_newest(const struct pose_log *log, struct pose *out);

/**
 * pose_log_last_ns - when the last sample was, given or carried, of that one of these parts (POSE_*) whose last is the
 * oldest; 0: of one there is none. An attitude of now makes no older place newer.
 */
uint64_t pose_log_last_ns(const struct pose_log *log, unsigned of_parts);

/**
 * pose_log_fresh - is the pose at most max_age old at now_ns? That is the attitude, and, once a place or a velocity was
 * given, one of these too, and likewise depth or velocity:
 * a vehicle whose place is lost must not be taken to stand still.
 */
bool pose_log_fresh(const struct pose_log *log, uint64_t now_ns);

/** pose_log_sparse - do attitudes come less often than max_age, by the last eight? Each is stale before the next. */
bool pose_log_sparse(const struct pose_log *log);

#endif
