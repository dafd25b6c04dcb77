/* SPDX-License-Identifier: MIT */
#include "can_socket.h"

#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if_arp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "arrival.h"

/* CAN_ERR_BUSERROR is left out: one for every disturbed bit floods a bus that is badly terminated. */
#define ERRORS_HEARD                                                                                              \
    (CAN_ERR_TX_TIMEOUT | CAN_ERR_CRTL | CAN_ERR_ACK | CAN_ERR_BUSOFF | CAN_ERR_RESTARTED | CAN_ERR_CNT)

#define RECEIVE_BYTES (1 << 20) /* of socket memory, of which a frame takes several hundred */

/* ---- addresses ---- */

const char *can_interface_name(const char *rest, char *name, struct fault *fault)
{
    size_t n = strcspn(rest, ":");
    bool good = n > 0 && n < IFNAMSIZ;
    for (size_t i = 0; i < n; i++)
        good &= isgraph((unsigned char)rest[i]) && rest[i] != '/';
    if (!good) {
        fault_set(fault, "CAN interface '%.32s': must be a name of 1 to %d characters, as can0", rest,
                  IFNAMSIZ - 1);
        return NULL;
    }
    memcpy(name, rest, n);
    name[n] = '\0';
    return rest + n;
}

/* ":7FF" or ":18DA01F1" at *text, which is moved behind it. */
static bool take_id(const char **text, uint32_t *id)
{
    if (**text != ':')
        return false;
    const char *digits = *text + 1;
    size_t n = strcspn(digits, ":");
    if (strspn(digits, "0123456789abcdefABCDEF") != n || !((n >= 1 && n <= 3) || n == 8))
        return false;
    unsigned long value = strtoul(digits, NULL, 16);
    *text = digits + n;
    *id = (uint32_t)value | (n == 8 ? CAN_EFF_FLAG : 0);
    return value <= (n == 8 ? CAN_EFF_MASK : CAN_SFF_MASK);
}

const char *can_address_parse(const char *rest, struct can_address *a, struct fault *fault)
{
    const char *p = can_interface_name(rest, a->name, fault);
    if (!p)
        return NULL;
    if (take_id(&p, &a->tx) && take_id(&p, &a->rx) && a->tx != a->rx)
        return p;
    fault_set(
        fault,
        "CAN address '%.48s': must be an interface and two identifiers, to the sonar and from it, each of 1 to 3 "
        "hexadecimal digits or, extended, 8: can0:701:702",
        rest);
    return NULL;
}

/* ---- opening ---- */

/* Always 0. */
static int not_there(struct port *port, int error, enum bus_state state, const char *name, const char *why,
                     struct fault *fault)
{
    port->error = error;
    port->bus.state = state;
    fault_set(fault, "CAN interface %s: %s", name, why);
    return 0;
}

/* Asked of sysfs: the flag IFF_RUNNING follows up to a second late. */
static bool has_carrier(const char *name)
{
    char path[64], carrier = '1';
    snprintf(path, sizeof path, "/sys/class/net/%s/carrier", name);
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0)
        return true; /* no sysfs, no answer */
    ssize_t n = read(fd, &carrier, 1);
    close(fd);
    return n != 1 || carrier != '0';
}

