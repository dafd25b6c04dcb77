/* SPDX-License-Identifier: MIT */
/*
 * can_socket - what the CAN ports share: finding an interface, and a raw socket on it that hears the frames asked for
 * and what the controller says of itself. Knows no protocol.
 *
 * A controller that has gone bus-off hears nothing until it is restarted, by its restart-ms or by hand. The port is
 * given up then, and opens again when the interface has its carrier back.
 */
#ifndef SONARD_CAN_SOCKET_H
#define SONARD_CAN_SOCKET_H

#include <net/if.h>

#include "core/fault.h"
#include "port.h"

/**
 * can_interface_name - the interface in front of the first colon (or the end) of `rest`, into name[IFNAMSIZ].
 * Returns what stands behind it (at the colon or the end), or NULL with a sentence in fault.
 */
const char *can_interface_name(const char *rest, char *name, struct fault *fault);

/* Where a pair of identifiers carries bytes: "can0:TXID:RXID", CAN_EFF_FLAG set in extended ones. */
struct can_address {
    char name[IFNAMSIZ];
    uint32_t tx, rx; /* with which we send; which we receive */
};

/**
 * can_address_parse - an interface and two identifiers in hexadecimal, of 1 to 3 digits (standard) or 8 (extended).
 * Returns what stands behind them (at a colon or the end), or NULL with a sentence in fault.
 */
const char *can_address_parse(const char *rest, struct can_address *a, struct fault *fault);

/**
 * can_interface_index - of an interface that is there, speaks CAN, is up and has carrier. 0 with a sentence in fault,
 * and port->error and port->bus.state set.
 */
int can_interface_index(struct port *port, const char *name, struct fault *fault);

/**
 * can_socket_open - a raw socket on the interface that receives the data frames matching port->can_match (classic and
 * FD) and error frames. As port_ops.open.
 */
bool can_socket_open(struct port *port, const char *name, struct fault *fault);

/**
 * can_socket_read - one frame as a record of 16 or 72 bytes into buf (at least CANFD_MTU), with port->t_ns and
 * port->bus brought up to date. Error frames are handed out too, but for bus-off and restart, after which the port is
 * to be opened anew. As port_ops.read.
 */
ssize_t can_socket_read(struct port *port, void *buf);

/**
 * can_socket_write - one frame of struct can_frame. CAN_MTU when it was taken, or dropped and counted because the
 * interface's queue is full; 0 when the socket is; -1 as port_ops.write.
 */
ssize_t can_socket_write(struct port *port, const struct can_frame *frame);

/** can_socket_close - as port_ops.close, for every kind of CAN socket. */
void can_socket_close(struct port *port);

/*
 * Bytes over CAN come at least as fast as over a line of this speed: 250 kbit/s, frames that carry seven bytes in 160
 * bits, a bus that others use to a third, gaps. What is waited for takes this into account, what is dated does not.
 */
#define CAN_LEAST_BAUD 60000u

/** can_hold_break - as port_ops.hold_break: CAN has nothing for it. */
void can_hold_break(struct port *port, bool on);

#endif
