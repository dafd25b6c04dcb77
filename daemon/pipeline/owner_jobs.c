/* SPDX-License-Identifier: MIT */
/*
 * owner_jobs - what the pipeline's threads do for the loop while the loop goes on. The queue of each is the
 * loop's; between the threads there are two places for one job each, so neither waits for the other.
 * tests/model/jobs.pml is the model.
 */
#include <errno.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "pipeline_state.h"

bool owner_jobs_start(struct pipeline *p)
{
    p->jobs_fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    return p->jobs_fd >= 0;
}

static void come_back(struct owner_job *e)
{
    e->state = OWNER_JOB_DONE;
    if (e->release)
        e->release(e);
    else if (e->resume)
        e->resume(e->request);
}

void owner_jobs_close(struct pipeline *p)
{
    if (p->jobs_fd >= 0)
        close(p->jobs_fd);
}

static void tell_loop(struct pipeline *p)
{
    const uint64_t one = 1;
    while (write(p->jobs_fd, &one, sizeof one) < 0 && errno == EINTR) {
    }
}

/* The next step waits for its owner, which is the loop where there is no thread. */
static void give(struct pipeline *p, struct owner_jobs *jobs, struct owner_job *e)
{
    atomic_store_explicit(&jobs->to_owner, e, memory_order_release);
    if (p->conf.threads == 0)
        tell_loop(p);
    else
        sem_post(jobs == &p->extract_jobs ? &p->pings.news : &pipeline_owners_queue(p)->news);
}

void owner_jobs_do(struct pipeline *p, struct owner_jobs *jobs)
{
    struct owner_job *e = atomic_exchange_explicit(&jobs->to_owner, NULL, memory_order_acquire);
    if (!e)
        return;
    const bool early = jobs == &p->extract_jobs; /* of a thread to which nothing of the owner's is known */
    const struct pipeline_owned owned = early ? (struct pipeline_owned){0} : pipeline_owned(p);
    e->more = false;
    e->fn(e, &owned);
    if (e->more) {
        give(p, jobs, e);
    } else {
        atomic_store_explicit(&jobs->done, e, memory_order_release);
        tell_loop(p);
    }
}

/* ---- the loop's side ---- */

static struct owner_jobs *jobs_of(struct pipeline *p, const struct owner_job *job)
{
    return job->extracts ? &p->extract_jobs : &p->jobs;
}

static void send_next(struct pipeline *p, struct owner_jobs *jobs)
{
    struct owner_job *e = jobs->first;
    if (!e || jobs->out)
        return;
    jobs->first = e->next;
    jobs->out = e;
    e->state = OWNER_JOB_OUT;
    give(p, jobs, e);
}

static void append(struct owner_jobs *jobs, struct owner_job *e)
{
    e->state = OWNER_JOB_WAITS;
    e->next = NULL;
    if (jobs->first)
        jobs->last->next = e;
    else
        jobs->first = e;
    jobs->last = e;
}

static void take_out(struct owner_jobs *jobs, const struct owner_job *e)
{
    struct owner_job **at = &jobs->first, *before = NULL;
    for (; *at != e; at = &before->next)
        before = *at;
    *at = e->next;
    if (jobs->last == e)
        jobs->last = before;
}

/* A step, for which the loop waits. */
static void step(struct pipeline *p, struct owner_job *job, pipeline_owner_fn *fn)
{
    job->pipeline = p;
    job->more = false;
    owner_run_now(p, fn, job);
}

void owner_call_now(struct pipeline *p, struct owner_job *job, pipeline_owner_fn *fn)
{
    do
        step(p, job, fn);
    while (job->more);
}

/* Of one that is not sent: what needs no sending, or no second step, is done; after those that were sent. */
static bool at_once(struct pipeline *p, struct owner_job *job, pipeline_owner_fn *fn)
{
    const struct owner_jobs *before = jobs_of(p, job);
    if (p->conf.patient)
        owner_call_now(p, job, fn);
    else if (p->conf.threads == 0 && !before->out && !before->first)
        step(p, job, fn);
    else
        return false;
    return !job->more;
}

