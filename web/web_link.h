/* SPDX-License-Identifier: MIT */
/*
 * web_link - a connection to the daemon within the event loop of libwebsockets: requests with a function for their
 * answer. A lost or silent daemon fails what waits, and is tried again every second.
 */
#ifndef SONARD_WEB_LINK_H
#define SONARD_WEB_LINK_H

#include <jansson.h>
#include <libwebsockets.h>
#include <stdbool.h>
#include <stdint.h>

#include "client/lib/sonard.h"

#define WEB_LINK_WAITING_MAX 64 /* requests that wait for their answer */

struct web_answer {
    json_t *result;      /* borrowed; NULL: refused or lost */
    int rpc_code;        /* of a refusal; 0: the daemon did not answer */
    const char *message; /* why there is no result: one sentence */
    uint64_t cpu_us;     /* that reading it took */
};

typedef void web_answer_fn(void *ctx, const struct web_answer *answer);

struct web_request {
    int64_t id; /* 0: free */
    uint64_t sent_us;
    web_answer_fn *done; /* NULL: nobody wants the answer any more */
    void *ctx;
};

struct web_link {
    const char *path; /* of the socket; NULL: as libsonard has it */
    struct lws_context *context;
    struct lws_vhost *vhost;
    void (*changed)(void *ctx); /* the connection was made or lost; NULL: nobody is told */
    void *ctx;
    /* the rest is the link's own */
    struct sonard_client *client; /* NULL: none */
    struct lws *wsi;              /* a duplicate of its descriptor, in the loop */
    struct sonard_error error;    /* why there is no connection */
    lws_sorted_usec_list_t timer;
    struct web_request waiting[WEB_LINK_WAITING_MAX];
};

/** web_link_protocol - what libwebsockets needs in the vhost's list of protocols. */
extern const struct lws_protocols web_link_protocol;

/** web_link_start - with path, context, vhost, changed and ctx set, the rest zero. Connects once the loop runs. */
void web_link_start(struct web_link *link);

/** web_link_stop - fails what waits. */
void web_link_stop(struct web_link *link);

/**
 * web_link_ask - done is called once with the answer, never before this returns; params (an object or NULL) are
 * borrowed. False: no daemon, or too much waits already; done is not called.
 */
bool web_link_ask(struct web_link *link, const char *method, json_t *params, web_answer_fn *done, void *ctx);

/** web_link_cancel - forget about the answers that ctx waits for. */
void web_link_cancel(struct web_link *link, const void *ctx);

/** web_link_state - NULL while there is a connection, otherwise why there is none. */
const char *web_link_state(const struct web_link *link);

#endif
