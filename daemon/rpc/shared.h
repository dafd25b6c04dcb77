/* SPDX-License-Identifier: MIT */
/*
 * shared - what many ask alike is worked out once. A question is a method with its parameters; the first to ask makes
 * the answer, and whoever asks the same in the same state of the daemon has it, too. Whoever asks in a later state
 * while an answer is being made waits for the next, which all of them share: no answer is older than its question. One
 * that fails, or is too long to be kept, each asker makes for itself. All of it belongs to the loop.
 */
#ifndef SONARD_SHARED_H
#define SONARD_SHARED_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/loop.h"
#include "json_out.h"
#include "work.h"

#define SHARED_MAX       8          /* different questions at a time; those beyond are each answered alone */
#define SHARED_BYTES_MAX (1 << 18)  /* of an answer that is kept */
#define SHARED_KEPT_NS   500000000u /* for those who waited for it; whoever could not be served then has another */

struct rpc_method;

/* What is the same was asked in the same state of the daemon. */
struct shared_state {
    uint64_t turn, now_ns; /* of the loop */
    uint64_t changes;      /* by clients */
    uint64_t pings;        /* as the daemon counts what else may have changed */
};

struct shared_answer {
    const struct rpc_method *method; /* NULL: free */
    json_t *params;
    struct shared_state state; /* in which its making began */
    uint64_t number;           /* of the making, or of the last; counts up for each question */
    bool making, made, alone;  /* alone: it was too long to be kept */
    char *text;                /* [n], when made */
    size_t n;
    uint64_t made_ns;
    struct rpc_waiters waiters;
    uint64_t used; /* by which the one that was asked longest ago is replaced */
};

struct shared {
    struct loop *loop;               /* the owner sets all up to daemon, the rest is zero at first */
    uint64_t (*pings)(void *daemon); /* NULL: nothing changes but by the loop's turns and clients */
    void *daemon;
    uint64_t changes, uses;
    struct loop_timer resume; /* some who wait in every turn of the loop, so that they hold nobody up */
    struct shared_answer answer[SHARED_MAX];
};

enum shared_outcome {
    SHARED_TAKEN, /* the answer is behind what was in *out */
    SHARED_WAITS, /* the request waits for it, and asks again when it is resumed */
    SHARED_MAKE,  /* the request is to make it; with work->making for others as well */
};

/** shared_ask - for a request whose parameters are complete. */
enum shared_outcome shared_ask(struct shared *s, struct rpc_work *work, const struct rpc_method *method,
                               json_t *params, struct json_out *out);

/** shared_made - the answer of the request, for which others may wait. */
void shared_made(struct rpc_work *work, const char *text, size_t n);

/** shared_changed - a client has changed something: what was answered before holds no longer. */
void shared_changed(struct shared *s);

/** shared_end - nobody asks or waits any more. */
void shared_end(struct shared *s);

#endif