bool owner_poll(struct pipeline *p, struct owner_job *job, pipeline_owner_fn *fn)
{
    if (p->jobs_ended)
        return false;
    const bool done = job->state == OWNER_JOB_DONE || (job->state == OWNER_JOB_NONE && at_once(p, job, fn));
    if (done) {
        job->state = OWNER_JOB_NONE;
    } else if (job->state == OWNER_JOB_NONE) {
        job->pipeline = p;
        job->fn = fn;
        append(jobs_of(p, job), job);
        send_next(p, jobs_of(p, job));
    }
    return done;
}

void owner_job_drop(struct owner_job *job, void (*release)(void *ctx))
{
    struct pipeline *p = job->pipeline;
    struct owner_jobs *jobs = p ? jobs_of(p, job) : NULL;
    struct owner_job *not_started = job;
    job->release = release;
    if (job->state == OWNER_JOB_WAITS) {
        take_out(jobs, job);
    } else if (job->state == OWNER_JOB_OUT) {
        if (!atomic_compare_exchange_strong(&jobs->to_owner, &not_started, NULL))
            return; /* it is being done, or is done: it comes back */
        jobs->out = NULL;
        send_next(p, jobs);
    }
    release(job);
}

static void then_release(struct owner_job *job, void (*release)(void *ctx))
{
    job->release = release;
    if (job->state != OWNER_JOB_WAITS && job->state != OWNER_JOB_OUT)
        release(job);
}

void owner_job_leave(struct owner_job *job, void (*release)(void *ctx))
{
    job->left = true;
    then_release(job, release);
}

void owner_call(struct pipeline *p, struct owner_job *job, pipeline_owner_fn *fn, void (*then)(void *ctx))
{
    *job = (struct owner_job){.extracts = job->extracts};
    if (owner_poll(p, job, fn))
        job->state = OWNER_JOB_DONE;
    then_release(job, then);
}

static unsigned count_left(const struct owner_jobs *jobs)
{
    unsigned n = 0;
    for (const struct owner_job *e = jobs->first; e; e = e->next)
        n += e->left;
    return n;
}

unsigned owner_jobs_orphaned(const struct pipeline *p)
{
    return count_left(&p->extract_jobs) + count_left(&p->jobs);
}

static void give_back(struct owner_job *e)
{
    e->state = OWNER_JOB_NONE;
    if (e->release)
        e->release(e);
}

/* A step that is being done ends; after it come no more. */
static void end_all(struct owner_jobs *jobs)
{
    struct owner_job *out = jobs->out, *not_started = NULL, *done = NULL;
    while (out && !not_started && !done) {
        not_started = atomic_exchange_explicit(&jobs->to_owner, NULL, memory_order_acquire);
        done = not_started ? NULL : atomic_exchange_explicit(&jobs->done, NULL, memory_order_acquire);
        if (!not_started && !done)
            pipeline_rest();
    }
    if (not_started)
        give_back(not_started);
    else if (done)
        come_back(done);
    jobs->out = NULL;
    for (struct owner_job *e; (e = jobs->first) != NULL;) {
        jobs->first = e->next;
        give_back(e);
    }
}

void owner_jobs_end(struct pipeline *p)
{
    p->jobs_ended = true;
    end_all(&p->extract_jobs);
    end_all(&p->jobs);
}

int owner_jobs_fd(const struct pipeline *p)
{
    return p->jobs_fd;
}

static void take_done(struct pipeline *p, struct owner_jobs *jobs)
{
    if (p->conf.threads == 0)
        owner_jobs_do(p, jobs);
    struct owner_job *done = atomic_exchange_explicit(&jobs->done, NULL, memory_order_acquire);
    if (!done)
        return;
    jobs->out = NULL;
    come_back(done);
    send_next(p, jobs);
}

void owner_jobs_take(struct pipeline *p)
{
    uint64_t times;
    while (read(p->jobs_fd, &times, sizeof times) < 0 && errno == EINTR) {
    }
    take_done(p, &p->extract_jobs);
    take_done(p, &p->jobs);
}
