/* SPDX-License-Identifier: MIT */
/*
 * worker - a thread that waits for the disk and for the name service, so that the loop does not. Work is done piece by
 * piece in the order in which it is handed over; the thread is made when there is something to do for the first time.
 */
#ifndef SONARD_WORKER_H
#define SONARD_WORKER_H

#include <stdbool.h>

#include "fault.h"
#include "loop.h"

struct worker;

/* A piece of work, embedded in its owner, who neither reads nor changes what fn works on until `done` is called. */
struct worker_job {
    void (*fn)(void *ctx);   /* by the worker */
    void (*done)(void *ctx); /* by the loop */
    void *ctx;
    struct worker_job *next; /* that waits */
};

/** worker_new - NULL with a sentence in fault. */
struct worker *worker_new(struct loop *loop, struct fault *fault);

/**
 * worker_run - have the worker call fn(ctx), then the loop done(ctx). Where no thread can be made the loop does it by
 * itself, before this returns. Loop thread.
 */
void worker_run(struct worker *w, struct worker_job *job, void (*fn)(void *ctx), void (*done)(void *ctx),
                void *ctx);

/** worker_finish - wait until all work is done, also what `done` hands over. Loop thread. */
void worker_finish(struct worker *w);

/** worker_free - finishes, ends the thread. NULL is allowed. */
void worker_free(struct worker *w);

#endif
