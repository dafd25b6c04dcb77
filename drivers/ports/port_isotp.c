/* SPDX-License-Identifier: MIT */
/*
 * port_isotp - bytes over ISO 15765-2 (ISO-TP), which the kernel's CAN_ISOTP sockets speak: each write is one
 * message, each read gives one, and what is inside is taken as a stream. "can0:TXID:RXID", identifiers in
 * hexadecimal, TXID the one that we send with; behind them ":fd" for CAN FD and ":pad" for frames that are filled
 * up. Knows no protocol above.
 */
#include <errno.h>
#include <linux/can/isotp.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "arrival.h"
#include "can_socket.h"
#include "core/fault.h"

#define MESSAGE_MAX 4095 /* every peer takes this much */

#define PAD_BYTE 0xcc /* as most peers have it; what is received is not looked at */

/* What stands behind the identifiers. */
struct way {
    bool fd, pad;
};

static bool take_word(const char **p, const char *word)
{
    const size_t n = strlen(word);
    if (strncmp(*p, word, n) != 0)
        return false;
    *p += n;
    return true;
}

static bool parse_address(const char *rest, struct can_address *a, struct way *way, struct fault *fault)
{
    const char *end = can_address_parse(rest, a, fault);
    if (!end)
        return false;
    way->fd = take_word(&end, ":fd");
    way->pad = take_word(&end, ":pad");
    return !*end ||
           fault_set(
               fault,
               "ISO-TP address '%.48s': must end behind the second identifier, or with :fd, :pad or :fd:pad, "
               "as can0:701:702:fd",
               rest);
}

static bool isotp_check(const char *rest, struct fault *fault)
{
    struct can_address a;
    struct way way;
    return parse_address(rest, &a, &way, fault);
}

static bool bind_to(int fd, int index, const struct can_address *a, struct way way)
{
    const struct can_isotp_ll_options long_frames = {
        .mtu = CANFD_MTU, .tx_dl = CANFD_MAX_DLEN, .tx_flags = CANFD_BRS};
    const struct can_isotp_options filled = {.flags = CAN_ISOTP_TX_PADDING | CAN_ISOTP_RX_PADDING,
                                             .txpad_content = PAD_BYTE,
                                             .rxpad_content = PAD_BYTE};
    struct sockaddr_can address = {.can_family = AF_CAN, .can_ifindex = index};
    address.can_addr.tp.tx_id = a->tx;
    address.can_addr.tp.rx_id = a->rx;
    if (way.fd && setsockopt(fd, SOL_CAN_ISOTP, CAN_ISOTP_LL_OPTS, &long_frames, sizeof long_frames) < 0)
        return false;
    if (way.pad && setsockopt(fd, SOL_CAN_ISOTP, CAN_ISOTP_OPTS, &filled, sizeof filled) < 0)
        return false;
    return bind(fd, (const struct sockaddr *)&address, sizeof address) == 0;
}

static bool isotp_open(struct port *port, const char *rest, struct fault *fault)
{
    struct can_address a;
    struct way way;
    port->ops = &port_isotp;
    port->fd = -1;
    port->error = EINVAL;
    if (!parse_address(rest, &a, &way, fault))
        return false;
    int index = can_interface_index(port, a.name, fault);
    if (!index)
        return false;
    int fd = socket(AF_CAN, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_ISOTP);
    if (fd < 0 || !bind_to(fd, index, &a, way)) {
        port->error = errno;
        fault_set(fault, "ISO-TP on %s: %s: %s", a.name,
                  fd < 0 ? "this kernel does not have it (module can-isotp)" : "cannot be opened",
                  strerror(port->error));
        if (fd >= 0)
            close(fd);
        return false;
    }
    arrival_ask(port, fd);
    port->fd = fd;
    port->error = 0;
    port->bus.state = BUS_UP;
    return true;
}

/*
 * A transfer that failed - no answer, a frame out of order, wrong padding, a receiver without room - is one message
 * lost and no reason to give the port up. The kernel may tell it at any later call.
 */
static ssize_t failed(struct port *port, size_t given_up)
{
    switch (errno) {
    case EAGAIN:
    case EINTR:
    case ENOBUFS: /* the interface's queue is full */
        return 0;
    case ECOMM:
    case ETIMEDOUT:
    case EILSEQ:
    case EBADMSG:
    case EMSGSIZE:
        port->bus.transfer_errors++;
        return (ssize_t)given_up;
    default:
        port->error = errno;
        port->bus.state = BUS_DOWN;
        return -1;
    }
}

static ssize_t isotp_read(struct port *port, void *buf, size_t size)
{
    _Alignas(struct cmsghdr) char control[ARRIVAL_CONTROL_BYTES];
    struct iovec space = {buf, size};
    struct msghdr message = {
        .msg_iov = &space, .msg_iovlen = 1, .msg_control = control, .msg_controllen = sizeof control};
    ssize_t n = recvmsg(port->fd, &message, 0);
    if (n == 0) {
        errno = ENODEV;
        n = -1;
    }
    if (n < 0)
        return failed(port, 0);
    arrival_take(port, &message);
    return n;
}

static ssize_t isotp_write(struct port *port, const void *buf, size_t size)
{
    size_t part = size < MESSAGE_MAX ? size : MESSAGE_MAX;
    ssize_t n = send(port->fd, buf, part, 0);
    return n >= 0 ? n : failed(port, part);
}

const struct port_ops port_isotp = {
    .kind = "isotp",
    .encoding = "octet-stream",
    .least_baud = CAN_LEAST_BAUD,
    .check = isotp_check,
    .open = isotp_open,
    .read = isotp_read,
    .write = isotp_write,
    .hold_break = can_hold_break,
    .close = can_socket_close,
};
