/* SPDX-License-Identifier: MIT */
#include "clock_note.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "core/log.h"

#define LOOK_NS     500000000u
#define STEP_NS     10000000 /* a clock that is only slewed takes the monotonic one along */
#define TOGETHER_NS 1000000u /* between two looks at one clock: what lies further apart shows no step */

static uint64_t unix_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_REALTIME, &t);
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

/* How far the computer's clock is ahead of the capture's. False: the process was held up in between. */
static bool look(const struct clock_note *note, int64_t *ahead_ns)
{
    const uint64_t before_ns = loop_clock(), wall_ns = unix_ns(), after_ns = loop_clock();
    *ahead_ns = (int64_t)(wall_ns - before_ns - note->unix_offset_ns);
    return after_ns - before_ns <= TOGETHER_NS;
}

static void write_note(struct clock_note *note, int64_t ahead_ns)
{
    char text[96];
    const int n = snprintf(text, sizeof text, "{\"ahead_ns\":%" PRId64 ",\"was_ahead_ns\":%" PRId64 "}", ahead_ns,
                           note->ahead_ns);
    record_message(note->record, note->channel, loop_now(note->loop), text, (size_t)n);
}

static void on_look(void *ctx, uint64_t now_ns)
{
    struct clock_note *note = ctx;
    struct record_status status;
    int64_t ahead_ns;
    loop_arm(note->loop, &note->timer, now_ns + LOOK_NS);
    record_status(note->record, &status);
    if (!look(note, &ahead_ns))
        return;
    const bool stepped = llabs(ahead_ns - note->ahead_ns) > STEP_NS;
    if (!stepped)
        ahead_ns = note->ahead_ns;
    if (stepped || (ahead_ns != 0 && status.segments.segments != note->segments))
        write_note(note, ahead_ns);
    if (stepped)
        log_line(LOG_NOTICE, "clock_set",
                 "recording: the computer's clock was set by %+.3f s; the capture notes it and keeps its own time",
                 (double)(ahead_ns - note->ahead_ns) * 1e-9);
    note->ahead_ns = ahead_ns;
    note->segments = status.segments.segments;
}

void clock_note_start(struct clock_note *note, struct loop *loop, struct record *record, uint64_t unix_offset_ns)
{
    struct record_status status;
    record_status(record, &status);
    *note = (struct clock_note){.loop = loop,
                                .record = record,
                                .unix_offset_ns = unix_offset_ns,
                                .channel = record_channel(record, "/clock", "json"),
                                .segments = status.segments.segments,
                                .timer = {.fire = on_look, .ctx = note}};
    loop_arm(loop, &note->timer, loop_now(loop) + LOOK_NS);
}

void clock_note_end(struct clock_note *note)
{
    if (note->loop)
        loop_arm(note->loop, &note->timer, LOOP_NEVER);
}
