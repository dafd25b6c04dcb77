/* SPDX-License-Identifier: MIT */
/*
 * pipeline - carries pings from the loop through extract to the maps: in the loop's own thread, in one worker, or in
 * one worker for each of the two stages, with the same answers. Buffers come from fixed pools; between threads only
 * their indices travel, through lock-free rings. After pipeline_new nothing is allocated.
 *
 * Overload: a live sonar never waits, the oldest waiting ping is dropped and counted. A replay (`patient`) waits.
 */
#ifndef SONARD_PIPELINE_H
#define SONARD_PIPELINE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "../grid/ping.h"
#include "../grid/answer/witness.h"
#include "../grid/range/background.h"
#include "../grid/range/background_learn.h"
#include "../grid/range/cleanup.h"
#include "../grid/range/extract.h"
#include "../grid/range/marks.h"
#include "../grid/voxel/voxmask.h"
#include "grid.h"
#include "image.h"
#include "latency.h"

#define PIPELINE_MAX_SENSORS 8
#define PIPELINE_MAX_GRIDS   5
#define PIPELINE_MAX_THREADS 2

struct pipeline_conf {
    int threads;          /* 0, 1 or 2 */
    uint32_t queue;       /* pings that may wait, [2, RING_MAX] */
    bool patient;         /* wait for room instead of dropping; never read the clock, but where it is */
    bool measured;        /* all the same: how long the stages take */
    uint32_t max_beams;   /* room of a ping buffer */
    uint32_t max_samples; /* bytes are twice that: samples may have 16 bits */
    uint32_t max_bins;
    int n_sensors;
    struct extract_conf extract[PIPELINE_MAX_SENSORS];
    bool marks; /* mark bursts and ghosts */
    bool image; /* keep the last turn of every sensor for people */
    struct cleanup_conf cleanup[PIPELINE_MAX_SENSORS];
    struct mount mount[PIPELINE_MAX_SENSORS];
    struct grid_setting grid; /* the main one; pipeline_add_grid has the others */
    bool map;                 /* keep a map of places: */
    uint32_t mask_blocks;     /* voxmask_bytes */
    struct voxmap_setting voxels;
    enum cast_shape shape[PIPELINE_MAX_SENSORS];
};

/* What the extract stage does about a sensor's own vehicle: memory of the caller. */
struct pipeline_background {
    const struct background *use;   /* template in force; NULL: none */
    struct background_learn *learn; /* sees every ping; NULL: nothing is learnt */
    uint64_t learning;              /* its number, of those of this sensor */
    struct background_view view;    /* room for the cells of a ping, with `use` */
};

/* What takes time; the whole is from a ping's last byte to the published picture. */
enum pipeline_stage { PIPELINE_EXTRACT, PIPELINE_MAPS, PIPELINE_WHOLE, PIPELINE_STAGES };

struct pipeline_stats {
    uint64_t submitted, finished;
    uint64_t dropped[PIPELINE_MAX_SENSORS]; /* by sensor */
    uint32_t waiting;
    struct sphere_stats grid;                           /* the main one */
    struct cleanup_state cleanup[PIPELINE_MAX_SENSORS]; /* of sensors that have one */
    enum law_doubt law_doubt[PIPELINE_MAX_SENSORS];     /* what the counts say against their amplitude law */
};

/* The map of places, and its judged form for questions. */
struct pipeline_map {
    struct voxmap map;
    struct voxmask mask;
};

struct pipeline;

/** pipeline_new - NULL with a sentence in err. */
struct pipeline *pipeline_new(const struct pipeline_conf *conf, char *err, size_t err_size);

/** pipeline_free - finishes what waits, ends the threads. */
void pipeline_free(struct pipeline *p);

/** pipeline_begin - a free ping buffer with nothing set but its room; never NULL. Loop thread. */
struct ping *pipeline_begin(struct pipeline *p);

/** pipeline_submit - hand the buffer of pipeline_begin on (seq, sensor and pose set). Loop thread. */
void pipeline_submit(struct pipeline *p, struct ping *ping);

