/* SPDX-License-Identifier: MIT */
/*
 * web_server - HTTP: the page, GET /api/METHOD?param=..., /metrics, /api/openapi.json, and upgrades to a WebSocket.
 * Over HTTP nothing can be changed; over the WebSocket, settings with a token (web_settings.h), and where a
 * capture is played. Connections, requests, times and memory are bounded.
 */
#ifndef SONARD_WEB_SERVER_H
#define SONARD_WEB_SERVER_H

#include <stdbool.h>

#include "core/fault.h"
#include "web_guard.h"

struct web_server_conf {
    const char *socket;  /* of the daemon; NULL: as libsonard has it */
    const char *address; /* to listen at; NULL: all */
    int port;
    struct web_guard guard;
    const char *settings, *token; /* files: what pages may change, and with what; NULL: nothing */
    bool replay;                  /* pages may pause a capture that is played, and jump in it */
};

struct web_server;

/** web_server_new - listens. NULL with a sentence in fault. */
struct web_server *web_server_new(const struct web_server_conf *conf, struct fault *fault);

/** web_server_turn - handles what comes, until something does; false: it cannot go on. */
bool web_server_turn(struct web_server *server);

/** web_server_wake - end the turn; safe in a signal handler. */
void web_server_wake(struct web_server *server);

void web_server_free(struct web_server *server);

#endif
