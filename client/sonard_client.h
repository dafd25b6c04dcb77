/* SPDX-License-Identifier: MIT */
/*
 * sonard_client - talk to a sonard over its UNIX socket: call a method, read notifications. Knows no method by name.
 *
 * Two ways of use. Waiting: sonard_call and sonard_next, each with a timeout. In a loop of one's own, which never
 * waits: sonard_connect with timeout 0, poll sonard_fd for sonard_events, sonard_send to ask, sonard_take with timeout 0
 * for whatever came, replies (by the number that sonard_send gave) and notifications alike.
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

/* What the daemon said. */
struct sonard_message {
    json_int_t id;   /* of the request that it answers; 0: a notification, or an error about no request */
    json_t *content; /* new reference: the result, or a notification's params; NULL: refused */
    struct sonard_error refusal; /* SONARD_REFUSED when refused, otherwise all zeros */
};

/**
 * sonard_connect - to the socket at `path`. NULL with *error set. timeout_s holds for every later sonard_call too; 0:
 * connect at once or not at all (SONARD_SILENT: the daemon takes no new clients now).
 */
struct sonard_client *sonard_connect(const char *path, double timeout_s, struct sonard_error *error);

void sonard_disconnect(struct sonard_client *client);

/** sonard_fd - to poll for sonard_events; when ready, sonard_take with timeout_s 0 until it says SONARD_SILENT. */
int sonard_fd(const struct sonard_client *client);

/** sonard_events - POLLIN, and POLLOUT while requests wait to be written. */
short sonard_events(const struct sonard_client *client);

/**
 * sonard_send - ask without waiting: the number of the request, or 0 with *error set. What the daemon does not read at
 * once waits, up to 64 KiB; then SONARD_SILENT. params as in sonard_call.
 */
json_int_t sonard_send(struct sonard_client *client, const char *method, json_t *params,
                       struct sonard_error *error);

/**
 * sonard_take - the next message, waiting at most timeout_s (0: only what is there); writes what waits, too. False
 * with *error set; SONARD_SILENT: none came.
 */
bool sonard_take(struct sonard_client *client, double timeout_s, struct sonard_message *out,
                 struct sonard_error *error);

/**
 * sonard_call - call `method` with params (an object, borrowed; NULL: none). New reference to the result, or NULL
 * with *error set. Notifications that come in between are kept for sonard_next, the newest 64; replies to
 * sonard_send are thrown away.
 */
json_t *sonard_call(struct sonard_client *client, const char *method, json_t *params, struct sonard_error *error);

/**
 * sonard_next - the next notification, waiting at most timeout_s (0: only what is there): new reference to its
 * params (of a watch: {watch, method, result or error, skipped?}), or NULL with *error set; SONARD_SILENT: none came.
 */
json_t *sonard_next(struct sonard_client *client, double timeout_s, struct sonard_error *error);

#endif