/** pipeline_drain - wait until all that was submitted is in the picture, or held back by the clean-up. */
void pipeline_drain(struct pipeline *p);

/** pipeline_grid - the i-th grid, the main one first; NULL: there are fewer. Loop thread. */
struct grid *pipeline_grid(struct pipeline *p, int i);

/**
 * pipeline_add_grid - the grid is one of the pipeline's, which frees it in the end, and has a number; false: there are
 * PIPELINE_MAX_GRIDS. pipeline_drop_grid - no longer. Pings learn of both by an errand or a visit: pipeline_feed_grid,
 * pipeline_starve_grid; only then may a dropped one be freed. Loop thread.
 */
bool pipeline_add_grid(struct pipeline *p, struct grid *grid);
void pipeline_drop_grid(struct pipeline *p, struct grid *grid);

/* What belongs to the thread that enters pings into it. */
struct pipeline_owned {
    struct pipeline_map *map; /* NULL: none is kept */
    const struct witnesses *witnesses;
    struct grid *const *grid;
    int n_grids;
};

/** pipeline_owned_grid - the one of that number (struct grid), NULL: it is there no longer. */
struct grid *pipeline_owned_grid(const struct pipeline_owned *owned, uint64_t number);

/* What is done to it by that thread, between two pings. Pings wait meanwhile: some milliseconds at most. */
typedef void pipeline_owner_fn(void *ctx, const struct pipeline_owned *owned);

/**
 * pipeline_visit - have fn called by the owner, and wait until it is done: at most for the ping that is being entered,
 * for a step of the errand that is out, and for fn itself. When patient, all that was submitted before is entered. No errand
 * begins between visits in one turn of the loop. Loop thread.
 */
void pipeline_visit(struct pipeline *p, pipeline_owner_fn *fn, void *ctx);

/*
 * What the owner does while the loop goes on; one at a time, in the order of sending, at most one between two pings.
 * Zeroed at first. It lies in what fn works on, at its begin: that is fn's ctx, and is neither read nor changed by the
 * loop while the errand is out. What would take too long between two pings is done in steps, with pings and visits
 * between them, and no other errand.
 */
struct errand {
    bool early;                /* it is for the thread that extracts, and knows nothing of what the owner has */
    bool left;                 /* its client has gone, or it never had one that waits */
    bool more;                 /* set by fn: it has done a step, and is to be called for the next */
    struct pipeline *pipeline; /* it was sent there last */
    pipeline_owner_fn *fn;
    enum errand_state { ERRAND_NONE, ERRAND_WAITS, ERRAND_OUT, ERRAND_DONE } state;
    void (*release)(void *ctx); /* nobody wants it any more; NULL: somebody does */
    struct errand *next;        /* that waits */
};

/**
 * pipeline_errand - send the errand, or ask for it. True: it is done, and may be sent anew; when patient it is at once, and
 * with no threads what has one step is, unless another has more. False: when it is done pipeline_errands_fd becomes
 * readable. Loop thread.
 */
bool pipeline_errand(struct pipeline *p, struct errand *errand, pipeline_owner_fn *fn);

/** pipeline_errand_now - the same of all its steps at once, while the loop waits. Of one that is not sent. */
void pipeline_errand_now(struct pipeline *p, struct errand *errand, pipeline_owner_fn *fn);

/**
 * pipeline_errand_drop - nobody waits for it any more: release is called with it, now or when the owner has done it.
 * pipeline_errand_leave - the same of an errand that is done all the same when it was sent.
 */
void pipeline_errand_drop(struct errand *errand, void (*release)(void *ctx));
void pipeline_errand_leave(struct errand *errand, void (*release)(void *ctx));

/**
 * pipeline_errand_then - send the errand, zeroed before but for `early`. `then` is called with it, in the loop, when it is
 * done (ERRAND_DONE), maybe at once as there; or when all ended before its last step was begun (ERRAND_NONE).
 */
void pipeline_errand_then(struct pipeline *p, struct errand *errand, pipeline_owner_fn *fn, void (*then)(void *ctx));

