/* SPDX-License-Identifier: MIT */
#include "work.h"

#include <stddef.h>

void rpc_work_keep(struct rpc_work *work, void *state, void (*drop)(void *state))
{
    work->state = state;
    work->drop = drop;
}

void rpc_work_go_on(struct rpc_work *work)
{
    if (work->among) {
        struct rpc_work **at = &work->among->first;
        while (*at != work)
            at = &(*at)->next;
        *at = work->next;
    }
    work->among = NULL;
    work->waits = false;
}

void rpc_work_wait(struct rpc_work *work, struct rpc_waiters *waiters)
{
    rpc_work_go_on(work);
    work->waits = true;
    work->among = waiters;
    if (!waiters)
        return;
    struct rpc_work **at = &waiters->first;
    while (*at)
        at = &(*at)->next;
    work->next = NULL;
    *at = work;
}

void rpc_work_resume(void *work)
{
    struct rpc_work *w = work;
    if (!w->waits)
        return;
    rpc_work_go_on(w);
    if (w->resume)
        w->resume(w->ctx);
}

/* Whoever goes on may wait again, and may end others. */
void rpc_work_resume_all(struct rpc_waiters *waiters)
{
    struct rpc_waiters now = *waiters;
    waiters->first = NULL;
    for (struct rpc_work *w = now.first; w; w = w->next)
        w->among = &now;
    while (now.first)
        rpc_work_resume(now.first);
}

void rpc_work_let_go(struct rpc_work *work)
{
    if (work->making)
        work->abandon(work);
}

void rpc_work_end(struct rpc_work *work)
{
    rpc_work_go_on(work);
    rpc_work_let_go(work);
    if (work->state)
        work->drop(work->state);
    *work = (struct rpc_work){.resume = work->resume, .ctx = work->ctx};
}
