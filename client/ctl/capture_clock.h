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

#define CAPTURE_CLOCK_STEPS 64 /* of more the newest counts */

struct capture_clock {
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

/**
 * capture_clock_date - the capture's time of what another log has at unix_ns. That log's clock was right all the time,
 * or it was this computer's: the first is tried first, for a capture from start_ns to end_ns, then the clock as it was
 * before each step, and the capture's own, into whose time somebody may have moved it. What falls into none is dated by
 * the first.
 */
int64_t capture_clock_date(const struct capture_clock *clock, int64_t unix_ns, uint64_t start_ns, uint64_t end_ns);

#endif
