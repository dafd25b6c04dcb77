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

#include "text.h"

enum rpc_code {
    RPC_PARSE_ERROR = -32700,
    RPC_INVALID_REQUEST = -32600,
    RPC_METHOD_NOT_FOUND = -32601,
    RPC_INVALID_PARAMS = -32602,
    RPC_INTERNAL_ERROR = -32603,
    RPC_FORBIDDEN = -32001, /* this client may ask but not change */
    RPC_LIMIT = -32000,     /* a limit of the server was reached; the message says which */
    RPC_UNFINISHED = 1,     /* in no reply: the method has done a part, and is called again for the next */
};

#define RPC_LINE_MAX  65536 /* longest request line, without the newline */
#define RPC_BATCH_MAX 16
#define RPC_DEPTH_MAX 16        /* nesting of arrays and objects in a request */
#define RPC_REPLY_MAX (4 << 20) /* results in one reply line; errors and ids add at most twice RPC_LINE_MAX */

struct rpc_error {
    int code;          /* 0: none */
    char message[640]; /* one sentence: what, which parameter, what would be right */
};

struct rpc_counts {
    uint64_t requests, errors; /* requests seen, each of a batch counted; error replies given */
};

/* What a method keeps from one part of a long work to the next. */
struct rpc_work {
    void *state;               /* NULL at the first part, and when the method has taken it back */
    void (*drop)(void *state); /* the request ends with a state left: its client has gone, or it was refused */
    bool waits;                /* for others, who do a part: it need not be called before they may have done it */
};

/* Who asks, at what time. */
struct rpc_call {
    void *daemon;              /* handed through to the methods */
    void *client;              /* handed through; NULL outside the server */
    uint64_t now_ns;           /* monotonic */
    const char *refusal;       /* why this client may not change anything; NULL: it may */
    struct rpc_counts *counts; /* counted up by rpc_begin and rpc_step; may be NULL */
    struct rpc_work *work;     /* of this request, or of what is watched */
};

/* Returns a new reference to the result, or NULL with *error set. params is an object (empty when absent) - requests
 * with params by position are refused before. */
typedef json_t *(*rpc_method_fn)(const struct rpc_call *call, json_t *params, struct rpc_error *error);

/* The same, with the result written behind what is in *out: for those that are asked often, or answer at length. False
 * with *error set: what was written is cut away, but between the parts of a long work (RPC_UNFINISHED). */
typedef bool (*rpc_write_fn)(const struct rpc_call *call, json_t *params, struct text *out,
                             struct rpc_error *error);

/* What calling a method takes. */
enum rpc_right {
    RPC_ASKS,    /* everybody who may connect */
    RPC_CHANGES, /* something in the daemon or on its disk: not for everybody, and cannot be watched */
};

struct rpc_method {
    const char *name; /* NULL ends the table */
    rpc_method_fn fn; /* NULL: it has ... */
    enum rpc_right right;
    rpc_write_fn write;
};

/*
 * A line is answered in steps of one request, so that who has other things to do can do them in the middle of a
 * batch: rpc_begin, rpc_step until it says that nothing is left (it may say so at once), rpc_end.
 */
struct rpc_job;

/** rpc_begin - read one line; any bytes are allowed, and they are not needed afterwards. NULL without memory. */
struct rpc_job *rpc_begin(const struct rpc_call *call, const char *line, size_t n);

/**
 * rpc_step - handle the next request of the line, or the next part of it. True when more is left. A result beyond
 * RPC_REPLY_MAX, the others of the line included, is replaced by the error RPC_LIMIT.
 */
bool rpc_step(struct rpc_job *job, const struct rpc_method *methods, const struct rpc_call *call);

/** rpc_waits - rpc_step is of no use before others have done something; rpc_go_on - they may have. */
bool rpc_waits(const struct rpc_job *job);
void rpc_go_on(struct rpc_job *job);

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

/**
 * rpc_answer - call one method by name, its result behind what is in *out. False with *error set when it fails, is unknown
 * or not allowed: *out is as before. RPC_UNFINISHED: to be called once more, with *out as it is.
 */
bool rpc_answer(const struct rpc_method *methods, const struct rpc_call *call, const char *method, json_t *params,
                struct text *out, struct rpc_error *error);

/** rpc_refuse - fill *error with a sentence (bytes that JSON or a terminal would mind are replaced); returns false. */
bool rpc_refuse(struct rpc_error *error, int code, const char *fmt, ...) __attribute__((format(printf, 3, 4)));

/*
 * Parameter helpers: false with *error set (RPC_INVALID_PARAMS, naming the key, what was found and what is allowed)
 * when wrong. A missing optional key leaves *out as it is. Not finite numbers cannot come from JSON; ranges are closed.
 */
bool rpc_number(json_t *params, const char *key, bool required, double lo, double hi, double *out,
                struct rpc_error *error);
bool rpc_integer(json_t *params, const char *key, bool required, int64_t lo, int64_t hi, int64_t *out,
                 struct rpc_error *error);
/* [n] numbers each in [lo, hi]; *present says whether the key was there */
bool rpc_numbers(json_t *params, const char *key, double lo, double hi, size_t n, double *out, bool *present,
                 struct rpc_error *error);
/* one of the NULL-terminated words; *out its index */
bool rpc_word(json_t *params, const char *key, const char *const *words, int *out, struct rpc_error *error);
/* refuses keys that are not in the NULL-terminated list: a misspelt parameter must not be ignored */
bool rpc_only(json_t *params, const char *const *keys, struct rpc_error *error);

#endif
