/* SPDX-License-Identifier: MIT */
/*
 * port_canstream - bytes as gateways from a serial line to CAN carry them: up to eight per frame, one identifier for
 * each direction, nothing else. "can0:TXID:RXID", identifiers in hexadecimal; TXID is the one that we send with. A
 * frame that is lost is bytes that are missing: the protocol above has to notice. Knows no protocol.
 */
#include <errno.h>
#include <string.h>

#include "can_frame.h"
#include "can_socket.h"
#include "core/fault.h"

static bool parse_address(const char *rest, struct can_address *a, struct fault *fault)
{
    const char *end = can_address_parse(rest, a, fault);
    if (end && *end)
        fault_set(fault, "CAN stream '%.48s': must end behind the second identifier, as can0:321:322", rest);
    return end && !*end;
}

static bool stream_check(const char *rest, struct fault *fault)
{
    struct can_address a;
    return parse_address(rest, &a, fault);
}

static bool stream_open(struct port *port, const char *rest, struct fault *fault)
{
    struct can_address a;
    port->ops = &port_canstream;
    port->fd = -1;
    port->error = EINVAL;
    if (!parse_address(rest, &a, fault))
        return false;
    port->can_match.id = a.rx;
    port->can_match.mask = CAN_EFF_FLAG | CAN_RTR_FLAG | (a.rx & CAN_EFF_FLAG ? CAN_EFF_MASK : CAN_SFF_MASK);
    port->can_send_id = a.tx;
    return can_socket_open(port, a.name, fault);
}

/* One frame at a time, since each has a time of its own. */
static ssize_t stream_read(struct port *port, void *buf, size_t size)
{
    uint8_t record[CANFD_MTU];
    struct canfd_frame frame;
    ssize_t n;
    (void)size; /* any frame fits */
    while ((n = can_socket_read(port, record)) > 0) {
        if (!can_frame_read(record, (size_t)n, &frame) || !can_frame_is_data(&frame) || frame.len == 0)
            continue;
        memcpy(buf, frame.data, frame.len);
        return frame.len;
    }
    return n;
}

static ssize_t stream_write(struct port *port, const void *buf, size_t size)
{
    size_t used = 0;
    while (used < size) {
        struct can_frame frame = {.can_id = port->can_send_id};
        frame.len = (uint8_t)(size - used < CAN_MAX_DLEN ? size - used : CAN_MAX_DLEN);
        memcpy(frame.data, (const uint8_t *)buf + used, frame.len);
        ssize_t n = can_socket_write(port, &frame);
        if (n < 0 && used == 0)
            return -1;
        if (n <= 0)
            break;
        used += frame.len;
    }
    return (ssize_t)used;
}

const struct port_ops port_canstream = {
    .kind = "canstream",
    .encoding = "octet-stream",
    .least_baud = CAN_LEAST_BAUD,
    .check = stream_check,
    .open = stream_open,
    .read = stream_read,
    .write = stream_write,
    .hold_break = can_hold_break,
    .close = can_socket_close,
};
