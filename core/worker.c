/* SPDX-License-Identifier: MIT */
/*
 * worker - see worker.h. The queue is the loop's; between the two threads there are two places for one piece of work
 * each, so that neither waits for a lock of the other, whatever their priorities.
 */
#include "worker.h"

#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <unistd.h>

struct worker {
    struct loop *loop;
    struct loop_fd news;                   /* an eventfd: a piece is done */
    struct worker_job *first, *last;       /* that wait */
    bool busy;                             /* one is at the thread */
    _Atomic(struct worker_job *) to, from; /* the thread */
    sem_t handed;
    atomic_bool stop;
    bool running;
    pthread_t thread;
};

static void *work(void *arg)
{
    struct worker *w = arg;
    const uint64_t one = 1;
    while (!atomic_load(&w->stop)) {
        struct worker_job *job = atomic_exchange_explicit(&w->to, NULL, memory_order_acquire);
        if (job) {
            job->fn(job->ctx);
            atomic_store_explicit(&w->from, job, memory_order_release);
            while (write(w->news.fd, &one, sizeof one) < 0 && errno == EINTR) {
            }
        } else {
            while (sem_wait(&w->handed) != 0) {
            }
        }
    }
    return NULL;
}

static void hand_next(struct worker *w)
{
    struct worker_job *job = w->first;
    if (!job || w->busy)
        return;
    w->first = job->next;
    w->busy = true;
    atomic_store_explicit(&w->to, job, memory_order_release);
    sem_post(&w->handed);
}

static void take_back(struct worker *w)
{
    uint64_t times;
    while (read(w->news.fd, &times, sizeof times) < 0 && errno == EINTR) {
    }
    struct worker_job *job = atomic_exchange_explicit(&w->from, NULL, memory_order_acquire);
    if (!job)
        return;
    w->busy = false;
    hand_next(w);
    job->done(job->ctx);
}

static void on_news(void *ctx, uint32_t epoll_events, uint64_t now_ns)
{
    (void)epoll_events;
    (void)now_ns;
    take_back(ctx);
}

struct worker *worker_new(struct loop *loop, struct fault *fault)
{
    struct worker *w = calloc(1, sizeof *w);
    if (w)
        *w = (struct worker){.loop = loop, .news = {.fd = -1, .ready = on_news, .ctx = w}};
    if (w && (w->news.fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) >= 0 && sem_init(&w->handed, 0, 0) == 0 &&
        loop_add(loop, &w->news, EPOLLIN))
        return w;
    fault_set(fault, "worker: %s", strerror(errno));
    if (w && w->news.fd >= 0)
        close(w->news.fd);
    free(w);
    return NULL;
}

void worker_run(struct worker *w, struct worker_job *job, void (*fn)(void *ctx), void (*done)(void *ctx),
                void *ctx)
{
    *job = (struct worker_job){.fn = fn, .done = done, .ctx = ctx};
    w->running = w->running || pthread_create(&w->thread, NULL, work, w) == 0;
    if (!w->running) {
        fn(ctx);
        done(ctx);
        return;
    }
    if (w->first)
        w->last->next = job;
    else
        w->first = job;
    w->last = job;
    hand_next(w);
}

void worker_finish(struct worker *w)
{
    struct pollfd news = {.fd = w->news.fd, .events = POLLIN};
    while (w->busy) {
        poll(&news, 1, -1);
        take_back(w);
    }
}

void worker_free(struct worker *w)
{
    if (!w)
        return;
    worker_finish(w);
    if (w->running) {
        atomic_store(&w->stop, true);
        sem_post(&w->handed);
        pthread_join(w->thread, NULL);
    }
    loop_remove(w->loop, &w->news);
    close(w->news.fd);
    sem_destroy(&w->handed);
    free(w);
}
