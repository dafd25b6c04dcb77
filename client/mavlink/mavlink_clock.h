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
    uint64_t late_ns;  /* since when everything came later than delays explain; 0: it does not */
};

/**
 * mavlink_clock_heard - the autopilot's clock (milliseconds since its start, wrapping after 49.7 days) was boot_ms
 * when it sent what came at now_ns. Returns that time in ours, never after now_ns. Begins anew with an autopilot that
 * has started again or has set its clock back.
 */
uint64_t mavlink_clock_heard(struct mavlink_clock *clock, uint32_t boot_ms, uint64_t now_ns);

/** mavlink_clock_answer - an answer to our TIMESYNC: its clock tc1_ns, our question's time asked_ns. */
void mavlink_clock_answer(struct mavlink_clock *clock, int64_t tc1_ns, int64_t asked_ns, uint64_t now_ns);

/** mavlink_clock_boot_ns - our time in the autopilot's clock; our own clock while the autopilot's is not known. */
uint64_t mavlink_clock_boot_ns(const struct mavlink_clock *clock, uint64_t t_ns);

#endif
