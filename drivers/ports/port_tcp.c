/* SPDX-License-Identifier: MIT */
/*
 * port_tcp - a connection to a serial device server: "192.168.2.5:4001", "[fe80::1%eth0]:4001", "serial.local:4001".
 * Its bytes are those of the line behind it, both ways, with nothing added; the speed of that line is the server's
 * matter.
 *
 * The connection is made without waiting. A far end that goes without a word shows within some ten seconds: by what is
 * sent and not confirmed, or by the kernel's own questions while nothing is sent.
 */
#include "port.h"

#include <errno.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/fault.h"

#define LEAST_BAUD 9600 /* what the line behind a server may run at: devices wait so long for their answers */

/* Of a connection on which nothing is sent: asked after so long, and then every ... until so many are in vain. */
#define KEEP_IDLE_S 5
#define KEEP_EACH_S 2
#define KEEP_TRIES  3
#define CONFIRM_MS  10000u /* what is sent must be confirmed within this */

#define NAME_LETTERS "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.-_"

struct address {
    char host[PORT_ADDRESS_MAX];
    char port[8];
};

/* The address of a checked host and port; flags of getaddrinfo. NULL: none, *cause says why. */
static struct addrinfo *resolve(const struct address *a, int flags, int *cause)
{
    const struct addrinfo want = {
        .ai_family = AF_UNSPEC, .ai_socktype = SOCK_STREAM, .ai_flags = AI_NUMERICSERV | flags};
    struct addrinfo *found = NULL;
    *cause = getaddrinfo(a->host, a->port, &want, &found);
    return *cause == 0 ? found : NULL;
}

static bool numeric(const struct address *a)
{
    int cause;
    struct addrinfo *found = resolve(a, AI_NUMERICHOST, &cause);
    if (found)
        freeaddrinfo(found);
    return found != NULL;
}

static bool is_port(const char *text, size_t n)
{
    return n >= 1 && n <= 5 && strspn(text, "0123456789") == n && text[n] == '\0' && atoi(text) >= 1 &&
           atoi(text) <= 65535;
}

/* A host and what follows its colon. False: there is no such pair. */
static bool split(const char *rest, struct address *a, const char **port)
{
    const bool v6 = rest[0] == '[';
    const char *host = rest + v6, *end = strchr(host, v6 ? ']' : ':');
    const size_t n = end ? (size_t)(end - host) : 0;
    if (n < 1 || n >= sizeof a->host || end[v6] != ':')
        return false;
    memcpy(a->host, host, n);
    a->host[n] = '\0';
    *port = end + v6 + 1;
    return v6 ? strchr(a->host, ':') && numeric(a) : strspn(a->host, NAME_LETTERS) == n;
}

static bool parse_address(const char *rest, struct address *a, struct fault *fault)
{
    const char *port = "";
    *a = (struct address){.port = "1"};
    const bool good = split(rest, a, &port);
    if (good && is_port(port, strlen(port))) {
        memcpy(a->port, port, strlen(port) + 1);
        return true;
    }
    const char *more = strchr(port, ':');
    if (good && more && more[1] && more[1 + strspn(more + 1, "0123456789")] == '\0')
        return fault_set(
            fault, "tcp port '%.64s': must end with the port number: the baud rate is set in the device server",
            rest);
    if (good && more)
        return fault_set(fault,
                         "tcp port '%.64s': nothing follows the port number; the speed of the line and its "
                         "direction are set in the device server",
                         rest);
    return fault_set(
        fault,
        "tcp port '%.64s': must be a host and a port number, as 192.168.2.5:4001, [fe80::1%%eth0]:4001 "
        "or serial.local:4001",
        rest);
}

static bool tcp_check(const char *rest, struct fault *fault)
{
    struct address a;
    return parse_address(rest, &a, fault);
}

static bool tcp_named(const char *rest)
{
    struct address a;
    struct fault fault;
    return parse_address(rest, &a, &fault) && !numeric(&a);
}

static bool take_far(const struct address *a, int flags, struct port_far *far, struct fault *fault)
{
    int cause;
    struct addrinfo *found = resolve(a, flags, &cause);
    far->n = 0;
    for (const struct addrinfo *f = found; f && far->n < PORT_FAR_MAX; f = f->ai_next)
        if (f->ai_addrlen <= sizeof far->at[0])
            memcpy(&far->at[far->n++], f->ai_addr, f->ai_addrlen);
    if (found)
        freeaddrinfo(found);
    return far->n > 0 || fault_set(fault, "tcp %s:%s: looking up the host: %s", a->host, a->port,
                                   cause ? gai_strerror(cause) : "it has no address");
}

static bool tcp_look_up(const char *rest, struct port_far *far, struct fault *fault)
{
    struct address a;
    return parse_address(rest, &a, fault) && take_far(&a, AI_ADDRCONFIG, far, fault);
}

