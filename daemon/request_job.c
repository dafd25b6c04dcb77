/* SPDX-License-Identifier: MIT */
#include "request_job.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>

static void on_done(void *ctx, uint32_t events, uint64_t now_ns)
{
    const struct request_jobs *e = ctx;
    (void)events, (void)now_ns;
    owner_jobs_take(e->pipeline);
}

bool request_jobs_start(struct request_jobs *e, struct loop *loop, struct pipeline *pipeline, struct fault *fault)
{
    *e = (struct request_jobs){.loop = loop, .pipeline = pipeline};
    e->fd = (struct loop_fd){.fd = owner_jobs_fd(pipeline), .ready = on_done, .ctx = e};
    if (loop_add(loop, &e->fd, EPOLLIN))
        return true;
    return fault_set(fault, "jobs to the pipeline: %s", strerror(errno));
}

void request_jobs_end(struct request_jobs *e)
{
    if (!e->fd.ready)
        return;
    owner_jobs_end(e->pipeline);
    loop_remove(e->loop, &e->fd);
}

bool request_job_done(const struct rpc_call *call, struct pipeline *p, pipeline_owner_fn *fn, rpc_part_fn *part)
{
    struct owner_job *job = call->work->state;
    job->resume = rpc_work_resume;
    job->request = call->work;
    if (owner_poll(p, job, fn))
        return true;
    rpc_work_wait(call->work, NULL);
    return rpc_continue(call, part);
}

bool request_job_room(const struct pipeline *p, struct rpc_error *error)
{
    return owner_jobs_orphaned(p) < ORPHANED_JOBS_MAX ||
           rpc_refuse(error, RPC_LIMIT,
                      "%d orphaned changes are queued (client gone or already answered): retry in a second",
                      ORPHANED_JOBS_MAX);
}

void request_job_leave(void *state)
{
    owner_job_leave(state, free);
}

void request_job_free(void *state)
{
    owner_job_drop(state, free);
}
