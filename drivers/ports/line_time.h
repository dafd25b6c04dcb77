/* SPDX-License-Identifier: MIT */
/*
 * line_time - what bytes on a serial line say about time: how long they take, and when the sound went out whose echo
 * they carry. Pure; knows no protocol.
 */
#ifndef SONARD_LINE_TIME_H
#define SONARD_LINE_TIME_H

#include <stddef.h>
#include <stdint.h>

/** line_ns - time of so many bytes on a line: a start, eight data and a stop bit each. 0 for baud 0. */
uint64_t line_ns(unsigned baud, size_t bytes);

/**
 * transmitted_ns - when a device transmitted that listened for listening_ns and then sent the `bytes` that arrived from
 * first_ns to last_ns: it began to send when the first byte arrived, but no later than the line allows (baud; 0: no
 * such bound), since bytes that waited in a buffer come late and all at once. A time before 0 is 0.
 */
uint64_t transmitted_ns(uint64_t first_ns, uint64_t last_ns, size_t bytes, unsigned baud, uint64_t listening_ns);

#endif
