/* SPDX-License-Identifier: MIT */
/*
 * sonard_client - talk to a sonard over its UNIX socket: call a method, read notifications. Blocking, each call with
 * the client's timeout; the descriptor may be polled in a loop of one's own. Knows no method by name.
 */
#ifndef SONARD_CLIENT_H
#define SONARD_CLIENT_H

#include <jansson.h>
#include <stdbool.h>

#define SONARD_DEFAULT_SOCKET "/run/sonard/sonard.sock"

enum sonard_status {
    SONARD_OK,
    SONARD_NO_DAEMON,     /* nobody listens at the path */
    SONARD_NO_PERMISSION, /* the socket is there, this user may not use it */
    SONARD_SILENT,        /* no answer within the timeout */
    SONARD_LOST,          /* the connection ended, or what came was no JSON-RPC */
    SONARD_REFUSED,       /* the daemon answered with an error: rpc_code */
};

struct sonard_error {
    enum sonard_status status;
    int rpc_code;      /* SONARD_REFUSED only */
    char message[512]; /* one sentence */
};

struct sonard_client;

/** sonard_connect - to the socket at `path`. NULL with *error set. timeout_s > 0 holds for every later call. */
struct sonard_client *sonard_connect(const char *path, double timeout_s, struct sonard_error *error);

void sonard_disconnect(struct sonard_client *client);

/** sonard_fd - to poll for reading: when ready, sonard_next with timeout_s 0 takes what came. */
int sonard_fd(const struct sonard_client *client);

/**
 * sonard_call - call `method` with params (an object, borrowed; NULL: none). New reference to the result, or NULL
 * with *error set. Notifications that come in between are kept for sonard_next, the newest 64.
 */
json_t *sonard_call(struct sonard_client *client, const char *method, json_t *params, struct sonard_error *error);

/**
 * sonard_next - the next notification, waiting at most timeout_s (0: only what is there): new reference to its
 * params (of a watch: {watch, method, result or error, skipped?}), or NULL with *error set; SONARD_SILENT: none came.
 */
json_t *sonard_next(struct sonard_client *client, double timeout_s, struct sonard_error *error);

#endif
