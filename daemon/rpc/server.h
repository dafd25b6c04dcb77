/* SPDX-License-Identifier: MIT */
/*
 * server - the UNIX stream socket: clients, their lines, their watches. All in the loop's thread. Requests are
 * newline-delimited JSON-RPC 2.0 (rpc.h). A client that does not read gets the newest state, not a growing queue;
 * one that misbehaves is cut off and nobody else notices.
 */
#ifndef SONARD_SERVER_H
#define SONARD_SERVER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/fault.h"
#include "core/latency.h"
#include "core/loop.h"
#include "core/worker.h"
#include "rpc.h"

struct server;

struct server_conf {
    const char *path;      /* of the socket; a stale file is replaced, a living one refuses the start */
    unsigned mode;         /* permission bits of the socket */
    int inherited_fd;      /* listens already and belongs to others: path and mode are theirs; 0: none */
    const char *change;    /* who may change something, see rights_set, ... */
    const char *keep;      /* for whom places and watches are kept, see keep_set, ... */
    struct worker *worker; /* ... and who looks names up that server_set_names tells; it ends after the server */
    int max_clients;
    int kept_clients; /* places beyond max_clients for those that may change something */
    /* who reads nothing for so long is cut off; who asks nothing for so long makes room for others */
    uint64_t client_timeout_ns;
    /* for a replay, whose clock may stand: then nothing would end the pause of a busy client */
    bool no_rate_limit;
    /* counts what changes answers beside clients and the loop's turns; NULL: nothing does */
    uint64_t (*pings)(void *daemon);
    uint64_t (*clock)(void); /* measures the work done for clients, in nanoseconds; NULL: loop_clock */
};

struct server_stats {
    uint64_t clients_now, clients_total, clients_refused,
        clients_cut; /* cut: for flooding, overlong lines, not reading */
    uint64_t requests, errors, notifications_sent, notifications_skipped;
};

/**
 * server_start - listen. `methods` must not contain "watch" and "unwatch": the server has these itself.
 * NULL with a sentence in fault.
 */
struct server *server_start(struct loop *loop, const struct server_conf *conf, const struct rpc_method *methods,
                            void *daemon, struct fault *fault);

/**
 * server_set_names - from now on these may change something, see rights_set, and for those places are kept, see
 * keep_set; also of the clients that are there. Names are looked up by the worker; until it has them, new ones give
 * nobody a right, and only programs are known by them.
 */
void server_set_names(struct server *server, const char *change, const char *keep);

/** server_path - where it listens; lives as long as the server. */
const char *server_path(const struct server *server);

/** server_stop - answer nothing more, close all, remove the socket file when it made it. */
void server_stop(struct server *server);

/** server_tell - what this method answers has changed in a way that its watchers should know at once. */
void server_tell(struct server *server, const char *method);

void server_stats(const struct server *server, struct server_stats *out);

/** server_latency - the time spent on each request and notification. */
struct latency *server_latency(struct server *server);

#endif
