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

#include "pipeline.h"
#include "ring.h"

/* A pool of buffers on its way: `waiting` from producer to consumer, `idle` back. */
struct belt {
    struct ring waiting, idle;
    sem_t news; /* posted for every entry put into waiting, for a visitor, to count a turn, and to stop */
    _Atomic uint64_t turns; /* of the thread behind it */
};

/* How far learning has come. */
struct learnt {
    uint64_t learning; /* number of the learner */
    struct background_progress progress;
};

/* Work of the loop that the maps' owner does for it between two pings, while it waits. */
struct visitor {
    pipeline_owner_fn *fn;
    void *ctx;
    sem_t done;
};

/* The same while it goes on, by one of the threads: the owner of what it is about. */
struct errands {
    struct errand *first, *last;             /* that wait */
    struct errand *out;                      /* at the owner; NULL: none */
    _Atomic(struct errand *) to_owner, done; /* the one that is out, not begun yet, and come back */
};

struct pipeline {
    struct pipeline_conf conf;
    struct ping *ping;
    struct echoes *echoes;
    uint32_t n_buffers;
    struct belt pings, found;
    _Atomic(struct visitor *) visitor; /* waits for the owner; NULL: nobody */
    struct errands errands, early; /* of the maps' owner, of the thread that extracts */
    int errands_fd;                /* an eventfd: one is done */
    uint32_t filling; /* ping buffer that pipeline_begin gave out, or NONE */
    struct extract *extract[PIPELINE_MAX_SENSORS];
    struct pipeline_background background[PIPELINE_MAX_SENSORS];
    struct cleanup *cleanup[PIPELINE_MAX_SENSORS];               /* NULL: no stage of it configured */
    struct grid *grid[PIPELINE_MAX_GRIDS];                       /* as the loop knows them, ... */
    struct grid *fed[PIPELINE_MAX_GRIDS];                        /* ... and the owner, who enters pings into them */
    int n_grids, n_fed;
    uint64_t grids_ever;
    struct witnesses witnesses;
    struct pipeline_map *map;                  /* NULL: not configured */
    struct marks *marks[PIPELINE_MAX_SENSORS]; /* NULL: not configured */
    struct image *image[PIPELINE_MAX_SENSORS]; /* NULL: nobody can ask for it */
    struct latency latency[PIPELINE_STAGES];
    _Atomic uint64_t submitted, finished;
    _Atomic uint64_t held; /* by the clean-ups: submitted, and finished when later pings come */
    _Atomic uint64_t dropped[PIPELINE_MAX_SENSORS];
    _Atomic int law_doubt[PIPELINE_MAX_SENSORS];
    struct seqlock cleanup_lock;
    seqlock_word cleanup_state[PIPELINE_MAX_SENSORS][sizeof(struct cleanup_state) / 8];
    struct seqlock learnt_lock;
    seqlock_word learnt[PIPELINE_MAX_SENSORS][sizeof(struct learnt) / 8];
    atomic_bool stop;
    pthread_t thread[PIPELINE_MAX_THREADS];
    int n_threads;
    void *memory[10 + 4 * PIPELINE_MAX_SENSORS];
    int n_memory;
};

/* What the owner owns; of the owner, and of the loop where there is no thread. */
static inline struct pipeline_owned pipeline_owned(struct pipeline *p)
{
    return (struct pipeline_owned){p->map, &p->witnesses, p->fed, p->n_fed};
}

/** errands_begin - none yet; false: there is no descriptor. errands_close - all have ended. */
bool errands_begin(struct pipeline *p);
void errands_close(struct pipeline *p);

/** errands_do - the one that is to be done next, if there is one. By the thread that they are for. */
void errands_do(struct pipeline *p, struct errands *errands);

/** pipeline_rest - between two looks at what another thread does. */
void pipeline_rest(void);

/* The way by which the echoes come to the thread that owns the maps. */
static inline struct belt *pipeline_owners_belt(struct pipeline *p)
{
    return p->conf.threads == 2 ? &p->found : &p->pings;
}

#endif
