/* SPDX-License-Identifier: MIT */
/*
 * request_job - methods whose answer is with the owner of the grids and the map: what they send there, and how their
 * requests are resumed when it is done.
 */
#ifndef SONARD_REQUEST_JOB_H
#define SONARD_REQUEST_JOB_H

#include "core/fault.h"
#include "core/loop.h"
#include "daemon/rpc/rpc.h"
#include "daemon/pipeline/pipeline.h"

/**
 * request_jobs_start - resume requests when their jobs complete; false with a sentence in fault. request_jobs_end - no
 * longer: all are dropped, and none is running when it returns. Before what jobs work on ends.
 */
struct request_jobs {
    struct loop *loop;
    struct pipeline *pipeline;
    struct loop_fd fd;
};

bool request_jobs_start(struct request_jobs *e, struct loop *loop, struct pipeline *pipeline, struct fault *fault);
void request_jobs_end(struct request_jobs *e);

/**
 * request_job_done - have the owner call fn with the request's state, which begins with a struct owner_job. False while
 * it is not done: then `part`, which asks again, is what the request continues with (rpc_continue).
 */
bool request_job_done(const struct rpc_call *call, struct pipeline *p, pipeline_owner_fn *fn, rpc_part_fn *part);

#define ORPHANED_JOBS_MAX 100

/**
 * request_job_room - may a request send one that changes something? False with a refusal in *error, before anything is
 * changed: at most ORPHANED_JOBS_MAX orphaned jobs (client gone or already answered) may be queued.
 */
bool request_job_room(const struct pipeline *p, struct rpc_error *error);

/**
 * request_job_free - for struct rpc_work: frees a malloced state that begins with a struct owner_job,
 * as soon as nobody uses it.
 * request_job_leave - the same of what changes something: when it was sent it is done, and its client may have gone.
 */
void request_job_free(void *state);
void request_job_leave(void *state);

#endif
