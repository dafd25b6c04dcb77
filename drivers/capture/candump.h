/* SPDX-License-Identifier: MIT */
/*
 * candump - reads logs of `candump -L` (or -l) as captures: one line per frame with its time and interface. Classic
 * and FD data frames, remote requests and error frames; everything else is left out and counted. Knows no protocol.
 *
 *   (1700000000.123456) can0 10041A2A#859087D612000085
 *   (1700000000.123460) can0 123##1AABBCC              CAN FD: a digit of flags before the data
 */
#ifndef SONARD_CANDUMP_H
#define SONARD_CANDUMP_H

#include <net/if.h>

#include "core/fault.h"
#include "drivers/ports/can_frame.h"

struct candump_frame {
    uint64_t t_ns; /* Unix time, or since the start of the log; may go back from one line to the next */
    char name[IFNAMSIZ];
    size_t n; /* CAN_MTU or CANFD_MTU: bytes of the record, as can_frame_read takes it */
    struct canfd_frame frame;
};

/** candump_line - one line of n bytes, without its newline; false when it is no frame. Takes any bytes. */
bool candump_line(const char *text, size_t n, struct candump_frame *out);

struct candump;

/**
 * candump_open - the log `path`, read as it is needed. NULL with a sentence in fault when no line of it is a frame. One
 * that is truncated meanwhile ends where it was cut.
 */
struct candump *candump_open(const char *path, struct fault *fault);

/**
 * candump_has_differences - are the times those since the line before, as `candump -td` writes them? Then
 * candump_next adds them up. They are taken for that when the first thousand are below CANDUMP_ABSOLUTE_S, a quarter
 * of them does not rise, and they begin with 0 or are more than a handful.
 */
bool candump_has_differences(const struct candump *log);

#define CANDUMP_ABSOLUTE_S 100000000u /* 1973: later times are Unix times */

/** candump_next - the next frame in the file's order; false at the end. */
bool candump_next(struct candump *log, struct candump_frame *out);

/** candump_left_out - lines so far that begin as a frame does, with a '(', and are none. */
uint64_t candump_left_out(const struct candump *log);

void candump_close(struct candump *log);

#endif
