/* SPDX-License-Identifier: MIT */
/*
 * pipeline_state - what the pipeline's own modules share: pipeline (buffers, stages, threads) and pipeline_maps (what
 * the loop does to the grids and the map). Nobody else includes it.
 */
#ifndef SONARD_PIPELINE_STATE_H
#define SONARD_PIPELINE_STATE_H

#include <pthread.h>
#include <semaphore.h>
#include <stdatomic.h>
#include <time.h>

#include "pipeline.h"
#include "core/ring.h"
#include "core/snapshot.h"
#include "grid/range/lost_echo.h"

/* A pool of buffers on its way: `waiting` from producer to consumer, `idle` back. */
struct stage_queue {
    struct ring waiting, idle;
    sem_t news; /* posted for every entry put into waiting, for a synchronous call, to count a turn, and to stop */
    _Atomic uint64_t turns; /* of the thread behind it */
    uint64_t lost_turns;    /* the producer's: sensors of which the first ping of a turn was dropped */
};

/* How far learning has come. */
struct learnt {
    uint64_t learning; /* number of the learner */
    struct background_progress progress;
};

/* Work of the loop that the maps' owner does for it between two pings, while it waits. */
struct sync_call {
    pipeline_owner_fn *fn;
    void *ctx;
    sem_t done;
};

/* The same while it goes on, by one of the threads: the owner of what it is about. */
struct owner_jobs {
    struct owner_job *first, *last;             /* that wait */
    struct owner_job *out;                      /* at the owner; NULL: none */
    _Atomic(struct owner_job *) to_owner, done; /* the one that is out, not started yet, and come back */
};

/* How the grids' centres follow poses (follow.h): of the loop, and `pose` of the owner while the job is out. */
struct follow {
    struct owner_job job;
    struct pose pose;
    uint64_t t_ping_ns; /* of the newest ping */
    double centre_m[3]; /* where the centre of the grid that follows most closely is, or soon will be */
};

struct pipeline {
    struct pipeline_conf conf;
    struct ping *ping;
    struct echoes *echoes;
    uint32_t n_buffers;
    struct stage_queue pings, found;
    _Atomic(struct sync_call *) sync_call; /* waits for the owner; NULL: nobody */
    struct owner_jobs jobs, extract_jobs;  /* of the maps' owner, of the thread that extracts */
    bool jobs_ended;
    int jobs_fd; /* an eventfd: one is done */
    struct follow follow;
    uint32_t filling; /* ping buffer that pipeline_begin gave out, or NONE */
    struct extract *extract[PIPELINE_MAX_SENSORS];
    struct pipeline_background background[PIPELINE_MAX_SENSORS];
    struct cleanup *cleanup[PIPELINE_MAX_SENSORS]; /* NULL: no stage of it configured */
    struct grid *grid[PIPELINE_MAX_GRIDS];
    int n_grids;
    struct witnesses witnesses;
    struct records *records;                         /* what was found free, of all sensors, for all grids */
    struct pipeline_map *map;                        /* NULL: not configured */
    struct marks *marks[PIPELINE_MAX_SENSORS];       /* NULL: not configured */
    struct own_echo *own_echo[PIPELINE_MAX_SENSORS]; /* with marks */
    struct lost_echo lost_echo[PIPELINE_MAX_SENSORS];
    struct image *image[PIPELINE_MAX_SENSORS]; /* NULL: nobody can ask for it */
    struct latency latency[PIPELINE_STAGES];
    _Atomic uint64_t submitted, finished;
    _Atomic uint64_t held; /* by the clean-ups: submitted, and finished when later pings come */
    _Atomic uint64_t dropped[PIPELINE_MAX_SENSORS];
    _Atomic int law_doubt[PIPELINE_MAX_SENSORS], hearing[PIPELINE_MAX_SENSORS];
    _Atomic uint32_t own_bearings[PIPELINE_MAX_SENSORS];
    SNAPSHOT_OF(struct cleanup_state) cleanup_state[PIPELINE_MAX_SENSORS]; /* from the thread that extracts */
    SNAPSHOT_OF(struct extract_reference) reference[PIPELINE_MAX_SENSORS]; /* likewise */
    SNAPSHOT_OF(struct learnt) learnt[PIPELINE_MAX_SENSORS];
    atomic_bool stop;
    pthread_t thread[PIPELINE_MAX_THREADS];
    int n_threads;
    void *memory[10 + 5 * PIPELINE_MAX_SENSORS];
    int n_memory;
};

/* What the owner owns; of the owner, and of the loop where there is no thread. */
static inline struct pipeline_owned pipeline_owned(struct pipeline *p)
{
    return (struct pipeline_owned){p->map, &p->witnesses};
}

/** owner_jobs_start - none yet; false: there is no descriptor. owner_jobs_close - all have ended. */
bool owner_jobs_start(struct pipeline *p);
void owner_jobs_close(struct pipeline *p);

/** follow_ping - it is about to be entered, and brings its own pose. Loop thread. */
void follow_ping(struct pipeline *p, const struct ping *ping);

/** owner_jobs_do - the one that is to be done next, if there is one. By the thread that they are for. */
void owner_jobs_do(struct pipeline *p, struct owner_jobs *jobs);

#define PIPELINE_REST_NS 20000

/* Between two looks at what another thread does. */
static inline void pipeline_rest(void)
{
    const struct timespec t = {.tv_nsec = PIPELINE_REST_NS};
    nanosleep(&t, NULL);
}

/* The way by which the echoes come to the thread that owns the maps. */
static inline struct stage_queue *pipeline_owners_queue(struct pipeline *p)
{
    return p->conf.threads == 2 ? &p->found : &p->pings;
}

#endif
