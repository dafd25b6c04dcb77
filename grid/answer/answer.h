/* SPDX-License-Identifier: MIT */
/*
 * answer - blocked, clear or unknown: the words of the answers about a cone, a corridor or a band of sectors, and what
 * such a question is. verdict.h gives them.
 */
#ifndef SONARD_ANSWER_H
#define SONARD_ANSWER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "grid/geometry.h"

#define ANSWER_SECTORS_MAX 720

enum answer_state { ANSWER_CLEAR, ANSWER_BLOCKED, ANSWER_UNKNOWN };

/* Why an answer is unknown (or ANSWER_HEARD when it is not), the graver ones later. */
enum answer_reason {
    ANSWER_HEARD,
    ANSWER_BEYOND,    /* no obstacle detected, but not observed as far as asked */
    ANSWER_BOTTOM,    /* the bottom may be there, by the altitude */
    ANSWER_BLIND,     /* asked nearer than the sonar can hear */
    ANSWER_MOVED,     /* the vehicle has moved on since it was scanned */
    ANSWER_STALE,     /* looked at too long ago */
    ANSWER_SILENT,    /* the sonar that looked there is lost */
    ANSWER_NEVER,     /* never looked at */
    ANSWER_OUTSIDE,   /* not among the directions that the grid keeps */
    ANSWER_NO_FRAME,  /* asked in NED, but no attitude was ever given */
    ANSWER_POSE_LOST, /* the pose is older than its limit */
    ANSWER_NO_DATA,   /* no ping at all yet */
};

struct answer_conf {
    double clear_for_s;  /* age limit of clear; as a setting 0: answer_clear_for_s works it out */
    double move_limit_m; /* distance travelled after which a cleared direction is unknown; INFINITY: however far */
};

/**
 * answer_clear_for_s - the age limit of clear for heads that turn within turn_s (0: not known yet): one and a half
 * turns, so that a lost ping or a slower turn does no harm; at least 30 s, at most forget_s.
 */
double answer_clear_for_s(double turn_s, double forget_s);

#define ANSWER_DRIFTED_S 64

/* The moment of asking. */
struct answer_now {
    uint64_t now_ns;
    bool pose_fresh;  /* all that is known of the pose is younger than its limit */
    struct pose pose; /* newest; parts in pose.has */
    uint64_t lost;    /* set of the sensors that are offline */
    /* Where its drift grows now faster and now slower than pose.drift_mps: by how much it grew in the last k + 1 s. */
    bool drift_varies;
    double drifted_m[ANSWER_DRIFTED_S];
};

/** answer_drifted_m - how far the vehicle may have drifted in the last age_s, beside what positions say. */
double answer_drifted_m(const struct answer_now *now, double age_s);

struct answer_query {
    double az_rad, el_rad;
    bool ned;          /* angles are NED; otherwise the body's */
    double distance_m; /* from the vehicle's centre */
    bool corridor;     /* a corridor of radius_m around the line; otherwise a cone of half_angle_rad */
    double half_angle_rad;
    double radius_m;
    double near_m; /* `near`: up to here water is promised (verdict.h), and weak echoes count; [0, inf) */
};

struct answer {
    enum answer_state state;
    enum answer_reason reason;
    double range_m; /* nearest obstacle; 0: none. Of a clear sector: beyond what was asked about */
    double range_sd_m;
    double near_m; /* blocked: the obstacle may begin as near as this, all that is uncertain allowed for */
    /* blocked: probability that the obstacle is there; clear: 1 fading to 0 at the age limit; unknown: 0 */
    double confidence;
    double free_to_m;  /* free from blind_to_m at least to here */
    double blind_to_m; /* nothing is known nearer than this */
    /* blocked: of the obstacle's last echo; else of the oldest ping of what is asked about; negative: no evidence */
    double age_s;
};

/* The sectors of a ring: sector k of `count` (1..ANSWER_SECTORS_MAX) is centred on k * 2pi/count, or where width_rad is
 * above 0 the k-th of so many that share what reaches clockwise from from_rad. */
struct answer_band {
    bool ned; /* otherwise of the body */
    double lo_rad, hi_rad;
    double from_rad, width_rad; /* below 2 pi */
    double reach_m;             /* clear: free as far as this; > 0 */
    double near_m;              /* as in struct answer_query */
    size_t count;
};

const char *answer_state_name(enum answer_state state);

/** answer_reason_text - one sentence for a person. */
const char *answer_reason_text(enum answer_reason reason);

#endif
