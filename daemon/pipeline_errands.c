/* SPDX-License-Identifier: MIT */
/*
 * pipeline_errands - what the grids' and the map's owner does for the loop while the loop goes on. The queue is the
 * loop's; between the threads there are two places for one errand each, so neither waits for the other.
 */
#include <errno.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "pipeline_state.h"

bool errands_begin(struct errands *errands)
{
    errands->fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    return errands->fd >= 0;
}

static void come_back(struct errand *e)
{
    e->state = ERRAND_DONE;
    if (e->release)
        e->release(e);
}

void errands_close(struct errands *errands)
{
    if (errands->fd >= 0)
        close(errands->fd);
}

void errands_do(struct pipeline *p)
{
    struct errand *e = atomic_exchange_explicit(&p->errands.to_owner, NULL, memory_order_acquire);
    const uint64_t one = 1;
    if (!e)
        return;
    const struct pipeline_owned owned = pipeline_owned(p);
    e->fn(e, &owned);
    atomic_store_explicit(&p->errands.done, e, memory_order_release);
    while (write(p->errands.fd, &one, sizeof one) < 0 && errno == EINTR) {
    }
}

/* ---- the loop's side ---- */

static void send_next(struct pipeline *p)
{
    struct errands *errands = &p->errands;
    struct errand *e = errands->first;
    if (!e || errands->out)
        return;
    errands->first = e->next;
    errands->out = e;
    e->state = ERRAND_OUT;
    atomic_store_explicit(&errands->to_owner, e, memory_order_release);
    sem_post(&pipeline_owners_belt(p)->news);
}

static void append(struct errands *errands, struct errand *e)
{
    e->state = ERRAND_WAITS;
    e->next = NULL;
    if (errands->first)
        errands->last->next = e;
    else
        errands->first = e;
    errands->last = e;
}

static void take_out(struct errands *errands, const struct errand *e)
{
    struct errand **at = &errands->first, *before = NULL;
    for (; *at != e; at = &before->next)
        before = *at;
    *at = e->next;
    if (errands->last == e)
        errands->last = before;
}

bool pipeline_errand(struct pipeline *p, struct errand *errand, pipeline_owner_fn *fn)
{
    errand->pipeline = p;
    if (p->conf.threads == 0 || p->conf.patient) {
        pipeline_visit(p, fn, errand);
        return true;
    }
    if (errand->state == ERRAND_DONE) {
        errand->state = ERRAND_NONE;
        return true;
    }
    if (errand->state == ERRAND_NONE) {
        errand->fn = fn;
        append(&p->errands, errand);
        send_next(p);
    }
    return false;
}

void pipeline_errand_drop(struct errand *errand, void (*release)(void *ctx))
{
    struct pipeline *p = errand->pipeline;
    struct errand *unbegun = errand;
    errand->release = release;
    if (errand->state == ERRAND_WAITS) {
        take_out(&p->errands, errand);
    } else if (errand->state == ERRAND_OUT) {
        if (!atomic_compare_exchange_strong(&p->errands.to_owner, &unbegun, NULL))
            return; /* it is being done, or is done: it comes back */
        p->errands.out = NULL;
        send_next(p);
    }
    release(errand);
}

void pipeline_errand_leave(struct errand *errand, void (*release)(void *ctx))
{
    errand->release = release;
    if (errand->state != ERRAND_WAITS && errand->state != ERRAND_OUT)
        release(errand);
}

static void nothing(void *ctx, const struct pipeline_owned *owned)
{
    (void)ctx, (void)owned;
}

static void give_back(struct errand *e)
{
    e->state = ERRAND_NONE;
    if (e->release)
        e->release(e);
}

/* One that is being done is done when a visit is over. */
void pipeline_errands_end(struct pipeline *p)
{
    struct errands *errands = &p->errands;
    struct errand *unbegun = atomic_exchange_explicit(&errands->to_owner, NULL, memory_order_acquire);
    pipeline_visit(p, nothing, NULL);
    struct errand *done = atomic_exchange_explicit(&errands->done, NULL, memory_order_acquire);
    errands->out = NULL;
    if (unbegun)
        give_back(unbegun);
    if (done)
        come_back(done);
    for (struct errand *e; (e = errands->first) != NULL;) {
        errands->first = e->next;
        give_back(e);
    }
}

int pipeline_errands_fd(const struct pipeline *p)
{
    return p->errands.fd;
}

void pipeline_errands_take(struct pipeline *p)
{
    uint64_t times;
    while (read(p->errands.fd, &times, sizeof times) < 0 && errno == EINTR) {
    }
    struct errand *done = atomic_exchange_explicit(&p->errands.done, NULL, memory_order_acquire);
    if (!done)
        return;
    p->errands.out = NULL;
    come_back(done);
    send_next(p);
}
