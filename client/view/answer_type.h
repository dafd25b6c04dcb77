/* SPDX-License-Identifier: MIT */
/*
 * answer_type - results of methods as types of messages, by the tables of the protocol: sonard.sectors has the fields
 * of the method's result, numbered in their order. Words and what has no type of its own are text; a number that may
 * be null is a double, and then NaN.
 */
#ifndef SONARD_ANSWER_TYPE_H
#define SONARD_ANSWER_TYPE_H

#include "message.h"
#include "protocol/protocol.h"

/** answer_type - of the method of that name; stays until the end of the process. NULL: no memory, or no such method. */
const struct message_type *answer_type(const char *method);

#endif
