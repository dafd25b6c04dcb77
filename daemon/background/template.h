/* SPDX-License-Identifier: MIT */
/*
 * template - the background template of each sonar while the daemon runs: loads it at the start, has one learnt on
 * request, puts it in force and takes it out again. All in the loop's thread; the extract stage is handed ready
 * templates (struct background_job) and never waits.
 *
 * Making a template (median, clusters) is done in the loop when the last ping is in: some ten milliseconds, once.
 */
#ifndef SONARD_TEMPLATE_H
#define SONARD_TEMPLATE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "config/conf.h"
#include "core/fault.h"
#include "daemon/pipeline/pipeline.h"
#include "grid/range/background.h"
#include "grid/range/background_keep.h"
#include "grid/range/background_learn.h"
#include "daemon/rpc/rpc.h"

#define TEMPLATE_LEARN_MAX ((size_t)128 << 20) /* bytes that a learner may take */

/* Of one sonar. */
struct template
{
    struct background *background; /* in force; NULL: none */
    struct background_kept kept;   /* when it was learnt here */
    unsigned made, in_file; /* counts templates: that in force, that which the file holds (0: none of ours) */
    uint8_t *view;          /* room for a ping's cells, with `background` */
    struct background_learn *learn; /* NULL: nothing is being learnt */
    uint64_t learnings;             /* started so far: the number of `learn` */
    unsigned handing;               /* changes that the extract stage has not heard of yet */
    struct rpc_waiters waiters;     /* requests to change it when that is over */
    struct background_learn_conf learning;
    struct background_shape shape; /* of the newest ping that can have a template */
    bool has_shape;
    unsigned strange;   /* pings in a row of another shape than that being learnt */
    int fit;            /* enum background_fit of the newest ping, with `background`; -1: no ping yet */
    uint64_t pings;     /* seen by the learner, or on their way to it */
    char happened[200]; /* the newest event, one sentence; empty: none */
};

/* What it needs; all of it outlives it. */
struct template_env {
    const struct conf *conf;
    const struct mount *mount; /* [conf->n_sonars] */
    struct pipeline *pipeline;
    bool replay;
    const bool *replay_ended;
};

/* Those of all sonars. Zeroed at first. */
struct templates {
    struct template_env env;
    struct template of[CONF_MAX_SONARS];
};

/** template_start - load what the configuration names. What cannot be had is logged; the daemon runs without. */
void template_start(struct templates *s, const struct template_env *env);

/**
 * template_ping - a ping of that sonar is about to be submitted. Ends learning when it is done, and begins it anew
 * when the sonar's pings have another shape by now, as with another range: none would be taken for ever.
 */
void template_ping(struct templates *s, int sensor, const struct ping *ping);

/** template_kept - the file `path` holds that template of the sonar now (template_keep). */
void template_kept(struct templates *s, int sensor, unsigned made, const char *path);

/** template_put - this one, malloced, of the file `path`, is in force now.
 * False with a sentence in fault: it is freed. */
bool template_put(struct templates *s, int sensor, struct background *background, const char *path,
                  struct fault *fault);

/** template_end - frees all; the pipeline has ended. Also when it never started. */
void template_end(struct templates *s);

/* What a client may ask for: false with a sentence in fault, and nothing changed. */

/** template_learn - begin anew. The template in force stays until the new one is there. */
bool template_learn(struct templates *s, int sensor, const struct background_learn_conf *conf,
                    struct fault *fault);

/**
 * template_stop - end learning: with `use` the template is made of what has been collected, refused while a row that
 * was seen has fewer than three pings (or than asked for); otherwise it is given up.
 */
bool template_stop(struct templates *s, int sensor, bool use, struct fault *fault);

/** template_clear - nothing is in force any more; the file stays. */
bool template_clear(struct templates *s, int sensor, struct fault *fault);

/** template_progress - of a sonar that is being learnt, as of the last ping that was worked on. */
void template_progress(const struct templates *s, int sensor, struct background_progress *out);

/** template_word - for `status`: "none", "learning", "in force", "does not fit". */
const char *template_word(const struct template *t);

#endif
