/* SPDX-License-Identifier: MIT */
/*
 * web_live - the WebSocket of the page, sub-protocol "sonard". A page says what it looks at, {"watch": [{"method",
 * "params"}, ...]}, and gets {"method", "params", "result" or "error"} whenever there is a newer answer; of the method
 * image it gets binary messages (view_rows.h). {"id", "method", "params"} is answered by {"id", "result" or "error"}.
 * The method "settings" with {"token", "text"} is this program's own: see web_settings.h; its result is {"applied"}.
 * The first message, and one whenever it changes, is {"method": "link", "result": {"connection", "fault",
 * "replay"}}: with another connection, what came before is void; replay: the method of that name may be called. A
 * slow page gets the newest answers; nothing else is kept for it.
 */
#ifndef SONARD_WEB_LIVE_H
#define SONARD_WEB_LIVE_H

#include "web_board.h"
#include "web_budget.h"
#include "web_settings.h"

#define WEB_LIVE_MAX 32 /* pages at a time */

struct web_live_session;
struct ask;

struct web_live {
    struct web_board *board;
    struct web_link *asks; /* for questions of pages */
    struct web_budget *budget;
    struct web_settings *settings; /* what a page may change */
    bool replay;                   /* a page may call the method replay */
    /* the rest is its own */
    struct web_live_session *first;
    unsigned sessions;
    unsigned connection; /* counts connections to the daemon, made and lost */
    enum { WEB_LIVE_IDLE, WEB_LIVE_CHANGING, WEB_LIVE_LOST } phase; /* of a change; lost: so was its answer */
    struct ask *changer;             /* question that it is of; NULL: none, or its page is gone */
    size_t changed_key;              /* bytes of "[section] key" ... */
    char changed[WEB_SETTINGS_LINE]; /* ... in this text */
};

/** web_live_protocol - its user is the struct web_live, with board, asks and budget set and the rest zero. */
struct lws_protocols web_live_protocol(struct web_live *live);

/** web_live_news - the board has something newer in a channel. */
void web_live_news(struct web_live *live, const struct web_channel *channel);

/** web_live_link_changed - the board's link was made or lost; the board was reset. */
void web_live_link_changed(struct web_live *live);

/** web_live_asks_changed - the link of questions was made or lost: a change whose answer was lost is taken back. */
void web_live_asks_changed(struct web_live *live);

#endif
