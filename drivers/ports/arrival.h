/* SPDX-License-Identifier: MIT */
/*
 * arrival - what the kernel notes of a datagram, frame or message of a socket: when it came, and how many before it
 * found no room. So what waits to be read while the process is held up still counts from when it came. Knows no kind
 * of socket.
 */
#ifndef SONARD_ARRIVAL_H
#define SONARD_ARRIVAL_H

#include <sys/socket.h>

#include "port.h"

/* Room for what it notes: struct msghdr.msg_control. */
#define ARRIVAL_CONTROL_BYTES (CMSG_SPACE(sizeof(struct timespec)) + CMSG_SPACE(sizeof(uint32_t)))

/** arrival_ask - have the kernel note both for this socket, which becomes the port's. False: it does not (errno), and
 * no time is known. */
bool arrival_ask(struct port *port, int fd);

/**
 * arrival_take - of what was just received: port->t_ns, 0 where the time is not known, and port->lost. The kernel
 * stamps with the time of day, which may be set at any moment: what came before it was seen to be set has no time.
 */
void arrival_take(struct port *port, struct msghdr *message);

#endif
