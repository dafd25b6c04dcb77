/* SPDX-License-Identifier: MIT */
/*
 * reload - reads the configuration anew while all goes on. All keys that a running daemon can change take effect, or,
 * where the new configuration has a fault, none; the others are named. Maps, poses, clients and sonars stay. The
 * method `reload` is in methods.h.
 */
#ifndef SONARD_RELOAD_H
#define SONARD_RELOAD_H

struct daemon;

/** reload_by_signal - do it, and say in the log and to the service manager what came of it. */
void reload_by_signal(struct daemon *d);

#endif
