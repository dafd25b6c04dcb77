/* SPDX-License-Identifier: MIT */
/*
 * watch - what one client wants to be told again and again: a method, its parameters and a rate. Knows when a
 * notification is due and how it reads; whether the client can take it now is its owner's matter.
 */
#ifndef SONARD_WATCH_H
#define SONARD_WATCH_H

#include <jansson.h>
#include <stdbool.h>
#include <stdint.h>

#include "loop.h"
#include "rpc.h"

#define WATCH_MAX         16 /* per client */
#define WATCH_RATE_MIN_HZ 0.1
#define WATCH_RATE_MAX_HZ 50.0

struct watch_set;

struct watch {
    struct watch_set *set;
    int64_t id;         /* 0: free */
    const char *method; /* in the table of methods */
    json_t *params;
    uint64_t period_ns;
    bool late;            /* a notification is due that the client could not take */
    uint64_t skipped;     /* notifications replaced by a newer one since the last that was sent */
    struct rpc_work work; /* of the notification that is being written ... */
    struct text text;     /* ... here, in parts */
    bool begun;           /* its first `head` bytes come before the result */
    size_t head;
    struct loop_timer timer;
};

/* All watches of one client. The owner sets the first five, the rest is zero at first. */
struct watch_set {
    struct loop *loop;
    const struct rpc_method *methods;
    void *daemon;
    void (*due)(void *ctx, struct watch *watch, uint64_t now_ns); /* must not remove watches */
    void *ctx;
    int64_t last_id;
    struct watch watch[WATCH_MAX];
};

/**
 * watch_add - {method, params = {}, rate_hz = 1}: result {watch: id}; the first notification is due at once. NULL
 * with *error set for methods that are unknown or change something, and beyond WATCH_MAX.
 */
json_t *watch_add(struct watch_set *set, json_t *params, uint64_t now_ns, struct rpc_error *error);

/** watch_remove - {watch}: result {watch: id}; NULL with *error set when this client has no such watch. */
json_t *watch_remove(struct watch_set *set, json_t *params, struct rpc_error *error);

/** watch_due_now - what this method tells has changed: its watches are due at once. */
void watch_due_now(struct watch_set *set, const char *method, uint64_t now_ns);

bool watch_any(const struct watch_set *set);

/** watch_clear - remove all. */
void watch_clear(struct watch_set *set);

/** watch_postpone - the client cannot take the due notification: the newest is sent later, others count as skipped. */
void watch_postpone(struct watch *watch);

/** watch_write - ask the method now for the notification that is due. True when more is left: call again. */
bool watch_write(struct watch *watch, uint64_t now_ns);

/** watch_take - the notification's line when it is all written, for free() (NULL without memory). Clears late, skipped. */
char *watch_take(struct watch *watch);

#endif
