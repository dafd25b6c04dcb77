/* SPDX-License-Identifier: MIT */
/*
 * pipeline_errands - what the pipeline's threads do for the loop while the loop goes on. The queue of each is the loop's;
 * between the threads there are two places for one errand each, so neither waits for the other.
 */
#include <errno.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "pipeline_state.h"

bool errands_begin(struct pipeline *p)
{
    p->errands_fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    return p->errands_fd >= 0;
}

static void come_back(struct errand *e)
{
    e->state = ERRAND_DONE;
    if (e->release)
        e->release(e);
}

void errands_close(struct pipeline *p)
{
    if (p->errands_fd >= 0)
        close(p->errands_fd);
}

static void tell_loop(struct pipeline *p)
{
    const uint64_t one = 1;
    while (write(p->errands_fd, &one, sizeof one) < 0 && errno == EINTR) {
    }
}

/* The next step waits for its owner, which is the loop where there is no thread. */
static void give(struct pipeline *p, struct errands *errands, struct errand *e)
{
    atomic_store_explicit(&errands->to_owner, e, memory_order_release);
    if (p->conf.threads == 0)
        tell_loop(p);
    else
        sem_post(errands == &p->early ? &p->pings.news : &pipeline_owners_belt(p)->news);
}

void errands_do(struct pipeline *p, struct errands *errands)
{
    struct errand *e = atomic_exchange_explicit(&errands->to_owner, NULL, memory_order_acquire);
    if (!e)
        return;
    const struct pipeline_owned owned = pipeline_owned(p);
    e->more = false;
    e->fn(e, &owned);
    if (e->more) {
        give(p, errands, e);
    } else {
        atomic_store_explicit(&errands->done, e, memory_order_release);
        tell_loop(p);
    }
}

/* ---- the loop's side ---- */

static struct errands *errands_of(struct pipeline *p, const struct errand *errand)
{
    return errand->early ? &p->early : &p->errands;
}

static void send_next(struct pipeline *p, struct errands *errands)
{
    struct errand *e = errands->first;
    if (!e || errands->out)
        return;
    errands->first = e->next;
    errands->out = e;
    e->state = ERRAND_OUT;
    give(p, errands, e);
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

/* A step, for which the loop waits. */
static void step(struct pipeline *p, struct errand *errand, pipeline_owner_fn *fn)
{
    errand->pipeline = p;
    errand->more = false;
    pipeline_visit(p, fn, errand);
}

void pipeline_errand_now(struct pipeline *p, struct errand *errand, pipeline_owner_fn *fn)
{
    do
        step(p, errand, fn);
    while (errand->more);
}

/* Of one that is not sent: what needs no sending, or no second step, is done; after those that were sent. */
static bool at_once(struct pipeline *p, struct errand *errand, pipeline_owner_fn *fn)
{
    const struct errands *before = errands_of(p, errand);
    if (p->conf.patient)
        pipeline_errand_now(p, errand, fn);
    else if (p->conf.threads == 0 && !before->out && !before->first)
        step(p, errand, fn);
    else
        return false;
    return !errand->more;
}

bool pipeline_errand(struct pipeline *p, struct errand *errand, pipeline_owner_fn *fn)
{
    const bool done = errand->state == ERRAND_DONE || (errand->state == ERRAND_NONE && at_once(p, errand, fn));
    if (done) {
        errand->state = ERRAND_NONE;
    } else if (errand->state == ERRAND_NONE) {
        errand->pipeline = p;
        errand->fn = fn;
        append(errands_of(p, errand), errand);
        send_next(p, errands_of(p, errand));
    }
    return done;
}

void pipeline_errand_drop(struct errand *errand, void (*release)(void *ctx))
{
    struct pipeline *p = errand->pipeline;
    struct errands *errands = p ? errands_of(p, errand) : NULL;
    struct errand *unbegun = errand;
    errand->release = release;
    if (errand->state == ERRAND_WAITS) {
        take_out(errands, errand);
    } else if (errand->state == ERRAND_OUT) {
        if (!atomic_compare_exchange_strong(&errands->to_owner, &unbegun, NULL))
            return; /* it is being done, or is done: it comes back */
        errands->out = NULL;
        send_next(p, errands);
    }
    release(errand);
}

static void then_release(struct errand *errand, void (*release)(void *ctx))
{
    errand->release = release;
    if (errand->state != ERRAND_WAITS && errand->state != ERRAND_OUT)
        release(errand);
}

void pipeline_errand_leave(struct errand *errand, void (*release)(void *ctx))
{
    errand->left = true;
    then_release(errand, release);
}

void pipeline_errand_then(struct pipeline *p, struct errand *errand, pipeline_owner_fn *fn, void (*then)(void *ctx))
{
    *errand = (struct errand){.early = errand->early};
    if (pipeline_errand(p, errand, fn))
        errand->state = ERRAND_DONE;
    then_release(errand, then);
}

static unsigned count_left(const struct errands *errands)
{
    unsigned n = 0;
    for (const struct errand *e = errands->first; e; e = e->next)
        n += e->left;
    return n;
}

unsigned pipeline_errands_left(const struct pipeline *p)
{
    return count_left(&p->early) + count_left(&p->errands);
}

static void give_back(struct errand *e)
{
    e->state = ERRAND_NONE;
    if (e->release)
        e->release(e);
}

/* A step that is being done ends; after it come no more. */
static void end_all(struct errands *errands)
{
    struct errand *out = errands->out, *unbegun = NULL, *done = NULL;
    while (out && !unbegun && !done) {
        unbegun = atomic_exchange_explicit(&errands->to_owner, NULL, memory_order_acquire);
        done = unbegun ? NULL : atomic_exchange_explicit(&errands->done, NULL, memory_order_acquire);
        if (!unbegun && !done)
            pipeline_rest();
    }
    if (unbegun)
        give_back(unbegun);
    else if (done)
        come_back(done);
    errands->out = NULL;
    for (struct errand *e; (e = errands->first) != NULL;) {
        errands->first = e->next;
        give_back(e);
    }
}

void pipeline_errands_end(struct pipeline *p)
{
    end_all(&p->early);
    end_all(&p->errands);
}

int pipeline_errands_fd(const struct pipeline *p)
{
    return p->errands_fd;
}

static void take(struct pipeline *p, struct errands *errands)
{
    if (p->conf.threads == 0)
        errands_do(p, errands);
    struct errand *done = atomic_exchange_explicit(&errands->done, NULL, memory_order_acquire);
    if (!done)
        return;
    errands->out = NULL;
    come_back(done);
    send_next(p, errands);
}

void pipeline_errands_take(struct pipeline *p)
{
    uint64_t times;
    while (read(p->errands_fd, &times, sizeof times) < 0 && errno == EINTR) {
    }
    take(p, &p->early);
    take(p, &p->errands);
}
