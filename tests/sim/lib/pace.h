/* SPDX-License-Identifier: MIT */
/*
 * pace - the time of a virtual instrument's program: the monotonic clock, or the virtual time of a voyage (tests/tools/
 * voyage.c). In a voyage the program takes its turns when it is told to, each at the time it is told, and its line is a
 * socket that it was given; so the same commands make the same bytes at the same times on every machine.
 */
#ifndef SONARD_SIM_PACE_H
#define SONARD_SIM_PACE_H

#include <signal.h>
#include <stdbool.h>
#include <stdint.h>

/* In the environment of a voyage's program: the numbers of two descriptors, "CLOCK,LINE". Over CLOCK, a socket that
 * keeps records, the voyage sends the time of every turn, a uint64_t in ns; the program answers with when its next is
 * due. */
#define PACE_VARIABLE "SONARD_VOYAGE"

/** pace_ns - the time, monotonic nanoseconds. */
uint64_t pace_ns(void);

/** pace_line - the descriptor of the line in a voyage; -1: there is none, make one. */
int pace_line(void);

/**
 * pace_wait - sleep until due_ns, until one of the descriptors can be read, or until a signal that `mask` lets in; -1
 * for no such descriptor. In a voyage: until the next turn, or input. Ends the program when the voyage has ended.
 * True when there is something to read on input_fd, or it has ended.
 */
bool pace_wait(int input_fd, int line_fd, uint64_t due_ns, const sigset_t *mask);

#endif
