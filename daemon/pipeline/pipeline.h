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

#include "core/fault.h"
#include "grid/ping.h"
#include "grid/answer/witness.h"
#include "grid/range/background.h"
#include "grid/range/background_learn.h"
#include "grid/range/cleanup.h"
#include "grid/range/extract.h"
#include "grid/range/marks.h"
#include "grid/range/own_echo.h"
#include "grid/voxel/voxmask.h"
#include "grid.h"
#include "image.h"
#include "records.h"
#include "core/latency.h"
#include "core/ring.h"

#define PIPELINE_MAX_SENSORS 8
#define PIPELINE_MAX_GRIDS   5
#define PIPELINE_MAX_THREADS 2
#define PIPELINE_SPARE       2 /* buffers beside those that may wait: one is filled, one is worked on */
#define PIPELINE_QUEUE_MAX   (RING_MAX - PIPELINE_SPARE)

struct pipeline_conf {
    int threads;        /* 0, 1 or 2 */
    uint32_t queue;     /* pings that may wait, [2, PIPELINE_QUEUE_MAX] */
    bool patient;       /* wait for room instead of dropping; never read the clock, but where it is */
    bool measured;      /* all the same: how long the stages take */
    uint32_t max_beams; /* room of a ping buffer */
    uint32_t beams[PIPELINE_MAX_SENSORS]; /* of each sensor's pings, at most; 0: no free water is kept of it */
    uint32_t max_samples;                 /* bytes are twice that: samples may have 16 bits */
    uint32_t max_bins;
    int n_sensors;
    struct extract_conf extract[PIPELINE_MAX_SENSORS];
    bool marks;       /* mark bursts, ghosts, the pulses of other sonars and the vehicle's own echoes */
    double sound_mps; /* speed of sound that ranges are made with */
    bool image;       /* keep the last turn of every sensor for people */
    struct cleanup_conf cleanup[PIPELINE_MAX_SENSORS];
    struct mount mount[PIPELINE_MAX_SENSORS];
    struct grid_setting grid; /* the main one, and those beside it */
    struct grid_setting more_grid[PIPELINE_MAX_GRIDS - 1];
    int n_more_grids;
    bool map;             /* keep a voxel map: */
    uint32_t mask_blocks; /* voxmask_bytes */
    struct voxmap_setting voxels;
    enum cast_shape shape[PIPELINE_MAX_SENSORS];
};

/* What the extract stage does about a sensor's own vehicle: memory of the caller. */
struct pipeline_background {
    const struct background *use;   /* template in force; NULL: none */
    struct background_learn *learn; /* sees every ping; NULL: nothing is learnt */
    uint64_t learning;              /* its number, of those of this sensor */
    struct background_view view;    /* room for the cells of a ping, with `use` */
    bool open_water;                /* `use` is promised to hold the vehicle alone */
};

/* What takes time; the whole is from a ping's last byte to the published picture. */
enum pipeline_stage { PIPELINE_EXTRACT, PIPELINE_MAPS, PIPELINE_WHOLE, PIPELINE_STAGES };

struct pipeline_stats {
    uint64_t submitted, finished;
    uint64_t dropped[PIPELINE_MAX_SENSORS]; /* by sensor */
    uint32_t waiting;
    uint64_t records_left_out;                                /* as records.h has it */
    struct sphere_stats grid;                                 /* the main one */
    struct cleanup_state cleanup[PIPELINE_MAX_SENSORS];       /* of sensors that have one */
    struct extract_reference reference[PIPELINE_MAX_SENSORS]; /* level_db is 0 where none is known */
    uint32_t own_bearings[PIPELINE_MAX_SENSORS];              /* as own_echo_known */
    enum law_doubt law_doubt[PIPELINE_MAX_SENSORS];           /* what the counts say against their amplitude law */
    enum hearing_doubt hearing[PIPELINE_MAX_SENSORS];         /* as extract_hearing_doubt */
};

/* The voxel map, and its judged form for questions. */
struct pipeline_map {
    struct voxmap map;
    struct voxmask mask;
};

struct pipeline;

/** pipeline_new - NULL with a sentence in fault. */
struct pipeline *pipeline_new(const struct pipeline_conf *conf, struct fault *fault);

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

/* What belongs to the thread that enters pings into it. */
struct pipeline_owned {
    struct pipeline_map *map; /* NULL: none is kept */
    const struct witnesses *witnesses;
};

/* What is done to it by that thread, between two pings. Pings wait meanwhile: some milliseconds at most. */
typedef void pipeline_owner_fn(void *ctx, const struct pipeline_owned *owned);

/**
 * owner_run_now - have fn called by the owner, and wait until it is done: at most for the ping that is being entered,
 * for a step of the job that is out, and for fn itself. When patient, all that was submitted before is entered. No
 * job begins between synchronous calls in one turn of the loop. Loop thread.
 */
void owner_run_now(struct pipeline *p, pipeline_owner_fn *fn, void *ctx);

