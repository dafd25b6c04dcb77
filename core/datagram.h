/* SPDX-License-Identifier: MIT */
/*
 * datagram - a datagram socket of somebody who listens on this computer: the service manager, the journal.
 */
#ifndef SONARD_DATAGRAM_H
#define SONARD_DATAGRAM_H

/** datagram_to - a descriptor that sends to NAME, a path or @NAME in the abstract namespace;
 * never waits. -1: nobody is there. */
int datagram_to(const char *name);

#endif