/** pipeline_errands_left - how many wait that were left, for whichever thread. Loop thread. */
unsigned pipeline_errands_left(const struct pipeline *p);

/** pipeline_errands_end - all are dropped, and none is being done when it returns. Loop thread. */
void pipeline_errands_end(struct pipeline *p);

/** pipeline_errands_fd - readable: call pipeline_errands_take, and ask for all errands that are out. Loop thread. */
int pipeline_errands_fd(const struct pipeline *p);
void pipeline_errands_take(struct pipeline *p);

/* How a sensor's pings are extracted from now on; an early errand. Ring-down and noise are learnt anew. */
struct extract_errand {
    struct errand errand;
    int sensor;
    struct extract_conf conf;
    bool good; /* otherwise nothing has changed: a sentence is in err */
    char err[256];
};

/* What is done about a sensor's own vehicle from now on; an early errand. When it is done nobody works with what was before. */
struct background_errand {
    struct errand errand;
    int sensor;
    struct pipeline_background background;
    bool done;
};

/** pipeline_take_extract, pipeline_take_background - what these errands do. The former takes some milliseconds. */
void pipeline_take_extract(void *extract_errand, const struct pipeline_owned *owned);
void pipeline_take_background(void *background_errand, const struct pipeline_owned *owned);

/** pipeline_learnt - how far the learner of that number has come, as of the last ping that it saw: nothing before. Loop thread. */
void pipeline_learnt(struct pipeline *p, int sensor, uint64_t learning, struct background_progress *out);

/* A grid that comes or goes. */
struct grid_errand {
    struct errand errand;
    struct grid *grid;
    bool done;
};

/** pipeline_feed_grid - pings that come after go into the grid of this struct grid_errand, too; _starve_ - no longer. */
void pipeline_feed_grid(void *grid_errand, const struct pipeline_owned *owned);
void pipeline_starve_grid(void *grid_errand, const struct pipeline_owned *owned);

/** pipeline_has_grid - is the grid of that number (struct grid) still one of the pipeline's? Loop thread. */
bool pipeline_has_grid(struct pipeline *p, uint64_t number);

/** pipeline_has_map - is there a map of places? */
bool pipeline_has_map(const struct pipeline *p);

/** pipeline_map_setting - how it is set; any thread. */
struct voxmap_setting pipeline_map_setting(const struct pipeline *p);

typedef void pipeline_visit_fn(void *ctx, struct pipeline_map *map);

/** pipeline_visit_map - pipeline_visit of the map alone. False: there is none. */
bool pipeline_visit_map(struct pipeline *p, pipeline_visit_fn *fn, void *ctx);

/** pipeline_picture - of the main grid. */
struct picture *pipeline_picture(struct pipeline *p);
struct image *pipeline_image(struct pipeline *p, int sensor);

/** pipeline_cleanup - how a sensor's clean-up is set. */
const struct cleanup_conf *pipeline_cleanup(const struct pipeline *p, int sensor);

/** pipeline_latency - of a stage, or from a ping's last byte to the published picture; a patient one knows the stages
 * when it is measured, and never the whole. */
struct latency *pipeline_latency(struct pipeline *p, enum pipeline_stage stage);

/** pipeline_threads - how many threads work beside the loop, at most PIPELINE_MAX_THREADS. */
int pipeline_threads(const struct pipeline *p);

/** pipeline_thread_name - what thread i does, in a word or two. */
const char *pipeline_thread_name(const struct pipeline *p, int i);

/** pipeline_turns - how often thread i has looked for work; it grows soon after pipeline_poke in a thread that is well. */
uint64_t pipeline_turns(const struct pipeline *p, int i);

/** pipeline_poke - have every thread look for work. Loop thread. */
void pipeline_poke(struct pipeline *p);

/** pipeline_schedule - give every thread this SCHED_FIFO priority; 0, or the cause as an errno. */
int pipeline_schedule(struct pipeline *p, int priority);

/** pipeline_stats - a consistent copy of the counters; any thread. */
void pipeline_stats(struct pipeline *p, struct pipeline_stats *out);

#endif
