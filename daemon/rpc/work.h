/* SPDX-License-Identifier: MIT */
/*
 * work - a request between two parts of a long answer: what it keeps, what follows, and what it waits for. Whoever has
 * done what it waits for resumes that request, and no other. All of it belongs to the loop.
 */
#ifndef SONARD_WORK_H
#define SONARD_WORK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct rpc_call;
struct rpc_error;
struct json_out;
struct shared;
struct shared_answer;

/* What follows the first part of a method (rpc_continue): as rpc_method_fn, with what was kept in work->state. */
typedef bool rpc_part_fn(const struct rpc_call *call, struct json_out *out, struct rpc_error *error);

struct rpc_work {
    void *state;               /* what the method keeps between parts; NULL: nothing */
    void (*drop)(void *state); /* the request ends with a state left: its client has gone, or it was refused */
    rpc_part_fn *part;         /* follows; NULL: nothing has started, or it is answered */
    bool postponed;            /* the method has done nothing yet and is called anew */
    size_t before;             /* bytes that were there before the answer: what is left of it when it fails */
    void (*resume)(void *ctx); /* has the request go on when it waits no more; NULL: it goes on in any case */
    void *ctx;
    bool waits;                /* nothing need be called before it is resumed */
    struct rpc_waiters *among; /* of these; NULL: of nobody else */
    struct shared *shared;     /* what it makes is for others as well (shared.h): ... */
    struct shared_answer *making;
    void (*abandon)(struct rpc_work *work); /* nobody makes it any more */
    uint64_t awaited; /* ... or it waits for the making of that number or a later one; 0: it does not */
    bool changes;     /* it changes something */
    struct rpc_work *next;
};

/* Requests that wait for the same, in their order. Zeroed at first. */
struct rpc_waiters {
    struct rpc_work *first;
};

/** rpc_work_keep - what the method wants to find at its next part. */
void rpc_work_keep(struct rpc_work *work, void *state, void (*drop)(void *state));

/** rpc_work_wait - until it is resumed with those, or, where they are NULL, by itself. */
void rpc_work_wait(struct rpc_work *work, struct rpc_waiters *waiters);

/** rpc_work_go_on - it waits no more; whoever goes on with it knows. */
void rpc_work_go_on(struct rpc_work *work);

/** rpc_work_resume - a struct rpc_work, if it waits, goes on. rpc_work_resume_all - those that wait there by now. */
void rpc_work_resume(void *work);
void rpc_work_resume_all(struct rpc_waiters *waiters);

/** rpc_work_let_go - what it makes for others as well (shared.h) is its own from now on: they make theirs. */
void rpc_work_let_go(struct rpc_work *work);

/** rpc_work_end - the request is answered, or its client has gone: drops what it keeps. */
void rpc_work_end(struct rpc_work *work);

#endif
