/* SPDX-License-Identifier: MIT */
/*
 * patience.h - waits for events. The limit ends a hang and nothing else: no verdict depends on how fast the machine is,
 * or on whether it stopped for some seconds.
 */
#ifndef SONARD_TEST_PATIENCE_H
#define SONARD_TEST_PATIENCE_H

#include <poll.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/loop.h"

#define PATIENCE_S  120
#define PATIENCE_MS (PATIENCE_S * 1000)
#define PATIENCE_NS (PATIENCE_S * 1000000000ull)

/* Waits for a descriptor; false: nothing came. */
static inline bool patience_for(int fd, short events)
{
    struct pollfd p = {.fd = fd, .events = events};
    return poll(&p, 1, PATIENCE_MS) == 1;
}

/* Waits a moment between two looks at a condition that has no descriptor; false: the time is over. */
static inline bool patience_left(uint64_t start_ns)
{
    poll(NULL, 0, 1);
    return loop_clock() - start_ns < PATIENCE_NS;
}

/* Looks at the condition until it holds. */
#define WAIT_UNTIL(condition)                                                                                     \
    for (const uint64_t start_ns_ = loop_clock(); !(condition) && patience_left(start_ns_);) {                    \
    }

/* Turns the loop until the condition holds. */
#define TURN_UNTIL(loop, condition)                                                                               \
    for (const uint64_t start_ns_ = loop_clock(); !(condition) && loop_clock() - start_ns_ < PATIENCE_NS;)        \
    loop_turn((loop), 10000000)

#endif
