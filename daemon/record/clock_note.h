/* SPDX-License-Identifier: MIT */
/*
 * clock_note - a note in the capture when the computer's clock is set. The times of a capture go by the clock that the
 * computer had at the start, and run on evenly: without a battery for its clock that is 1970, or the last shutdown. The
 * note says how far the computer's clock is ahead of the capture's since then, so that poses of another log can be
 * dated. Channel /clock, JSON:
 *
 *   {"ahead_ns":1795817000123456789,"was_ahead_ns":0}
 *
 * The first note of a segment has it from the segments before, and both are the same then.
 */
#ifndef SONARD_CLOCK_NOTE_H
#define SONARD_CLOCK_NOTE_H

#include "core/loop.h"
#include "record.h"

struct clock_note {
    struct loop *loop;
    struct record *record;
    uint64_t unix_offset_ns; /* of the capture's times, as in struct segments_conf */
    int channel;
    int64_t ahead_ns;  /* as noted */
    uint64_t segments; /* then */
    struct loop_timer timer;
};

/** clock_note_start - watch the clock; before record_start, and while record lives. */
void clock_note_start(struct clock_note *note, struct loop *loop, struct record *record, uint64_t unix_offset_ns);

void clock_note_end(struct clock_note *note);

#endif
