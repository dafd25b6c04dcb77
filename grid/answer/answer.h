/* SPDX-License-Identifier: MIT */
/*
 * answer - blocked, clear or unknown: what a picture says about a cone, a corridor or a ring of sectors at a given
 * time. Pure; reads the picture and nothing else.
 *
 * Clear is said only where every direction asked about was pinged, recently, without the vehicle having moved on
 * since, and was free as far as asked. Whatever is missing makes the answer unknown and is named. Unknown never
 * hides an obstacle: blocked is looked for first.
 */
#ifndef SONARD_ANSWER_H
#define SONARD_ANSWER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "grid/geometry.h"
#include "grid/picture/picture.h"

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
    double clear_for_s;  /* age limit of clear; as a setting 0: free_clear_for_s works it out */
    double move_limit_m; /* distance travelled after which a cleared direction is unknown; INFINITY: however far */
};

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
    /* water nearer than this does not make the answer old, and beside a corridor it is asked for only where an echo
     * was received; [0, inf) */
    double near_m;
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

/** answer_direction - the state of a cone or corridor up to distance_m. */
void answer_direction(struct picture *p, const struct answer_conf *conf, const struct answer_now *now,
                      const struct answer_query *query, struct answer *out);

/* The sectors of a ring: sector k of `count` (1..ANSWER_SECTORS_MAX) is centred on k * 2pi/count, or where width_rad is
 * above 0 (answer_sectors knows no such) the k-th of so many that share what reaches clockwise from from_rad. */
struct answer_band {
    bool ned; /* otherwise of the body */
    double lo_rad, hi_rad;
    double from_rad, width_rad; /* below 2 pi */
    double reach_m;             /* clear: free as far as this; 0: as far as any sonar listened */
    double near_m;              /* water nearer than this does not make the answer old */
    size_t count;
};

/**
 * answer_sectors - of a band of elevations. Clear: free as far as the band's reach_m, whatever stands behind.
 * Blocked: an obstacle in it, at any range, else. Unknown: the rest; free_to_m says how far it is known to be
 * free all the same.
 */
void answer_sectors(struct picture *p, const struct answer_conf *conf, const struct answer_now *now,
                    const struct answer_band *band, struct answer *sectors);

const char *answer_state_name(enum answer_state state);

/** answer_reason_text - one sentence for a person. */
const char *answer_reason_text(enum answer_reason reason);

#endif
