/* SPDX-License-Identifier: MIT */
/*
 * mavlink_clock - the autopilot's clock against ours, from time stamps of messages and answers to TIMESYNC. Pure.
 * Times are CLOCK_MONOTONIC nanoseconds of this computer unless they are named boot.
 */
#ifndef SONARD_MAVLINK_CLOCK_H
#define SONARD_MAVLINK_CLOCK_H

#include <stdbool.h>
#include <stdint.h>

struct mavlink_clock {
    bool known;
    uint64_t boot_ms;  /* newest received, unwrapped */
    uint64_t heard_ns; /* when */
    int64_t offset_ns; /* ours minus the autopilot's: the smallest seen, since delays only add */
    int64_t floor_ns;  /* the smallest offset that a time stamp showed since the start; a jump goes below it */
    uint64_t late_ns;  /* since when everything came later than delays explain; 0: it does not */
    uint32_t last_ms;  /* of the message before */
    uint64_t jump_ns;  /* when it jumped last; 0: never */
    uint64_t doubt_ns; /* no time of it is known until then */
    bool two;          /* because there are two clocks */
};

/**
 * mavlink_clock_heard - the autopilot's clock (milliseconds since its start, wrapping after 49.7 days) was boot_ms
 * when it sent what came at now_ns. Returns that time in ours, never after now_ns. Begins anew when the clock jumps:
 * when it goes back, or is further ahead than it can be by delays that became shorter.
 */
uint64_t mavlink_clock_heard(struct mavlink_clock *clock, uint32_t boot_ms, uint64_t now_ns);

/** mavlink_clock_jumps - would a message of boot_ms that came at now_ns begin the clock anew? Changes nothing. */
bool mavlink_clock_jumps(const struct mavlink_clock *clock, uint32_t boot_ms, uint64_t now_ns);

/**
 * mavlink_clock_doubtful - has the clock jumped within a second? An autopilot that has started again jumps once. Two
 * clocks under one system id, as of a simulator beside the vehicle, make it jump again and again: after the second jump
 * within ten seconds it is doubtful until ten seconds have passed without any.
 */
bool mavlink_clock_doubtful(const struct mavlink_clock *clock, uint64_t now_ns);

/** mavlink_clock_two - is that because of two clocks? */
bool mavlink_clock_two(const struct mavlink_clock *clock, uint64_t now_ns);

/** mavlink_clock_answer - an answer to our TIMESYNC: its clock tc1_ns, our question's time asked_ns. */
void mavlink_clock_answer(struct mavlink_clock *clock, int64_t tc1_ns, int64_t asked_ns, uint64_t now_ns);

/** mavlink_clock_boot_ns - our time in the autopilot's clock; our own clock while the autopilot's is not known. */
uint64_t mavlink_clock_boot_ns(const struct mavlink_clock *clock, uint64_t t_ns);

#endif
