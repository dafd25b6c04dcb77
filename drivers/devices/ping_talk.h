/* SPDX-License-Identifier: MIT */
/*
 * ping_talk - what devices of the Ping protocol have in common: an poller and the frames that come in. Knows the
 * messages that all of them know, and what no single one means. A device's state begins with a struct ping_talk, so
 * that the functions here stand in its device_ops.
 */
#ifndef SONARD_PING_TALK_H
#define SONARD_PING_TALK_H

#include "poller.h"
#include "ping_frame.h"

#define PING_TYPE_ECHOSOUNDER 1
#define PING_TYPE_PING360     2

struct ping_talk {
    struct poller poller; /* first: see poller.h */
    struct ping_parser parser;
    void (*on_frame)(void *device, const struct ping_frame *frame, uint64_t now_ns, const struct device_io *io);
};

/** ping_talk_opened - drop what was received before, and start. */
void ping_talk_opened(struct ping_talk *t, uint64_t now_ns, const struct device_io *io);

/** ping_talk_request - ask for the message `id`. */
void ping_talk_request(uint16_t id, const struct device_io *io);

/** ping_talk_identity - a device_information; false, and counted, when it is none. */
bool ping_talk_identity(struct ping_talk *t, const struct ping_frame *frame, struct ping_device_information *out);

/** ping_talk_name - "NAME fw 3.3.8 id 2" is what the device is from now on. */
void ping_talk_name(struct ping_talk *t, const char *name, const struct ping_device_information *info, uint8_t id);

/**
 * ping_talk_answered - does the frame acknowledge or refuse a message, *id? Refusals are counted and noted: `refused`
 * says so. A frame of these kinds that cannot be read is counted.
 */
bool ping_talk_answered(struct ping_talk *t, const struct ping_frame *frame, const struct device_io *io,
                        uint16_t *id, bool *refused);

/** ping_talk_says - passes an ascii_text on to the operator. */
void ping_talk_says(const struct ping_frame *frame, const struct device_io *io);

/* For device_ops; `state` begins with the ping_talk. */
void ping_talk_closed(void *state, uint64_t now_ns);
void ping_talk_feed(void *state, const uint8_t *bytes, size_t n, uint64_t now_ns, const struct device_io *io);
void ping_talk_tick(void *state, uint64_t now_ns, const struct device_io *io);
void ping_talk_status(const void *state, struct device_status *out);

#endif
