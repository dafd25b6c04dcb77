/* SPDX-License-Identifier: MIT */
/*
 * message - types of messages as data: what a message is called, and the name, number and kind of each of its fields.
 * A message of a type is a JSON object with members of these names, with two liberties that JSON has not: a string may
 * hold any bytes, and a number may be null (none: NaN) or the string "inf".
 */
#ifndef SONARD_MESSAGE_H
#define SONARD_MESSAGE_H

#include <stdbool.h>

/* Numbered as Protocol Buffers number the types of fields; those from 100 on only ROS has. */
enum message_kind {
    MESSAGE_DOUBLE = 1,
    MESSAGE_FLOAT = 2,
    MESSAGE_INT64 = 3,
    MESSAGE_INT32 = 5,
    MESSAGE_FIXED32 = 7,
    MESSAGE_FLAG = 8,
    MESSAGE_TEXT = 9,
    MESSAGE_OBJECT = 11,
    MESSAGE_BYTES = 12,
    MESSAGE_WORD = 14, /* one of a list, as its place there */
    MESSAGE_UINT8 = 100,
    MESSAGE_SIGNED_BYTES, /* as MESSAGE_BYTES, which a reader takes for numbers with a sign */
};

struct message_type;

struct message_field {
    const char *name; /* NULL ends the list */
    int number;       /* of Protocol Buffers */
    enum message_kind kind;
    bool repeated;
    bool maybe;                    /* a number that is null is told, as NaN, and not left out */
    const struct message_type *of; /* MESSAGE_OBJECT */
    const char *words;             /* MESSAGE_WORD: the name of the list and its words, "Level: UNKNOWN DEBUG" */
};

struct message_type {
    const char *name; /* with its package: foxglove.Log, std_msgs/msg/Header */
    const struct message_field *fields;
};

#endif
