/* SPDX-License-Identifier: MIT */
/*
 * loop - the event loop: descriptors (epoll) and timers, one thread. Only the loop reads a clock; everybody else is
 * handed the time. In a replay the clock is the capture's: loop_advance() moves it and fires the timers due on the
 * way, in order of their time.
 */
#ifndef SONARD_LOOP_H
#define SONARD_LOOP_H

#include <stdbool.h>
#include <stdint.h>

#define LOOP_NEVER UINT64_MAX

/* What waited no longer than this may be taken to have come when it was read. */
#define LOOP_TIMELY_NS 100000000u

struct loop;

/* Embedded in its owner. Fields are set before loop_add and not touched until loop_remove. */
struct loop_fd {
    int fd;
    void (*ready)(void *ctx, uint32_t epoll_events, uint64_t now_ns);
    void *ctx;
};

/* Embedded in its owner; zeroed except fire and ctx before the first loop_arm. One shot. */
struct loop_timer {
    void (*fire)(void *ctx, uint64_t now_ns);
    void *ctx;
    /* the rest is owned by the loop */
    uint64_t due_ns;
    bool armed;
    uint64_t order;                         /* of arming: decides between equal times */
    struct loop_timer *child, *next, *prev; /* in the heap; prev of a first child is its parent */
};

/** loop_new - NULL when the kernel refuses (errno). virtual_clock: time stands until loop_advance. */
struct loop *loop_new(bool virtual_clock);
void loop_free(struct loop *loop);

/** loop_clock - the monotonic clock itself, in nanoseconds; for measuring and pacing, not for deciding. */
uint64_t loop_clock(void);

/** loop_now - monotonic nanoseconds, read once per turn of the loop. */
uint64_t loop_now(const struct loop *loop);

bool loop_add(struct loop *loop, struct loop_fd *handler, uint32_t epoll_events);
void loop_change(struct loop *loop, struct loop_fd *handler, uint32_t epoll_events);
/* Safe inside any handler, also for other handlers whose events of this turn are still waiting. */
void loop_remove(struct loop *loop, struct loop_fd *handler);

/** loop_arm - fire at due_ns (or at once when that is past); arming again moves it. LOOP_NEVER disarms.
 * Cannot fail; takes the logarithm of the number of armed timers, amortised. */
void loop_arm(struct loop *loop, struct loop_timer *timer, uint64_t due_ns);

/** loop_turn - wait at most until the next timer or max_wait_ns, then handle what is ready, then the timers that are
 * due. False after loop_quit. */
bool loop_turn(struct loop *loop, uint64_t max_wait_ns);

/** loop_turns - how often loop_turn has started: what is the same was done in the same turn. */
uint64_t loop_turns(const struct loop *loop);

/**
 * loop_since - what a handler finds ready came since then, unless it left it unread before: its descriptor was last
 * seen not to be ready. That is at most some 50 ms ago, or the process was held up.
 */
uint64_t loop_since(const struct loop *loop);

/**
 * loop_reread - reads the clock in the middle of a turn; loop_now is that from then on. What a handler read before has
 * come by then, and not by the time of the look: the process may have been held up since.
 */
uint64_t loop_reread(struct loop *loop);

/** loop_advance - virtual clock only: set the time to t_ns (never back), firing the timers due up to it. */
void loop_advance(struct loop *loop, uint64_t t_ns);

/** loop_skip - virtual clock only: set the time to t_ns (never back) at once; what is due by then fires once. */
void loop_skip(struct loop *loop, uint64_t t_ns);

void loop_quit(struct loop *loop);

#endif
