/* SPDX-License-Identifier: MIT */
#include "loop.h"

#include <errno.h>
#include <stddef.h>
#include <stdlib.h>
#include <sys/epoll.h>
#include <time.h>
#include <unistd.h>

#define EVENTS_PER_TURN 32

/* Descriptors are looked at no more seldom than this, so that it is known of what is ready when it came. */
#define PULSE_NS 25000000u

struct loop {
    int epoll;
    bool virtual_clock;
    bool quit;
    uint64_t now_ns, turns;
    uint64_t looked_ns; /* before the last look at all descriptors */
    uint64_t since_ns;  /* the same of the look before */
    struct loop_timer
        *timers;    /* armed ones: a pairing heap; on top the earliest, of equal times the first armed */
    uint64_t order; /* of the timer that is armed next */
    struct epoll_event events[EVENTS_PER_TURN];
    int n_events; /* of this turn; entries of removed handlers are set to NULL */
};

uint64_t loop_clock(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

struct loop *loop_new(bool virtual_clock)
{
    struct loop *loop = calloc(1, sizeof *loop);
    if (!loop)
        return NULL;
    loop->epoll = epoll_create1(EPOLL_CLOEXEC);
    if (loop->epoll < 0) {
        free(loop);
        return NULL;
    }
    loop->virtual_clock = virtual_clock;
    loop->now_ns = virtual_clock ? 0 : loop_clock();
    loop->looked_ns = loop->since_ns = loop->now_ns;
    return loop;
}

void loop_free(struct loop *loop)
{
    if (!loop)
        return;
    close(loop->epoll);
    free(loop);
}

uint64_t loop_now(const struct loop *loop)
{
    return loop->now_ns;
}

uint64_t loop_turns(const struct loop *loop)
{
    return loop->turns;
}

uint64_t loop_since(const struct loop *loop)
{
    return loop->since_ns;
}

bool loop_add(struct loop *loop, struct loop_fd *handler, uint32_t epoll_events)
{
    struct epoll_event e = {.events = epoll_events, .data.ptr = handler};
    return epoll_ctl(loop->epoll, EPOLL_CTL_ADD, handler->fd, &e) == 0;
}

void loop_change(struct loop *loop, struct loop_fd *handler, uint32_t epoll_events)
{
    struct epoll_event e = {.events = epoll_events, .data.ptr = handler};
    epoll_ctl(loop->epoll, EPOLL_CTL_MOD, handler->fd, &e);
}

void loop_remove(struct loop *loop, struct loop_fd *handler)
{
    epoll_ctl(loop->epoll, EPOLL_CTL_DEL, handler->fd, NULL);
    for (int i = 0; i < loop->n_events; i++)
        if (loop->events[i].data.ptr == handler)
            loop->events[i].data.ptr = NULL;
}

static bool is_before(const struct loop_timer *a, const struct loop_timer *b)
{
    return a->due_ns < b->due_ns || (a->due_ns == b->due_ns && a->order < b->order);
}

/* Two heaps become one. Either may be empty. */
static struct loop_timer *meld(struct loop_timer *a, struct loop_timer *b)
{
    if (!a || !b)
        return a ? a : b;
    struct loop_timer *top = is_before(b, a) ? b : a, *below = top == a ? b : a;
    below->next = top->child;
    if (below->next)
        below->next->prev = below;
    below->prev = top;
    top->child = below;
    return top;
}

/* A chain of siblings becomes one heap: in pairs on the way there, all pairs together on the way back. */
static struct loop_timer *meld_siblings(struct loop_timer *first)
{
    struct loop_timer *pairs = NULL, *heap = NULL;
    while (first) {
        struct loop_timer *a = first, *b = a->next;
        first = b ? b->next : NULL;
        a->next = a->prev = NULL;
        if (b)
            b->next = b->prev = NULL;
        a = meld(a, b);
        a->next = pairs;
        pairs = a;
    }
    while (pairs) {
        struct loop_timer *pair = pairs;
        pairs = pair->next;
        pair->next = NULL;
        heap = meld(heap, pair);
    }
    return heap;
}

static void unlink_timer(struct loop *loop, struct loop_timer *timer)
{
    struct loop_timer *below = meld_siblings(timer->child);
    if (loop->timers == timer) {
        loop->timers = below;
    } else {
        if (timer->prev->child == timer)
            timer->prev->child = timer->next;
        else
            timer->prev->next = timer->next;
        if (timer->next)
            timer->next->prev = timer->prev;
        loop->timers = meld(loop->timers, below);
    }
    timer->child = timer->next = timer->prev = NULL;
    timer->armed = false;
}

/* What is armed for the past goes behind what has been due for longer. */
void loop_arm(struct loop *loop, struct loop_timer *timer, uint64_t due_ns)
{
    if (due_ns < loop->now_ns)
        due_ns = loop->now_ns;
    if (timer->armed && timer->due_ns == due_ns)
        return;
    if (timer->armed)
        unlink_timer(loop, timer);
    if (due_ns == LOOP_NEVER)
        return;
    timer->due_ns = due_ns;
    timer->armed = true;
    timer->order = loop->order++;
    loop->timers = meld(loop->timers, timer);
}

/* Those that are due now: timers that a handler arms for now come behind them and wait for the next round, so that none
 * can hold the loop for ever. */
static void fire_due(struct loop *loop)
{
    const uint64_t end = loop->order;
    while (loop->timers && loop->timers->due_ns <= loop->now_ns && loop->timers->order < end) {
        struct loop_timer *t = loop->timers;
        unlink_timer(loop, t);
        t->fire(t->ctx, loop->now_ns);
    }
}

static bool is_due(const struct loop *loop)
{
    return loop->timers && loop->timers->due_ns <= loop->now_ns;
}

/* A virtual clock stands meanwhile: what is not due will not be. */
static int wait_ms(const struct loop *loop, uint64_t max_wait_ns)
{
    uint64_t wait = is_due(loop) ? 0 : max_wait_ns;
    if (wait && !loop->virtual_clock && loop->timers) {
        const uint64_t left = loop->timers->due_ns - loop->now_ns;
        if (left < wait)
            wait = left;
    }
    if (wait == LOOP_NEVER)
        return -1;
    uint64_t ms = wait / 1000000u + (wait % 1000000u != 0);
    return ms > 60000 ? 60000 : (int)ms;
}

static void read_clock(struct loop *loop)
{
    if (!loop->virtual_clock)
        loop->now_ns = loop_clock();
}

uint64_t loop_reread(struct loop *loop)
{
    read_clock(loop);
    return loop->now_ns;
}

/* Which descriptors are ready, after at most `ms`. A look that was interrupted, or had no room for all, says nothing
 * of those that it did not name. */
static void poll_events(struct loop *loop, int ms)
{
    const uint64_t before_ns = loop->now_ns;
    const int n = epoll_wait(loop->epoll, loop->events, EVENTS_PER_TURN, ms);
    loop->n_events = n > 0 ? n : 0;
    read_clock(loop);
    loop->since_ns = loop->looked_ns;
    if (n >= 0 && n < EVENTS_PER_TURN)
        loop->looked_ns = before_ns;
}

/* Until a descriptor is ready, a timer is due, or for max_wait_ns. */
static void await(struct loop *loop, uint64_t max_wait_ns)
{
    read_clock(loop);
    const uint64_t started_ns = loop->now_ns;
    uint64_t waited_ns = 0;
    do {
        const uint64_t left_ns = max_wait_ns == LOOP_NEVER ? LOOP_NEVER : max_wait_ns - waited_ns;
        poll_events(loop, wait_ms(loop, left_ns < PULSE_NS || loop->virtual_clock ? left_ns : PULSE_NS));
        waited_ns = loop->now_ns - started_ns;
    } while (loop->n_events == 0 && !loop->virtual_clock && !is_due(loop) && waited_ns < max_wait_ns);
}

static void handle(struct loop *loop)
{
    for (int i = 0; i < loop->n_events; i++) {
        struct loop_fd *handler = loop->events[i].data.ptr;
        if (handler)
            handler->ready(handler->ctx, loop->events[i].events, loop->now_ns);
    }
    loop->n_events = 0;
}

/* The process may have been held up since it looked. So before a timer fires it looks again: what came before the timer
 * was due is handled first, and nobody is given up whose bytes are waiting. */
bool loop_turn(struct loop *loop, uint64_t max_wait_ns)
{
    loop->turns++;
    await(loop, max_wait_ns);
    handle(loop);
    if (is_due(loop)) {
        poll_events(loop, 0);
        handle(loop);
    }
    fire_due(loop);
    return !loop->quit;
}

void loop_advance(struct loop *loop, uint64_t t_ns)
{
    while (loop->timers && loop->timers->due_ns <= t_ns) {
        if (loop->timers->due_ns > loop->now_ns)
            loop->now_ns = loop->timers->due_ns;
        struct loop_timer *t = loop->timers;
        unlink_timer(loop, t);
        t->fire(t->ctx, loop->now_ns);
    }
    if (t_ns > loop->now_ns)
        loop->now_ns = t_ns;
}

void loop_skip(struct loop *loop, uint64_t t_ns)
{
    if (t_ns > loop->now_ns)
        loop->now_ns = t_ns;
    fire_due(loop);
}

void loop_quit(struct loop *loop)
{
    loop->quit = true;
}
