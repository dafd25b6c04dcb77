/* SPDX-License-Identifier: MIT */
/*
 * view_topics - what viewers of robots are shown: each topic with the type of its messages, the method that they are
 * made from, how often at most, and how. Frames: "vehicle" is forward, left, up; "map" is east, north, up. Pure.
 */
#ifndef SONARD_VIEW_TOPICS_H
#define SONARD_VIEW_TOPICS_H

#include <jansson.h>
#include <stdbool.h>
#include <stdint.h>

#include "message.h"
#include "view_rows.h"

/* What there is to make messages from. */
struct view_source {
    const json_t *result;         /* of the topic's method; NULL for image: */
    const struct view_rows *rows; /* then these */
    double now_unix;              /* for what has no time of its own */
};

/* How far a reader of a topic has come; all zeros at first. */
struct view_cursor {
    uint64_t row; /* number of the last change of a row */
    json_t *said; /* for json_decref: the newest sentence of each name */
};

struct view_topic {
    const char *topic;               /* NULL ends the table; its place in it is the channel's id */
    const struct message_type *type; /* NULL: answer_type of the method */
    const char *method;              /* what is asked, with these parameters (JSON) */
    const char *params;
    double period_s; /* at least so long between two of what is made of one source */
    bool one_by_one; /* make is called until it has nothing more */
    /* A message (message.h), or NULL: there is nothing to tell now. */
    json_t *(*make)(const struct view_source *source, struct view_cursor *cursor);
};

#define VIEW_TOPICS 11

extern const struct view_topic view_topics[VIEW_TOPICS + 1];

/** view_topic_type - of its messages; NULL: no memory. */
const struct message_type *view_topic_type(const struct view_topic *topic);

#endif
