/* SPDX-License-Identifier: MIT */
/*
 * ros2 - the topics of view_topics.h as messages of ROS 2's common interfaces: frames, units and meanings are the same
 * there (REP 103, REP 117), the fields are not. What ROS has no message for is left out.
 */
#ifndef SONARD_ROS2_H
#define SONARD_ROS2_H

#include <jansson.h>

#include "message.h"

struct ros2_topic {
    const char *topic; /* as in view_topics */
    const struct message_type *type;
    json_t *(*convert)(const json_t *message); /* a message of the type, of one of the topic's */
};

/** ros2_topic - of that name, or NULL: ROS has no message for it. */
const struct ros2_topic *ros2_topic(const char *topic);

#endif
