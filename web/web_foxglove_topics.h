/* SPDX-License-Identifier: MIT */
/*
 * web_foxglove_topics - what is told to Foxglove: each topic with its schema, the method that it is made from, and how.
 * Frames: "vehicle" is forward, left, up; "map" is east, north, up. Pure.
 */
#ifndef SONARD_WEB_FOXGLOVE_TOPICS_H
#define SONARD_WEB_FOXGLOVE_TOPICS_H

#include <jansson.h>

#include "web_rows.h"

struct web_topic {
    const char *topic; /* NULL ends the table; its place in it is the channel's id */
    const char *schema_name, *schema;
    const char *method; /* what is asked, with these parameters (JSON) */
    const char *params;
    /* A message; NULL: there is nothing to tell now. `result` is that of the method, or NULL for image: then rows.
     * What has no time of its own gets now_unix. */
    json_t *(*make)(const json_t *result, const struct web_rows *rows, double now_unix);
};

extern const struct web_topic web_topics[];

#endif