/*
 * What the owner does while the loop goes on; one at a time, in the order of sending, at most one between two pings.
 * Zeroed at first. It lies in what fn works on, at its begin: that is fn's ctx, and is neither read nor changed by the
 * loop while the job is out. What would take too long between two pings is done in steps, with pings and
 * synchronous calls between them, and no other job.
 */
struct owner_job {
    bool extracts;             /* it is for the thread that extracts, and knows nothing of what the owner has */
    bool left;                 /* its client has gone, or it never had one that waits */
    bool more;                 /* set by fn: it has done a step, and is to be called for the next */
    struct pipeline *pipeline; /* it was sent there last */
    pipeline_owner_fn *fn;
    enum owner_job_state { OWNER_JOB_NONE, OWNER_JOB_WAITS, OWNER_JOB_OUT, OWNER_JOB_DONE } state;
    void (*release)(void *ctx); /* nobody wants it any more; NULL: somebody does, who is called when it is done: */
    void (*resume)(void *request);
    void *request;
    struct owner_job *next; /* that waits */
};

/**
 * owner_poll - send the job, or ask for it. True: it is done, and may be sent anew; when patient it is at once,
 * and with no threads what has one step is, unless another has more. False: when it is done owner_jobs_fd becomes
 * readable. Loop thread.
 */
bool owner_poll(struct pipeline *p, struct owner_job *job, pipeline_owner_fn *fn);

/** owner_call_now - the same of all its steps at once, while the loop waits. Of one that is not sent. */
void owner_call_now(struct pipeline *p, struct owner_job *job, pipeline_owner_fn *fn);

/**
 * owner_job_drop - nobody waits for it any more: release is called with it, now or when the owner has done it.
 * owner_job_leave - the same of a job that is done all the same when it was sent.
 */
void owner_job_drop(struct owner_job *job, void (*release)(void *ctx));
void owner_job_leave(struct owner_job *job, void (*release)(void *ctx));

/**
 * owner_call - send the job, zeroed before but for `extracts`. `then` is called with it, in the loop, when it is done
 * (OWNER_JOB_DONE), maybe at once as there; or when all ended before its last step was started (OWNER_JOB_NONE).
 */
void owner_call(struct pipeline *p, struct owner_job *job, pipeline_owner_fn *fn, void (*then)(void *ctx));

/** owner_jobs_orphaned - how many wait that were left, for whichever thread. Loop thread. */
unsigned owner_jobs_orphaned(const struct pipeline *p);

/** owner_jobs_end - all are dropped, none is being done when it returns, and none is sent from then on. Loop
 * thread. */
void owner_jobs_end(struct pipeline *p);

/** owner_jobs_fd - readable: call owner_jobs_take, and ask for all jobs that are out. Loop thread. */
int owner_jobs_fd(const struct pipeline *p);
void owner_jobs_take(struct pipeline *p);

/* How a sensor's pings are extracted from now on; a job of the thread that extracts. Ring-down and noise are
 * learnt anew. */
struct extract_job {
    struct owner_job call;
    int sensor;
    struct extract_conf conf;
    bool good; /* otherwise nothing has changed: a sentence is in fault */
    struct fault fault;
};

/* What is done about a sensor's own vehicle from now on; a job of the thread that extracts.
 * When it is done nobody works with what was before. */
struct background_job {
    struct owner_job call;
    int sensor;
    struct pipeline_background background;
    bool done;
};

/** pipeline_take_extract, pipeline_take_background - what these jobs do. The former takes some milliseconds. */
void pipeline_take_extract(void *extract_job, const struct pipeline_owned *owned);
void pipeline_take_background(void *background_job, const struct pipeline_owned *owned);

/** pipeline_learnt - how far the learner of that number has come, as of the last ping that it saw:
 * nothing before. Loop thread. */
void pipeline_learnt(struct pipeline *p, int sensor, uint64_t learning, struct background_progress *out);

/** pipeline_has_map - is there a voxel map? */
bool pipeline_has_map(const struct pipeline *p);

/** pipeline_map_setting - how it is set; any thread. */
struct voxmap_setting pipeline_map_setting(const struct pipeline *p);

typedef void pipeline_map_fn(void *ctx, struct pipeline_map *map);

/** owner_run_map_now - owner_run_now of the map alone. False: there is none. */
bool owner_run_map_now(struct pipeline *p, pipeline_map_fn *fn, void *ctx);

/** pipeline_records - what was found free, of all sensors, for all grids. */
struct records *pipeline_records(struct pipeline *p);

/** pipeline_records_bytes - memory that it takes. */
size_t pipeline_records_bytes(const struct pipeline_conf *conf);

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

/** pipeline_turns - how often thread i has looked for work;
 * it grows soon after pipeline_poke in a thread that is well. */
uint64_t pipeline_turns(const struct pipeline *p, int i);

/** pipeline_poke - have every thread look for work. Loop thread. */
void pipeline_poke(struct pipeline *p);

/** pipeline_schedule - give every thread this SCHED_FIFO priority; 0, or the cause as an errno. */
int pipeline_schedule(struct pipeline *p, int priority);

/** pipeline_stats - a consistent copy of the counters; any thread. */
void pipeline_stats(struct pipeline *p, struct pipeline_stats *out);

#endif
