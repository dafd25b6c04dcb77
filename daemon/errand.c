/* SPDX-License-Identifier: MIT */
#include "errand.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>

static void on_done(void *ctx, uint32_t events, uint64_t now_ns)
{
    struct daemon *d = ctx;
    (void)events, (void)now_ns;
    pipeline_errands_take(d->pipeline);
    if (d->server)
        server_go_on(d->server);
}

bool errand_start(struct daemon *d, char *err, size_t err_size)
{
    d->errands = (struct loop_fd){.fd = pipeline_errands_fd(d->pipeline), .ready = on_done, .ctx = d};
    if (loop_add(d->loop, &d->errands, EPOLLIN))
        return true;
    snprintf(err, err_size, "errands to the pipeline: %s", strerror(errno));
    return false;
}

void errand_end(struct daemon *d)
{
    if (!d->errands.ready)
        return;
    pipeline_errands_end(d->pipeline);
    loop_remove(d->loop, &d->errands);
}

bool errand_done(const struct rpc_call *call, pipeline_owner_fn *fn, struct rpc_error *error)
{
    struct daemon *d = call->daemon;
    call->work->waits = !pipeline_errand(d->pipeline, call->work->state, fn);
    if (call->work->waits)
        error->code = RPC_UNFINISHED;
    return !call->work->waits;
}

bool errand_room(const struct rpc_call *call, struct rpc_error *error)
{
    const struct daemon *d = call->daemon;
    return pipeline_errands_left(d->pipeline) < ERRANDS_LEFT_MAX ||
           rpc_refuse(error, RPC_LIMIT,
                      "%d changes wait to be made for which nobody waits any more: ask again in a second",
                      ERRANDS_LEFT_MAX);
}

void errand_leave(void *state)
{
    pipeline_errand_leave(state, free);
}

void errand_free(void *state)
{
    pipeline_errand_drop(state, free);
}
