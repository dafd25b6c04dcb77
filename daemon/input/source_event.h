/* SPDX-License-Identifier: MIT */
/*
 * source_event - what befalls a sonar beside the bytes that come, as a capture keeps it on the channel /NAME/events:
 * what its device was told, and the state that it was in then. With the bytes that is all that a device ever learns, so
 * a replay that tells it the same in the same order has the same pings. Each message is a JSON object. Knows no source.
 */
#ifndef SONARD_SOURCE_EVENT_H
#define SONARD_SOURCE_EVENT_H

#include <stdbool.h>
#include <stddef.h>

#include "core/fault.h"
#include "drivers/devices/device.h"

#define SOURCE_EVENT_TEXT_MAX 160

struct source_event {
    enum source_event_kind {
        SOURCE_OPENED, /* its port, and the device was told */
        SOURCE_CLOSED,
        SOURCE_TICK,  /* its deadline had come */
        SOURCE_LOOKS, /* as source_steer was told */
        SOURCE_STATE, /* so it is from now on; repeated, as a capture may begin at any time */
    } kind;
    double from_rad, to_rad; /* SOURCE_LOOKS */
    bool only;
    bool open; /* SOURCE_STATE: its port is */
    enum device_state state;
};

/** source_event_write - as a message; returns its bytes, without the NUL. */
size_t source_event_write(const struct source_event *event, char text[SOURCE_EVENT_TEXT_MAX]);

/** source_event_read - a message of n bytes from anywhere. False with what is wrong in fault. */
bool source_event_read(const void *text, size_t n, struct source_event *out, struct fault *fault);

/** source_state_word - the state of a sonar whose port is open, or not, for people and for captures. */
const char *source_state_word(bool open, enum device_state state);

#endif