static void set_options(int fd)
{
    const int on = 1, idle = KEEP_IDLE_S, each = KEEP_EACH_S, tries = KEEP_TRIES;
    const unsigned confirm_ms = CONFIRM_MS;
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    setsockopt(fd, SOL_SOCKET, SO_KEEPALIVE, &on, sizeof on);
    setsockopt(fd, IPPROTO_TCP, TCP_KEEPIDLE, &idle, sizeof idle);
    setsockopt(fd, IPPROTO_TCP, TCP_KEEPINTVL, &each, sizeof each);
    setsockopt(fd, IPPROTO_TCP, TCP_KEEPCNT, &tries, sizeof tries);
    setsockopt(fd, IPPROTO_TCP, TCP_USER_TIMEOUT, &confirm_ms, sizeof confirm_ms);
}

/* A port of this computer on which nobody listens may be the one that the kernel chose for our own end. */
static bool is_ourselves(int fd)
{
    struct sockaddr_storage near = {0}, far = {0};
    socklen_t n = sizeof near, m = sizeof far;
    return getsockname(fd, (struct sockaddr *)&near, &n) == 0 &&
           getpeername(fd, (struct sockaddr *)&far, &m) == 0 && n == m && memcmp(&near, &far, n) == 0;
}

/* errno says why. Always false. */
static bool fail(struct port *port, const char *rest, const char *what, struct fault *fault)
{
    port->error = errno;
    return fault_set(fault, "tcp %s: %s: %s", rest, what, strerror(port->error));
}

static bool tcp_connected(struct port *port, const char *rest, struct fault *fault)
{
    int error = 0;
    socklen_t n = sizeof error;
    port->connecting = false;
    if (getsockopt(port->fd, SOL_SOCKET, SO_ERROR, &error, &n) < 0)
        error = errno;
    if (!error && is_ourselves(port->fd))
        error = ECONNREFUSED;
    errno = error;
    return !error || fail(port, rest, "cannot connect", fault);
}

static bool tcp_open(struct port *port, const char *rest, struct fault *fault)
{
    struct address a;
    port->ops = &port_tcp;
    port->fd = -1;
    port->error = EINVAL;
    port->connecting = false;
    if (!parse_address(rest, &a, fault) || (numeric(&a) && !take_far(&a, AI_NUMERICHOST, &port->far, fault)))
        return false;
    if (port->far.n == 0)
        return fault_set(fault, "tcp %s: the host was not looked up", rest);
    const struct sockaddr_storage *far = &port->far.at[port->connects++ % port->far.n];
    const socklen_t size = far->ss_family == AF_INET6 ? sizeof(struct sockaddr_in6) : sizeof(struct sockaddr_in);
    const int fd = socket(far->ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (fd < 0)
        return fail(port, rest,
                    errno == EAFNOSUPPORT
                        ? "network access is not permitted; install network.conf (sonard(8), RUNNING)"
                        : "no socket",
                    fault);
    set_options(fd);
    const bool there = connect(fd, (const struct sockaddr *)far, size) == 0;
    port->connecting = !there && errno == EINPROGRESS;
    if (there || port->connecting) {
        port->fd = fd;
        port->error = 0;
        return true;
    }
    fail(port, rest, "cannot connect", fault);
    close(fd);
    return false;
}

/* -1 with the cause noted, or 0 when it only was the wrong moment. */
static ssize_t failed(struct port *port)
{
    if (errno == EAGAIN || errno == EINTR)
        return 0;
    port->error = errno;
    return -1;
}

static ssize_t tcp_read(struct port *port, void *buf, size_t size)
{
    const ssize_t n = recv(port->fd, buf, size, 0);
    port->error = 0;
    return n > 0 ? n : n == 0 ? -1 : failed(port);
}

static ssize_t tcp_write(struct port *port, const void *buf, size_t size)
{
    const ssize_t n = send(port->fd, buf, size, MSG_NOSIGNAL);
    return n >= 0 ? n : failed(port);
}

/* Nothing in a plain stream stands for one. */
static void tcp_hold_break(struct port *port, bool on)
{
    (void)port;
    (void)on;
}

static void tcp_close(struct port *port)
{
    if (port->fd >= 0)
        close(port->fd);
    port->fd = -1;
    port->connecting = false;
}

const struct port_ops port_tcp = {
    .kind = "tcp",
    .encoding = "octet-stream",
    .check = tcp_check,
    .least_baud = LEAST_BAUD,
    .named = tcp_named,
    .look_up = tcp_look_up,
    .open = tcp_open,
    .connected = tcp_connected,
    .read = tcp_read,
    .write = tcp_write,
    .hold_break = tcp_hold_break,
    .close = tcp_close,
};
