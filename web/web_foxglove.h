/* SPDX-License-Identifier: MIT */
/*
 * web_foxglove - the Foxglove WebSocket protocol (sub-protocol "foxglove.websocket.v1") for Foxglove Studio, Lichtblick
 * and others: topics in JSON with the schemas of foxglove.dev, made from what the board has. A client gets the newest
 * of what it subscribed to as fast as it reads, and can publish and change nothing.
 */
#ifndef SONARD_WEB_FOXGLOVE_H
#define SONARD_WEB_FOXGLOVE_H

#include "web_board.h"

#define WEB_FOXGLOVE_MAX 8 /* clients at a time */

struct web_foxglove_session;

struct web_foxglove {
    struct web_board *board;
    /* the rest is its own */
    struct web_foxglove_session *first;
    unsigned sessions;
};

/** web_foxglove_protocol - its user is the struct web_foxglove, with board set and the rest zero. */
struct lws_protocols web_foxglove_protocol(struct web_foxglove *foxglove);

/** web_foxglove_news - the board has something newer in a channel. */
void web_foxglove_news(struct web_foxglove *foxglove, const struct web_channel *channel);

/** web_foxglove_link_changed - the daemon is gone or another one. */
void web_foxglove_link_changed(struct web_foxglove *foxglove);

#endif
