/* SPDX-License-Identifier: MIT */
/*
 * session - one client of the server: its descriptor, the lines that come in, the replies and notifications that go
 * out, its rate limit and its watches. Knows no other client.
 */
#ifndef SONARD_SESSION_H
#define SONARD_SESSION_H

#include <jansson.h>
#include <stdint.h>

#include "latency.h"
#include "log.h"
#include "loop.h"
#include "rights.h"
#include "rpc.h"
#include "server.h"

struct session;

/* What all clients share; owned by the server, which outlives them. */
struct session_host {
    struct loop *loop;
    const struct rpc_method *methods; /* with session_watch and session_unwatch among them */
    void *daemon;
    bool no_rate_limit;
    struct rights rights;
    uint64_t (*clock)(void); /* measures the work done for clients, in nanoseconds */
    struct server_stats stats;
    struct rpc_counts counts;
    struct latency spent; /* on each request and notification */
};

/**
 * session_open - serve the connected, non-blocking descriptor `fd`, which it owns from now on. *slot points to the
 * session until it ends by itself (client gone, or cut off), then it is NULL. False without memory; fd is closed.
 */
bool session_open(struct session_host *host, int fd, struct session **slot);

/** session_close - end it now. NULL is allowed. Not from within a method. */
void session_close(struct session *session);

/** session_judge - the rights of all have changed: find out anew what this client may. */
void session_judge(struct session *session);

/** session_go_on - if it waits for others (struct rpc_work), they may have done their part. It may end by itself. */
void session_go_on(struct session *session);

/** session_tell - its watches of the method are due at once. */
void session_tell(struct session *session, const char *method);

/* The methods that need to know who asks; call->client is the session. */
json_t *session_watch(const struct rpc_call *call, json_t *params, struct rpc_error *error);
json_t *session_unwatch(const struct rpc_call *call, json_t *params, struct rpc_error *error);

#endif
