/* SPDX-License-Identifier: MIT */
/*
 * plan - which stages a configuration needs: each in or out, and why. The wiring builds by it; `sonard --explain` and
 * the method `plan` show it. Knows the configuration and the devices' table; no process, no memory, no time.
 *
 * A stage is left out by itself only where every answer stays the same, bit for bit (PLAN_IDENTICAL), or because a key
 * of the configuration says so, which bounds what is lost (PLAN_BOUNDED).
 */
#ifndef SONARD_PLAN_H
#define SONARD_PLAN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "config/conf.h"

#define PLAN_WHY_MAX    112
#define PLAN_STAGES_MAX (CONF_MAX_SONARS * 6 + (CONF_MAX_GRIDS + 1) * 4 + 8)

enum plan_id {
    /* of every sonar */
    PLAN_DEVICE,  /* bytes to pings */
    PLAN_EXTRACT, /* intensities to echoes */
    PLAN_BACKGROUND,
    PLAN_CLEANUP,
    PLAN_MARKS,
    PLAN_IMAGE,
    /* of all of them; of a grid: its directions, those above and below the horizon, a move of its centre, the step
     * towards neighbours */
    PLAN_GRID,
    PLAN_ELEVATION,
    PLAN_MOTION,
    PLAN_RELAXATION,
    PLAN_CLUSTERS,
    PLAN_RECORDS, /* of free water, for all grids */
    PLAN_MAP,
    PLAN_SAVER,
    PLAN_ACTIVE_SENSING,
    PLAN_THREADS,
    PLAN_RECORD,
    PLAN_SERVER,
    PLAN_IDS
};

enum plan_proof {
    PLAN_NONE,      /* it is in */
    PLAN_IDENTICAL, /* no answer changes by leaving it out */
    PLAN_BOUNDED,   /* by what the user set: `why` names the key */
};

struct plan_stage {
    enum plan_id id;
    int which; /* sonar; grid, 0 being the plain one; 0 where there is one only */
    bool in;
    enum plan_proof proof;
    char why[PLAN_WHY_MAX];
};

struct plan {
    int n;
    struct plan_stage stage[PLAN_STAGES_MAX]; /* sonar by sonar, then what all share */
    uint64_t steered; /* sonars that are told where to look: scan = active, or auto and it makes sense */
    bool ranges[CONF_MAX_SONARS]; /* the sonar reports ready ranges: what it detects is its own choice */
};

/** plan_make - of a checked configuration. */
void plan_make(const struct conf *conf, struct plan *plan);

/** plan_is_steered - would that sonar be told where to look, by *conf? See plan.steered. */
bool plan_is_steered(const struct conf *conf, int sonar);

/** plan_has - is that stage in? */
bool plan_has(const struct plan *plan, enum plan_id id, int which);

/** plan_name, plan_proof_name - words for people and for clients. */
const char *plan_name(enum plan_id id);
const char *plan_proof_name(enum plan_proof proof);

#endif
