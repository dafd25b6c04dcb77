/* SPDX-License-Identifier: MIT */
/*
 * rpc - JSON-RPC 2.0 on text: one request line in, one reply line (or none) out. Knows no socket and no sonar; the
 * methods come as a table. Batches, notifications and the standard error codes as the specification has them.
 */
#ifndef SONARD_RPC_H
#define SONARD_RPC_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "params.h"
#include "json_out.h"
#include "rpc_error.h"
#include "shared.h"
#include "work.h"

#define RPC_LINE_MAX  65536 /* longest request line, without the newline */
#define RPC_BATCH_MAX 16
#define RPC_DEPTH_MAX 16        /* nesting of arrays and objects in a request */
#define RPC_REPLY_MAX (4 << 20) /* results in one reply line; errors and ids add at most twice RPC_LINE_MAX */

struct rpc_counts {
    uint64_t requests, errors; /* requests seen, each of a batch counted; error replies given */
};

/* Who asks, at what time. */
struct rpc_call {
    void *daemon;                 /* handed through to the methods */
    void *client;                 /* handed through; NULL outside the server */
    uint64_t now_ns;              /* monotonic */
    uint64_t waited_ns;           /* the line may have waited so long to be read and handled */
    const char *refusal;          /* why this client may not change anything; NULL: it may */
    void (*resume)(void *client); /* what waits goes on; NULL: it is called in any case */
    struct rpc_counts *counts;    /* counted up by rpc_begin and rpc_step; may be NULL */
    struct rpc_work *work;        /* of this request, or of what is watched */
    struct shared *shared;        /* answers that others may have, too; NULL: none */
};

/* Writes the result behind what is in *out. False with *error set: what was written is cut away. A long answer is
 * written in parts: `return rpc_continue(call, part)`. params is an object (empty when absent) - requests with params
 * by position are refused before. */
typedef bool rpc_method_fn(const struct rpc_call *call, json_t *params, struct json_out *out,
                           struct rpc_error *error);

/* What calling a method takes. */
enum rpc_right {
    RPC_ASKS,    /* everybody who may connect */
    RPC_CHANGES, /* something in the daemon or on its disk: not for everybody, and cannot be watched */
    RPC_OWN,     /* everybody, about himself: nobody else has that answer, and it cannot be watched */
};

struct rpc_method {
    const char *name; /* NULL ends the table */
    rpc_method_fn *fn;
    enum rpc_right right;
    const struct protocol_method *row; /* its parameters are taken by this; NULL: as they come */
};

/*
 * A line is answered in steps of one request, so that who has other things to do can do them in the middle of a
 * batch: rpc_begin, rpc_step until it says that nothing is left (it may say so at once), rpc_end.
 */
struct rpc_job;

/** rpc_begin - read one line; any bytes are allowed, and they are not needed afterwards. NULL without memory. */
struct rpc_job *rpc_begin(const struct rpc_call *call, const char *line, size_t n);

/** rpc_let_go - it cannot go on for the present: nobody else is to wait for the answer that it makes. */
void rpc_let_go(struct rpc_job *job);

/**
 * rpc_step - handle the next request of the line, or the next part of it. True when more is left. A result beyond
 * RPC_REPLY_MAX, the others of the line included, is replaced by the error RPC_LIMIT.
 */
bool rpc_step(struct rpc_job *job, const struct rpc_method *methods, const struct rpc_call *call);

/** rpc_waits - rpc_step is of no use before the request is resumed (work.h). */
bool rpc_waits(const struct rpc_job *job);

/**
 * rpc_end - free the job, also an unfinished one. *reply is malloced text without newline for free(), or NULL when
 * there is nothing to answer (notifications). False without memory for it.
 */
bool rpc_end(struct rpc_job *job, char **reply);

/** rpc_refusal - the line that tells a client which limit (RPC_LIMIT) it met outside any request; for free(). */
char *rpc_refusal(const char *message);

/** rpc_find - the row of a method, or NULL. */
const struct rpc_method *rpc_find(const struct rpc_method *methods, const char *name);

/** rpc_refuse_method - there is no such method: false, with the name that may have been meant in *error. */
bool rpc_refuse_method(const struct rpc_method *methods, const char *name, struct rpc_error *error);

enum rpc_outcome {
    RPC_FAILED,   /* *error says why; *out is as before */
    RPC_ANSWERED, /* the result is behind what was in *out */
    RPC_MORE,     /* a part of it: call again, with *out as it is, unless the request waits */
};

/** rpc_answer - call one method by name, or what follows of it. It fails when it is unknown or not allowed, too. */
enum rpc_outcome rpc_answer(const struct rpc_method *methods, const struct rpc_call *call, const char *method,
                            json_t *params, struct json_out *out, struct rpc_error *error);

/**
 * rpc_continue - the answer is not whole yet: `part` is called for the next, at once or, where the request waits
 * (work.h), when it is resumed. rpc_postpone - the method has done nothing: it is called anew when those waiters are
 * resumed, and the client's right asked again. Both return false, for the method to return.
 */
bool rpc_continue(const struct rpc_call *call, rpc_part_fn *part);
bool rpc_postpone(const struct rpc_call *call, struct rpc_waiters *waiters);

#endif
