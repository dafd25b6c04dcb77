/* SPDX-License-Identifier: MIT */
/*
 * web_foxglove - the Foxglove WebSocket protocol (sub-protocols "foxglove.websocket.v1" and "foxglove.sdk.v1", which
 * differ in nothing that is used here) for Foxglove, Lichtblick and others: the topics of view_topics.h as Protocol
 * Buffers, made from what the board has, once for all clients. A client gets the newest of what it subscribed to as
 * fast as it reads, and can publish and change nothing.
 */
#ifndef SONARD_WEB_FOXGLOVE_H
#define SONARD_WEB_FOXGLOVE_H

#include "client/view/bytes.h"
#include "client/view/view_topics.h"
#include "web_board.h"

#define WEB_FOXGLOVE_MAX      8 /* clients at a time */
#define WEB_FOXGLOVE_NAME     "foxglove.websocket.v1"
#define WEB_FOXGLOVE_SDK_NAME "foxglove.sdk.v1"

struct web_foxglove_session;

/* The newest message of a topic, for whoever subscribed. */
struct web_foxglove_told {
    struct bytes message;
    bool there;       /* nothing of the topic can be told otherwise */
    uint64_t number;  /* of the message; 0: none yet */
    uint64_t version; /* of the channel that it is of; 0: of none */
    uint64_t made_us;
};

struct web_foxglove {
    struct web_board *board;
    /* the rest is its own */
    struct web_foxglove_told told[VIEW_TOPICS];
    lws_sorted_usec_list_t timer; /* for what was told a moment ago */
    uint64_t wake_us;             /* when it rings; 0: never */
    struct web_foxglove_session *first;
    unsigned sessions;
};

/** web_foxglove_protocol - of that name; its user is the struct web_foxglove, with board set and the rest zero. */
struct lws_protocols web_foxglove_protocol(struct web_foxglove *foxglove, const char *name);

/** web_foxglove_news - the board has something newer in a channel. */
void web_foxglove_news(struct web_foxglove *foxglove, const struct web_channel *channel);

/** web_foxglove_link_changed - the daemon is gone or another one. */
void web_foxglove_link_changed(struct web_foxglove *foxglove);

/** web_foxglove_stop - tells nothing any more. */
void web_foxglove_stop(struct web_foxglove *foxglove);

#endif
