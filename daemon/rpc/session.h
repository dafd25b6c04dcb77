/* SPDX-License-Identifier: MIT */
/*
 * session - one client of the server: its descriptor, the lines that come in, the replies and notifications that go
 * out, its rate limit and its watches. Knows no other client.
 */
#ifndef SONARD_SESSION_H
#define SONARD_SESSION_H

#include <jansson.h>
#include <stdint.h>

#include "core/latency.h"
#include "core/log.h"
#include "core/loop.h"
#include "peer.h"
#include "rights.h"
#include "shares.h"
#include "rpc.h"
#include "server.h"
#include "watch.h"

struct session;

/* What all clients share; owned by the server, which outlives them. */
struct session_host {
    struct loop *loop;
    const struct rpc_method *methods; /* with method_watch and method_unwatch among them */
    void *daemon;
    bool no_rate_limit;
    uint64_t client_timeout_ns;
    struct rights rights;
    /* ends a client that has a greater share of all watches than `session` with such a share more; false: none has */
    bool (*make_room)(void *server, const struct session *session, double share);
    void *server;
    struct watch_sum watches;
    struct shared shared;
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

/**
 * session_idle_since - the time from which on it has not asked and has no watch, after client_timeout, or has not read
 * what waits for it. LOOP_NEVER: its place is not free for others; that of a client that may change something is so
 * only for another such client.
 */
uint64_t session_idle_since(const struct session *session, bool for_owner);

/** session_peer - who it is, as of when it came. */
const struct peer *session_peer(const struct session *session);

/** session_keep, session_is_kept - its place and its watches are kept for it. */
void session_keep(struct session *session, bool kept);
bool session_is_kept(const struct session *session);

/** session_watch_share - what its watches take of all that there is. */
double session_watch_share(const struct session *session);

/** session_share - its share, with that amount, of what others want; one that is working now is kept. */
struct share session_share(const struct session *session, double amount);

/** session_displace - tell it why, and end it now for another client; counted and logged as cut off. */
void session_displace(struct session *session, const char *why);

/** session_skipped - notifications that have been left out since those that were sent last. */
uint64_t session_skipped(const struct session *session);

/** session_tell - its watches of the method are due at once. */
void session_tell(struct session *session, const char *method);

/* The methods that need to know who asks; call->client is the session. */
rpc_method_fn method_watch;
rpc_method_fn method_unwatch;

#endif