int can_interface_index(struct port *port, const char *name, struct fault *fault)
{
    struct ifreq request;
    int fd = socket(AF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
    if (fd < 0)
        return not_there(port, errno, BUS_DOWN, name,
                         errno == EAFNOSUPPORT ? "this kernel has no CAN, or the service does not permit it"
                                               : strerror(errno),
                         fault);
    memset(&request, 0, sizeof request);
    snprintf(request.ifr_name, sizeof request.ifr_name, "%s", name);
    bool there = ioctl(fd, SIOCGIFHWADDR, &request) == 0;
    bool speaks_can = there && request.ifr_hwaddr.sa_family == ARPHRD_CAN;
    unsigned flags = there && ioctl(fd, SIOCGIFFLAGS, &request) == 0 ? (unsigned short)request.ifr_flags : 0;
    there = there && ioctl(fd, SIOCGIFINDEX, &request) == 0;
    close(fd);
    if (!there)
        return not_there(port, ENODEV, BUS_DOWN, name, "no such interface", fault);
    if (!speaks_can)
        return not_there(port, ENODEV, BUS_DOWN, name, "not a CAN interface", fault);
    if (!(flags & IFF_UP))
        return not_there(port, ENETDOWN, BUS_DOWN, name, "it is down; bring it up with ip link set ... up", fault);
    if (!has_carrier(name))
        return not_there(
            port, ENETDOWN, BUS_OFF, name,
            "the bus is off or not connected; it needs restart-ms, or ip link set ... type can restart", fault);
    return request.ifr_ifindex;
}

static bool set(int fd, int level, int option, const void *value, socklen_t size)
{
    return setsockopt(fd, level, option, value, size) == 0;
}

/* The least memory for sending: then the socket is full before the interface's short queue, and poll can wait. */
static bool set_up(int fd, struct port *port)
{
    const struct can_filter filter = {.can_id = port->can_match.id, .can_mask = port->can_match.mask};
    const can_err_mask_t errors = ERRORS_HEARD;
    const int on = 1, receive = RECEIVE_BYTES, send = 1;
    set(fd, SOL_SOCKET, SO_RCVBUF, &receive, sizeof receive);
    set(fd, SOL_SOCKET, SO_SNDBUF, &send, sizeof send);
    return set(fd, SOL_CAN_RAW, CAN_RAW_FILTER, &filter, sizeof filter) &&
           set(fd, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors) &&
           set(fd, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on) && arrival_ask(port, fd);
}

bool can_socket_open(struct port *port, const char *name, struct fault *fault)
{
    struct sockaddr_can address = {.can_family = AF_CAN};
    port->fd = -1;
    address.can_ifindex = can_interface_index(port, name, fault);
    if (!address.can_ifindex)
        return false;
    int fd = socket(AF_CAN, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_RAW);
    if (fd < 0 || !set_up(fd, port) || bind(fd, (const struct sockaddr *)&address, sizeof address) < 0) {
        port->error = errno;
        if (fd >= 0)
            close(fd);
        return fault_set(fault, "CAN interface %s: cannot be opened: %s", name, strerror(port->error));
    }
    port->fd = fd;
    port->error = 0;
    port->bus.state = BUS_UP;
    return true;
}

/* ---- reading ---- */

/* What an error frame says. False: nothing more is to be expected of this socket. */
static bool take_error(struct port_bus *bus, const struct can_frame *frame)
{
    const uint8_t controller = frame->can_id & CAN_ERR_CRTL ? frame->data[1] : 0;
    bus->error_frames++;
    if (frame->can_id & CAN_ERR_CNT) {
        bus->tx_errors = frame->data[6];
        bus->rx_errors = frame->data[7];
    }
    if (controller & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE))
        bus->state = BUS_PASSIVE;
    else if (controller & (CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING))
        bus->state = BUS_WARNING;
    else if (controller & CAN_ERR_CRTL_ACTIVE)
        bus->state = BUS_UP;
    if (controller & CAN_ERR_CRTL_RX_OVERFLOW)
        bus->controller_overflows++;
    if (frame->can_id & CAN_ERR_BUSOFF) {
        bus->bus_offs++;
        bus->state = BUS_OFF;
    }
    if (frame->can_id & CAN_ERR_RESTARTED) {
        bus->restarts++;
        bus->state = BUS_UP;
    }
    return !(frame->can_id & (CAN_ERR_BUSOFF | CAN_ERR_RESTARTED));
}

/* -1 with the cause noted, or 0 when it only was the wrong moment. */
static ssize_t failed(struct port *port)
{
    if (errno == EAGAIN || errno == EINTR)
        return 0;
    port->error = errno;
    port->bus.state = BUS_DOWN;
    return -1;
}

ssize_t can_socket_read(struct port *port, void *buf)
{
    _Alignas(struct cmsghdr) char control[ARRIVAL_CONTROL_BYTES];
    struct iovec space = {.iov_base = buf, .iov_len = CANFD_MTU};
    struct msghdr message = {
        .msg_iov = &space, .msg_iovlen = 1, .msg_control = control, .msg_controllen = sizeof control};
    struct can_frame error;

    ssize_t n = recvmsg(port->fd, &message, 0);
    if (n < 0)
        return failed(port);
    if (n != CAN_MTU && n != CANFD_MTU) {
        port->error = n == 0 ? ENODEV : EBADMSG;
        return -1;
    }
    arrival_take(port, &message);
    memcpy(&error, buf, sizeof error);
    if ((error.can_id & CAN_ERR_FLAG) && !take_error(&port->bus, &error)) {
        port->error = ENETDOWN;
        return -1;
    }
    return n;
}

/* ---- writing, closing ---- */

ssize_t can_socket_write(struct port *port, const struct can_frame *frame)
{
    ssize_t n = send(port->fd, frame, sizeof *frame, 0);
    if (n < 0 && errno == ENOBUFS) {
        port->bus.not_sent++; /* nothing tells when there is room again: waiting would spin */
        return CAN_MTU;
    }
    return n >= 0 ? n : failed(port);
}

void can_socket_close(struct port *port)
{
    if (port->fd >= 0)
        close(port->fd);
    port->fd = -1;
}

void can_hold_break(struct port *port, bool on)
{
    (void)port;
    (void)on;
}
