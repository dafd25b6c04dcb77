/* SPDX-License-Identifier: MIT */
/*
 * garbage - tells in the log when a port brings bytes that are no message. A wrong baud rate or device brings nothing
 * else: that is a warning, at once and with the sum of it every minute. Noise between messages, or another talker on
 * the line, is reported when it starts. Never more than a line a minute.
 */
#ifndef SONARD_GARBAGE_H
#define SONARD_GARBAGE_H

#include "core/loop.h"

/* What came over a port since the start. */
struct garbage_count {
    uint64_t bytes, garbage, messages;
};

/* Of one port, embedded in its owner; zeroed but for what the owner gives. */
struct garbage {
    struct loop *loop;
    const char *sonar;  /* NULL: the port is no sonar's, ... */
    const char *whose;  /* ... but this one's, as the line begins then: "nmea: " */
    const char *port;   /* as the configuration names it */
    const char *speech; /* what is wanted there: "ping360" */
    void (*count)(const void *owner, struct garbage_count *now);
    const void *owner;
    struct loop_timer timer;
    uint64_t told_ns;            /* the newest line; 0: none */
    struct garbage_count before; /* when it was looked at last */
    bool mostly;                 /* more than half of what came last, over a second or more, was garbage */
    uint64_t judged_ns;
    struct garbage_count judged;
};

/** garbage_heard - bytes have come: they are looked at soon, once for all. */
void garbage_heard(struct garbage *g);

/** garbage_word - of a sonar whose port brings mostly garbage, what to check first. */
const char *garbage_word(const char *port);

/** garbage_end - no more reports. */
void garbage_end(struct garbage *g);

#endif
