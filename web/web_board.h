/* SPDX-License-Identifier: MIT */
/*
 * web_board - what is shown live: each method that somebody looks at is asked once for all who do, never again before
 * its answer has come, and its newest answer stands here with a number. Who is slow reads the newest and misses the
 * rest; what nobody looks at is not asked.
 */
#ifndef SONARD_WEB_BOARD_H
#define SONARD_WEB_BOARD_H

#include "web_link.h"
#include "client/view/view_rows.h"

#define WEB_BOARD_CHANNELS 32

struct web_channel {
    const char *method; /* NULL: free */
    json_t *params;
    unsigned users;
    bool asked;
    uint64_t due_us;
    uint64_t asked_us;
    uint64_t version;       /* of text, or of a refusal; 0: nothing yet */
    char *text;             /* {"method", "params", "result" or "error"}, behind LWS_PRE bytes of room */
    size_t size;            /* of the text */
    json_t *result;         /* that the text has; NULL: none */
    struct view_rows *rows; /* of the method image, which has no text unless it is refused */
    double newer_s;         /* rows that were asked for last; 0: all. Used with rows */
    bool whole;             /* some may be missing: all are asked for next */
    struct web_board *board;
};

struct web_board {
    struct web_link *link;
    void (*news)(void *ctx, const struct web_channel *channel);
    void *ctx;
    /* the rest is the board's own */
    lws_sorted_usec_list_t timer;
    struct web_channel channel[WEB_BOARD_CHANNELS];
};

/**
 * web_board_open - look at a method that may be asked (web_query_method): params (an object) are borrowed. The channel,
 * shared with all who look at the same; NULL: there are too many, or no memory.
 */
struct web_channel *web_board_open(struct web_board *board, const char *method, json_t *params);

/** web_board_close - look no longer. */
void web_board_close(struct web_channel *channel);

/** web_board_reset - the daemon is gone or another one: what it said is not shown any more. */
void web_board_reset(struct web_board *board);

/** web_board_stop - asks nothing any more. */
void web_board_stop(struct web_board *board);

#endif
