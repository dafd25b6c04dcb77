/* SPDX-License-Identifier: MIT */
/*
 * capture_clock - what the notes of a capture say of the computer's clock while it was recorded (daemon/record/
 * clock_note.h): how far it was ahead of the capture's times, and since when. Pure.
 */
#ifndef SONARD_CAPTURE_CLOCK_H
#define SONARD_CAPTURE_CLOCK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "drivers/capture/mcap.h"

#define CAPTURE_CLOCK_STEPS 64 /* of more the newest are kept */

struct capture_clock {
    bool noted;
    int64_t before_ns; /* how far it was ahead before the steps */
    size_t n;
    struct {
        uint64_t from_ns; /* of the capture */
        int64_t ahead_ns;
    } step[CAPTURE_CLOCK_STEPS];
};

/** capture_clock_take - true: the message is a note, and it says something new. *clock is zeroed at first. */
bool capture_clock_take(struct capture_clock *clock, const struct mcap_message *m);

/** capture_clock_ahead_ns - how far the clock was ahead when it had been set for the last time; 0: it never was. */
int64_t capture_clock_ahead_ns(const struct capture_clock *clock);

/* Whose clock gave another log its times. A log has one from its beginning to its end. */
enum capture_clock_of {
    CAPTURE_CLOCK_RIGHT, /* one that was right all the time, as this computer's after the last step */
    CAPTURE_CLOCK_OWN,   /* this computer's, before and after each step */
    CAPTURE_CLOCK_NONE   /* somebody has moved the log into the capture's time */
};

/** capture_clock_date - the capture's time of what the log has at unix_ns; false: no such time is in the capture. */
bool capture_clock_date(const struct capture_clock *clock, enum capture_clock_of of, int64_t unix_ns,
                        uint64_t *t_ns);

#endif
