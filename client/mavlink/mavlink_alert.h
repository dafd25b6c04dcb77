/* SPDX-License-Identifier: MIT */
/*
 * mavlink_alert - one thing that can fail, sent to the pilot as STATUSTEXT when it fails and when it is well again.
 * What lasts less than a second is not sent, unless it is grave, and no two texts follow within five seconds: the last
 * word is always the truth. A text that is longer than a message goes out in parts, one right behind the other.
 * Pure.
 */
#ifndef SONARD_MAVLINK_ALERT_H
#define SONARD_MAVLINK_ALERT_H

#include <stdbool.h>
#include <stdint.h>

#include "mavlink_messages.h"

#define MAVLINK_ALERT_TEXT 256

/* All zeros but grave: well, nothing sent. */
struct mavlink_alert {
    bool grave; /* sent as critical; otherwise as a warning */
    bool failed, told_failed;
    uint64_t since_ns, told_ns;
    char text[MAVLINK_ALERT_TEXT]; /* of the state it is in */
    bool goes_on;                  /* a part of it went out, and another follows */
    size_t told;                   /* bytes of it that went out while it goes on */
    uint16_t id;                   /* of the parts of the newest long text */
};

/**
 * mavlink_alert_set - how it is now, with what to say about it; of a longer text the first 255 bytes. The text of
 * an unchanged state is not said again.
 */
__attribute__((format(printf, 4, 5))) void mavlink_alert_set(struct mavlink_alert *alert, bool failed,
                                                             uint64_t now_ns, const char *format, ...);

/** mavlink_alert_due - is there something to tell? True for each message, which is in *out: to be asked until false. */
bool mavlink_alert_due(struct mavlink_alert *alert, uint64_t now_ns, struct mavlink_statustext *out);

#endif
