/* SPDX-License-Identifier: MIT */
/*
 * port_can - whole frames of a CAN bus, classic and FD: "can0". One read gives one record of can_frame.h; only what
 * port->can_match lets through, and error frames. Knows no protocol.
 */
#include <errno.h>
#include <string.h>

#include "can_socket.h"
#include "core/fault.h"

static bool can_check(const char *rest, struct fault *fault)
{
    char name[IFNAMSIZ];
    const char *end = can_interface_name(rest, name, fault);
    if (end && *end)
        fault_set(fault, "CAN interface '%.32s': must be its name alone, as can0", rest);
    return end && !*end;
}

static bool can_open(struct port *port, const char *rest, struct fault *fault)
{
    char name[IFNAMSIZ];
    port->ops = &port_can;
    port->fd = -1;
    port->error = EINVAL;
    return can_check(rest, fault) && can_interface_name(rest, name, fault) && can_socket_open(port, name, fault);
}

static ssize_t can_read(struct port *port, void *buf, size_t size)
{
    if (size < CANFD_MTU) {
        port->error = EINVAL;
        return -1;
    }
    return can_socket_read(port, buf);
}

/* One record of 16 bytes at a time. */
static ssize_t can_write(struct port *port, const void *buf, size_t size)
{
    struct can_frame frame;
    if (size < sizeof frame) {
        port->error = EINVAL;
        return -1;
    }
    memcpy(&frame, buf, sizeof frame);
    return can_socket_write(port, &frame);
}

const struct port_ops port_can = {
    .kind = "can",
    .encoding = "socketcan",
    .check = can_check,
    .open = can_open,
    .read = can_read,
    .write = can_write,
    .hold_break = can_hold_break,
    .close = can_socket_close,
};
