/* SPDX-License-Identifier: MIT */
/* test_worker - work is done in its order by another thread and comes back to the loop; the end leaves none behind. */
#include "tests/lib/patience.h"
#include "tests/lib/test.h"

#include <pthread.h>
#include <semaphore.h>
#include <stdatomic.h>

#include "core/loop.h"
#include "core/worker.h"

struct piece {
    struct worker_job job;
    struct worker *worker;
    struct piece *then; /* is handed over when this one is done; NULL: none */
    sem_t *wait;        /* for this first; NULL: for nothing */
    atomic_int *count;
    int done_as, back_as; /* by the worker, by the loop */
    bool elsewhere;
    pthread_t loop_thread;
};

static void act(void *ctx)
{
    struct piece *p = ctx;
    while (p->wait && sem_wait(p->wait) != 0) {
    }
    p->elsewhere = !pthread_equal(p->loop_thread, pthread_self());
    p->done_as = ++*p->count;
}

static void back(void *ctx)
{
    struct piece *p = ctx;
    CHECK(pthread_equal(p->loop_thread, pthread_self()) && p->done_as > 0);
    p->back_as = ++*p->count;
    if (p->then)
        worker_run(p->worker, &p->then->job, act, back, p->then);
}

static struct worker *begin(struct loop **loop)
{
    struct fault fault;
    *loop = loop_new(false);
    struct worker *w = worker_new(*loop, &fault);
    CHECK(w != NULL);
    return w;
}

TEST(work_is_done_elsewhere_in_its_order)
{
    struct loop *loop;
    struct worker *w = begin(&loop);
    struct piece piece[100];
    sem_t go;
    atomic_int count = 0;
    sem_init(&go, 0, 0);
    for (int i = 0; i < 100; i++) {
        piece[i] =
            (struct piece){.worker = w, .count = &count, .loop_thread = pthread_self(), .wait = i ? NULL : &go};
        worker_run(w, &piece[i].job, act, back, &piece[i]);
    }
    loop_turn(loop, 0); /* goes on while the first waits */
    CHECK_INT(piece[0].back_as, 0);
    sem_post(&go);
    TURN_UNTIL(loop, piece[99].back_as);
    for (int i = 0; i < 100; i++) {
        CHECK(piece[i].elsewhere && piece[i].back_as > piece[i].done_as);
        CHECK(i == 0 || piece[i].done_as > piece[i - 1].done_as);
    }
    worker_free(w);
    loop_free(loop);
    sem_destroy(&go);
}

TEST(the_end_waits_for_what_is_handed_over_by_then)
{
    struct loop *loop;
    struct worker *w = begin(&loop);
    atomic_int count = 0;
    struct piece last = {.worker = w, .count = &count, .loop_thread = pthread_self()};
    struct piece middle = last, first = last;
    middle.then = &last;
    first.then = &middle;
    worker_run(w, &first.job, act, back, &first);
    worker_finish(w);
    CHECK(first.back_as && middle.back_as && last.back_as);
    first.back_as = 0;
    first.then = NULL;
    worker_run(w, &first.job, act, back, &first);
    worker_free(w);
    CHECK(first.back_as > 0);
    loop_free(loop);
}

TEST(no_work_needs_no_thread)
{
    struct loop *loop;
    struct worker *w = begin(&loop);
    worker_finish(w);
    worker_free(w);
    worker_free(NULL);
    loop_free(loop);
}

int main(void)
{
    RUN(work_is_done_elsewhere_in_its_order);
    RUN(the_end_waits_for_what_is_handed_over_by_then);
    RUN(no_work_needs_no_thread);
    return test_end();
}
