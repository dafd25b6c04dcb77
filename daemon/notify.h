/* SPDX-License-Identifier: MIT */
/*
 * notify - messages to a service manager (sd_notify(3)): a datagram to $NOTIFY_SOCKET. Knows nothing of what it says.
 */
#ifndef SONARD_NOTIFY_H
#define SONARD_NOTIFY_H

#include <stdint.h>

/**
 * notify_tell - send one state, lines of NAME=VALUE: "READY=1\nSTATUS=...". Nothing happens where no manager listens.
 * Never blocks: a message that finds no room is lost.
 */
void notify_tell(const char *fmt, ...) __attribute__((format(printf, 1, 2)));

/** notify_watchdog_ns - within this time the manager wants WATCHDOG=1 again and again
 * ($WATCHDOG_USEC); 0: it does not. */
uint64_t notify_watchdog_ns(void);

#endif
