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

#include "core/loop.h"
#include "rpc.h"

#define WATCH_MAX       16     /* per client */
#define WATCH_CLIENT_HZ 200.0  /* all watches of a client together */
#define WATCH_ALL_MAX   1024   /* of all clients together ... */
#define WATCH_ALL_HZ    4000.0 /* 64 clients with one at the greatest rate, and more */

/* The watches of all clients together. As much as one client may have is kept for those that may change something, and
 * whoever has less may have room made by who has most (make_room). */
struct watch_sum {
    int n;
    double rate_hz;
};

struct watch_set;

struct watch {
    struct watch_set *set;
    int64_t id;         /* 0: free */
    const char *method; /* in the table of methods */
    json_t *params;
    double rate_hz;
    uint64_t period_ns;
    bool late; /* a notification has been due since due_ns; the timer rests until it is taken */
    uint64_t due_ns;
    struct rpc_work work; /* of the notification that is being written ... */
    struct json_out text; /* ... here, in parts */
    bool started;         /* its first `head` bytes come before the result */
    size_t head;
    struct loop_timer timer;
};

/* All watches of one client. The owner sets all up to ctx, the rest is zero at first. */
struct watch_set {
    struct loop *loop;
    const struct rpc_method *methods;
    void *daemon;
    struct watch_sum *all;                   /* shared with the other clients */
    struct shared *shared;                   /* likewise; may be NULL */
    bool kept;                               /* may use what is kept for those that may change something */
    void (*due)(void *ctx, uint64_t now_ns); /* a watch has become late; must not remove watches */
    /* end another client that has more, for a further watch of such a share of all; false: none has; NULL: never */
    bool (*make_room)(void *ctx, double share);
    void (*resume)(void *ctx); /* what a watch waits for is done */
    void *ctx;
    int64_t last_id;
    struct watch watch[WATCH_MAX];
};

/**
 * watch_add - {method, params = {}, rate_hz = 1}: result {watch: id}; the first notification is due at once. False
 * with *error set for methods that are unknown or change something, and beyond the bounds of number and rate.
 */
bool watch_add(struct watch_set *set, json_t *params, uint64_t now_ns, struct json_out *out,
               struct rpc_error *error);

/** watch_remove - {watch}: result {watch: id}; false with *error set when this client has no such watch. */
bool watch_remove(struct watch_set *set, json_t *params, struct json_out *out, struct rpc_error *error);

/** watch_due_now - what this method tells has changed: its watches are due at once. */
void watch_due_now(struct watch_set *set, const char *method, uint64_t now_ns);

/** watch_share - what the watches of a client take of all there is; watch_share_of - what one of that rate does. */
double watch_share(const struct watch_set *set);
double watch_share_of(double rate_hz);

/** watch_let_go - nobody else is to wait for the notifications that are being written, see rpc_work_let_go. */
void watch_let_go(struct watch_set *set);

bool watch_any(const struct watch_set *set);

/** watch_clear - remove all. */
void watch_clear(struct watch_set *set);

/** watch_skipped - how many notifications newer ones have replaced since the last that was taken. */
uint64_t watch_skipped(const struct watch *watch, uint64_t now_ns);

/** watch_write - ask the method now for the notification that is due. True when more is left: call again. */
bool watch_write(struct watch *watch, uint64_t now_ns);

/** watch_take - the notification's line when it is all written, for free() (NULL without memory). The next one is due
 * at the next whole period. */
char *watch_take(struct watch *watch, uint64_t now_ns);

#endif
